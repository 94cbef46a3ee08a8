"""What a diagnosis leaves open: where and when, which signals it follows, and why the nearest effects fail."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from airtouch.gap.evidence.data import Study
from airtouch.gap.flights.flight import GROUND, PERIOD_S, Flight
from airtouch.gap.flights.motion import held
from airtouch.gap.naming.selection import Judged, Selection
from airtouch.gap.relations.inference import LEAST_EVIDENCE, Inference
from airtouch.gap.result import Cell
from airtouch.gap.signals.channels import CHANNELS, residual
from airtouch.gap.signals.spectra import AIR, LENGTH, blocks, frequencies, starts
from airtouch.gap.signatures.signature import MEAN
from airtouch.simulation import signals as at

MOST_CELLS = 5  #: cells that are reported
NEAREST = 3  #: effects that are reported with the reason why they fail
FEWEST = 8  #: blocks that do not overlap, from which on a rank correlation is tested
CHANCE = 0.01  #: probability of a correlation by chance alone, all signals together (Bonferroni)
TINY = 1e-9  #: ratio to the floor at least, of which a logarithm is taken
#: column of each channel, by its name
PLACE = {c.name: i for i, c in enumerate(CHANNELS)}


def unexplained(study: Study, flights: Sequence[Flight], selection: Selection, cells: Sequence[Cell],
                ) -> list[dict[str, Any]]:
    """The largest cells of the map that the named effects leave, JSON-ready (GAP.md, `unexplained`).

    cells: largest first. Each entry has the stretch of time in which most of it is (of the flight in which it is
    largest), how far it is over the floor there, signals that the cell's power follows from block to block, and
    the effects that gain most with the reason why they were not named.
    """
    terms = selection.whole.fits[0].terms if selection.whole and selection.whole.fits else ()
    active = tuple(t.active() for t in terms if t.kind == MEAN)
    near = nearest(selection)
    out = []
    for cell in [c for c in cells if c.phase != "ground" and c.regime == "all"][:MOST_CELLS]:
        over = [(f, o) for f in flights if len(o := _over(study, f, active, cell))]
        if not over:
            continue
        flight, ratio = max(over, key=lambda x: float(x[1].max()))
        first, last = _stretch(ratio)
        begin = starts(flight, AIR)
        out.append({"channel": cell.channel, "band_hz": list(cell.band_hz), "phase": cell.phase, "flight": flight.name,
                    "from_s": float(begin[first] * PERIOD_S), "to_s": float((begin[last] + LENGTH[AIR]) * PERIOD_S),
                    "over_floor": float(ratio[first:last + 1].max()), "follows": _follows(study, over),
                    "nearest": near})
    return out


def nearest(selection: Selection) -> list[dict[str, str]]:
    """The effects that gain most, each with what speaks against it where the verdict is `unknown`."""
    gaining = (j for j in selection.singles.values() if selection.gained(j) > 0.0)
    most = sorted(gaining, key=lambda j: -selection.gained(j))
    return [{"name": j.name, "fails": fails(selection, j)} for j in most[:NEAREST]]


def fails(selection: Selection, judged: Judged) -> str:
    """The reason why a candidate is not the answer, in nats of held-out log likelihood."""
    if selection.inference is not None:
        return fails_by_relations(selection, selection.inference, judged.name)
    least = selection.least[judged.name]
    if judged.name in {s.name for s in selection.named}:  # the best there is, and not enough
        return against(selection)
    if judged.gain < least:
        return f"held-out data gain {judged.gain:.1f} nats by it, {least:.0f} are needed"
    if judged.evidence < least:
        return (f"as strong as it often seems to be in nominal flights: {judged.gain:.0f} nats, of which "
                f"{max(judged.evidence, 0.0):.1f} beyond that scatter, {least:.0f} are needed")
    if selection.chosen:
        return (f"gains {judged.gain:.0f} nats, {' and '.join(s.name for s in selection.named)} "
                f"{selection.chosen.gain:.0f}")
    return f"gains {judged.gain:.0f} of the {selection.free_before:.0f} nats that a model without names gains"


def fails_by_relations(selection: Selection, inference: Inference, name: str) -> str:
    """The reason why the relations of the signals do not name an effect, in nats."""
    gain = inference.evidence[name]
    first = [s.name for s in selection.named]
    if name in first:
        return against(selection)
    if gain < LEAST_EVIDENCE:
        return f"the relations of the signals gain {gain:.1f} nats by it, {LEAST_EVIDENCE:.0f} are needed"
    if not first:
        return f"the relations of the signals gain {gain:.1f} nats by it, and more by a model without names"
    return f"the relations of the signals gain {gain:.0f} nats by it, {inference.evidence[first[0]]:.0f} by {first[0]}"


def against(selection: Selection) -> str:
    """The evidence against the effects named, in words, with the limit that it exceeds or keeps."""
    lost, worst = selection.contradicted
    if selection.loss == selection.unlike:
        return (f"it loses {lost:.0f} nats where it says more than the flights show, most in {worst}; "
                f"{selection.least_left:.0f} may be chance")
    return (f"a model without names gains {max(selection.free_after, 0.0):.0f} nats beside it, up to "
            f"{selection.allowed:.0f} may be left")


def why_not(selection: Selection, name: str, verdict: str) -> str:
    """The reason why a candidate of the ranking is not the answer, "" for the answer."""
    first = selection.named[0].name if selection.named else ""
    step = next((s for s in selection.named[1:] if s.name == name), None)
    if name == verdict or (verdict == "effect" and name == first):
        return ""
    if step is not None and verdict == "effect" and selection.inference is not None:
        return f"named beside {first}: the probability is that it acts alone"
    if step is not None and verdict == "effect":
        before = selection.steps[selection.steps.index(step) - 1].gain
        return f"named beside {first}: adds {step.gain - before:.0f} nats to it; the probability is that it acts alone"
    if name == "unknown":
        return (f"a model without names adds {max(selection.free_after, 0.0):.0f} nats, up to {selection.allowed:.0f} "
                "may be left"
                if selection.explained else "the gap as a whole is at its floor")
    if name == "none":
        gain = selection.inference.evidence[first] if selection.inference and first else \
            selection.chosen.gain if selection.chosen else 0.0
        return (f"{first} gains {gain:.0f} nats over it" if selection.chosen else
                f"a model without names gains {selection.free_after:.0f} nats, up to {selection.allowed:.0f} may be "
                "left")
    return fails(selection, selection.singles[name])


def _over(study: Study, flight: Flight, active: Sequence[Any], cell: Cell) -> np.ndarray:
    """Rms of a cell's channel and band over its floor, in each block (b,) in the air; active: effects in the model."""
    begin, c = starts(flight, AIR), PLACE[cell.channel]
    if not len(begin):
        return np.zeros(0)
    gap = held(residual(flight, study.vehicle, (*study.calibration, *active), study.controller)[:, c:c + 1])
    f = frequencies(AIR)
    band = (f >= cell.band_hz[0]) & (f <= cell.band_hz[1])
    power = (np.abs(blocks(gap, begin, AIR)[:, band, 0]) ** 2).mean(axis=1)
    return np.sqrt(power / max(float(study.floor.power[AIR][band, c].mean()), 1e-300))


def _stretch(ratio: np.ndarray) -> tuple[int, int]:
    """First and last block around the largest that stay above the middle between it and the median."""
    peak = int(np.argmax(ratio))
    limit = 0.5 * (ratio[peak] + float(np.median(ratio)))
    first = last = peak
    while first > 0 and ratio[first - 1] >= limit:
        first -= 1
    while last + 1 < len(ratio) and ratio[last + 1] >= limit:
        last += 1
    return first, last


def _signals(study: Study, flight: Flight) -> Mapping[str, np.ndarray]:
    """The signals (n,) of a flight that a gap may follow, by their names in the answer."""
    s, log = flight.signals, flight.log
    thrust = study.vehicle.thrust(flight.pwm).sum(axis=1)
    out = {"thrust": thrust, "tilt": np.hypot(flight.turn[:, 2, 0], flight.turn[:, 2, 1]),
           "time": np.arange(len(flight)) * PERIOD_S}
    if log.has("zrange_m") or log.has("z_m"):
        out["height"] = s[:, at.LOWER_HEIGHT:at.LOWER_HEIGHT + 4].mean(axis=1)
    if log.has("vx_mps", "vy_mps"):
        out["speed"] = np.hypot(s[:, at.VELOCITY], s[:, at.VELOCITY + 1])
    if log.has("vbat_V"):
        out["battery voltage"] = held(log["vbat_V"])
    return out


def _follows(study: Study, over: Sequence[tuple[Flight, np.ndarray]]) -> list[str]:
    """The names of signals whose mean over a block ranks like the cell's power: Spearman, CHANCE over all signals."""
    table: dict[str, list[np.ndarray]] = {}
    power = []
    for flight, ratio in over:
        begin = starts(flight, AIR)
        power.append(np.log(np.maximum(ratio, TINY)))
        air = np.where(flight.phase == GROUND, np.nan, 1.0)
        for name, values in _signals(study, flight).items():
            in_blocks = (values * air)[begin[:, None] + np.arange(LENGTH[AIR])]
            table.setdefault(name, []).append(np.nanmean(in_blocks, axis=1))
    from scipy.stats import spearmanr  # slow to import, and seldom needed

    level = np.concatenate(power)[::2]  # every other block: they overlap by half
    if len(level) < FEWEST:
        return []
    correlations = []
    for name, parts in table.items():
        values = np.concatenate(parts)
        if len(values) != sum(len(p) for p in power) or np.ptp(values) == 0.0:
            continue
        rank = spearmanr(values[::2], level)
        if rank.pvalue < CHANCE / len(table):
            correlations.append((abs(rank.statistic), name))
    return [name for _, name in sorted(correlations, reverse=True)]
