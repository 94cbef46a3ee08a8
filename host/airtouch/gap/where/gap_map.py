"""Where the gap lies: a map of channel x band x phase x regime, each cell beside its floor.

A cell is the rms of measured minus modelled, in the channel's unit. Its floor is what
flights declared nominal differ by among themselves (without such flights: how much the
flights at hand differ in this phase), and never less than the noise of the declared
sensors. Intervals are 90 %: bootstrap over flights (over blocks where there are few
flights), and never narrower than the time-bandwidth product of the cell allows.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from airtouch.gap.flights.flight import GROUND, Flight
from airtouch.gap.signals.channels import CHANNELS, COMMAND, COUNT, RATE
from airtouch.gap.signatures.term import Term
from airtouch.gap.study import Study
from airtouch.gap.where.band_sums import Sums, block_sums, join
from airtouch.gap.where.cell import BASELINE, SMALLEST_FLOOR, SPREAD, Cell, GapMap
from airtouch.gap.where.cell_tables import LEAST_SECONDS, Table, floors_of, phase_floor, spreads_of, table_of
from airtouch.gap.where.filter_bank import MAP_BANDS_HZ, sensor_rms
from airtouch.gap.where.random_power import SumsWith, join_with, sums_with
from airtouch.gap.where.regimes import REGIMES
from airtouch.logs.segments import KINDS

LEAST_SHARE = 0.05  #: fraction of a cell's gap over the floor that an effect must take to be given as its cause; chosen


@dataclass(frozen=True)
class Part:
    """The block sums of one flight, without effects (before) and with those named in the model (after)."""

    name: str
    before: Sums
    after: SumsWith | None
    alone: tuple[SumsWith, ...] = ()  #: sums with one of the effects in the model each, where there are several


@dataclass(frozen=True)
class MapSums:
    """The block sums of all flights: without effects, with those named in the model, with each of these by itself.

    effects: their names; alone: in the order of these.
    """

    before: Sums
    after: SumsWith | None
    alone: Sequence[SumsWith]
    effects: Sequence[str]


@dataclass(frozen=True)
class PhaseTables:
    """The tables of one phase, of which its cells are made.

    kind: name of the phase; after, floor, floor_high (regimes, bands, COUNT): rms with the named effects in the model,
    floor and its upper end, in the channels' units; best: name of the effect that takes most from each cell, or "".
    """

    kind: str
    table: Table
    after: np.ndarray | None
    floor: np.ndarray
    floor_high: np.ndarray
    best: np.ndarray | None


def gap_map(study: Study, flights: Iterable[Flight], baseline: Iterable[Flight] = (),
            terms: Sequence[Term] = ()) -> GapMap:
    """The map of flights under a study; `after` of each cell is with the terms' effects in the model.

    baseline: flights declared nominal, whose differences are the floor. One flight is held
    at a time besides those that the caller keeps.
    """
    return assemble(study, [part_of(study, f, terms) for f in flights], [part_of(study, f) for f in baseline],
                    [group[0].name for group in _effects(terms)])


def part_of(study: Study, flight: Flight, terms: Sequence[Term] = ()) -> Part:
    """One flight's part of the map under a study, and with the terms' effects in the model."""
    gap = study.residual(flight)
    after, groups = sums_with(study, flight, terms) if terms else None, _effects(terms)
    return Part(flight.name, block_sums(flight, gap, study.vehicle), after,
                tuple(sums_with(study, flight, group) for group in groups) if len(groups) > 1 else ())


def _effects(terms: Sequence[Term]) -> list[list[Term]]:
    """The terms of each effect, its mean and its random part, which follow each other."""
    return [list(group) for _, group in groupby(terms, key=lambda t: t.identity)]


def assemble(study: Study, parts: Sequence[Part], nominal: Sequence[Part] = (),
             effects: Sequence[str] = ()) -> GapMap:
    """The map made of the parts of flights; effects: names of those with which the parts were made."""
    joined, sensor = join([p.before for p in parts]), sensor_rms(study.vehicle)
    floors = floors_of(join([p.before for p in nominal]), sensor) if nominal \
        else spreads_of(joined, sensor)
    after = join_with([p.after for p in parts if p.after]) if parts and all(p.after for p in parts) else None
    alone = ([join_with([p.alone[i] for p in parts]) for i in range(len(effects))] if len(effects) > 1
             else [after] if after is not None else [])
    map_sums, cells = MapSums(joined, after, alone, effects), []
    for phase in range(len(KINDS)):
        tables = _phase_tables(phase, map_sums, phase_floor(floors, phase), sensor)
        if tables is not None:
            cells += _cells(tables, visible(phase, bool(nominal)))
    return GapMap(tuple(cells), BASELINE if nominal else SPREAD, tuple(p.name for p in parts))


def _best_effect(alone: Sequence[np.ndarray], effects: Sequence[str], gap: np.ndarray,
                 floor: np.ndarray) -> np.ndarray:
    """Name of the effect that alone takes most from each cell, "" where none takes LEAST_SHARE of it."""
    with np.errstate(invalid="ignore"):
        reduction = np.nan_to_num((gap - np.array(alone)) / np.maximum(gap - floor, SMALLEST_FLOOR))
    best = np.array(effects, dtype=object)[reduction.argmax(axis=0)]
    return np.where((reduction.max(axis=0) > LEAST_SHARE) & (gap > floor), best, "")


def _phase_tables(phase: int, of_map: MapSums, floor: tuple[np.ndarray, np.ndarray], sensor: np.ndarray,
                  ) -> PhaseTables | None:
    """The tables of a phase, None where no flight has it.

    floor: and its upper end, (regimes, bands, COUNT) each; sensor: `sensor_rms`.
    """
    table = table_of(of_map.before, phase, seed=phase)
    if table is None:
        return None
    if of_map.after is None:
        return PhaseTables(KINDS[phase], table, None, *floor, None)
    after, *alone = (np.sqrt(s.of_phase(phase).mean_square(sensor ** 2)) for s in (of_map.after, *of_map.alone))
    return PhaseTables(KINDS[phase], table, after, *floor, _best_effect(alone, of_map.effects, table.rms, floor[0]))


def _cells(phase: PhaseTables, shown: np.ndarray) -> list[Cell]:
    """The cells of one phase; shown (bands, COUNT): those that mean something in it."""
    table, after, cells = phase.table, phase.after, []
    known = (table.seconds >= LEAST_SECONDS) & np.isfinite(table.rms) & np.isfinite(phase.floor)
    for r, b, c in np.argwhere(known & shown):
        cells.append(Cell(
            channel=CHANNELS[c].name, band_hz=MAP_BANDS_HZ[b], phase=phase.kind, gap=float(table.rms[r, b, c]),
            floor=float(phase.floor[r, b, c]), unit=CHANNELS[c].unit, low=float(table.low[r, b, c]),
            high=float(table.high[r, b, c]), regime=REGIMES[r], blocks=int(table.blocks[r, b, c]),
            flights=int(table.flights[r, b, c]), after=None if after is None else float(after[r, b, c]),
            floor_high=float(phase.floor_high[r, b, c]),
            by=None if phase.best is None else phase.best[r, b, c] or None))
    return cells


def visible(phase: int, baseline: bool) -> np.ndarray:
    """Mask (bands, COUNT) of the cells that mean something in a phase, a place in KINDS.

    Rates hold turns that were flown, so in the air they are only held against baseline flights;
    commands are judged in all bands but the lowest and the highest (0.5 to 25 Hz).
    """
    at_rest = phase == GROUND
    out = np.ones((len(MAP_BANDS_HZ), COUNT), bool)
    out[1:, RATE] = False
    out[:, RATE] &= at_rest or baseline
    out[0, COMMAND], out[-1, COMMAND] = False, False
    if at_rest:
        out[:, COMMAND] = False
    return out
