"""The curves of a report: signals of the headline's cell, spectra, commands."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.random_effects import replayed_power
from airtouch.gap.flights.flight import GROUND, PERIOD_S, Flight
from airtouch.gap.flights.missing import interpolate_over
from airtouch.gap.nominal.build_study import sensor_noise
from airtouch.gap.signals.channels import CHANNELS, COLUMN, FORCE, TORQUE, angular_acceleration
from airtouch.gap.signals.floor import sensor_power
from airtouch.gap.signals.spectra import AIR, frequencies, short_time_spectra, starts
from airtouch.gap.signatures.candidates import mean_of, random_of
from airtouch.gap.signatures.term import Term
from airtouch.gap.study import Study
from airtouch.gap.where.band_sums import stretches
from airtouch.gap.where.cell import Cell
from airtouch.gap.where.command_power import MeanSpectra, command_power, mean_spectra
from airtouch.gap.where.filter_bank import MAP_BANDS_HZ, band_passed
from airtouch.logs.segments import KINDS
from airtouch.simulation import signals as at

GROUND_EFFECT = "ground_effect"  #: the effect beside whose signal the height is drawn
SAME = 1e-6  #: of the largest value: less is no difference between two curves; chosen
#: flights from which the curves are made, first those that can be drawn as the signal; chosen for time
MOST_FLIGHTS = 40
MOST_SPECTRA = 3  #: channels whose spectra are drawn; chosen. A larger number makes a report longer
#: lowest cutoff of a signal that is drawn: the lowest band alone is nearly a constant; chosen, the end of the second
LEAST_CUTOFF_HZ = 2.0
#: blocks of nominal flights from which on the power of their residual is drawn as the floor of a spectrum; with fewer
#: the declared noise of the sensors is; chosen. A smaller number draws a floor that is itself noise
FEWEST_NOMINAL_BLOCKS = 9
LEAST_FLOOR_POWER = 1e-12  #: least power of a floor that is shown, in a channel's unit squared/Hz; chosen


@dataclass(frozen=True)
class FlightResidual:
    """Residual (n, COUNT) of a flight without and with mean effects in the model; after: None where none act."""

    flight: Flight
    before: np.ndarray
    after: np.ndarray | None


@dataclass(frozen=True)
class Signal:
    """One channel of one flight in a band of frequencies; curves (n,), NaN where nothing is judged.

    measured: None where no sensor shows it alone; before, after: what the model leaves, without and with the effects,
    the latter None without effects, and of one at random that has no mean; phase: of each sample, a place in
    `segments.KINDS`; floor: rms of the floor in that band and the sample's phase, NaN where the map does not have it;
    height_m: of the rotors over the ground below, None where no effect of the ground is named or it is not known;
    acts_s: begin and end, s, of each stretch in which a passing effect acts; cell: that of the answer.
    """

    flight: str
    channel: str
    band_hz: tuple[float, float]
    unit: str
    time_s: np.ndarray
    phase: np.ndarray
    measured: np.ndarray | None
    before: np.ndarray
    after: np.ndarray | None
    floor: np.ndarray
    height_m: np.ndarray | None = None
    acts_s: tuple[tuple[float, float], ...] = ()
    cell: Cell | None = None


@dataclass(frozen=True)
class Spectrum:
    """Power spectral densities (bins,) of a channel's residual in the air, unit squared/Hz; after as in `Signal`.

    floor: mean power of the same residual of nominal flights, or the noise of the sensors where there are too few; None
    where that is nothing, as of a command.
    """

    channel: str
    unit: str
    before: np.ndarray
    after: np.ndarray | None
    floor: np.ndarray | None


@dataclass(frozen=True)
class Curves:
    """Every curve of a report.

    signal: of the headline's cell, None without one and where no flight has its channel; frequency_hz (bins,): of the
    spectra; commands: None where no flight has a steady stretch; random: whether an effect that acts at random is
    among those named; remark: in what the gap that is drawn is another than that of the answer, a sentence, "" where it
    is the same.
    """

    signal: Signal | None = None
    frequency_hz: np.ndarray = field(default_factory=lambda: np.zeros(0))
    spectra: tuple[Spectrum, ...] = ()
    commands: MeanSpectra | None = None
    random: bool = False
    remark: str = ""


def curves_of(study: Study, flights: Sequence[Flight], nominal: Sequence[Flight], effects: Sequence[Term],
              cells: Sequence[Cell], whole_map: Sequence[Cell]) -> Curves:
    """The curves of a diagnosis.

    cells: the one that its answer speaks of, whose signal is drawn, then others, whose channels' spectra are drawn too;
    without any, the commands are all. whole_map: every cell of the map, whose floors are drawn.

    Of more than MOST_FLIGHTS flights those that have the phase of that cell come first, of these those in which a
    passing effect acts.
    """
    commands = mean_spectra(*([command_power(f, study.vehicle) for f in some] for some in (flights, nominal)))
    if not cells or not flights:
        return Curves(commands=commands)
    active = [t.active() for t in mean_of(effects)]
    gated = {name for t in effects for name, *_ in t.gate}  # flights in which a passing effect acts
    phase = KINDS.index(cells[0].phase)
    chosen = sorted(flights, key=lambda f: (phase not in f.phase, f.name not in gated))[:MOST_FLIGHTS]
    residuals = [FlightResidual(f, study.residual(f), study.residual(f, active) if active else None) for f in chosen]
    channels = list(dict.fromkeys(c.channel for c in cells))[:MOST_SPECTRA]
    median = _median_residual(residuals, cells[0], gated)
    signal = None if median is None else _signal(median, cells[0], whole_map, effects)
    return Curves(signal, frequencies(AIR), _spectra(study, residuals, nominal, effects, channels), commands,
                  bool(random_of(effects)))


def _signal(residual: FlightResidual, cell: Cell, whole_map: Sequence[Cell], effects: Sequence[Term]) -> Signal:
    """The curves of one flight in a cell's channel and band (`_band`); the height beside a ground effect alone."""
    flight, c, band_hz = residual.flight, COLUMN[cell.channel], _band(cell, whole_map)
    measured, after = (None if values is None else _band_passed(flight, values, band_hz)
                       for values in (_measured(flight, c), None if residual.after is None else residual.after[:, c]))
    before = _band_passed(flight, residual.before[:, c], band_hz)
    least = SAME * float(np.max(np.abs(np.nan_to_num(before))))
    if after is not None and np.allclose(after, before, rtol=0.0, atol=least, equal_nan=True):
        after = None
    floor = np.where(np.isfinite(before), _floors(cell.channel, band_hz, whole_map)[flight.phase], np.nan)
    return Signal(flight.name, cell.channel, band_hz, CHANNELS[c].unit, np.arange(len(flight)) * PERIOD_S,
                  flight.phase, measured, before, after, floor,
                  _height(flight) if any(t.name == GROUND_EFFECT for t in effects) else None,
                  tuple((begin, end) for t in effects for name, begin, end in t.gate if name == flight.name), cell)


def _band(cell: Cell, whole_map: Sequence[Cell]) -> tuple[float, float]:
    """The band in which a cell's signal is drawn, Hz: as a rule the cell's own.

    It is 0 to LEAST_CUTOFF_HZ where the cell's band lies within that and the map has the channel in all bands there,
    and where the cell's band is none of MAP_BANDS_HZ.
    """
    low = [band for band in MAP_BANDS_HZ if band[1] <= LEAST_CUTOFF_HZ]
    in_map = {c.band_hz for c in whole_map if c.channel == cell.channel}
    own = cell.band_hz in MAP_BANDS_HZ and not (cell.band_hz in low and in_map.issuperset(low))
    return cell.band_hz if own else (0.0, LEAST_CUTOFF_HZ)


def _within(band_hz: tuple[float, float]) -> list[int]:
    """Places in MAP_BANDS_HZ of the bands that lie within a wider one."""
    return [i for i, (low, high) in enumerate(MAP_BANDS_HZ) if band_hz[0] <= low and high <= band_hz[1]]


def _floors(channel: str, band_hz: tuple[float, float], whole_map: Sequence[Cell]) -> np.ndarray:
    """Rms (len(KINDS),) of a channel's floor in a band in each phase; NaN where the map lacks a part of it.

    The mean squares of the map's bands add up, as their gains are power-complementary (`filter_bank`).
    """
    of_cell = {(c.phase, c.band_hz): c.floor for c in whole_map if c.channel == channel and c.regime == "all"}
    parts = [MAP_BANDS_HZ[i] for i in _within(band_hz)]
    return np.sqrt([sum(of_cell.get((kind, part), np.nan) ** 2 for part in parts) for kind in KINDS])


def _height(flight: Flight) -> np.ndarray | None:
    """Height of the rotors over the ground below (n,), m, NaN where nothing is judged; None where it is not known."""
    if not flight.signals[:, at.HEIGHT].any():
        return None
    return np.where(flight.usable, flight.signals[:, at.HEIGHT], np.nan)


def _median_residual(residuals: Sequence[FlightResidual], cell: Cell, gated: Collection[str],
                     ) -> FlightResidual | None:
    """The residual whose rms in a cell's channel, band and phase is the median; None where no flight has the channel.

    gated: names of the flights in which a passing effect acts. Flights that lack the phase do not count, nor do those
    that are not gated, unless there are no others.
    """
    column, phase = COLUMN[cell.channel], KINDS.index(cell.phase)
    band_hz = cell.band_hz if cell.band_hz in MAP_BANDS_HZ else (0.0, LEAST_CUTOFF_HZ)
    gaps = [_band_passed(r.flight, r.before[:, column], band_hz) for r in residuals]
    inside = [np.isfinite(gap) & (r.flight.phase == phase) for gap, r in zip(gaps, residuals, strict=True)]
    if not any(here.any() for here in inside):
        inside = [np.isfinite(gap) & (r.flight.phase != GROUND) for gap, r in zip(gaps, residuals, strict=True)]
    known = [(float(np.mean(gap[here] ** 2)), r) for gap, here, r in zip(gaps, inside, residuals, strict=True)
             if here.any()]
    known = [pair for pair in known if pair[1].flight.name in gated] or known
    return sorted(known, key=lambda pair: pair[0])[len(known) // 2][1] if known else None


def _measured(flight: Flight, channel: int) -> np.ndarray | None:
    """What sensors show of a channel (n,): acceleration, or the slope of the rates; None of any other channel."""
    if FORCE.start <= channel < FORCE.stop:
        return flight.acceleration[:, channel - FORCE.start]
    if TORQUE.start <= channel < TORQUE.stop and flight.rates is not None:
        return angular_acceleration(flight)[:, channel - TORQUE.start]
    return None


def _band_passed(flight: Flight, values: np.ndarray, band_hz: tuple[float, float]) -> np.ndarray:
    """Values (n,) in a band, NaN where nothing is judged."""
    out = np.full(len(values), np.nan)
    for start, stop in stretches(flight):
        valid = ~flight.bridged[start:stop]
        here = interpolate_over(values[start:stop, None], valid)
        out[start:stop] = np.where(valid, band_passed(here, _within(band_hz))[:, 0], np.nan)
    return out


def _spectra(study: Study, residuals: Sequence[FlightResidual], nominal: Sequence[Flight], effects: Sequence[Term],
             channels: Sequence[str]) -> tuple[Spectrum, ...]:
    """The spectra of channels in the air, means over the flights that have the channel; none where none has."""
    airborne = [r for r in residuals if len(starts(r.flight, AIR))]
    if not airborne:
        return ()
    floor = _floor_power(study, nominal)
    before = _mean_of_known([_power(r.flight, r.before) for r in airborne])
    after = _power_after(study, airborne, effects, floor) if effects else None
    return tuple(Spectrum(name, CHANNELS[c].unit, before[:, c], None if after is None else after[:, c],
                          floor[:, c] if (floor[1:, c] > LEAST_FLOOR_POWER).any() else None)
                 for name, c in ((name, COLUMN[name]) for name in channels) if np.isfinite(before[:, c]).all())


def _floor_power(study: Study, nominal: Sequence[Flight]) -> np.ndarray:
    """Floor (bins, COUNT) of the spectra: the mean power of the residual of nominal flights, as the curves have it.

    It is not that of `Study.floor`, in which torque is what the response of nominal flights leaves.
    """
    floor = sensor_power(sensor_noise(study.vehicle), AIR)
    airborne = [f for f in nominal[:MOST_FLIGHTS] if len(starts(f, AIR))]
    if sum(len(starts(f, AIR)) for f in airborne) >= FEWEST_NOMINAL_BLOCKS:
        measured = _mean_of_known([_power(f, study.residual(f)) for f in airborne])
        floor = np.where(np.isfinite(measured), measured, floor)
    return np.maximum(floor, LEAST_FLOOR_POWER)


def _mean_of_known(powers: Sequence[np.ndarray]) -> np.ndarray:
    """Mean power (bins, COUNT) over the flights that have a channel, as rates need a gyro; NaN where none has."""
    stacked = np.array(powers)
    known = np.isfinite(stacked)
    count = known.sum(axis=0)
    return np.where(count > 0, np.where(known, stacked, 0.0).sum(axis=0) / np.maximum(count, 1), np.nan)


def _power(flight: Flight, residual: np.ndarray) -> np.ndarray:
    """Mean power (bins, COUNT) of a residual (n, COUNT) over all blocks in the air of a flight."""
    bridged = interpolate_over(residual, ~flight.bridged)
    return (np.abs(short_time_spectra(bridged, starts(flight, AIR), AIR)) ** 2).mean(axis=0)


def _power_after(study: Study, residuals: Sequence[FlightResidual], effects: Sequence[Term], floor: np.ndarray,
                 ) -> np.ndarray:
    """Mean power (bins, COUNT) with effects in the model.

    No sample of a random effect can be predicted, only its power. What it leaves is the floor times the ratio of the
    power to that expected, floor and random effect together: the floor where the model is right, less where it predicts
    too much.
    """
    powers = [_power(r.flight, r.before if r.after is None else r.after) for r in residuals]
    random = random_of(effects)
    if not random:
        return _mean_of_known(powers)
    of_random = [sum(replayed_power(data, t)[0][AIR].mean(axis=0) for t in random)
                 for data in (Data(study, [r.flight]) for r in residuals)]
    expected = _mean_of_known([np.where(np.isfinite(p), x, np.nan) for p, x in zip(powers, of_random, strict=True)])
    return _mean_of_known(powers) * floor / (floor + expected)
