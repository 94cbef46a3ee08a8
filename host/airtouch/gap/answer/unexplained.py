"""What a diagnosis leaves open: in which cells of the map, and when; what makes a flight less steady than others."""

from collections.abc import Sequence

import numpy as np

from airtouch.gap.answer.followed_signals import followed_signals
from airtouch.gap.answer.reasons import nearest
from airtouch.gap.flights.flight import PERIOD_S, Flight
from airtouch.gap.flights.missing import interpolate_over
from airtouch.gap.naming.records import Selection
from airtouch.gap.naming.unknown import unsteadiness_ratio
from airtouch.gap.passing.bursts import SHAKE_BAND_HZ, SHAKE_PIECE_S
from airtouch.gap.passing.unsteadiness import COLUMNS, rms_over_median
from airtouch.gap.result import REST_OF_FLIGHT, OpenCell, Rejected
from airtouch.gap.signals.channels import CHANNELS, COLUMN
from airtouch.gap.signals.spectra import AIR, LENGTH, frequencies, short_time_spectra, starts
from airtouch.gap.signatures.candidates import mean_of
from airtouch.gap.study import Study
from airtouch.gap.where import summary
from airtouch.gap.where.band_sums import block_bounds, block_sums
from airtouch.gap.where.cell import Cell
from airtouch.gap.where.filter_bank import MAP_BANDS_HZ, gains
from airtouch.logs.segments import KINDS

MOST_CELLS = 5  #: cells that are reported at most; chosen, as many as a reader can take in


def unexplained(study: Study, flights: Sequence[Flight], selection: Selection, cells: Sequence[Cell],
                ) -> list[OpenCell]:
    """What stays open: cells of the map, each with the flight and the seconds of its phase in which most is left.

    A phase too short for a block of spectra has a block of the map instead (`_blocks_in_phase`), and no signals. Where
    the flights are less steady than nominal ones, what shakes most comes before them (`_unsteady_cell`). cells: the
    headline, then the others, those with the largest gap before any effect first. Of these the first MOST_CELLS are
    reported, without those on the ground and those of one regime alone.

    What is left is the residual with the effects of the last step in the model, deviations included, at the values
    fitted to the first half of the data (`Hypothesis.terms`), not at those of the answer, which are fitted to all of it
    (`named_effects`). So the second half is held out and the first is not: less is left in the flights of the first.
    """
    terms = selection.last_step.fits[0].terms if selection.last_step and selection.last_step.fits else ()
    active = [t.active() for t in mean_of(terms)]
    chosen = [c for c in cells if c.phase != summary.GROUND_NAME and c.regime == "all"][:MOST_CELLS]
    residuals = [(f, study.residual(f, active)) for f in flights] if chosen else []
    near = tuple(nearest(selection))
    out = []
    if unsteadiness_ratio(selection) >= 1.0:
        out.append(_unsteady_cell(study, flights, COLUMNS[selection.unsteadiness_rarity.rarest], near))
    for cell in chosen:
        ratios = _in_phase([(f, ratios_of_blocks(f, residual, cell)) for f, residual in residuals], cell.phase)
        blocks = [] if ratios else [(f, *b) for f, residual in residuals
                                    for b in _blocks_in_phase(study, f, residual, cell)]
        if ratios:
            flight, ratio = max(ratios, key=lambda pair: float(np.nanmax(pair[1])))
            begin = starts(flight, AIR)
            first, last = worst_interval(ratio, begin)
            start, stop, over_floor = begin[first], begin[last] + LENGTH[AIR], ratio[first:last + 1].max()
        elif blocks:
            flight, start, stop, over_floor = max(blocks, key=lambda block: block[3])
        else:
            continue
        out.append(OpenCell(
            cell.channel, cell.band_hz, cell.phase, flight.name, float(start * PERIOD_S), float(stop * PERIOD_S),
            float(over_floor), follows=tuple(followed_signals(study, ratios)) if ratios else (), nearest=near))
    return out


def _unsteady_cell(study: Study, flights: Sequence[Flight], columns: Sequence[int], near: tuple[Rejected, ...],
                   ) -> OpenCell:
    """The channel among columns of the residual that is shaken most beyond the rest of its flight, and when.

    columns: of the torques or the lift, whichever is rarer as unsteady in nominal flights.
    """
    ratios = [(f, c, rms_over_median(study, f, c)) for f in flights for c in columns]
    flight, column, ratio = max((r for r in ratios if np.isfinite(r[2]).any()), key=lambda r: float(np.nanmax(r[2])))
    first, last = worst_interval(ratio)
    from_s, to_s = first * SHAKE_PIECE_S, (last + 1) * SHAKE_PIECE_S
    phase = np.bincount(flight.phase[round(from_s / PERIOD_S):round(to_s / PERIOD_S)], minlength=len(KINDS)).argmax()
    return OpenCell(CHANNELS[column].name, SHAKE_BAND_HZ, KINDS[phase], flight.name, from_s, to_s,
                    float(ratio[first:last + 1].max()), nearest=near, floor=REST_OF_FLIGHT)


def ratios_of_blocks(flight: Flight, residual: np.ndarray, cell: Cell) -> np.ndarray:
    """Rms of a cell's channel and band over the cell's floor, in each block (blocks,) in the air.

    residual (n, COUNT): of the flight; straight lines stand for rows that are not judged. NaN where the log lacks the
    channel.
    """
    begin, c, f = starts(flight, AIR), COLUMN[cell.channel], frequencies(AIR)
    if not len(begin) or not np.isfinite(residual[:, c]).any():
        return np.full(len(begin), np.nan)
    judged = interpolate_over(residual[:, c:c + 1], ~flight.bridged)
    density = np.abs(short_time_spectra(judged, begin, AIR)[:, :, 0]) ** 2
    gain = gains(f)[MAP_BANDS_HZ.index(cell.band_hz)]
    return np.sqrt(density @ gain ** 2 * f[1]) / max(cell.floor, summary.SMALLEST_FLOOR)


def _in_phase(ratios: Sequence[tuple[Flight, np.ndarray]], phase: str) -> list[tuple[Flight, np.ndarray]]:
    """Flights with their ratios (blocks,), NaN in blocks of which most is another phase.

    Flights without a number are left out.
    """
    place = KINDS.index(phase)
    within = [(f, np.where(_commonest_phase(f) == place, ratio, np.nan)) for f, ratio in ratios]
    return [(f, ratio) for f, ratio in within if np.isfinite(ratio).any()]


def _blocks_in_phase(study: Study, flight: Flight, residual: np.ndarray, cell: Cell) -> list[tuple[int, int, float]]:
    """First sample, the one after the last, and rms over the floor of each block of the map in a cell's phase.

    residual (n, COUNT): of the flight. No block where the log lacks the channel, or where no row is judged.
    """
    sums = block_sums(flight, residual, study.vehicle)
    power, weight = sums.power[:, 0, MAP_BANDS_HZ.index(cell.band_hz), COLUMN[cell.channel]], sums.weight[:, 0]
    over_floor = np.sqrt(power / weight) / max(cell.floor, summary.SMALLEST_FLOOR)
    return [(start, stop, float(ratio)) for (start, stop), phase, ratio
            in zip(block_bounds(flight), sums.phase, over_floor, strict=True)
            if phase == KINDS.index(cell.phase) and np.isfinite(ratio)]


def _commonest_phase(flight: Flight) -> np.ndarray:
    """Phase of most samples of each block in the air (blocks,), a place in `segments.KINDS`."""
    phase = flight.phase[starts(flight, AIR)[:, None] + np.arange(LENGTH[AIR])]
    return (phase[:, :, None] == np.arange(len(KINDS))).sum(axis=1).argmax(axis=1)


def worst_interval(ratio: np.ndarray, begin: np.ndarray | None = None) -> tuple[int, int]:
    """First and last block around the largest ratio (blocks,) that stay above the middle between it and the median.

    A block of NaN counts in neither and ends the interval. begin (blocks,): first samples of blocks in the air; where
    one begins more than half a block after the one before, as after lost rows or a landing, the interval ends. None:
    the blocks follow one another.
    """
    follows = np.ones(len(ratio), bool) if begin is None else np.diff(begin, prepend=begin[:1]) <= LENGTH[AIR] // 2
    peak = int(np.nanargmax(ratio))
    limit = 0.5 * (ratio[peak] + float(np.nanmedian(ratio)))
    first = last = peak
    while first > 0 and follows[first] and ratio[first - 1] >= limit:
        first -= 1
    while last + 1 < len(ratio) and follows[last + 1] and ratio[last + 1] >= limit:
        last += 1
    return first, last
