"""The diagnosis of flights without a gyro, from the balance of the motors in hover (`hover_balance`)."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

import airtouch.gap.measure as measure
from airtouch.gap.answer import advice as advices
from airtouch.gap.answer import pictures as picture
from airtouch.gap.balance.hover_balance import Hypothesis, Reference, evidence, hypotheses, pattern, reference
from airtouch.gap.flights.flight import Flight
from airtouch.gap.nominal import calibrate
from airtouch.gap.result import BASELINE, Cell, Diagnosis, Found, GapMap, Quantity, Ranked
from airtouch.gap.signatures.candidates import names_alike
from airtouch.gap.where import summary
from airtouch.simulation.effects import get
from airtouch.vehicle import Vehicle

LEAST_SHIFT = 0.9  #: posterior probability of an off-centre weight's side, for com_offset to be named


def applies(flights: Sequence[Flight], nominal: Sequence[Flight], vehicle: Vehicle) -> bool:
    """Whether no flight has a gyro, and both nominal and other ones hover for long enough."""
    def hovers(some):
        return any(np.isfinite(pattern(f, vehicle)).all() for f in some)
    return all(f.rates is None for f in flights) and hovers(nominal) and hovers(flights)


def diagnosis(flights: Sequence[Flight], nominal: Sequence[Flight], vehicle: Vehicle,
              notes: Sequence[str] = (), without: Iterable[str] = (), pictures: bool = False) -> Diagnosis:
    """Which of the hypotheses of `hover_balance` the flights' mean pattern fits best."""
    left_out = set(without)
    every = [h for h in hypotheses(vehicle) if not left_out & {h.name, *(name for name, _ in h.effects)}]
    voltage = all(f.log.has("vbat_V") for f in (*flights, *nominal))
    base = reference(np.array([pattern(f, vehicle, voltage) for f in nominal]))
    table = np.array([pattern(f, vehicle, voltage) for f in flights])
    seen = np.nanmean(table, axis=0)
    logs, weights = evidence(seen, base, every)
    chance = np.exp(logs - logs.max())
    chance /= chance.sum()
    names = list(dict.fromkeys(h.name for h in every))
    total = {n: float(sum(c for c, h in zip(chance, every, strict=True) if h.name == n)) for n in names}
    family = {n: total[n] for n in names}
    if "mass" in family:
        family["mass"] += family.get("com_offset", 0.0)  # a weight, whether its own mass shows or not
    first = max(family, key=family.__getitem__)
    if first == "mass" and total.get("com_offset", 0.0) > total["mass"]:
        first = "com_offset"
    best = {n: max((i for i, h in enumerate(every) if h.name == n), key=logs.__getitem__) for n in names}
    share = {n: _shrink(seen, base, every[i], weights[i]) for n, i in best.items()}
    ranking = _ranking(names, first, total, family, {n: s[1] for n, s in share.items()})
    verdict = first if first in ("none", "unknown") else "effect"
    effects = _found(every[best[first]], weights[best[first]]) if verdict == "effect" else ()
    cells = _cells(seen, base, vehicle, every[best[first]], weights[best[first]], len(flights))
    before, after = share[first][0]
    alike = [tuple(sorted(group[0])) for e in effects if (group := names_alike(e.name))]
    others = [n for n in names if n not in (first, "unknown") and total[n] > 0.5 * family[first]]
    if others:
        alike.append(tuple(sorted({first, *others})))
    wrong = next((n for n in ("com_offset", "slung_load", "mass", "weak_motor") if n in names and n != first
                  and total[n] < 0.1), None)
    control = {}
    if verdict == "effect" and wrong is not None:
        (gap, left), part = share[wrong]
        control = {"name": wrong, "before": gap, "after": left, "shrink": part.plain()}
    said = ["no gyro: judged by the balance of the motors in hover and how unsteady it is; candidates that "
            "leave both as they are were not tried", *notes]
    if not voltage:
        said.append("no battery voltage in some flights: their lift may differ for that alone")
    alike = list(dict.fromkeys(alike))
    headline = summary.headline(cells, bool(effects))
    made = GapMap(cells, BASELINE, tuple(f.name for f in flights))
    steps = advices.steps(verdict, effects, alike, headline, flights, True, vehicle.name)
    study = calibrate.declared(vehicle, ())
    return Diagnosis(
        verdict, tuple(effects), tuple(ranking), tuple(alike), cells,
        {"before": before, "after": after if verdict == "effect" else before, "floor": 1.0},
        share[first][1] if verdict == "effect" else None, control,
        advices.advice(steps), {}, tuple(said), measure.cannot_of([f.cannot for f in flights]),
        tuple(f.name for f in flights), (), made, headline, steps, vehicle.name, tuple(f.name for f in nominal), {},
        picture.of(study, flights, nominal, [], headline, cells) if pictures else None)


def _ranking(names: Sequence[str], first: str, total: Mapping[str, float], family: Mapping[str, float],
             share: Mapping[str, Quantity]) -> list[Ranked]:
    """Every candidate, best first. A weight's two forms count as one where one of them is the answer."""
    chance = dict(total)
    weight = "com_offset" if first == "mass" else "mass"
    if first in ("mass", "com_offset") and weight in chance:
        chance[first], chance[weight] = chance[first] + chance[weight], 0.0
    why = {}
    if chance.get(weight) == 0.0:
        why[weight] = f"counted with {first}: a weight, whether its own mass shows or not"
    best = max(chance.values())
    return sorted((Ranked(n, chance[n], share[n],
                          "" if n == first
                          else why.get(n, f"{best / max(chance[n], 1e-12):.3g} times less probable than {first}"))
                   for n in names), key=lambda r: (r.name != first, -r.probability))


def _shrink(seen: np.ndarray, base: Reference, h: Hypothesis,
            weight: np.ndarray) -> tuple[tuple[float, float], Quantity]:
    """Gap before and after in deviations of the floor, and the share of it that goes, with its interval."""
    gap, spread = base.difference(seen)[:4], np.sqrt(base.variance[:4])
    def rms(x):
        return float(np.sqrt(np.mean((x / spread) ** 2)))
    before, after = rms(gap), rms(gap - weight @ h.change)
    each = np.sqrt((((gap - h.change) / spread) ** 2).mean(axis=1))
    def part(a):
        return float(np.clip((before - a) / max(before - 1.0, 1e-9), 0.0, 1.0)) if before > 1.0 else 0.0
    low, high = _quantile(each, weight, 0.95), _quantile(each, weight, 0.05)
    return (before, after), Quantity(part(after), min(part(low), part(after)), max(part(high), part(after)))


def _quantile(values: np.ndarray, weight: np.ndarray, q: float) -> float:
    order = np.argsort(values)
    return float(np.interp(q, np.cumsum(weight[order]), values[order]))


def _found(h: Hypothesis, weight: np.ndarray) -> list[Found]:
    """The effects, posterior means with 90 % intervals; a weight's com_offset only where its side is sure."""
    out = []
    for name, drawn in h.effects:
        if name == "com_offset" and len(h.effects) > 1 and not any(
                max(weight @ (v > 0), weight @ (v < 0)) > LEAST_SHIFT for v in drawn.values()):
            continue
        parameters = {}
        for p in get(name).parameters:
            if p.name in drawn:
                v = drawn[p.name]
                interval = () if p.integer else (_quantile(v, weight, 0.05), _quantile(v, weight, 0.95))
                parameters[p.name] = Quantity(float(weight @ v), *interval, unit=p.unit) if interval \
                    else Quantity(float(v[0]), unit=p.unit)
        out.append(Found(name, parameters))
    return out


def _cells(seen: np.ndarray, base: Reference, vehicle: Vehicle, h: Hypothesis, weight: np.ndarray,
           flights: int) -> tuple[Cell, ...]:
    """The pattern as forces and angular accelerations in hover, largest over the floor first."""
    g, half = vehicle.gravity_mps2, vehicle.arm_m / np.sqrt(2.0)
    inertia, lift = vehicle.inertia_kg_m2, vehicle.mass_kg * vehicle.gravity_mps2
    unit = np.array([g, lift * half / inertia[0], lift * half / inertia[1],
                     lift * vehicle.yaw_torque_over_thrust_m / inertia[2]])
    gap = base.difference(seen)[:4]
    after = gap - weight @ h.change
    floor = np.sqrt(base.variance[:4])
    channels = (("force_z", "m/s^2"), *((f"torque_{a}", "rad/s^2") for a in "xyz"))
    cells = [Cell(c, (0.0, 0.2), "hover", float(abs(gap[i]) * unit[i]), float(floor[i] * unit[i]), u,
                  flights=flights, after=float(abs(after[i]) * unit[i])) for i, (c, u) in enumerate(channels)]
    return tuple(sorted(cells, key=lambda c: -c.gap / c.floor))


__all__ = ["applies", "diagnosis"]
