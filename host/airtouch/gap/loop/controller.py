"""Gains of the controller, axis by axis, in newtons per motor: crazyflie-firmware's own, from a plant row.

A cascade: the velocity's error asks for an angle, the angle's error for a rate, the rate's error for a command
(thrust: height, climb, command).
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.gap.flights.flight import PERIOD_S
from airtouch.gap.loop.axis_plant import PlantRow
from airtouch.simulation.firmware import battery_compensation, settings

DEGREES = 180.0 / np.pi
RICCATI_STEPS = 400  #: readings after which the Kalman filter's gains stand still; chosen
AXES = ("thrust", "roll", "pitch")
TURNING = AXES[1:]  #: axes that turn the vehicle, in the order of torques and rates


@dataclass(frozen=True)
class Controller:
    """Gains of the controller of one axis.

    roll, pitch: rate -> command (gain, N per rad/s), angle -> rate (angle, 1/s), velocity -> angle (velocity, rad per
    m/s). thrust: climb -> command (gain, N per m/s), height -> climb (angle, 1/s). Integrals are shares of their gain
    per second, derivative in s. period_s: of the controller; lowpass_hz: of its gyro, 0 for none.
    """

    gain: float
    angle: float
    velocity: float = 0.0
    derivative: float = 0.0
    integral: float = 0.0
    angle_integral: float = 0.0
    velocity_integral: float = 0.0
    period_s: float = PERIOD_S
    lowpass_hz: float = 0.0
    on_error: bool = False  #: derivative acts on the error, angle loop included
    kicked: bool = False  #: a row of the log holds the one run in which attitude and its set-point are renewed
    hold_s: float = 0.0  #: the estimator's attitude, velocity and height are renewed so often; 0: at every run
    chip_hz: float = 0.0  #: bandwidth of the gyro itself, 0 for all
    range_gains: tuple[float, float] = (0.0, 0.0)  #: of a reading of the down range, to height and (1/s) climb
    range_s: float = 0.025  #: s, period of these readings; the firmware's own comes from its release
    acc_hz: float = 0.0  #: low-pass of the acceleration that the climb is integrated from, 0 for none


def newtons_per_pwm(row: PlantRow) -> float:
    """Slope of a motor's thrust over its command in hover, N.

    Thrust is c0 + c1 x + c2 x^2 of the command x, whose slope is the root of c1^2 + 4 c2 (thrust - c0).
    """
    c0, c1, c2 = (float(c) for c in row["thrust_curve"])
    return float(np.sqrt(max(c1 * c1 + 4.0 * c2 * (_hover_thrust(row) - c0), 1e-30)))


def newtons_per_command(row: PlantRow) -> float:
    """Slope of a motor's thrust over the command that the firmware's battery compensation turns into PWM, N."""
    c0, c1, c2 = (float(c) for c in row["thrust_curve"])
    slope = newtons_per_pwm(row)
    hover = (slope - c1) / (2.0 * c2) if c2 else (_hover_thrust(row) - c0) / c1
    return slope * battery_compensation.slope(row["firmware"], row, hover)


def _hover_thrust(row: PlantRow) -> float:
    """Nominal thrust of one motor in hover, N."""
    return float(row["mass"]) * float(row["gravity"]) / (4.0 * float(np.mean(row["gain"])))


def firmware(row: PlantRow, axis: str) -> Controller:
    """crazyflie-firmware's gains of one of AXES (simulation.firmware), with battery compensation where it is on."""
    return firmware_of(row)[AXES.index(axis)]


def firmware_of(row: PlantRow) -> list[Controller]:
    """`firmware` of each of AXES."""
    slope = newtons_per_command(row)
    return [_height(row, slope), _attitude(row, 0, slope), _attitude(row, 1, slope)]


def _height(row: PlantRow, slope: float) -> Controller:
    """The firmware's height loop: height -> climb -> thrust. slope: `newtons_per_command`."""
    release, loops = row["firmware"], row["firmware"]["loops"]
    climb, height = loops[settings.VELOCITY_Z], loops[settings.POSITION_Z]
    reading = 0.001 * float(release["periods"]["range_ms"])
    return Controller(
        gain=float(climb["p"]) * float(row["thrust_scale"]) * slope, angle=float(height["p"]),
        integral=share_of_gain(climb["i"], climb["p"]), angle_integral=share_of_gain(height["i"], height["p"]),
        hold_s=_hold_s(row), range_s=reading, acc_hz=float(release["filters"]["acc_hz"]),
        range_gains=_range_gains(reading, float(release["range"]["std_m"]),
                                 float(release["kalman"]["noise_acc_z_mps2"])))


def _attitude(row: PlantRow, i: int, slope: float) -> Controller:
    """The firmware's loop of roll (i = 0) or pitch (1): velocity -> angle -> rate -> command; slope: as `_height`."""
    release, loops = row["firmware"], row["firmware"]["loops"]
    rate, angle = loops[settings.RATE_ROLL + i], loops[settings.ROLL + i]
    speed = loops[settings.VELOCITY_Y if i == 0 else settings.VELOCITY_X]
    period, hold = 0.001 * float(release["periods"]["attitude_ms"]), _hold_s(row)
    return Controller(
        gain=0.5 * float(rate["p"]) * DEGREES * float(row["rate_scale"]) * slope, angle=float(angle["p"]),
        velocity=float(speed["p"]) / DEGREES, derivative=share_of_gain(rate["d"], rate["p"]),
        integral=share_of_gain(rate["i"], rate["p"]), angle_integral=share_of_gain(angle["i"], angle["p"]),
        velocity_integral=share_of_gain(speed["i"], speed["p"]), period_s=period, lowpass_hz=float(row["gyro_lowpass"]),
        on_error=bool(release["controller"]["derivative_on_error"]),
        kicked=float(row["controller_ahead"]) % hold < 0.5 * period, hold_s=hold,
        chip_hz=float(row["gyro_bandwidth"]))


def _hold_s(row: PlantRow) -> float:
    """Period of the firmware's estimator, s."""
    return 0.001 * float(row["firmware"]["periods"]["prediction_ms"])


@lru_cache(16)
def _range_gains(period: float, std: float, acceleration: float) -> tuple[float, float]:
    """Steady gains of the firmware's Kalman filter from a near down range reading to height and climb (1/s).

    By iterating its Riccati equation; the filter is that of Mueller, Hamer, D'Andrea, ICRA 2015.
    period: s, of the readings; std: m, that it gives them; acceleration: its process noise, m/s^2 a millisecond.
    """
    variance, noise = std ** 2, 1000.0 * period * (0.001 * acceleration) ** 2
    ahead, p, gains = np.array([[1.0, period], [0.0, 1.0]]), np.eye(2), np.zeros(2)
    for _ in range(RICCATI_STEPS):
        p = ahead @ p @ ahead.T + np.diag([0.0, noise])
        gains = p[:, 0] / (p[0, 0] + variance)
        p = p - np.outer(gains, p[0])
    return float(gains[0]), float(gains[1])


def share_of_gain(part: float, of: float) -> float:
    """A gain as a share of another, both as the release's settings have them. Raises AirTouchError for none of it."""
    if not of:
        raise AirTouchError("the firmware has a loop without a proportional gain (p = 0), which the diagnosis cannot "
                            "follow; correct the vehicle's firmware settings")
    return float(part) / float(of)
