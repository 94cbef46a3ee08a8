"""The map in a few figures: where most of the gap lies, what stays and what got worse, phase by phase.

Everything that is said of a map, in a sentence, a table, the JSON or a picture, comes from here.
Of a cell: g its gap, l the lower end of g's interval (g where it has none), F the upper end of its floor, n its blocks;
a its gap with the named effects in the model.

    stands out    l / F > 1
    stays         a l / g > F
    got worse     it stays, and a > WORSE g
    energy        n ((g / F)^2 - 1)                   0 where it does not stand out
    removed       n ((g / F)^2 - max(a / F, 1)^2)     0 where it does not stand out
    closes        removed >= HALF energy > 0
    shrinks       it stands out, and WORSE a <= g
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from airtouch.gap.where.cell import SMALLEST_FLOOR, Cell, GapMap
from airtouch.logs.segments import KINDS

GROUND_NAME = "ground"  #: a phase, of `segments.KINDS`
MOST_SHOWN = 10  #: cells of a map that are listed as its largest; chosen
MOST_REDUCED = 3  #: cells that are listed because the effects take most from them; chosen
WORSE = 1.1  #: gap with the effects over gap without, from which on a cell has become worse; chosen
HALF = 0.5  #: fraction of a cell's energy from which on the named effects close it; chosen


@dataclass(frozen=True)
class Phase:
    """One phase of the flights: rms over its cells of gap over floor, and how many cells stand out from their floor.

    energy: of all its cells over the floor, in blocks, by which phases are put in order; stay, worse: cells that
    still stand out, and that got worse, with the named effects in the model.
    """

    name: str
    before: float
    after: float | None
    cells: int
    over: int
    stay: int
    worse: int
    energy: float

    def plain(self) -> dict[str, Any]:
        """The figures as JSON has them, without those that there are not."""
        return {k: v for k, v in asdict(self).items() if v is not None}


def over_floor(cell: Cell, value: float | None = None) -> float:
    """The cell's gap, or another value in its unit, over the upper end of its floor."""
    return (cell.gap if value is None else value) / cell.upper_floor


def sure_ratio(cell: Cell) -> float:
    """The lower end of the cell's gap over the upper end of its floor; 0 where the gap has no interval."""
    return over_floor(cell, cell.low or 0.0)


def significant(cell: Cell) -> bool:
    """Whether the gap has an interval, and it lies above that of the floor, which is SMALLEST_FLOOR at least."""
    return cell.low is not None and stands_out(cell)


def stands_out(cell: Cell) -> bool:
    """Whether the gap lies above the interval of the floor: by its own interval, or by itself where it has none.

    The cells of flights without a gyro (`gap.balance`) have no interval. They may stand out, so that a headline can
    name one, and a report colours those that do; none is `significant`, which `largest` asks for.
    """
    return over_floor(cell, cell.low) > 1.0


def stays(cell: Cell) -> bool:
    """Whether the cell's interval, moved with the named effects in the model, lies above that of the floor."""
    if cell.after is None:
        return stands_out(cell)
    low = cell.after * (1.0 if cell.low is None else cell.low / max(cell.gap, SMALLEST_FLOOR))
    return low > cell.upper_floor


def got_worse(cell: Cell) -> bool:
    """Whether the named effects made the cell larger, by a tenth or more, and it stands out from its floor."""
    return cell.after is not None and stays(cell) and cell.after > WORSE * cell.gap


def energy(cell: Cell) -> float:
    """Energy of the cell, in blocks: its part in the whole flight."""
    return max(cell.blocks, 1) * max(over_floor(cell) ** 2 - 1.0, 0.0) if stands_out(cell) else 0.0


def removed(cell: Cell) -> float:
    """Part of its energy that the named effects take from the cell, in blocks; below 0 where they add to it."""
    if cell.after is None or not stands_out(cell):
        return 0.0
    return max(cell.blocks, 1) * (over_floor(cell) ** 2 - max(over_floor(cell, cell.after), 1.0) ** 2)


def closes(cell: Cell) -> bool:
    """Whether the named effects take half or more of the cell's power over the floor."""
    return removed(cell) >= HALF * energy(cell) > 0.0


def shrinks(cell: Cell) -> bool:
    """Whether the cell stands out, and is smaller with the named effects, by about a tenth or more."""
    return cell.after is not None and stands_out(cell) and WORSE * cell.after <= cell.gap


def within_floor(cell: Cell) -> float:
    """Power over that of the floor, in blocks, that the named effects take from a cell that does not stand out.

    0 where they take less than half of its power, or less than the floor's power of one block: that may be chance.
    """
    if cell.after is None or stands_out(cell):
        return 0.0
    before, after = over_floor(cell) ** 2, over_floor(cell, cell.after) ** 2
    taken = max(cell.blocks, 1) * (before - after)
    return taken if taken >= 1.0 and before - after >= HALF * before else 0.0


def headline(cells: Sequence[Cell], named: bool = False) -> Cell | None:
    """The cell that stands for the gap; None where no cell in the air stands out.

    It is in the channel and band with most energy over all phases in the air, there in the phase with most of it. A
    short phase with one large ratio is not the gap. With named effects it is instead where they take most, among the
    first of these cells that there are: those that they halve; those that they shrink; those inside their floor that
    they halve (`within_floor`). Where there are none, it is as without.
    """
    weights: list[Callable[[Cell], float]] = [energy]
    if named:
        weights = [lambda c: removed(c) if closes(c) else 0.0, lambda c: removed(c) if shrinks(c) else 0.0,
                   within_floor, energy]
    return next((c for w in weights if (c := _heaviest(cells, w)) is not None), None)


def _heaviest(cells: Iterable[Cell], weight: Callable[[Cell], float]) -> Cell | None:
    """The cell in the air with most weight, within the channel and band with most; None where all have 0."""
    air = [c for c in cells if c.regime == "all" and c.phase != GROUND_NAME and weight(c) > 0.0]
    total: dict[tuple, float] = {}
    for c in air:
        total[c.channel, c.band_hz] = total.get((c.channel, c.band_hz), 0.0) + weight(c)
    if not total:
        return None
    best = max(total, key=total.__getitem__)
    return max((c for c in air if (c.channel, c.band_hz) == best), key=weight)


def same_place(cells: Iterable[Cell], one: Cell) -> list[Cell]:
    """The cells in the air of one's channel and band that stand out from their floor."""
    return [c for c in cells if c.regime == "all" and c.phase != GROUND_NAME and stands_out(c)
            and (c.channel, c.band_hz) == (one.channel, one.band_hz)]


def remaining(cells: Iterable[Cell]) -> list[Cell]:
    """Cells that stand out with the named effects in the model, largest first."""
    return sorted((c for c in cells if c.regime == "all" and c.after is not None and stays(c)),
                  key=lambda c: -over_floor(c, c.after))


def worse(cells: Iterable[Cell]) -> list[Cell]:
    """Cells that the named effects made larger, the largest first."""
    return [c for c in remaining(cells) if got_worse(c)]


def phases(cells: Sequence[Cell]) -> tuple[Phase, ...]:
    """The phases of the flights with their figures, that with most energy first."""
    out = []
    for kind in KINDS:
        own = [c for c in cells if c.phase == kind and c.regime == "all"]
        if not own:
            continue
        after = [c.ratio_after for c in own if c.after is not None]
        out.append(Phase(kind, rms([c.ratio for c in own]),
                          rms(after) if len(after) == len(own) else None, len(own),
                          sum(stands_out(c) for c in own), sum(stays(c) for c in own),
                          sum(got_worse(c) for c in own), sum(energy(c) for c in own)))
    return tuple(sorted(out, key=lambda p: -p.energy))


def largest(cells: Iterable[Cell], count: int = MOST_SHOWN) -> list[Cell]:
    """The significant cells with the largest ratio of lower end to upper end of the floor, largest first.

    Of a channel, band and phase the regime is named in which the gap is significantly larger than in the phase as a
    whole, if there is one.
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


def cells_to_show(of_map: GapMap, count: int = MOST_SHOWN) -> list[Cell]:
    """The largest cells, then the largest of each phase, and those from which the effects take most."""
    chosen = largest(of_map.cells, count)
    ordered = largest(of_map.cells, len(of_map.cells))
    more = [next((c for c in ordered if c.phase == kind), None) for kind in KINDS]
    reductions = [(over_floor(c, c.after - c.gap), c) for c in ordered
                  if c.after is not None and c.after < c.gap]
    more += [c for _, c in sorted(reductions, key=lambda x: x[0])[:MOST_REDUCED]]
    others = {c for c in more if c is not None and c not in chosen}
    return chosen + sorted(others, key=sure_ratio, reverse=True)


def overall(cells: Iterable[Cell]) -> float:
    """Root mean square over all cells in the air of gap over floor, each with the same weight; NaN without any."""
    ratios = [c.ratio for c in cells if c.regime == "all" and c.phase != GROUND_NAME]
    return rms(ratios) if ratios else float("nan")


def rms(values: Sequence[float]) -> float:
    """Root mean square of values."""
    return float(np.sqrt(np.mean(np.square(values))))
