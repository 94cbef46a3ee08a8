"""Where, which, how far: the whole diagnosis of some flights."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import numpy as np

import airtouch.gap.measure as measure
from airtouch.errors import AirTouchError
from airtouch.gap import callable_module
from airtouch.gap.answer import advice as advices
from airtouch.gap.answer import pictures as picture
from airtouch.gap.answer.ranking import alike_of, ranked
from airtouch.gap.answer.shrink import Cells, Shrink, cells_of, shrink_of
from airtouch.gap.answer.unexplained import unexplained
from airtouch.gap.balance import balance_result
from airtouch.gap.evidence.data import Data, Study
from airtouch.gap.evidence.fit import fit
from airtouch.gap.evidence.gates import TOLD
from airtouch.gap.evidence.overhead import seconds_overhead, with_overhead
from airtouch.gap.evidence.problem import LOOP
from airtouch.gap.flights.flight import Flight
from airtouch.gap.naming.judging import halves
from airtouch.gap.naming.select import LOOP_SHARE, select
from airtouch.gap.naming.selection import Judged, Selection
from airtouch.gap.nominal import calibrate
from airtouch.gap.result import Diagnosis
from airtouch.gap.signals.spectra import AIR
from airtouch.gap.signatures import candidates
from airtouch.gap.signatures.candidates import CLOCK, Term
from airtouch.gap.where import summary
from airtouch.gap.where.gap_map import gap_map, where
from airtouch.logs.flight_log import FlightLog
from airtouch.vehicle import Vehicle

MOST_SECONDS = 210.0  #: of flight that candidates are fitted and judged on; more adds time, not certainty
NO_BASELINE = ("no baseline flights: the vehicle is taken as declared, and torque is judged in the mean alone, as "
               "nobody knows how much of the commanded torque is aliases of a faster loop")
STANDS_OUT = 1.1  #: gap from which what comes and goes must close it; the halves seldom share its seconds
WRONG = ("rotor_drag", "com_offset", "motor_lag", "thrust_coefficient", "imu_bias")


def diagnose(flights: Sequence[FlightLog], vehicle: Vehicle, baseline: Sequence[FlightLog] = (), *,
             progress: Callable[[str], None] | None = None, without: Iterable[str] = (),
             pictures: bool = False, before: Diagnosis | None = None, partner: Sequence[FlightLog] = ()) -> Diagnosis:
    """Name the unmodelled effect that the flights have in common and how much of the gap it is.

    flights: one or more; what they share is looked for. baseline: flights declared free of
    unmodelled effects, on which the vehicle is calibrated and the floor is measured; without
    them the floor is the sensors' declared noise and the command view is left out. without:
    names of effects to leave out. pictures: whether to keep the curves that a report shows. before: a
    diagnosis with the same vehicle, baseline and effects left out, whose calibration is used again. partner: logs of
    other vehicles in the air with one flight, on its clock and in its frame; where one is overhead, a wake is judged in
    these seconds. Raises AirTouchError when no flight can be used, or for a partner of several flights.
    """
    say, without = progress or (lambda _: None), tuple(without)
    if partner and len(flights) != 1:
        raise AirTouchError("a partner's log belongs to one flight; diagnose that flight alone")
    seconds = seconds_overhead(flights[0], partner) if partner else ()
    left_out: list[str] = []
    nominal = list(measure.usable(baseline, vehicle, left_out))
    seen = list(measure.usable(flights, vehicle, left_out))
    if not seen:
        raise AirTouchError(left_out[-1] if left_out else "no flight to diagnose")
    if balance_result.applies(seen, nominal, vehicle):
        return balance_result.diagnosis(seen, nominal, vehicle, left_out, without, pictures)
    say("calibration")
    if before is not None and before.held is not None:
        study, fitted = before.held
    else:
        study, fitted = calibrate.calibrated(vehicle, nominal, without=without) if nominal \
            else (calibrate.declared(vehicle, ()), None)
    some = _some(seen)
    held = (study, fitted)
    if partner:
        study = with_overhead(study, seen[0], seconds)
        left_out.append(f"the other vehicle was overhead for {sum(b - a for a, b in seconds):.1f} s" if seconds
                        else "the other vehicle was never overhead")
    data = _data(study, some)
    selection, gap_cells = _selected(data, without, say)
    say("how far")
    ranking, overall, verdict, effects = ranked(data, selection, gap_cells)
    named = [candidates.term_of(e) for e in effects]
    made = gap_map(study, seen, nominal, named)
    first = summary.headline(made.cells, bool(named))
    cells = tuple(dict.fromkeys([c for c in (first,) if c is not None] + where(made)))
    alike = alike_of(selection)
    notes = [n for f in seen for n in f.notes] + left_out
    notes += list(fitted.notes) if fitted else [NO_BASELINE]
    notes += measure.differences(study, nominal)
    notes += measure.flown_unlike(study, seen)
    if len(some) < len(seen):
        notes.append(f"candidates were judged on {len(some)} of {len(seen)} flights, evenly chosen")
    control = _control(data, selection, gap_cells) if verdict == "effect" else {}
    arms = _arms(vehicle, nominal, fitted, some, selection, overall) if verdict == "effect" else {}
    steps = advices.steps(verdict, effects, alike, first, seen, bool(nominal), vehicle.name)
    return Diagnosis(
        verdict, tuple(effects), tuple(ranking), alike, cells,
        {"before": overall.before, "after": overall.after if verdict == "effect" else overall.before,
         "floor": 1.0},
        overall.share if verdict == "effect" else None, control, advices.advice(steps),
        arms, tuple(dict.fromkeys(notes)),
        measure.cannot_of([f.cannot for f in seen]), tuple(f.name for f in seen),
        tuple(unexplained(study, some, selection, cells)) if verdict == "unknown" else (), made, first, steps,
        vehicle.name, tuple(f.name for f in nominal), fitted.parameters if fitted else {},
        picture.of(study, seen, nominal, named, first, cells) if pictures else None, held)


def brief(study: Study, flights: Sequence[Flight], without: Iterable[str] = (), data: Data | None = None) -> Diagnosis:
    """`diagnose` with a study that is there already, without map, arms and advice: for many cases alike.

    data: of an earlier call with the same flights, whose spectra are used again. Raises as `diagnose`.
    """
    data = _data(study, flights) if data is None else data
    selection, gap_cells = _selected(data, tuple(without))
    ranking, overall, verdict, effects = ranked(data, selection, gap_cells)
    named = verdict == "effect"
    return Diagnosis(
        verdict, tuple(effects), tuple(ranking), alike_of(selection), (),
        {"before": overall.before, "after": overall.after if named else overall.before, "floor": 1.0},
        overall.share if named else None, _control(data, selection, gap_cells) if named else {}, "",
        flights=tuple(f.name for f in flights))


def _data(study: Study, flights: Sequence[Flight]) -> Data:
    """The flights with their spectra; torque in the mean alone where nobody knows which share of it is aliases."""
    data = Data(study, flights, slow=study.response is None)
    if any(not sum(chosen.sum() for _, regime, chosen in p.pieces if regime == AIR) for p in halves(data)):
        raise AirTouchError(f"{flights[0].name}: too short to be judged on other data than it is fitted on; at least "
                            "5 s in the air without a hole are needed")
    return data


def _selected(data: Data, without: Sequence[str], say: Callable[[str], None] = lambda _: None,
              ) -> tuple[Selection, Cells]:
    """What is chosen among the candidates, and the cells in which the gap is measured.

    In recorded flights an effect of the loop must take away as much of the gap as the loop model may be wrong by: the
    gains of two days differ a little, and that is not what a gap comes from. So must one that comes and goes, where a
    gap stands out that it could take away: nominal flights meet gusts, which is not what their gap comes from either.
    """
    selection = select(data, candidates.all_candidates(without), say, without)
    cells = cells_of(data, selection.parts, selection.chosen)
    of_loop = _of_the_loop(data, selection)
    passing = _comes_and_goes(selection) and selection.named[0].key != TOLD  # seconds that are known are no gust's
    if data.study.recorded and (of_loop or passing):
        gap = shrink_of(data, selection.parts, selection.chosen, cells)
        if gap.share.value < LOOP_SHARE and (of_loop or gap.before > STANDS_OUT):
            selection = replace(selection, steps=(), free_after=selection.free_before, assumed=False)
            cells = cells_of(data, selection.parts, None)
    return selection, cells


def _comes_and_goes(selection: Selection) -> bool:
    """Whether one effect is named, and it comes and goes."""
    chosen = selection.chosen
    return chosen is not None and len(selection.named) == 1 and all(t.gate for t in chosen.terms)


def _of_the_loop(data: Data, selection: Selection) -> bool:
    """Whether one effect is named, and it is one of the control loop."""
    law, chosen = data.study.controller, selection.chosen
    if law is None or chosen is None or len(selection.named) != 1:
        return False
    terms = [t for t in chosen.terms if t.kind == candidates.MEAN and not t.gate]
    return bool(terms) and (law.changes_loop([t.active() for t in terms]) or any(t.name in LOOP for t in terms))


def _some(flights: Sequence[Flight]) -> list[Flight]:
    """Evenly chosen flights of MOST_SECONDS together; all where there are no more."""
    total = sum(len(f) for f in flights) * 0.01
    keep = max(int(len(flights) * min(MOST_SECONDS / total, 1.0)), min(len(flights), 4))
    return [flights[i] for i in np.unique(np.linspace(0, len(flights) - 1, keep).astype(int))]


def _start(terms: Sequence[Term], chosen: Judged) -> np.ndarray | None:
    """Scaled parameters of mean effects as they were fitted."""
    if not chosen.fits:
        return None
    return np.concatenate([np.zeros(0),
                           *(t.scaled(t.values) for t in chosen.fits[0].terms if t.kind == candidates.MEAN)])


def _control(data: Data, selection: Selection, cells: Cells) -> dict[str, object]:
    """The gap with a deliberately wrong effect in the model."""
    taken = {n for g in alike_of(selection) for n in g} | {s.name for s in selection.named}
    every = candidates.all_candidates()
    for name in WRONG:
        if name in every and name not in taken:
            fits = tuple(fit(data, p, every[name][0]) for p in selection.parts)
            done = shrink_of(data, selection.parts, Judged(name, fits[0].terms, 0.0, fits), cells)
            return {"name": name, "before": done.before, "after": done.after, "shrink": done.share.plain()}
    return {}


def _arms(vehicle: Vehicle, nominal: Sequence[Flight], fitted: calibrate.Calibration | None, some: Sequence[Flight],
          selection: Selection, overall: Shrink) -> dict[str, object]:
    """The shrink with the vehicle as calibrated (or declared, without baseline) and as its file declares it."""
    if not nominal or selection.chosen is None:
        return {"declared": _plain(overall)}
    known = fitted.declared if fitted is not None else None
    data = Data(known or calibrate.declared(vehicle, nominal), some)
    parts = halves(data)
    terms = tuple(t for t in selection.chosen.terms if t.kind != CLOCK)
    fits = tuple(fit(data, p, terms, _start(terms, selection.chosen)) for p in parts)
    declared = Judged(selection.chosen.name, terms, 0.0, fits)
    one = shrink_of(data, parts, declared, cells_of(data, parts, declared))
    return {"declared": _plain(one), "calibrated": _plain(overall)}


def _plain(shrink: Shrink) -> dict[str, object]:
    return {"before": shrink.before, "after": shrink.after, "shrink": shrink.share.plain()}


callable_module(__name__)
