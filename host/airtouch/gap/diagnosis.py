"""Where, which, how far: the whole diagnosis of some flights."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.gap.answer.advice import next_steps
from airtouch.gap.answer.controls import arms_of, control_of
from airtouch.gap.answer.curves import curves_of
from airtouch.gap.answer.named_effects import named_effects
from airtouch.gap.answer.notes import (
    at_end_of_range,
    cannot_be_replayed,
    mostly_random,
    noise_echoed_otherwise,
    signs_not_shown,
)
from airtouch.gap.answer.ranking import alike_of, ranking_of, verdict_of
from airtouch.gap.answer.shrink import Gap, closure_of, gap_of
from airtouch.gap.answer.unexplained import unexplained
from airtouch.gap.balance import balance_result
from airtouch.gap.evidence.data import Data
from airtouch.gap.flights.evenly import evenly_spaced
from airtouch.gap.flights.fitness import cannot_of
from airtouch.gap.flights.flight import PERIOD_S, Flight, none_usable, notes_on, ready_alike
from airtouch.gap.naming import gap_closure
from airtouch.gap.naming.judging import HALVED_BY_FLIGHT, halves
from airtouch.gap.naming.records import Selection
from airtouch.gap.naming.select import select
from airtouch.gap.nominal import calibrate
from airtouch.gap.nominal.build_study import declared_study
from airtouch.gap.nominal.consistency import differences, flown_unlike, logged_unlike
from airtouch.gap.passing import overhead
from airtouch.gap.result import FITTED, HELD_OUT, Diagnosis
from airtouch.gap.signals.spectra import AIR, LENGTH, starts
from airtouch.gap.signatures import candidates
from airtouch.gap.signatures.signature import OVERHEAD
from airtouch.gap.study import Study
from airtouch.gap.where import summary
from airtouch.gap.where.gap_map import gap_map
from airtouch.logs.flight_log import FlightLog
from airtouch.simulation import effects
from airtouch.vehicle import Vehicle, name_in, other_baseline

MOST_SECONDS = 210.0  #: of flight that candidates are fitted and judged on; chosen: more adds time, not certainty
BLOCK_S = LENGTH[AIR] * PERIOD_S  #: length of a block in the air, the least that is judged
LEAST_IN_ONE_S = 1.5 * BLOCK_S  #: two blocks, which overlap by half: one for either half of the data
LEAST_FLIGHTS = 4  #: flights that are judged however long they are; chosen
NO_BASELINE = ("no baseline flights: the vehicle is taken as declared. Torque is judged in its mean alone, as logged "
               "commands of a fast loop are aliased. No wake is judged, as a vehicle that shakes by itself looks like "
               "one; a recorded flight is then often called motor_noise")


@dataclass(frozen=True)
class Comparison:
    """What is diagnosed: flights made ready, compared with the study of a vehicle.

    usable: all flights; judged: those on which candidates are judged; nominal: those of the baseline that are like the
    others; calibration: None without a baseline.
    """

    vehicle: Vehicle
    usable: Sequence[Flight]
    nominal: Sequence[Flight]
    judged: Sequence[Flight]
    study: Study
    calibration: calibrate.Calibration | None

    @property
    def declared(self) -> Study | None:
        """The study of the vehicle as its file declares it, where `study` is a calibrated one; else None."""
        return self.calibration.declared if self.calibration else None


def diagnose(flights: Sequence[FlightLog], vehicle: Vehicle, baseline: Sequence[FlightLog] = (), *,
             progress: Callable[[str], None] | None = None, without: Iterable[str] = (),
             curves: bool = False, before: Diagnosis | None = None, partner: Sequence[FlightLog] = ()) -> Diagnosis:
    """Name the unmodelled effect that the flights have in common and how much of the gap it is.

    flights: one or more; what they share is looked for. baseline: flights declared free of
    unmodelled effects, on which the vehicle is calibrated and the floor is measured; without
    them the floor is the sensors' declared noise and the command view is left out. without:
    names of effects to leave out. curves: whether to keep the curves that a report shows. before: a
    diagnosis with the same vehicle, baseline and effects left out, whose calibration is used again. partner: logs of
    other vehicles in the air with one flight, on its clock and in its frame; where one is overhead, a wake is judged in
    these seconds, if there is a baseline. Raises AirTouchError when no flight can be used, for a partner of several
    flights, an unknown effect, or where `before` has another vehicle, baseline or effects left out.
    """
    say, without = progress or (lambda _: None), effects.names_of(without)
    if partner and len(flights) != 1:
        raise AirTouchError("a partner's log belongs to one flight; diagnose that flight alone")
    seconds = overhead.seconds_overhead(flights[0], partner) if partner else ()
    notes: list[str] = []
    of_flights: list[str] = []
    usable, nominal = ready_alike(flights, baseline, vehicle, of_flights, notes)
    if not usable:
        raise none_usable(of_flights, "no flight to diagnose")
    notes += [*of_flights, *other_baseline((name_in(f.meta) for f in flights), (name_in(f.meta) for f in baseline))]
    if balance_result.applies(usable, nominal, vehicle):
        notes += [overhead.UNUSED.format("a gyro")] if partner else []
        return balance_result.diagnosis(usable, nominal, vehicle, [*notes_on(usable, nominal), *notes], without,
                                        curves)
    say("calibration")
    calibrated_with = (vehicle, tuple(_content(f) for f in nominal), tuple(sorted(without)))
    if before is not None and before.calibrated is not None:
        if before.calibrated_with != calibrated_with:
            raise AirTouchError("the diagnosis before has another vehicle, baseline or effects left out: its "
                                "calibration does not hold here")
        calibrated = before.calibrated
    else:
        calibrated = _calibrated(vehicle, nominal, without)
    study, calibration = calibrated
    if partner:
        study = overhead.with_overhead(study, usable[0], seconds)
        notes.append(overhead.note(study, seconds))
    nominal = [] if calibration is None else list(calibration.flights)  # without those that are left out
    comparison = Comparison(vehicle, usable, nominal, flights_to_judge(usable), study, calibration)
    data = _data(study, comparison.judged)
    selection, gap = selection_and_gap(data, without, say)
    notes += signs_not_shown(selection) + noise_echoed_otherwise(data)
    say("how far")
    result = _answer(data, selection, gap)
    notes += at_end_of_range(result.effects) + mostly_random(result.effects)
    return replace(_explained(result, comparison, selection, curves), notes=_notes(comparison, notes),
                   calibrated=calibrated, calibrated_with=calibrated_with)


def _content(flight: Flight) -> str:
    """What tells a flight from another, of the same name too: its name and a hash of its log's columns."""
    digest = sha256()
    for name, values in sorted(flight.log.columns.items()):
        digest.update(f"{name} {values.shape} ".encode())
        digest.update(np.ascontiguousarray(values).tobytes())
    return f"{flight.name} {digest.hexdigest()}"


def diagnose_with_study(study: Study, flights: Sequence[Flight], without: Iterable[str] = (),
                        data: Data | None = None, rank_all: bool = True) -> Diagnosis:
    """`diagnose` with a study that is there already, without map, arms and advice: for many cases alike.

    data: of an earlier call with the same flights, whose spectra are used again; rank_all: as for `naming.select`:
    without it the answer comes sooner, and in the ranking the effects that are not named have no shrink. Raises as
    `diagnose`.
    """
    data = _data(study, flights) if data is None else data
    selection, gap = selection_and_gap(data, tuple(without), rank_all=rank_all)
    return replace(_answer(data, selection, gap), flights=tuple(f.name for f in flights))


def _answer(data: Data, selection: Selection, gap: Gap) -> Diagnosis:
    """The diagnosis as far as the flights judged give it: verdict, effects, ranking, how far, control."""
    verdict, before = verdict_of(data, selection, gap), gap.closure.before
    is_effect = verdict == "effect"
    effects = named_effects(data, selection) if is_effect else []
    passes_alone = len(effects) == 1 and bool(effects[0].seconds)  # it may act in one half only: none is held out
    ranking = ranking_of(data, selection, gap, verdict, effects[0].name if effects else verdict)
    return Diagnosis(
        verdict=verdict, effects=tuple(effects), ranking=tuple(ranking),
        indistinguishable=() if verdict == "none" else alike_of(selection),
        where=(), gap={"before": before, "after": gap.closure.after if is_effect else before, "floor": 1.0},
        shrink=gap.closure.shrink if is_effect else None, judged_on=FITTED if passes_alone else HELD_OUT,
        control=control_of(data, selection, gap) if is_effect else None)


def _explained(result: Diagnosis, comparison: Comparison, selection: Selection, curves: bool) -> Diagnosis:
    """The answer with what it is compared with: the map and its largest cells, arms, what stays open, what to fly next.

    curves: whether to keep the curves that a report shows.
    """
    study, usable, nominal, judged = comparison.study, comparison.usable, comparison.nominal, comparison.judged
    is_effect, terms = result.verdict == "effect", [t for e in result.effects for t in candidates.terms_of(e)]
    whole_map = gap_map(study, usable, nominal, terms)
    headline = summary.headline(whole_map.cells, bool(terms))
    cells = tuple(dict.fromkeys([c for c in (headline,) if c is not None] + summary.cells_to_show(whole_map)))
    answer = replace(
        result, where=cells, map=whole_map, headline=headline,
        arms=arms_of(comparison.declared, judged, selection, result) if is_effect else {},
        unexplained=tuple(unexplained(study, judged, selection, cells)) if result.verdict == "unknown" else (),
        cannot=(*cannot_of([f.cannot for f in usable]), *cannot_be_replayed(selection)),
        flights=tuple(f.name for f in usable),
        vehicle=comparison.vehicle.name, baseline=tuple(f.name for f in nominal),
        calibration=comparison.calibration.parameters if comparison.calibration else {},
        curves=curves_of(study, usable, nominal, terms, cells if headline else (), whole_map.cells)
        if curves else None)
    return replace(answer, next=next_steps(answer, usable, comparison.vehicle, bool(flown_unlike(study, usable))))


def _calibrated(vehicle: Vehicle, nominal: Sequence[Flight], without: Sequence[str],
                ) -> tuple[Study, calibrate.Calibration | None]:
    """The study of the vehicle, calibrated on nominal flights if there are any; and the calibration."""
    if not nominal:
        return declared_study(vehicle, ()), None
    return calibrate.calibrated(vehicle, nominal, without=without)


def _notes(comparison: Comparison, of_logs: Sequence[str]) -> tuple[str, ...]:
    """What is worth a word: on the flights, on logs left out (of_logs), on the baseline, on flights not judged."""
    notes = [*notes_on(comparison.usable, comparison.nominal), *of_logs]
    notes += list(comparison.calibration.notes) if comparison.calibration else [NO_BASELINE]
    notes += differences(comparison.study, comparison.nominal)
    notes += flown_unlike(comparison.study, comparison.usable)
    notes += logged_unlike(comparison.usable, comparison.nominal)
    if len(comparison.judged) < len(comparison.usable):
        notes.append(f"candidates were judged on {len(comparison.judged)} of {len(comparison.usable)} flights, evenly "
                     "chosen")
    without_block = [f.file_name for f in comparison.judged if not len(starts(f, AIR))]
    if without_block:
        notes.append(f"too short to be judged, without {BLOCK_S:g} s in the air that have no hole: "
                     + ", ".join(without_block))
    return tuple(dict.fromkeys(notes))


def flights_to_judge(flights: Sequence[Flight]) -> list[Flight]:
    """Evenly chosen flights of MOST_SECONDS together, but no fewer than LEAST_FLIGHTS; all where there are no more.

    Of flights that differ in length there are as many as do not exceed MOST_SECONDS.
    """
    keep = len(flights)
    while keep > LEAST_FLIGHTS and sum(len(f) for f in evenly_spaced(flights, keep)) * PERIOD_S > MOST_SECONDS:
        keep -= 1
    return evenly_spaced(flights, keep)


def _data(study: Study, flights: Sequence[Flight]) -> Data:
    """The flights with their spectra. Raises AirTouchError where they are too short for two halves."""
    data = Data(study, flights)
    if any(not sum(chosen.sum() for _, state, chosen in p.pieces if state == AIR) for p in halves(data)):
        which = flights[0].name if len(flights) == 1 else f"{len(flights)} flights"
        raise AirTouchError(f"{which}: too short to be judged on other data than it is fitted on; {LEAST_IN_ONE_S:g} s "
                            f"of a flight in the air without a hole are needed, or {BLOCK_S:g} s of each of "
                            f"{HALVED_BY_FLIGHT} flights")
    return data


def selection_and_gap(data: Data, without: Sequence[str], say: Callable[[str], None] = lambda _: None,
                      rank_all: bool = True) -> tuple[Selection, Gap]:
    """The selection among all candidates, and the gap that its effects close; rank_all: as for `naming.select`.

    In recorded flights effects must close a part of the gap to be named, those of the loop also beside others: see
    `naming.gap_closure`. Where they do not, the others are judged without them. Without nominal flights a wake is no
    candidate: one that fills a flight looks like a vehicle that shakes by itself.
    """
    variants = candidates.all_candidates(without if data.study.nominal_count else (*without, OVERHEAD))
    selection = select(data, variants, say, without, rank_all)
    gap = gap_of(data, selection.halves, selection.named_hypothesis)
    others = gap_closure.named_beside_the_loop(data, selection)
    if others:
        left_out = [*without, *(n for n in variants if n not in others)]
        rest = select(data, {n: variants[n] for n in others}, say, left_out)
        closed_by_rest = closure_of(data, selection.halves, rest.named_hypothesis, gap).shrink.value  # of the same gap
        if gap_closure.loop_closes_too_little(gap.closure.shrink.value, closed_by_rest):
            selection = replace(rest, single_effects={**selection.single_effects, **rest.single_effects},
                                least_nats=selection.least_nats)
            gap = gap_of(data, rest.halves, rest.named_hypothesis)
    shrink = gap.closure.shrink.value
    if gap_closure.closes_too_little(data, selection, gap.closure.before, shrink):
        selection = gap_closure.with_names_withdrawn(data, selection, shrink)
        gap = gap_of(data, selection.halves, None)
    return selection, gap
