"""What a flight, taken for a hover, shows without a gyro: balance of motors, unsteadiness, corrections of estimates.

Angular acceleration is not measured then, but its mean is zero over seconds. So the mean commanded
thrusts are the torques that act on the vehicle.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d

from airtouch.gap.flights.flight import GROUND, MOST_BRIDGED, PERIOD_S, Flight
from airtouch.gap.loop.command_spectra import MIX
from airtouch.logs.flight_log import VELOCITY
from airtouch.logs.segments import runs
from airtouch.vehicle import Vehicle

#: thrust at a PWM grows with voltage to this power; chosen: the lift commanded falls with voltage to the power 1.1
#: between CrazyPAD's four nominal flights of E8, 1.2 between three of E9 (least squares of the logarithms)
VOLTAGE_EXPONENT = 1.2
VOLTAGE_SAMPLES = 20  #: standard deviation of the Gaussian that smooths the voltage, samples (0.2 s); chosen
SETTLE_S = 0.8  #: s at either end of a stretch in the air that do not count; chosen
LEAST_S = 4.0  #: s that a hover lasts at least, and that a flight has of hovers without their holes; chosen
SPECTRUM_SAMPLES = 256  #: of a block of the spectra: bins of 0.4 Hz, three of them in HEAVE_HZ; chosen
LEAST_SPECTRUM = SPECTRUM_SAMPLES // 2  #: samples of a part beside a hole, at least, whose powers count; chosen
UNSTEADY_HZ = (2.0, 35.0)  #: band of the commands' unsteadiness; chosen
UNSTEADY_BANDS = 4  #: parts of UNSTEADY_HZ, equal in octaves, whose log power has the same weight; chosen
HEAVE_HZ = (0.9, 2.0)  #: band of the vertical acceleration's heave; chosen
LEAST_POWER = -9.0  #: log10 of a power or of a variance; nothing logged is below


@dataclass(frozen=True)
class HoverPattern:
    """The hovers of one flight in eight numbers, NaN where they are not known.

    balance (4,): logarithm of the lift, in units of the weight (at 1 V where the voltage is logged); roll, pitch and
    yaw over the lift. power (2,): log10 of the power of unsteadiness (1/Hz) and heave (m^2/s^4/Hz).
    corrections (2,): log10 of the variance by which the estimated velocity is corrected, (m/s)^2, sideways and upwards;
    NaN where the log has no velocity.
    """

    balance: np.ndarray
    power: np.ndarray
    corrections: np.ndarray

    @property
    def known(self) -> bool:
        """Whether the flight has a hover in which balance and power are known."""
        return bool(np.isfinite([*self.balance, *self.power]).all())

    def array(self) -> np.ndarray:
        """The eight numbers, (8,)."""
        return np.concatenate([self.balance, self.power, self.corrections])


NO_HOVER = HoverPattern(np.full(4, np.nan), np.full(2, np.nan), np.full(2, np.nan))


class _Stretch(NamedTuple):
    """One hover: mean of the mixed thrust (4,), log10 powers, variance of the corrections along x, y and z (3,).

    The powers are NaN where it has fewer than LEAST_SPECTRUM, the corrections where fewer than two are known.
    """

    samples: int
    mixed: np.ndarray
    unsteadiness: float
    heave: float
    corrections: np.ndarray


def hover_pattern(flight: Flight, vehicle: Vehicle, at_one_volt: bool = True) -> HoverPattern:
    """The pattern of a flight, its hovers weighted by their length.

    at_one_volt: take the lift at 1 V, for flights that log the voltage; else at the voltage flown.
    """
    mixed, corrections = _mixed_thrust(flight, vehicle, at_one_volt), _corrections(flight)
    stretches = [_stretch(mixed[first:last], flight.acceleration[first:last, 2], corrections[first:last - 1])
                 for first, last in stretches_in_air(flight)]
    if not stretches:
        return NO_HOVER
    samples = [s.samples for s in stretches]
    mean = np.average([s.mixed for s in stretches], axis=0, weights=samples)
    power = [_mean_of_known([s.unsteadiness for s in stretches], samples),
             _mean_of_known([s.heave for s in stretches], samples)]
    x, y, z = (_mean_of_known([s.corrections[axis] for s in stretches], samples) for axis in range(3))
    return HoverPattern(np.array([np.log(mean[0]), *(mean[1:] / mean[0])]), np.array(power),
                        np.log10(np.maximum([x + y, z], 10.0 ** LEAST_POWER)))


def _mean_of_known(values: Sequence[float], samples: Sequence[int]) -> float:
    """Mean of a number of stretches, weighted by their samples; NaN where it is known of none."""
    known = np.isfinite(values)
    return float(np.average(np.array(values)[known], weights=np.array(samples)[known])) if known.any() else np.nan


def stretches_in_air(flight: Flight) -> list[tuple[int, int]]:
    """What is taken for a hover: first sample, and the one after the last, of each stretch in the air.

    All that is flown is in it, moves and most of a climb as well, but SETTLE_S at either end, and the holes of more
    than MOST_BRIDGED samples that were not logged, at which a stretch is split: a straight line is steadier than any
    flight. A stretch has LEAST_S with its holes, and the flight without them; parts may be shorter, as balance and
    powers are not the same all along a flight. The numbers of a pattern are means over that, of a hover only where the
    flight is one. CrazyPAD's 91 flights are not: the phase hover has 7 to 27 % of it, 22 % in the median, and cruise
    61 to 81 %, at 0.4 m/s. So nominal flights must be flown alike.
    """
    logged = np.ones(len(flight), bool)
    for a, b in runs(flight.not_logged):
        logged[a:b] = b - a <= MOST_BRIDGED
    parts = [(a + first, a + last) for a, b in _stretches_with_holes(flight) for first, last in runs(logged[a:b])]
    return parts if sum(b - a for a, b in parts) * PERIOD_S >= LEAST_S else []


def share_not_logged(flight: Flight) -> float:
    """Share of the samples of a flight's hovers, holes included, that were not logged; 0 without a hover."""
    stretches = [flight.not_logged[a:b] for a, b in _stretches_with_holes(flight)]
    return float(np.concatenate(stretches).mean()) if stretches else 0.0


def _stretches_with_holes(flight: Flight) -> list[tuple[int, int]]:
    """First sample, and the one after the last, of each stretch in the air but SETTLE_S at either end."""
    air = (flight.phase != GROUND) & ~flight.on_ground
    trim = int(SETTLE_S / PERIOD_S)
    trimmed = [(a + trim, b - trim) for a, b in runs(air)]
    return [(a, b) for a, b in trimmed if (b - a) * PERIOD_S >= LEAST_S]


def _mixed_thrust(flight: Flight, vehicle: Vehicle, at_one_volt: bool) -> np.ndarray:
    """Commanded lift, roll, pitch and yaw (n, 4) in units of the weight."""
    weight = vehicle.mass_kg * vehicle.gravity_mps2 / 4.0
    thrust = vehicle.thrust(flight.pwm) / weight
    if at_one_volt and flight.log.has("vbat_V"):
        voltage = np.nan_to_num(flight.log["vbat_V"], nan=float(np.nanmedian(flight.log["vbat_V"])))
        smooth = gaussian_filter1d(voltage, VOLTAGE_SAMPLES, mode="nearest")
        thrust = thrust * smooth[:, None] ** VOLTAGE_EXPONENT
    return thrust @ MIX.T


def _stretch(mixed: np.ndarray, upwards: np.ndarray, corrections: np.ndarray) -> _Stretch:
    """One hover, from mixed thrust (n, 4), vertical acceleration (n,) and corrections of the velocity (n - 1, 3)."""
    known = corrections[np.isfinite(corrections).all(axis=1)]
    variance = known.var(axis=0) if len(known) > 1 else np.full(3, np.nan)
    unsteadiness, heave = _log_powers(mixed, upwards) if len(mixed) >= LEAST_SPECTRUM else (np.nan, np.nan)
    return _Stretch(len(mixed), mixed.mean(axis=0), unsteadiness, heave, variance)


def _log_powers(mixed: np.ndarray, upwards: np.ndarray) -> tuple[float, float]:
    """Unsteadiness and heave of a hover of LEAST_SPECTRUM samples or more; mixed, upwards: as for `_stretch`."""
    from scipy.signal import welch  # slow to import, and seldom needed

    settings = {"fs": 1.0 / PERIOD_S, "nperseg": min(len(mixed), SPECTRUM_SAMPLES), "nfft": SPECTRUM_SAMPLES}
    f, of_commands = welch(mixed[:, 1:] / mixed[:, :1].mean(), **settings, axis=0)
    f, of_heave = welch(upwards, **settings)
    heave = float(np.log10(of_heave[(f >= HEAVE_HZ[0]) & (f < HEAVE_HZ[1])].mean()))
    return _unsteadiness(f, of_commands), heave


def _unsteadiness(f: np.ndarray, power: np.ndarray) -> float:
    """Mean log10 power of roll, pitch and yaw commands (bins, 3) over the UNSTEADY_BANDS."""
    edges = np.geomspace(*UNSTEADY_HZ, UNSTEADY_BANDS + 1)
    pairs = zip(edges[:-1], edges[1:], strict=True)
    return float(np.array([np.log10(power[(f >= a) & (f < b)].mean(axis=0)) for a, b in pairs]).mean())


def _corrections(flight: Flight) -> np.ndarray:
    """What the estimated velocity changes from row to row beyond the acceleration, m/s (n - 1, 3).

    Each has the same share of gravity. NaN beside a row in which a velocity was lost, and where the log has none.
    """
    if not all(flight.log.has(name) for name in VELOCITY):
        return np.full((len(flight) - 1, 3), np.nan)
    velocity = np.column_stack([flight.log[name] for name in VELOCITY])
    world = np.einsum("nij,nj->ni", flight.body_to_world, flight.acceleration)
    return np.diff(velocity, axis=0) - 0.5 * PERIOD_S * (world[1:] + world[:-1])
