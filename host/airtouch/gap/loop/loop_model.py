"""Transfer functions of the attitude and height loops: plant P, controller K and its paths, whether P K is stable.

The equations are in `gap.loop`; the controller is `gap.loop.controller`, the vehicle `gap.loop.axis_plant`. Commands
are in newtons per motor. `f` is always in Hz, and s = 2 pi i f.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from airtouch.gap.loop.axis_plant import AxisPlant
from airtouch.gap.loop.controller import Controller

LOWEST_HZ = 0.05  #: a frequency below it counts as it, so that integrals stay finite; chosen
OUTER_S = 0.01  #: s, period of the firmware's position loop and of its estimator's predictions
IMU_S = 0.001  #: s between samples of the IMU, which the firmware reads at 1 kHz
OPEN = 0.49  #: share of the IMU's rate from which a low-pass's cutoff lets everything pass, as the simulator has it
NO_GAIN = 1e-300  #: gain that counts as none: its logarithm is finite
CROSSING_HZ = np.geomspace(0.3, 45.0, 160)  #: where a loop's gain may last be 1: up to below the log's 50 Hz; chosen


class AxisLoop(NamedTuple):
    """The loop of one axis: its plant, the firmware's controller there, and the controller that counts.

    controller: the firmware's or, where that does not explain nominal flights, one fitted to them.
    """

    plant: AxisPlant
    firmware: Controller
    controller: Controller

    @property
    def by_firmware(self) -> bool:
        """Whether the controller that counts is the firmware's."""
        return self.controller == self.firmware


class LoopParts(NamedTuple):
    """Transfer functions of a loop at some frequencies, complex (bins,) each.

    plant: P, command to measured rate. rate, angle, velocity: R, A and V, paths from the measured rate, through its
    integrals, to the command; on the height axis these are climb, height and, always 0, its integral. controller: K,
    the three together.
    """

    plant: np.ndarray
    rate: np.ndarray
    angle: np.ndarray
    velocity: np.ndarray
    controller: np.ndarray

    @property
    def return_difference(self) -> np.ndarray:
        """1 + P K: open loop over closed loop, 1 / S."""
        return 1.0 + self.plant * self.controller

    def logged_controller(self, kick: np.ndarray | float) -> np.ndarray:
        """K_log = R + k (A + V): measured rate to the command in the log. kick: `noise_spectra.kick_of`."""
        return self.rate + kick * (self.angle + self.velocity)


def excess_phase(c: Controller, plant: AxisPlant) -> float:
    """Phase (rad) by which the loop lags more than half a turn where its gain last is 1; > 0: unstable.

    Between two of CROSSING_HZ phase and logarithm of the gain are straight lines, so that it is continuous in the
    parameters of the loop: fits fail at steps.
    """
    parts = loop_parts(c, plant, CROSSING_HZ)
    loop = parts.plant * parts.controller
    phase, log_size = np.unwrap(np.angle(loop)), np.log(np.maximum(np.abs(loop), NO_GAIN))
    phase += -2.0 * np.pi * np.ceil(phase[0] / (2.0 * np.pi))
    above = np.flatnonzero(log_size > 0.0)
    if not len(above):
        return -np.pi
    last, following = above[-1], min(above[-1] + 1, len(phase) - 1)
    share = log_size[last] / (log_size[last] - log_size[following]) if following > last else 0.0
    return float(-np.pi - phase[last] - share * (phase[following] - phase[last]))


def torque_per_command(c: Controller, plant: AxisPlant, f: np.ndarray) -> np.ndarray:
    """Angular acceleration (bins,) that the motors make of a command, rad/s^2 per N; of c its period counts alone."""
    f = np.maximum(f, LOWEST_HZ)
    return 2j * np.pi * f * plant_of(c, plant, f)


def plant_of(c: Controller, plant: AxisPlant, f: np.ndarray) -> np.ndarray:
    """P, command to measured rate (climb), complex (bins,). The motors' lag M is the mean of rising and falling."""
    factors = factors_of(c, f)
    s = factors.s
    motor = _delayed(plant.actuator_delay_s, 0.0, f.shape, f.tobytes()) * factors.hold * 0.5 * (
        1.0 / (1.0 + s * plant.motor_rise_s) + 1.0 / (1.0 + s * plant.motor_fall_s))
    return plant.acceleration * motor / s


def loop_parts(c: Controller, plant: AxisPlant, f: np.ndarray) -> LoopParts:
    """The transfer functions of a controller and a plant at frequencies f (bins,).

    In roll and pitch, with gain G, sensors' delay L, low-passes B of controller and gyro, renewal E of the estimate,
    C = 1 + i / s + d and I = 1 + i / s of the loop that its index names (C' = C, or I where the derivative is of the
    rate alone), gravity g and factors on the gains in `plant`:

        R = G C L / B
        A = G C' angle I_angle E / s L / B
        V = G C' angle I_angle velocity I_velocity E g / s^2 L

    In thrust, of the climb: R = G I L E / B, A = R angle I_angle / s, with B the low-pass of the acceleration.
    """
    factors, to_rate = factors_of(c, f), plant_of(c, plant, f)
    s, late = factors.s, sensed_late(c, plant, f)
    if plant.axis == "thrust":
        k = plant.height_gain
        climb = k * c.gain * factors.integral * (late * factors.renewed / factors.acc)
        height = climb * c.angle * k * factors.angle_integral / s
        return LoopParts(to_rate, climb, height, 0.0 * s, climb + height)
    k = c.gain * plant.rate_gain
    filtered = late / factors.lowpass / factors.chip
    rate = k * factors.pid * filtered
    per_angle = k * (factors.pid if c.on_error else factors.integral) * c.angle * plant.attitude_gain
    per_angle = per_angle * factors.angle_integral
    per_velocity = per_angle * c.velocity * plant.position_gain * factors.velocity_integral
    angle = per_angle * filtered * factors.renewed / s
    velocity = per_velocity * factors.renewed * plant.gravity_mps2 / factors.s2 * late
    return LoopParts(to_rate, rate, angle, velocity, rate + angle + velocity)


def sensed_late(c: Controller, plant: AxisPlant, f: np.ndarray) -> np.ndarray:
    """The sensors' delay, complex (bins,)."""
    return _delayed(plant.sensor_delay_s, IMU_S if c.lowpass_hz or c.acc_hz else 0.0, f.shape, f.tobytes())


class Factors(NamedTuple):
    """Factors of the transfer functions that neither gains nor vehicle change: complex (bins,) each, or 1.

    s: 2 pi i f; s2: its square; hold: of the motors' commands; renewed: of the estimator's attitude, velocity and
    height, which hold between two predictions; integral, angle_integral, velocity_integral: 1 and the integral of the
    error, in the three loops; pid: with the derivative, in the innermost; outer: differences over a run of the outer
    loop, 1/s; lowpass, chip, acc: by which the controller's low-pass, the gyro's own and that of the acceleration
    divide.
    """

    s: np.ndarray
    s2: np.ndarray
    hold: np.ndarray
    renewed: np.ndarray
    integral: np.ndarray
    angle_integral: np.ndarray
    velocity_integral: np.ndarray
    pid: np.ndarray
    outer: np.ndarray
    lowpass: np.ndarray | float
    chip: np.ndarray | float
    acc: np.ndarray | float


def factors_of(c: Controller, f: np.ndarray) -> Factors:
    """The factors of a controller's loop at frequencies f (bins,); cached."""
    return _factors_at(c.period_s, c.hold_s, (c.lowpass_hz, c.chip_hz, c.acc_hz),
                     (c.integral, c.angle_integral, c.velocity_integral, c.derivative), f.shape, f.tobytes())


@lru_cache(256)
def _factors_at(period: float, hold: float, filters: tuple[float, float, float],
              shares: tuple[float, float, float, float], shape: tuple[int, ...], frequencies: bytes) -> Factors:
    """`factors_of` by what it depends on.

    filters: cutoffs (Hz) of the controller, the gyro, the acceleration; shares: of the three integrals (1/s) and of the
    derivative (s); frequencies: the bytes of an array of that shape, Hz.
    """
    f = np.frombuffer(frequencies).reshape(shape)
    s = 2j * np.pi * f
    runs = round(hold / period) if filters[0] else 1
    renewed = sum(np.exp(-s * k * period) for k in range(runs)) / runs if runs > 1 else 1.0 + 0.0 * s
    lowpass, chip, acc = (butterworth(s, cutoff) for cutoff in filters)
    integral, angle_integral, velocity_integral = (1.0 + share / s for share in shares[:3])
    return Factors(
        s=s, s2=s ** 2, hold=np.sinc(f * period) * np.exp(-0.5 * s * period),
        renewed=renewed * np.exp(-0.5 * s * IMU_S) if hold else renewed,
        integral=integral, angle_integral=angle_integral, velocity_integral=velocity_integral,
        pid=integral + shares[3] * ((1.0 - np.exp(-s * period)) / period),
        outer=(1.0 - np.exp(-s * OUTER_S)) / period, lowpass=lowpass, chip=chip, acc=acc)


@lru_cache(512)
def _delayed(delay: float, step: float, shape: tuple[int, ...], frequencies: bytes) -> np.ndarray:
    """A delay; between two steps the simulator (and this) draws a straight line, which smooths.

    Not below one step: there the smoothing alone would pass for lower gains.
    """
    s = 2j * np.pi * np.frombuffer(frequencies).reshape(shape)
    if step <= 0.0 or delay < step:
        return np.exp(-s * delay)
    whole = np.floor(delay / step + 1e-9)
    part = max(delay / step - whole, 0.0)
    return np.exp(-s * whole * step) * (1.0 - part + part * np.exp(-s * step))


def butterworth(s: np.ndarray, cutoff: float) -> np.ndarray | float:
    """By what a second-order low-pass at the IMU's rate divides at s = 2 pi i f; 1 for a cutoff (Hz) that passes all.

    As in `simulation.sensors.filters`: bilinear, so that it takes more than its analogue towards half of that rate.
    """
    if cutoff <= 0.0 or cutoff >= OPEN / IMU_S:
        return 1.0
    x = 1j * np.tan(0.5 * IMU_S * s.imag) / np.tan(np.pi * cutoff * IMU_S)
    return 1.0 + np.sqrt(2.0) * x + x * x
