"""The diagnosis of flights without a gyro, from the balance of the motors in hover (`hover_balance`)."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import airtouch.gap.measure as measure
from airtouch.gap.answer.advice import steps as next_steps
from airtouch.gap.answer.pictures import of as pictures_of
from airtouch.gap.answer.shrink import Shrink
from airtouch.gap.balance.hover_balance import BALANCE, Reference, evidence, reference
from airtouch.gap.balance.hover_hypotheses import Hypothesis, hypotheses
from airtouch.gap.balance.hover_pattern import hover_pattern, mean_pattern
from airtouch.gap.flights.flight import Flight
from airtouch.gap.nominal.build_study import declared_study
from airtouch.gap.result import BASELINE, Cell, Diagnosis, GapMap, NamedEffect, Quantity, RankedCandidate
from airtouch.gap.signatures.alike import names_alike
from airtouch.gap.where import summary
from airtouch.simulation.effects import Parameter, get
from airtouch.vehicle import Vehicle

LOW, HIGH = 0.05, 0.95  #: quantiles between which the 90 % intervals lie
BAND_HZ = (0.0, 0.2)  #: of a mean over a hover of 4 s or more, as its cells name it; chosen
LEAST_SHIFT = 0.9  #: posterior probability of an off-centre weight's side, for com_offset to be named; chosen
COMPETES = 0.5  #: of the answer's probability, from which on another name counts as one that fits alike; chosen
#: effects of which the first with a probability below WRONG_BELOW is the wrong one of the control; chosen
WRONG, WRONG_BELOW = ("com_offset", "slung_load", "mass", "weak_motor"), 0.1
#: the two names of a weight: on the vehicle; so far off centre that its own mass does not show
WEIGHT, OFF_CENTRE = "mass", "com_offset"
NO_GYRO = ("no gyro: judged by the balance of the motors in hover and how unsteady it is; candidates that "
           "leave both as they are were not tried")
NO_VOLTAGE = "no battery voltage in some flights: their lift may differ for that alone"


@dataclass(frozen=True)
class Fit:
    """The likeliest hypothesis of one name: weight (samples,) of its samples, and the gap before and after."""

    hypothesis: Hypothesis
    weight: np.ndarray
    shrink: Shrink


def applies(flights: Sequence[Flight], nominal: Sequence[Flight], vehicle: Vehicle) -> bool:
    """Whether no flight has a gyro, and both nominal and other ones hover for long enough."""
    def any_hovers(flights_of_one_kind: Sequence[Flight]) -> bool:
        return any(hover_pattern(f, vehicle).known for f in flights_of_one_kind)
    return all(f.rates is None for f in flights) and any_hovers(nominal) and any_hovers(flights)


def diagnosis(flights: Sequence[Flight], nominal: Sequence[Flight], vehicle: Vehicle,
              notes: Sequence[str] = (), without: Iterable[str] = (), pictures: bool = False) -> Diagnosis:
    """Which of the hypotheses of `hover_hypotheses` the flights' mean pattern fits best."""
    voltage = all(f.log.has("vbat_V") for f in (*flights, *nominal))
    base = reference([hover_pattern(f, vehicle, voltage) for f in nominal])
    pattern = mean_pattern([hover_pattern(f, vehicle, voltage) for f in flights])
    candidates = _candidates(vehicle, without)
    logs, weights = evidence(pattern, base, candidates)
    total = probabilities(logs, candidates)
    first, probability = likeliest(total)
    gap = base.difference(pattern)[BALANCE]
    fits = {name: _fit(name, candidates, logs, weights, gap, base) for name in total}
    shrink = {name: fit.shrink for name, fit in fits.items()}
    verdict = first if first in ("none", "unknown") else "effect"
    effects = _found(fits[first]) if verdict == "effect" else []
    cells = _cells(gap, base, vehicle, fits[first], len(flights))
    alike = _alike(effects, total, first, probability)
    headline = summary.headline(cells, bool(effects))
    steps = next_steps(verdict, effects, alike, headline, flights, True, vehicle.name)
    return Diagnosis(
        verdict=verdict, effects=tuple(effects), ranking=tuple(_ranking(first, total, shrink)),
        indistinguishable=alike, where=cells, gap=_gap(verdict, shrink[first]),
        shrink=shrink[first].share if verdict == "effect" else None,
        control=_control(total, first, shrink) if verdict == "effect" else {},
        notes=_notes(voltage, notes),
        cannot=measure.cannot_of([f.cannot for f in flights]), flights=tuple(f.name for f in flights),
        map=GapMap(cells, BASELINE, tuple(f.name for f in flights)), headline=headline, next=steps,
        vehicle=vehicle.name, baseline=tuple(f.name for f in nominal),
        pictures=pictures_of(declared_study(vehicle, ()), flights, nominal, [], headline, cells) if pictures else None)


def _candidates(vehicle: Vehicle, without: Iterable[str]) -> list[Hypothesis]:
    """The hypotheses in which none of the names `without` is."""
    left_out = set(without)
    return [h for h in hypotheses(vehicle) if not left_out & {h.name, *(name for name, _ in h.effects)}]


def _fit(name: str, candidates: Sequence[Hypothesis], logs: np.ndarray, weights: Sequence[np.ndarray],
         gap: np.ndarray, base: Reference) -> Fit:
    """The likeliest hypothesis of a name; gap (4,): BALANCE from the nominal mean."""
    best = max((i for i, h in enumerate(candidates) if h.name == name), key=logs.__getitem__)
    return Fit(candidates[best], weights[best], _shrink(gap, base, candidates[best], weights[best]))


def _gap(verdict: str, shrink: Shrink) -> dict[str, float]:
    """The gap before and after in deviations of the floor; unchanged where no effect is named."""
    return {"before": shrink.before, "floor": 1.0, "after": shrink.after if verdict == "effect" else shrink.before}


def probabilities(logs: np.ndarray, candidates: Sequence[Hypothesis]) -> dict[str, float]:
    """Posterior probability of each name, all its hypotheses together. logs: log evidence of each hypothesis."""
    chance = np.exp(logs - logs.max())
    chance /= chance.sum()
    return {name: float(sum(c for c, h in zip(chance, candidates, strict=True) if h.name == name))
            for name in dict.fromkeys(h.name for h in candidates)}


def likeliest(total: Mapping[str, float]) -> tuple[str, float]:
    """The likeliest name, and the probability that other names are held against.

    A weight on the vehicle and one off centre count as one; of the two the likelier is the answer. The probability is
    that of both for the one on the vehicle, its own for the one off centre, with which the other may compete.
    """
    family = dict(total)
    if WEIGHT in family:
        family[WEIGHT] += family.get(OFF_CENTRE, 0.0)
    first = max(family, key=family.__getitem__)
    if first == WEIGHT and total.get(OFF_CENTRE, 0.0) > total[WEIGHT]:
        first = OFF_CENTRE
    return first, family[first]


def _alike(effects: Sequence[NamedEffect], total: Mapping[str, float], first: str, probability: float,
           ) -> tuple[tuple[str, ...], ...]:
    """Sets of names that the flights cannot tell apart: names of one thing, and those that COMPETE with the answer."""
    alike = [tuple(sorted(group[0])) for e in effects if (group := names_alike(e.name))]
    others = [n for n in total if n not in (first, "unknown") and total[n] > COMPETES * probability]
    if others:
        alike.append(tuple(sorted({first, *others})))
    return tuple(dict.fromkeys(alike))


def _control(total: Mapping[str, float], first: str, shrink: Mapping[str, Shrink]) -> dict[str, Any]:
    """The gap with a deliberately wrong effect, JSON-ready; empty where none of WRONG is surely wrong."""
    wrong = next((n for n in WRONG if n in total and n != first and total[n] < WRONG_BELOW), None)
    if wrong is None:
        return {}
    return {"name": wrong, "before": shrink[wrong].before, "after": shrink[wrong].after,
            "shrink": shrink[wrong].share.plain()}


def _notes(voltage: bool, notes: Sequence[str]) -> tuple[str, ...]:
    """Notes of every such diagnosis before those given. voltage: whether all flights log the battery's."""
    return (NO_GYRO, *notes, *(() if voltage else (NO_VOLTAGE,)))


def _ranking(first: str, total: Mapping[str, float], shrink: Mapping[str, Shrink]) -> list[RankedCandidate]:
    """Every candidate, best first. A weight's two forms count as one where one of them is the answer."""
    chance = dict(total)
    weight = OFF_CENTRE if first == WEIGHT else WEIGHT
    if first in (WEIGHT, OFF_CENTRE) and weight in chance:
        chance[first], chance[weight] = chance[first] + chance[weight], 0.0
    why = {}
    if chance.get(weight) == 0.0:
        why[weight] = f"counted with {first}: a weight, whether its own mass shows or not"
    best = max(chance.values())
    return sorted((RankedCandidate(n, p, shrink[n].share,
                                   "" if n == first
                                   else why.get(n, f"{best / max(p, 1e-12):.3g} times less probable than {first}"))
                   for n, p in chance.items()), key=lambda r: (r.name != first, -r.probability))


def _shrink(gap: np.ndarray, base: Reference, h: Hypothesis, weight: np.ndarray) -> Shrink:
    """Gap before and after in deviations of the floor, and the share of it that goes, with its interval.

    gap (4,): BALANCE from the nominal mean; weight (samples,): of the hypothesis's samples.
    """
    spread = np.sqrt(base.variance[BALANCE])

    def rms(difference: np.ndarray) -> float:
        return float(np.sqrt(np.mean((difference / spread) ** 2)))

    before, after = rms(gap), rms(gap - weight @ h.change)
    after_each = np.sqrt((((gap - h.change) / spread) ** 2).mean(axis=1))

    def share(rest: float) -> float:
        return float(np.clip((before - rest) / max(before - 1.0, 1e-9), 0.0, 1.0)) if before > 1.0 else 0.0

    low, high = share(_quantile(after_each, weight, HIGH)), share(_quantile(after_each, weight, LOW))
    return Shrink(before, after, Quantity(share(after), min(low, share(after)), max(high, share(after))))


def _quantile(values: np.ndarray, weight: np.ndarray, q: float) -> float:
    """The q-quantile of samples (n,) with weights (n,) that add up to 1."""
    order = np.argsort(values)
    return float(np.interp(q, np.cumsum(weight[order]), values[order]))


def _found(fit: Fit) -> list[NamedEffect]:
    """The effects, posterior means with 90 % intervals; a weight's com_offset only where its side is sure."""
    out = []
    for name, drawn in fit.hypothesis.effects:
        alone = len(fit.hypothesis.effects) == 1
        if name == OFF_CENTRE and not alone and not any(side_is_sure(v, fit.weight) for v in drawn.values()):
            continue
        out.append(NamedEffect(name, {p.name: _posterior(drawn[p.name], fit.weight, p)
                                      for p in get(name).parameters if p.name in drawn}))
    return out


def side_is_sure(samples: np.ndarray, weight: np.ndarray) -> bool:
    """Whether samples (n,) with weights (n,) lie to one side of zero with a probability above LEAST_SHIFT."""
    return bool(max(weight @ (samples > 0), weight @ (samples < 0)) > LEAST_SHIFT)


def _posterior(samples: np.ndarray, weight: np.ndarray, parameter: Parameter) -> Quantity:
    """Mean and 90 % interval of a parameter; an integer, as a rotor's number, is the same in all samples."""
    if parameter.integer:
        return Quantity(float(samples[0]), unit=parameter.unit)
    return Quantity(float(weight @ samples), _quantile(samples, weight, LOW), _quantile(samples, weight, HIGH),
                    parameter.unit)


def _cells(gap: np.ndarray, base: Reference, vehicle: Vehicle, fit: Fit, flights: int) -> tuple[Cell, ...]:
    """The gap (4,) of BALANCE as lift and angular accelerations in hover, largest over the floor first."""
    half_side, lift = vehicle.arm_m / np.sqrt(2.0), vehicle.mass_kg * vehicle.gravity_mps2
    inertia = vehicle.inertia_kg_m2
    unit = np.array([vehicle.gravity_mps2, lift * half_side / inertia[0], lift * half_side / inertia[1],
                     lift * vehicle.yaw_torque_over_thrust_m / inertia[2]])  # of each entry in its channel's unit
    after = gap - fit.weight @ fit.hypothesis.change
    floor = np.sqrt(base.variance[BALANCE])
    channels = (("force_z", "m/s^2"), *((f"torque_{a}", "rad/s^2") for a in "xyz"))
    cells = [Cell(c, BAND_HZ, "hover", float(abs(gap[i]) * unit[i]), float(floor[i] * unit[i]), u,
                  flights=flights, after=float(abs(after[i]) * unit[i])) for i, (c, u) in enumerate(channels)]
    return tuple(sorted(cells, key=lambda c: -c.gap / c.floor))


__all__ = ["applies", "diagnosis"]
