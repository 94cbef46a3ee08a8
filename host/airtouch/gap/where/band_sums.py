"""The gap cut into bands and summed over short blocks of each phase: what the gap map is made of.

A power-complementary filter bank (raised cosine between neighbours) is laid over each
stretch in the air or on the ground, mirrored at its ends, so that phases of half a second
have a value in every band, and the bands' mean squares add up to that of the signal.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from airtouch.gap.flights.flight import GROUND, PERIOD_S, Flight
from airtouch.gap.signals.channels import COUNT, FORCE, RATE, TORQUE
from airtouch.gap.signals.spectra import difference_power
from airtouch.simulation import signals as at
from airtouch.simulation.flight import prepare
from airtouch.vehicle import Vehicle

#: edges of the map's bands, Hz: about octaves, chosen; the last ends at half the 100 Hz of the flights
BANDS_HZ = ((0.0, 0.5), (0.5, 2.0), (2.0, 6.0), (6.0, 12.0), (12.0, 25.0), (25.0, 50.0))
CROSSOVER = 0.3  #: half the width of a crossover between two bands, as a fraction of its frequency; chosen
BLOCK = 256  #: samples (2.56 s) that a block has about: a phase is cut into equal blocks of nearly this length; chosen
NOISE_FREQUENCIES = 2000  #: at which the gain of a band is averaged for the sensors' noise; chosen
#: names of the thirds of a flight, by its time in the air
THIRDS = ("first", "second", "last")
#: regimes beside "all" and the thirds: the quantity, its unit, the two limits between its three bins; chosen
BINS = (("height", "m", (0.1, 0.3)), ("speed", "m/s", (0.15, 0.5)), ("cell voltage", "V", (3.6, 3.9)))


def _regime_names() -> tuple[str, ...]:
    """Names of the regimes, in the order of their columns."""
    names = ["all"]
    for quantity, unit, (low, high) in BINS:
        names += [f"{quantity} {limits} {unit}" for limits in (f"< {low:g}", f"{low:g}-{high:g}", f"> {high:g}")]
    return (*names, *(f"{third} third of the flight" for third in THIRDS))


REGIMES = _regime_names()  #: names of the regimes; column r of every array over regimes belongs to REGIMES[r]


@dataclass(frozen=True)
class Sums:
    """Blocks of one flight, or whole phases of it, with their sums over samples.

    phase (b,): place in `segments.KINDS`; flight (b,): number of the flight; weight (b, r):
    samples in each of REGIMES; power (b, r, bands, COUNT): sum of squares; mean
    (b, r, COUNT): sum of the lowest band. NaN where a channel is missing.
    """

    phase: np.ndarray
    flight: np.ndarray
    weight: np.ndarray
    power: np.ndarray
    mean: np.ndarray

    def by_phase(self) -> "Sums":
        """One row for each phase of each flight."""
        keys, row = np.unique(np.column_stack([self.flight, self.phase]), axis=0, return_inverse=True)
        row = row.ravel()

        def total(values: np.ndarray) -> np.ndarray:
            out = np.zeros((len(keys), *values.shape[1:]))
            np.add.at(out, row, values)
            return out

        return Sums(keys[:, 1], keys[:, 0], total(self.weight), total(self.power), total(self.mean))


def join(parts: Sequence[Sums]) -> Sums:
    """Sums of several flights, numbered in their order."""
    if not parts:
        r = len(REGIMES)
        return Sums(np.zeros(0, int), np.zeros(0, int), np.zeros((0, r)),
                    np.zeros((0, r, len(BANDS_HZ), COUNT)), np.zeros((0, r, COUNT)))
    return Sums(np.concatenate([p.phase for p in parts]),
                np.concatenate([np.full(len(p.phase), i) for i, p in enumerate(parts)]),
                *(np.concatenate([getattr(p, key) for p in parts]) for key in ("weight", "power", "mean")))


def gains(f: np.ndarray) -> np.ndarray:
    """Amplitude gain (bands, len(f)) of each band at frequencies f, Hz; the squares of all bands add up to 1."""
    lowpass = [np.zeros(len(f))]
    for _, edge in BANDS_HZ[:-1]:
        position = np.clip((f - edge) / (2.0 * CROSSOVER * edge) + 0.5, 0.0, 1.0)
        lowpass.append(np.cos(0.5 * np.pi * position) ** 2)
    lowpass.append(np.ones(len(f)))
    return np.sqrt(np.maximum(np.diff(lowpass, axis=0), 0.0))


def filtered(values: np.ndarray) -> np.ndarray:
    """Values (n, c) of one stretch in each band, (bands, n, c); a constant stays in the lowest."""
    n = len(values)
    mirrored = np.concatenate([values, values[::-1]])
    spectrum = np.fft.rfft(mirrored, axis=0)
    gain = gains(np.fft.rfftfreq(2 * n, PERIOD_S))
    return np.fft.irfft(spectrum * gain[:, :, None], 2 * n, axis=1)[:, :n]


def regimes(flight: Flight, vehicle: Vehicle) -> np.ndarray:
    """Membership of every sample in each of REGIMES, bool (n, r); samples on the ground are in "all" alone."""
    n, log = len(flight), flight.log
    out = np.zeros((n, len(REGIMES)), bool)
    out[:, 0] = True
    air = flight.phase != GROUND
    quantities = {
        "height": flight.signals[:, at.LOWER_HEIGHT:at.LOWER_HEIGHT + 4].mean(axis=1) if log.has("zrange_m")
        else None,
        "speed": np.hypot(log["vx_mps"], log["vy_mps"]) if log.has("vx_mps", "vy_mps") else None,
        "cell voltage": log["vbat_V"] / vehicle.battery_cells if log.has("vbat_V") else None,
    }
    for i, (quantity, _, limits) in enumerate(BINS):
        value = quantities[quantity]
        if value is not None:
            bin_index = np.where(np.isfinite(value), np.digitize(value, limits), -1)
            for k in range(3):
                out[:, 1 + 3 * i + k] = air & (bin_index == k)
    third = np.minimum(3 * np.cumsum(air) // max(int(air.sum()) + 1, 1), 2)
    for k in range(3):
        out[:, 1 + 3 * len(BINS) + k] = air & (third == k)
    return out


def sums(flight: Flight, residual: np.ndarray, vehicle: Vehicle) -> Sums:
    """Block sums of one flight's residual (n, COUNT), in the channels' units; lost samples are left out."""
    member = regimes(flight, vehicle)
    parts: list[tuple] = []
    for start, stop in stretches(flight):
        valid = ~flight.bridged[start:stop]
        values = _interpolated(residual[start:stop], valid)
        bands = filtered(values)
        flat = (bands ** 2).transpose(1, 0, 2).reshape(stop - start, -1)
        for first, last in _blocks(flight.phase[start:stop]):
            here = slice(first, last)
            mask = (member[start:stop][here] & valid[here, None]).T.astype(np.float64)
            if mask[0].any():
                parts.append((flight.phase[start + first], mask.sum(axis=1),
                              (mask @ flat[here]).reshape(len(REGIMES), len(BANDS_HZ), COUNT),
                              mask @ bands[0, here]))
    if not parts:
        return join([])
    phase, weight, power, mean = (np.array(column) for column in zip(*parts, strict=True))
    return Sums(phase.astype(int), np.zeros(len(phase), int), weight, power, mean)


def stretches(flight: Flight) -> list[tuple[int, int]]:
    """First sample and the one after the last of each stretch without contact, in the air or at rest."""
    air = (flight.phase != GROUND) & ~flight.on_ground
    kind = np.where(flight.on_ground, 1, np.where(air, 2, 0)) * (flight.usable | flight.bridged)
    bounds = np.r_[0, np.flatnonzero(np.diff(kind)) + 1, len(kind)]
    return [(int(a), int(b)) for a, b in zip(bounds[:-1], bounds[1:], strict=True) if kind[a] and b - a > 1]


def sensor_rms(vehicle: Vehicle) -> np.ndarray:
    """Rms (bands, COUNT) that the declared sensor noise alone has in each band; 0 for commands.

    White noise is averaged over NOISE_FREQUENCIES up to half the sampling rate; torque is its difference quotient.
    """
    row = prepare(vehicle, ())[0][0]
    f = (np.arange(NOISE_FREQUENCIES) + 0.5) * (0.5 / NOISE_FREQUENCIES) / PERIOD_S
    gain = gains(f) ** 2
    white = gain.mean(axis=1)
    differenced = (gain * difference_power(f)).mean(axis=1) / PERIOD_S ** 2
    out = np.zeros((len(BANDS_HZ), COUNT))
    out[:, FORCE] = white[:, None] * np.asarray(row["acc_noise"]) ** 2
    out[:, TORQUE] = differenced[:, None] * np.asarray(row["gyro_noise"]) ** 2
    out[:, RATE] = white[:, None] * np.asarray(row["gyro_noise"]) ** 2
    return np.sqrt(out)


def _interpolated(values: np.ndarray, valid: np.ndarray) -> np.ndarray:
    """The values (n, c) with straight lines over the samples that are not valid; absent channels stay NaN."""
    out = np.array(values)
    if not valid.all() and valid.any():
        index = np.arange(len(out))
        for c in range(out.shape[1]):
            out[:, c] = np.interp(index, index[valid], out[valid, c])
    return out


def _blocks(phase: np.ndarray) -> list[tuple[int, int]]:
    """Runs of one phase cut into equal blocks of about BLOCK samples; short phases are one block."""
    bounds = np.r_[0, np.flatnonzero(np.diff(phase)) + 1, len(phase)]
    blocks = []
    for a, b in zip(bounds[:-1], bounds[1:], strict=True):
        cuts = np.linspace(a, b, max(round((b - a) / BLOCK), 1) + 1).astype(int)
        blocks += list(zip(cuts[:-1].tolist(), cuts[1:].tolist(), strict=True))
    return blocks
