"""The diagnosis of flights without a gyro: the pattern of their hovers, judged, in the form of every diagnosis.

`diagnosis` is the whole of it, in the order of `gap.balance`: measured, modelled, compared, answered.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from airtouch.gap.answer.advice import next_steps
from airtouch.gap.answer.curves import curves_of
from airtouch.gap.answer.shrink import fraction_closed
from airtouch.gap.answer.words import joined, rotors_in_words
from airtouch.gap.balance.hover_balance import BALANCE, Reference, evidence, reference
from airtouch.gap.balance.hover_hypotheses import hypotheses
from airtouch.gap.balance.hover_pattern import hover_pattern, share_not_logged
from airtouch.gap.balance.hover_posterior import (
    COMPETES,
    HIGH,
    LOW,
    OTHER_WEIGHT,
    WEAK_MOTOR,
    Likeliest,
    alike,
    answer_of,
    effects_of,
    likeliest_of,
    probabilities,
    quantile,
    rotor_sets_of,
)
from airtouch.gap.balance.hover_ranking import NO_EFFECTS, ranking_of, with_names_withdrawn
from airtouch.gap.flights.fitness import cannot_of, notes_of
from airtouch.gap.flights.flight import Flight
from airtouch.gap.nominal.build_study import declared_study
from airtouch.gap.result import FITTED, Closure, Control, Diagnosis, OverallGap, Quantity, RotorSet
from airtouch.gap.signals.spectra import MOST_LOST
from airtouch.gap.where import summary
from airtouch.gap.where.cell import BASELINE, Cell, GapMap
from airtouch.simulation.effects import EFFECTS, NAMES
from airtouch.vehicle import Vehicle

#: of the curves of a report
OTHER_GAP = ("The gap drawn is that to the vehicle as declared. That of the answer is to the means of the baseline "
             "flights, so it is another.")
BAND_HZ = (0.0, 0.2)  #: of a mean over a hover of 4 s or more, as its cells name it; chosen
#: the first of these that is improbable is the wrong effect of the control; chosen, those that a hover shows
#: (`signature.WRONG` has others)
WRONG_IN_HOVER = ("com_offset", "slung_load", "mass", "weak_motor")
WRONG_BELOW = 0.1  #: probability below which an effect is surely wrong; chosen
NO_GYRO = ("no gyro: judged by the mean balance of the motors over all that is flown, moves included{}; {}")
TRIED, NONE_TRIED = "the only effects tried are {}", "no effect was tried"  #: in NO_GYRO
UNSTEADINESS = ", and how unsteady it is"  #: in NO_GYRO, where that is judged
OWN_NOT_TRIED = "effects of your own are not tried where flights have no gyro and hovers are judged: {}"
NOT_LOGGED = ("{:.0%} of what is flown was not logged; what is left may be flown unlike the other flights, and a wrong "
              "effect named for that")
NO_VOLTAGE = "no battery voltage in some flights: their lift may differ for that alone"
NO_VELOCITY = ("no velocity in some flights: how unsteady flights are is not judged, as it depends on how the "
               "estimated velocity is corrected")

OTHER_ROTORS = "which rotors are weak is not sure: instead of those named it may be {}"


def applies(flights: Sequence[Flight], nominal: Sequence[Flight], vehicle: Vehicle) -> bool:
    """Whether none of the flights has a gyro, and both one of them and a nominal one hover for long enough."""
    return all(f.rates is None for f in flights) and all(
        any(_hovers(f, vehicle) for f in some) for some in (nominal, flights))


def _hovers(flight: Flight, vehicle: Vehicle) -> bool:
    """Whether a flight has a hover."""
    return hover_pattern(flight, vehicle).known


def diagnosis(flights: Sequence[Flight], nominal: Sequence[Flight], vehicle: Vehicle,
              notes: Sequence[str] = (), without: Iterable[str] = (), curves: bool = False) -> Diagnosis:
    """Which of the hypotheses of `hover_hypotheses` the flights' mean difference from nominal ones fits best.

    notes: on logs left out; without: names that are no candidates; curves: whether to keep a report's curves. Flights
    without a hover are left out, and named in a note.
    """
    without_hover = [f.name for f in (*flights, *nominal) if not _hovers(f, vehicle)]
    if without_hover:
        notes = [*notes, f"too short to be judged, without a hover: {', '.join(without_hover)}"]
        flights, nominal = ([f for f in some if _hovers(f, vehicle)] for some in (flights, nominal))
    voltage = all(f.log.has("vbat_V") for f in (*flights, *nominal))
    base = reference([hover_pattern(f, vehicle, voltage) for f in nominal])
    difference = base.mean_difference([hover_pattern(f, vehicle, voltage) for f in flights])
    gap = difference[BALANCE]

    candidates = hypotheses(vehicle, without=set(without))
    judged = evidence(difference, base, candidates)
    by_evidence = probabilities(judged, candidates)
    fits = {name: likeliest_of(name, candidates, judged) for name in by_evidence}
    closures = {name: _closure(gap, base, fit) for name, fit in fits.items()}
    by_balance = probabilities(evidence(np.append(gap, [np.nan, np.nan]), base, candidates), candidates)
    probability_of, withdrawn = with_names_withdrawn(by_evidence, closures, by_balance)
    first, probability = answer_of(probability_of)
    verdict = first if first in NO_EFFECTS else "effect"

    effects = effects_of(fits[first]) if verdict == "effect" else []
    cells = _cells(gap, base, vehicle, fits[first] if effects else None, len(flights))
    ranking = ranking_of(first, probability_of, closures, withdrawn)
    if first == WEAK_MOTOR:
        ranking[0] = replace(ranking[0], rotor_sets=rotor_sets_of(judged, candidates, ranking[0].probability))
    indistinguishable = alike([e.name for e in effects], probability_of, first, probability)
    headline = summary.headline(cells, bool(effects))
    answer = Diagnosis(
        verdict=verdict, effects=tuple(effects), ranking=tuple(ranking),
        indistinguishable=indistinguishable, where=cells, gap=_gap(verdict, closures[first]),
        shrink=closures[first].shrink if verdict == "effect" else None, judged_on=FITTED,
        control=control_of(by_evidence, [e.name for e in effects], closures) if verdict == "effect" else None,
        notes=_notes(voltage, bool(np.isfinite(difference).all()), list(probability_of),
                     [*other_rotors(ranking[0].rotor_sets), *notes, *_not_logged([*flights, *nominal])]),
        cannot=cannot_of([f.cannot for f in flights]), flights=tuple(f.name for f in flights),
        map=GapMap(cells, BASELINE, tuple(f.name for f in flights)), headline=headline,
        vehicle=vehicle.name, baseline=tuple(f.name for f in nominal),
        curves=replace(curves_of(declared_study(vehicle, ()), flights, nominal, [],
                                 [headline, *cells] if headline else [], cells), remark=OTHER_GAP)
        if curves else None)
    return replace(answer, next=next_steps(answer, flights, vehicle, own_effects=False))


def _closure(gap: np.ndarray, base: Reference, fit: Likeliest) -> Closure:
    """Gap before and after in standard deviations of the floor, and the fraction of it that closes, with its interval.

    The hypothesis was fitted to this same gap: nothing is held out. gap (4,): BALANCE from the nominal mean.
    """
    spread = np.sqrt(base.variance[BALANCE])

    def rms(difference: np.ndarray) -> float:
        """Root mean square of the balance in standard deviations of the floor."""
        return float(np.sqrt(np.mean((difference / spread) ** 2)))

    before, after = rms(gap), rms(gap - fit.change)
    after_each = np.sqrt((((gap - fit.hypothesis.change) / spread) ** 2).mean(axis=1))

    def closed(rest: float) -> float:
        """Fraction of the gap above the floor that is closed when this rms is left."""
        return fraction_closed(before ** 2, rest ** 2)

    low, high = closed(quantile(after_each, fit.weight, HIGH)), closed(quantile(after_each, fit.weight, LOW))
    return Closure(before, after, Quantity(closed(after), min(low, closed(after)), max(high, closed(after))))


def _gap(verdict: str, closure: Closure) -> OverallGap:
    """The gap before and after in standard deviations of the floor; unchanged where no effect is named."""
    return {"before": closure.before, "floor": 1.0, "after": closure.after if verdict == "effect" else closure.before}


def control_of(probability_of: Mapping[str, float], named: Collection[str], closures: Mapping[str, Closure],
               ) -> Control | None:
    """The gap with a deliberately wrong effect; None where none of WRONG_IN_HOVER is surely wrong.

    named: the effects of the answer. None of them is wrong, nor is a weight's other form.
    """
    right = {*named, *(OTHER_WEIGHT[n] for n in named if n in OTHER_WEIGHT)}
    wrong = next((n for n in WRONG_IN_HOVER if n not in right and probability_of.get(n, 1.0) < WRONG_BELOW), None)
    return None if wrong is None else Control(wrong, closures[wrong])


def _cells(gap: np.ndarray, base: Reference, vehicle: Vehicle, fit: Likeliest | None, flights: int,
           ) -> tuple[Cell, ...]:
    """The gap (4,) of BALANCE as lift and angular accelerations in hover, largest over the floor first.

    fit: of the effects named, None where none is: the cells then have no `after`.
    """
    half_side, lift = vehicle.arm_m / np.sqrt(2.0), vehicle.mass_kg * vehicle.gravity_mps2
    inertia = vehicle.inertia_kg_m2
    unit = np.array([vehicle.gravity_mps2, lift * half_side / inertia[0], lift * half_side / inertia[1],
                     lift * vehicle.yaw_torque_over_thrust_m / inertia[2]])  # of each entry in its channel's unit
    after = None if fit is None else np.abs(gap - fit.change) * unit
    floor = np.sqrt(base.variance[BALANCE])
    channels = (("force_z", "m/s^2"), *((f"torque_{a}", "rad/s^2") for a in "xyz"))
    cells = [Cell(c, BAND_HZ, "hover", float(abs(gap[i]) * unit[i]), float(floor[i] * unit[i]), u,
                  flights=flights, after=None if after is None else float(after[i]))
             for i, (c, u) in enumerate(channels)]
    return tuple(sorted(cells, key=lambda c: -c.ratio))


def _notes(voltage: bool, velocity: bool, tried: Sequence[str], notes: Sequence[str]) -> tuple[str, ...]:
    """Notes of every such diagnosis before those given.

    voltage, velocity: whether all flights log that of the battery, and their own; tried: names of the candidates.
    """
    effects, own = [n for n in tried if n not in NO_EFFECTS], [n for n in EFFECTS if n not in NAMES]
    which = TRIED.format(joined(effects)) if effects else NONE_TRIED
    return (NO_GYRO.format(UNSTEADINESS if velocity else "", which),
            *([OWN_NOT_TRIED.format(joined(own))] if own else []), *notes,
            *([] if voltage else [NO_VOLTAGE]), *([] if velocity else [NO_VELOCITY]))


def other_rotors(rotor_sets: Sequence[RotorSet]) -> list[str]:
    """A note on the sets of rotors that COMPETE with the likeliest, the first; none where there are none."""
    others = [s for s in rotor_sets[1:] if s.probability > COMPETES * rotor_sets[0].probability]
    words = " or ".join(f"{rotors_in_words(s.rotors)} ({s.probability:.0%})" for s in others)
    return [OTHER_ROTORS.format(words)] if others else []


def _not_logged(flights: Sequence[Flight]) -> list[str]:
    """A note on each flight of whose hovers more than MOST_LOST was not logged, as of a block's samples elsewhere."""
    shares = [share_not_logged(f) for f in flights]
    return notes_of([(f.name, [NOT_LOGGED.format(s)] if s > MOST_LOST else [])
                     for f, s in zip(flights, shares, strict=True)])
