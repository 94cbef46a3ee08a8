"""Where the gap lies: a map of channel x band x phase x regime, each cell beside its floor.

A cell is the rms of measured minus modelled, in the channel's unit. Its floor is what
flights declared nominal differ by among themselves (without such flights: how much the
flights at hand differ in this phase), and never less than the noise of the declared
sensors. Intervals are 90 %: bootstrap over flights (over blocks where there are few
flights), and never narrower than the time-bandwidth product of the cell allows.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from airtouch.gap.evidence import random_effects
from airtouch.gap.evidence.data import Data, Study
from airtouch.gap.flights.flight import GROUND, Flight
from airtouch.gap.result import BASELINE, SPREAD, Cell, GapMap
from airtouch.gap.signals.channels import CHANNELS, COMMAND, COUNT, RATE, TORQUE, residual
from airtouch.gap.signals.spectra import frequencies
from airtouch.gap.signatures.candidates import MEAN, Term, random_of
from airtouch.gap.where.band_sums import BANDS_HZ, REGIMES, Sums, gains, join, sensor_rms, sums
from airtouch.gap.where.cell_tables import AIR, LEAST_SECONDS, Table, floors_of, spreads_of, table_of
from airtouch.logs.segments import KINDS

LEAST_SHARE = 0.05  #: an effect that takes less of a cell's gap is not its cause

CHANNEL_WORDS = {
    "force_x": "forward force", "force_y": "sideways force", "force_z": "lift",
    "torque_x": "roll torque", "torque_y": "pitch torque", "torque_z": "yaw torque",
    "rate_x": "roll rate", "rate_y": "pitch rate", "rate_z": "yaw rate",
    "command_thrust": "thrust command", "command_roll": "roll command",
    "command_pitch": "pitch command", "command_yaw": "yaw command",
}
PHASE_WORDS = {"ground": "on the ground", "take-off": "at take-off", "hover": "in hover",
               "cruise": "in cruise", "over platform": "over the platform", "landing": "at landing"}


@dataclass(frozen=True)
class Part:
    """What one flight adds to a map."""

    name: str
    before: Sums
    after: Sums | None
    has_gyro: bool
    alone: tuple[Sums, ...] = ()  #: with one of the effects each, where there are several


def gap_map(study: Study, flights: Iterable[Flight], baseline: Iterable[Flight] = (),
            terms: Sequence[Term] = ()) -> GapMap:
    """The map of flights under a study; `after` of each cell is with the terms' effects in the model.

    baseline: flights declared nominal, whose differences are the floor. One flight is held
    at a time besides those that the caller keeps.
    """
    return assemble(study, [part_of(study, f, terms) for f in flights], [part_of(study, f) for f in baseline],
                    [t.name for t in terms])


def part_of(study: Study, flight: Flight, terms: Sequence[Term] = ()) -> Part:
    """One flight's part of the map under a study, and with the terms' effects in the model."""
    left = residual(flight, study.vehicle, study.calibration, study.controller)
    after = _after(study, flight, terms) if terms else None
    return Part(flight.name, sums(flight, left, study.vehicle), after, flight.rates is not None,
                tuple(_after(study, flight, [t]) for t in terms) if len(terms) > 1 else ())


def assemble(study: Study, parts: Sequence[Part], nominal: Sequence[Part] = (),
             effects: Sequence[str] = ()) -> GapMap:
    """The map of flights that were gone through one by one; effects: names of the terms they were given."""
    joined, sensor = join([p.before for p in parts]), sensor_rms(study.vehicle)
    floors = floors_of(join([p.before for p in nominal]), len(nominal), sensor) if nominal \
        else spreads_of(joined, sensor)
    later = join([p.after for p in parts if p.after]) if parts and all(p.after for p in parts) else None
    alone = ([join([p.alone[i] for p in parts]) for i in range(len(effects))] if len(effects) > 1
             else [later] if later is not None else [])
    no_gyro = not any(p.has_gyro for p in parts)
    cells = []
    for k, kind in enumerate(KINDS):
        table = table_of(joined, k, seed=k)
        if table is None:
            continue
        then = table_of(later, k, seed=k) if later is not None else None
        level, top = floors.get(k) or (floors[GROUND] if k == GROUND else floors[AIR])
        best = _best([_rms(a, k) for a in alone], effects, table.rms, level) if then else None
        cells += _cells(kind, table, then, best, level, top, bool(nominal), no_gyro)
    return GapMap(tuple(cells), BASELINE if nominal else SPREAD, tuple(p.name for p in parts))


def significant(cell: Cell) -> bool:
    """Whether the cell's interval lies above the upper end of its floor's."""
    return sure_ratio(cell) > 1.0


def largest(cells: Iterable[Cell], count: int = 10) -> list[Cell]:
    """The significant cells that surely stand out most from their floor, largest first.

    Of a channel, band and phase the regime is named in which the gap is significantly
    larger than in the phase as a whole, if there is one.
    """
    cells = list(cells)
    best: dict[tuple, Cell] = {}
    whole = {(c.channel, c.band_hz, c.phase): c for c in cells if c.regime == "all"}
    for c in cells:
        key = (c.channel, c.band_hz, c.phase)
        if not significant(c) or key not in whole:
            continue
        phase = whole[key]
        if c.regime != "all" and not ((c.low or 0.0) > (phase.high or np.inf) and sure_ratio(c) > sure_ratio(phase)):
            continue
        if key not in best or sure_ratio(c) > sure_ratio(best[key]):
            best[key] = c
    return sorted(best.values(), key=sure_ratio, reverse=True)[:count]


def where(made: GapMap, count: int = 10) -> list[Cell]:
    """The largest cells, then the largest of each phase, and those from which the effects take most."""
    chosen = largest(made.cells, count)
    every = largest(made.cells, len(made.cells))
    more = [next((c for c in every if c.phase == kind), None) for kind in KINDS]
    closed = [((c.after - c.gap) / max(c.floor_high or c.floor, 1e-12), c) for c in every if c.after is not None]
    more += [c for _, c in sorted(closed, key=lambda x: x[0])[:3]]
    others = {c for c in more if c is not None and c not in chosen}
    return chosen + sorted(others, key=sure_ratio, reverse=True)


def ratio(cell: Cell) -> float:
    """Gap over floor."""
    return cell.gap / max(cell.floor, 1e-12)


def sure_ratio(cell: Cell) -> float:
    """Lower end of the gap over the upper end of the floor."""
    return (cell.low or 0.0) / max(cell.floor_high or cell.floor, 1e-12)


def overall(cells: Iterable[Cell], key: str = "gap") -> float:
    """Root mean square of gap (or `after`) over floor, all channels, bands and phases in the air alike."""
    found = [getattr(c, key) / c.floor for c in cells if c.regime == "all" and c.phase != "ground"
             and getattr(c, key) is not None and c.floor > 0.0]
    return float(np.sqrt(np.mean(np.square(found)))) if found else float("nan")


def in_words(cell: Cell) -> str:
    """The cell as a phrase, `over the platform, 0-0.5 Hz, roll torque: 16 rad/s^2, 18 times the floor`."""
    regime = "" if cell.regime == "all" else f" ({cell.regime})"
    return (f"{PHASE_WORDS[cell.phase]}{regime}, {cell.band_hz[0]:g}-{cell.band_hz[1]:g} Hz, "
            f"{CHANNEL_WORDS[cell.channel]}: {short(cell.gap)} {cell.unit}, "
            f"{short(ratio(cell))} times the floor")


def interval(cell: Cell) -> str:
    """The interval of the cell's gap, "" where there is none."""
    return "" if cell.low is None or cell.high is None else f"{short(cell.low)} to {short(cell.high)}"


def short(value: float) -> str:
    """Two digits, or the whole part where that has more."""
    return f"{value:.0f}" if 10.0 <= abs(value) < 1e5 else f"{value:.2g}"


def _after(study: Study, flight: Flight, terms: Sequence[Term]) -> Sums:
    """Sums with effects in the model; the power of random ones is taken off, and what is too much counts."""
    active = [t.active() for t in terms if t.kind == MEAN]
    left = sums(flight, residual(flight, study.vehicle, (*study.calibration, *active), study.controller),
                study.vehicle)
    random = random_of(terms)
    if not random or not len(left.phase):
        return left
    data = Data(study, [flight])
    sensor = sensor_rms(study.vehicle) ** 2
    power = left.power.copy()
    for place, regime in ((left.phase == GROUND, "ground"), (left.phase != GROUND, "air")):
        share = gains(frequencies(regime)) ** 2 * frequencies(regime)[1]
        added = sum(np.einsum("bf,fc->bc", share, p.mean(axis=0)) if len(p) else 0.0
                    for p in (random_effects.power(data, t)[0][regime] for t in random))
        weight = left.weight[place][:, :, None, None]
        rest = np.minimum(sensor * weight, left.power[place])
        power[place] = rest + np.abs(left.power[place] - rest - weight * added)
    return replace(left, power=power)


def _rms(found: Sums, phase: int) -> np.ndarray:
    rows = found.phase == phase
    samples = np.maximum(found.weight[rows].sum(axis=0), 1.0)
    return np.sqrt(found.power[rows].sum(axis=0) / samples[:, None, None])


def _best(alone: Sequence[np.ndarray], effects: Sequence[str], gap: np.ndarray,
          floor: np.ndarray) -> np.ndarray:
    """For each cell the effect that alone takes most from it, "" where each takes little."""
    with np.errstate(invalid="ignore"):
        taken = np.nan_to_num((gap - np.array(alone)) / np.maximum(gap - floor, 1e-12))
    best = np.array(effects, dtype=object)[taken.argmax(axis=0)]
    return np.where((taken.max(axis=0) > LEAST_SHARE) & (gap > floor), best, "")


def _cells(kind: str, table: Table, then: Table | None, best: np.ndarray | None, level: np.ndarray,
           top: np.ndarray, baseline: bool, no_gyro: bool) -> list[Cell]:
    cells = []
    shown = _shown(kind, baseline, no_gyro)
    for r, regime in enumerate(REGIMES):
        if table.seconds[r] < LEAST_SECONDS:
            continue
        for b, band in enumerate(BANDS_HZ):
            for c, channel in enumerate(CHANNELS):
                if not shown[b, c] or not np.isfinite(table.rms[r, b, c]):
                    continue
                cells.append(Cell(
                    channel.name, band, kind, float(table.rms[r, b, c]), float(level[r, b, c]), channel.unit,
                    float(table.low[r, b, c]), float(table.high[r, b, c]), regime, int(table.blocks[r]),
                    int(table.flights[r]), None if then is None else float(then.rms[r, b, c]),
                    float(top[r, b, c]), (best[r, b, c] or None) if best is not None else None))
    return cells


def _shown(kind: str, baseline: bool, no_gyro: bool) -> np.ndarray:
    """Which cells mean something, bool (bands, COUNT).

    Rates hold turns that were flown, so in the air they are only held against baseline
    flights; without a gyro torque is known at low frequency only; commands need a law.
    """
    shown = np.ones((len(BANDS_HZ), COUNT), bool)
    shown[1:, RATE] = False
    shown[:, RATE] &= kind == "ground" or baseline
    shown[0, COMMAND], shown[-1, COMMAND] = False, False
    if kind == "ground":
        shown[:, COMMAND] = False
    if no_gyro:
        shown[1:, TORQUE] = False
    if no_gyro and kind == "ground":
        shown[:, TORQUE] = False
    return shown
