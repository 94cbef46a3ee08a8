"""Where the lines of turning rotors lie in a flight's spectra, and how strong they are there.

An out-of-balance rotor shakes the IMU once a turn; the log's 100 Hz fold that line to somewhere below 50 Hz. Motor
commands tell how the speed wanders: the mean of the rotors follows the thrust, which changes slowly, while differences
between them are aliases of the rate loop but for their mean (trim). How fast a rotor turns for its thrust is seldom
known to the percent that would tell where the fold puts the line. So the shift of all lines together, and the spread of
those of single rotors around it, are estimated from the flights: two numbers for all of them. Lines of rotors that turn
alike add up as their phases happen to stand, so that flights of one vehicle differ: each has its own power.
"""

import itertools
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.likelihood import REPLAY_FREEDOM, minus_log_likelihood
from airtouch.gap.flights.blocks import hann_window
from airtouch.gap.flights.evenly import evenly_spaced
from airtouch.gap.flights.flight import GROUND, PERIOD_S, Flight
from airtouch.gap.flights.missing import interpolate_missing
from airtouch.gap.signals.channels import FORCE
from airtouch.gap.signals.spectra import AIR, LEAST_POWER, LENGTH
from airtouch.gap.study import Study
from airtouch.simulation import replay
from airtouch.simulation.flight import prepare
from airtouch.simulation.plant import hover_speed

BINS = LENGTH[AIR]  #: of a block's two-sided spectrum
#: rad^2/s, variance that a rotor's phase gains over the commanded one; chosen. A larger number makes wider lines
PHASE_WANDER = 0.3
#: Hz, standard deviations of the single rotors' lines around their mean that are tried; chosen. Larger ones fit wider
#: lines
SPREADS_HZ = (0.0, 1.0, 3.0)
#: relative error of a rotor's speed where the vehicle declares thrust over speed squared, or the log has the speed;
#: chosen. A larger number looks for lines farther from where they should be, and may find others
SPEED_ERROR = 0.02
#: columns of the rotors' logged speeds, 1/min
RPM = ("rpm_1", "rpm_2", "rpm_3", "rpm_4")
LOWEST_HZ = 3.0  #: lines are looked for above it, as forces of other origin are strong below; chosen
STRENGTH_GRID = np.geomspace(1e-3, 1e3, 13)  #: power of lines over the floor's, of which the best is refined; chosen
#: multiples of the best strength of the grid that are tried then, from its one neighbour to the other; chosen. More
#: find the strength more exactly
FINER_FACTORS = np.geomspace(10.0 ** -0.5, 10.0 ** 0.5, 9)
#: bins between the shifts that are tried first; chosen for time. With more the best may lie between two of them
ROUGH_BINS = 2
#: bins on either side of the best of these in which every shift is tried then; chosen, more than ROUGH_BINS
FINER_BINS = 3
#: blocks, at most, by which the shift is estimated; chosen for time. More find it more exactly
MOST_BLOCKS = 40


@dataclass(frozen=True)
class Lines:
    """The lines of some flights, together 1 m/s^2 in hover.

    power: PSD (blocks, bins) of an accelerometer axis, (m/s^2)^2/Hz, for each flight; shift: bins from where the
    vehicle's thrust over speed squared puts the lines; spread_hz: standard deviation of the single rotors' lines
    around that.
    """

    power: list[np.ndarray]
    shift: int
    spread_hz: float


def lines(data: Data) -> Lines:
    """The lines of the flights of `data`; computed once."""
    return data.workspace.cached("lines", (), lambda: _search(data))


def two_sided(speed: np.ndarray, hover: float, first: np.ndarray) -> np.ndarray:
    """Power (blocks, BINS) of exp(i angle) of all rotors, each 0.5 (speed / hover)^2, as blocks hold it.

    speed (n, 4): of the rotors, rad/s, at 100 Hz; hover: their speed in hover, rad/s; first: samples at which the
    blocks begin. Bins as numpy.fft orders them.
    """
    window = hann_window(BINS)[0][:, 0]
    samples = first[:, None] + np.arange(BINS)
    total = np.zeros((len(first), BINS))
    for one in speed.T:
        turning = 0.5 * (one / hover) ** 2 * np.exp(1j * PERIOD_S * np.cumsum(one))
        total += np.abs(np.fft.fft(turning[samples] * window, axis=1)) ** 2
    return total * 2.0 * PERIOD_S / (window ** 2).sum()


def widened(power: np.ndarray, spread_hz: float) -> np.ndarray:
    """Two-sided power (blocks, BINS) where phases walk randomly (PHASE_WANDER) and frequencies are uncertain.

    power: that of `two_sided`; spread_hz: standard deviation of the frequency (Gaussian).
    """
    apart = PERIOD_S * np.minimum(np.arange(BINS), BINS - np.arange(BINS))
    less = np.exp(-0.5 * PHASE_WANDER * apart - 0.5 * (2.0 * np.pi * spread_hz * apart) ** 2)
    return np.maximum(np.fft.fft(np.fft.ifft(power, axis=1) * less, axis=1).real, 0.0)


def folded(power: np.ndarray, shift: int = 0) -> np.ndarray:
    """One-sided PSD (blocks, BINS // 2 + 1) of the real part of a signal with a two-sided power (blocks, BINS).

    shift: bins by which the power is moved before it is folded.
    """
    moved = np.roll(power, shift, axis=1)
    half = BINS // 2
    out = 0.25 * (moved[:, :half + 1] + moved[:, -np.arange(half + 1) % BINS])
    out[:, [0, half]] *= 0.5
    return out


def speeds(flight: Flight, study: Study) -> np.ndarray:
    """Rotor speeds (n, 4), rad/s: as logged, else those of the mean command with each rotor's trim."""
    if flight.log.has(*RPM):
        return interpolate_missing(flight.log.stack(RPM)) * np.pi / 30.0
    replayed = replay.run(flight.log, study.vehicle, study.calibration, period_s=PERIOD_S,
                      signals=flight.signals.copy(), pwm=flight.pwm).rotor_speed
    common = replayed.mean(axis=1, keepdims=True)
    return common + (replayed - common)[flight.phase != GROUND].mean(axis=0)


def _search(data: Data) -> Lines:
    """The lines with the likeliest shift and spread, by some blocks of all flights.

    First the shift at one spread, in every ROUGH_BINS bins, then shift and spread together around it.
    """
    study = data.study
    hover = hover_speed(prepare(study.vehicle, study.calibration)[0])
    powers = [two_sided(speeds(f, study), hover, s[AIR]) for f, s in zip(data.flights, data.block_starts, strict=True)]
    speed_known = all(f.log.has(*RPM) for f in data.flights) or study.vehicle.thrust_per_speed2 > 0.0
    turns = hover / (2.0 * np.pi)
    reach = int(min(np.ceil(SPEED_ERROR * turns * PERIOD_S * BINS), BINS // 2)) if speed_known else BINS // 2
    sample = _Sample(data, powers)
    if not len(sample.over_floor):
        return Lines([folded(widened(z, 0.0)) for z in powers], 0, 0.0)
    rough = max(range(-reach, reach + 1, ROUGH_BINS), key=lambda shift: sample.gain(SPREADS_HZ[1], shift))
    around = range(max(rough - FINER_BINS, -reach), min(rough + FINER_BINS, reach) + 1)
    spread, shift = max(itertools.product(SPREADS_HZ, around), key=lambda pair: sample.gain(*pair))
    power = [folded(widened(z, spread), shift) for z in powers]
    return Lines(_scaled_by_flight(data, power), int(shift), spread)


class _Sample:
    """Some blocks of all flights, and how likely lines of a shift and spread make them."""

    def __init__(self, data: Data, powers: list[np.ndarray]) -> None:
        blocks = np.concatenate([b[AIR][:, :, FORCE] for b in data.residual])
        chosen = evenly_spaced(range(len(blocks)), MOST_BLOCKS)
        self.over_floor, self.floor = _over_floor(data, blocks[chosen])
        two_sided_power = np.concatenate(powers)[chosen]
        self.two_sided_power = {h: widened(two_sided_power, h) for h in SPREADS_HZ}

    def gain(self, spread_hz: float, shift: int) -> float:
        """Log likelihood, without OVERLAP_WEIGHT, that lines of the best strength gain over none."""
        shape = folded(self.two_sided_power[spread_hz], shift)[:, _line_bins()] / self.floor
        return best_strength(self.over_floor, shape).gain


def _line_bins() -> np.ndarray:
    """Bins (bins,) in which lines are looked for."""
    f = np.fft.rfftfreq(BINS, PERIOD_S)
    return (f >= LOWEST_HZ) & (f < f[-1])


class _OverFloor(NamedTuple):
    """Power of the accelerometer over its floor, and that floor.

    over (blocks, bins): ratio, mean of three axes; floor (bins,): PSD, (m/s^2)^2/Hz, harmonic mean of three axes.
    """

    over: np.ndarray
    floor: np.ndarray


def _over_floor(data: Data, blocks: np.ndarray) -> _OverFloor:
    """The power of blocks over the floor in the bins of `_line_bins`.

    blocks: spectra (blocks, bins, 3) of the forces.
    """
    floor = data.study.floor.power[AIR][_line_bins(), FORCE]
    with np.errstate(invalid="ignore"):
        over = np.nan_to_num(np.abs(blocks[:, _line_bins()]) ** 2 / floor).mean(axis=2)
    return _OverFloor(over, 1.0 / (1.0 / floor).mean(axis=1))


class BestStrength(NamedTuple):
    """Nats, without OVERLAP_WEIGHT, that the likeliest lines gain over none, and the strength of these.

    strength: factor on the power of the lines' shape.
    """

    gain: float
    strength: float


def best_strength(over: np.ndarray, shape: np.ndarray) -> BestStrength:
    """The likeliest strength of lines of a shape, to the nearest that is tried.

    over (blocks, bins): power over the floor, a ratio; shape (blocks, bins): that of lines of strength 1.

    The law of the power is Lomax's, whose tails have the scale nu, as that of the commands (`loop.command_spectra`). It
    is not the one of the replay, of scale `likelihood.tail_scale`, with which other strengths would be found.
    """
    strengths = STRENGTH_GRID / max(float(shape.mean()), LEAST_POWER)
    size, flat = over.ravel(), shape.ravel()
    tail_scale, exponents, valid = (np.full(len(size), x) for x in (REPLAY_FREEDOM, REPLAY_FREEDOM + 1.0, True))

    def likelihood(strength: float) -> float:
        """Log likelihood of lines of a strength (power), without OVERLAP_WEIGHT and but for a constant."""
        return -minus_log_likelihood(size, 1.0 + strength * flat, tail_scale, exponents, valid)

    levels = [likelihood(s) for s in strengths]
    best = int(np.argmax(levels))
    fine = strengths[best] * FINER_FACTORS
    fine_levels = [likelihood(s) for s in fine]
    return BestStrength(max(fine_levels) - likelihood(0.0), float(fine[int(np.argmax(fine_levels))]))


def _scaled_by_flight(data: Data, power: list[np.ndarray]) -> list[np.ndarray]:
    """Lines of several flights, each scaled by its own strength over the mean strength."""
    if len(power) < 2:
        return power
    strength = np.zeros(len(power))
    for i, (lines_of_flight, residual) in enumerate(zip(power, data.residual, strict=True)):
        if len(lines_of_flight):
            over, floor = _over_floor(data, residual[AIR][:, :, FORCE])
            strength[i] = best_strength(over, lines_of_flight[:, _line_bins()] / floor).strength
    mean = strength[strength > 0.0].mean() if (strength > 0.0).any() else 1.0
    return [p * s / mean for p, s in zip(power, strength, strict=True)]
