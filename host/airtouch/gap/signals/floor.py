"""The floor of the replay: the power that nominal flights' residuals have, by state, bin and channel.

A gap is held against it. It has a column for each channel, but the likelihood holds the commands against a floor of
their own, `ClosedLoop.floor` (`loop.identify`), not against these columns.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from airtouch.gap.flights.blocks import BANDS_HZ, smooth_power
from airtouch.gap.flights.flight import GROUND, PERIOD_S, Flight
from airtouch.gap.flights.hardness import Slopes, hardness_of, slopes_of
from airtouch.gap.signals.channels import COUNT, TORQUE
from airtouch.gap.signals.spectra import AIR, LEAKED, LEAST_POWER, LENGTH, REST, SMOOTH, difference_power, frequencies

# A measured floor
FEWEST_BLOCKS = 4  #: blocks of nominal flights that a floor is measured on; chosen
#: power of a floor that no flight measures, over that of the sensors' noise: in a state of which nominal flights have
#: fewer than FEWEST_BLOCKS, and without any nominal flight; chosen
UNKNOWN_FLOOR = 2.0
LEAST_FLOOR = 0.5  #: least power of a measured floor over that of the sensors' noise; chosen
LEAST_LEFT = 0.1  #: share of a block's power that is left at least when the power of lost rows is taken off; chosen

# Trim: what the mean of a flight has of its own
#: Hz, upper end of the band in which torque and rate hold the trim of a flight, which does not go with how hard it is
#: flown: that of the lowest band
TRIM_HZ = BANDS_HZ[1]
#: bins, noise bandwidth of a Hann window. Times the duration, the variance of a flight's mean is 1.5 times the power in
#: the lowest bin for what is constant within a block, once for white noise; the larger is used
HANN_POWER = 1.5


@dataclass(frozen=True)
class Floor:
    """Power of the residuals of nominal flights, against which a gap is held.

    power: by state (bins, COUNT), unit^2/Hz; block_counts: by state, how many blocks it is measured on; offset
    (COUNT,): standard deviation between flights of a channel's mean in the air, in its unit; offset_beyond (COUNT,):
    that part of it which the power in the lowest bin does not give; clock_s: rms of the logged times around regular
    ones, s; lost: share of lost samples; slopes: of the power in the air with how hard the vehicle is flown, None for
    too few flights; least_power (bins, COUNT): power in the air that stays however calmly it is flown.
    """

    power: dict[str, np.ndarray]
    block_counts: dict[str, int]
    offset: np.ndarray
    clock_s: float
    lost: float
    slopes: Slopes | None = None
    least_power: np.ndarray | float = 0.0
    offset_beyond: np.ndarray = field(default_factory=lambda: np.zeros(COUNT))

    def of_blocks(self, flight: Flight, first: np.ndarray, state: str) -> np.ndarray:
        """Power (blocks, bins, COUNT) of the blocks of a flight that begin at samples `first`."""
        power = self.power[state]
        if self.slopes is None or state != AIR:
            return np.broadcast_to(power, (len(first), *power.shape))
        return np.maximum(power * self.slopes.relative_power(hardness_of(flight, first, LENGTH[AIR])), self.least_power)


@dataclass(frozen=True)
class NominalBlocks:
    """A flight declared nominal and its blocks.

    residual (n, COUNT): what the calibrated model leaves of it; first, spectra: by state the first samples (blocks,)
    and the spectra (blocks, bins, COUNT) of the blocks; bridging (blocks, bins, COUNT): power that lost rows add in the
    air.
    """

    flight: Flight
    residual: np.ndarray
    first: dict[str, np.ndarray]
    spectra: dict[str, np.ndarray]
    bridging: np.ndarray


def floor_of(nominal: Sequence[NominalBlocks], sensor_rms: np.ndarray) -> Floor:
    """The floor of flights declared nominal, one or more, from what the calibrated model leaves of them.

    sensor_rms (COUNT,): white noise that the sensors are declared to have, rms at 100 Hz (of the gyro for torque,
    rad/s); the floor never falls below LEAST_FLOOR of its power. The power that lost rows add is taken off, as each
    flight loses other rows, to LEAST_LEFT of what is measured.
    """
    flights = [n.flight for n in nominal]
    powers = {r: np.abs(np.concatenate([n.spectra[r] for n in nominal])) ** 2 for r in (AIR, REST)}
    in_air, slopes = _power_in_air(nominal, powers[AIR])
    sensors = {r: sensor_power(sensor_rms, r) for r in (AIR, REST)}
    power = {AIR: _floor_power(in_air, sensors[AIR]), REST: _floor_power(powers[REST], sensors[REST])}
    offset, beyond = _offsets(nominal, power[AIR][0])
    return Floor(power=power, block_counts={r: len(p) for r, p in powers.items()}, offset=offset, offset_beyond=beyond,
                 clock_s=float(np.sqrt(np.mean(np.concatenate([f.clock_s for f in flights]) ** 2))),
                 lost=float(np.mean(np.concatenate([f.lost for f in flights]))),
                 slopes=slopes, least_power=LEAST_FLOOR * sensors[AIR])


def _power_in_air(nominal: Sequence[NominalBlocks], power: np.ndarray) -> tuple[np.ndarray, Slopes | None]:
    """Power (blocks, bins, COUNT) as if all blocks were flown alike, and its slopes with how hard they are flown.

    power (blocks, bins, COUNT): of all blocks in the air, from which what lost rows add is taken off. Too few blocks
    stay as they are, and have no slopes.
    """
    if len(power) < FEWEST_BLOCKS:
        return power, None
    hardness = np.concatenate([hardness_of(n.flight, n.first[AIR], LENGTH[AIR]) for n in nominal])
    trim = (frequencies(AIR) < TRIM_HZ)[:, None] & (np.arange(COUNT) >= TORQUE.start)
    slopes = slopes_of(power, hardness, frequencies(AIR), trim)
    own = np.maximum(power - np.concatenate([n.bridging for n in nominal]), LEAST_LEFT * power)
    return own / slopes.relative_power(hardness), slopes


def _floor_power(power: np.ndarray, sensor: np.ndarray) -> np.ndarray:
    """Power (bins, COUNT) of the floor from that of nominal blocks (blocks, bins, COUNT) and of the sensors' noise."""
    if len(power) < FEWEST_BLOCKS:
        return UNKNOWN_FLOOR * sensor
    mean, blocks = np.nan_to_num(np.nanmean(power, axis=0)), np.maximum(np.isfinite(power).sum(axis=0), 1)
    mean[2:] = smooth_power(np.maximum(mean[2:], LEAST_POWER), blocks[2:], SMOOTH)  # the lowest two hold the means
    return np.maximum(mean, LEAST_FLOOR * sensor)


def _offsets(nominal: Sequence[NominalBlocks], lowest: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """`Floor.offset` and `Floor.offset_beyond`, (COUNT,) each: 0 for one flight.

    lowest (COUNT,): the floor's power in the lowest bin, which gives the means of flights a scatter by chance.
    """
    if len(nominal) < 2:
        return np.zeros(COUNT), np.zeros(COUNT)
    air = [(n.flight.phase != GROUND) & n.flight.usable for n in nominal]
    means = np.array([n.residual[a].mean(axis=0) for n, a in zip(nominal, air, strict=True)])
    variance = np.nan_to_num(means.var(axis=0, ddof=1))
    chance = HANN_POWER * lowest * np.mean([1.0 / max(a.sum() * PERIOD_S, PERIOD_S) for a in air])
    return np.sqrt(variance), np.sqrt(np.maximum(variance - chance, 0.0))


def sensor_power(sensor_rms: np.ndarray, state: str) -> np.ndarray:
    """PSD (bins, COUNT) of the sensors' white noise; that of the gyro's differences rises with frequency.

    sensor_rms (COUNT,): as for `floor_of`.
    """
    f = frequencies(state)
    white = np.broadcast_to(2.0 * PERIOD_S * sensor_rms ** 2, (len(f), COUNT)).copy()
    differences = difference_power(np.maximum(f, LEAKED * f[1]))
    white[:, TORQUE] = differences[:, None] * 2.0 * PERIOD_S * (sensor_rms[TORQUE] / PERIOD_S) ** 2
    return white
