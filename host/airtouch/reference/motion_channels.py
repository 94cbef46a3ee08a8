"""The inputs of the streaming detector: channels without slow drift, each in units of its nominal amplitude."""

from dataclasses import dataclass, field

import numpy as np

from airtouch import vehicle as vehicles
from airtouch.errors import AirTouchError
from airtouch.parameters import DEFAULT
from airtouch.reference.finite import ACC_CLAMP, PWM_MAX, RATE_CLAMP, hold_finite
from airtouch.vehicle import Vehicle

ACCELERATION, RATES, MOTORS = "acceleration", "rates", "motors"  #: the sensors


@dataclass(frozen=True)
class Channel:
    """One motion channel.

    amplitude: its nominal amplitude, the unit of its values: m/s^2, rad/s or PWM. mirror: its sign where the flight is
    reflected left to right. sensors: those that it needs.
    """

    name: str
    amplitude: float
    mirror: int
    sensors: tuple[str, ...]


#: The channels in the order of their columns, as motion_channels.c computes them, but the last one, which is 0.
#: Amplitudes: no source, round numbers of the order of a pass over an edge (the rates are 15 and 5 deg/s).
CHANNEL_TABLE = (
    Channel("ax", 0.5, 1, (ACCELERATION,)),
    Channel("ay", 0.5, -1, (ACCELERATION,)),
    Channel("az", 0.5, 1, (ACCELERATION,)),
    Channel("gyro x", 0.2618, -1, (RATES,)),
    Channel("gyro y", 0.2618, 1, (RATES,)),
    Channel("gyro z", 0.08727, -1, (RATES,)),
    Channel("motor roll", 4000.0, -1, (MOTORS,)),
    Channel("motor pitch", 4000.0, 1, (MOTORS,)),
    Channel("motor yaw", 4000.0, -1, (MOTORS,)),
    Channel("motor mean", 1500.0, 1, (MOTORS,)),
    Channel("unexplained az", 0.5, 1, (ACCELERATION, MOTORS)),
)
#: Names of all columns: the last one is 0, so that they come in blocks of four.
NAMES = (*(channel.name for channel in CHANNEL_TABLE), "zero")
THRUST_DELAY = 2  #: samples from a command to its thrust, MOTION_THRUST_DELAY in motion_channels.h; chosen


@dataclass(frozen=True)
class MotionConfig:
    """Settings; the samples are those of a 100 Hz log.

    scale: nominal amplitude of each of CHANNEL_TABLE: m/s^2 (3), rad/s (3), PWM (4), m/s^2. limit: channels are
    clamped to that many amplitudes. arm_pwm: mean PWM above which the drone is in the air. slow_samples: time constant
    of the slow means of motors and thrust. lag_samples: time constant of the thrust behind the command, after
    THRUST_DELAY. settle_samples: for so long after take-off the slow means follow at once. least_thrust_n: N, sum of
    the motors' slow mean thrust that is divided by at least, so that a drone on the ground divides by no zero. vehicle:
    its thrust curve and gravity. Those without a source here are chosen; a model is trained with them.
    """

    scale: tuple[float, ...] = tuple(channel.amplitude for channel in CHANNEL_TABLE)
    limit: float = 4.0
    arm_pwm: float = DEFAULT.arm_pwm
    slow_samples: float = 300.0
    lag_samples: float = 6.0
    settle_samples: int = 100
    least_thrust_n: float = 0.05
    vehicle: Vehicle = field(default_factory=vehicles.load)


def motion_channels(
    acc_level: np.ndarray, gyro: np.ndarray, pwm: np.ndarray, config: MotionConfig | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Channels (n, 12) in units of their nominal amplitude, and airborne (n,) bool. Causal.

    acc_level: (n, 3) m/s^2, level axes, gravity in z. gyro: (n, 3) rad/s. pwm: (n, 4).
    Columns as NAMES: the motors' roll, pitch, yaw and mean have their slow mean taken off; `unexplained
    az` is the vertical specific force less g times the lagged thrust over its slow mean, so that neither
    mass nor battery matter; the last is 0. Values that are not finite: `hold_finite`.
    Raises AirTouchError when the shapes disagree.
    """
    config = config or MotionConfig()
    acc, rate, motors = (np.asarray(x, dtype=np.float64) for x in (acc_level, gyro, pwm))
    n = len(acc)
    if (acc.shape, rate.shape, motors.shape) != ((n, 3), (n, 3), (n, 4)):
        raise AirTouchError(f"motion channels: needs (n, 3), (n, 3) and (n, 4), "
                            f"not {acc.shape}, {rate.shape} and {motors.shape}")
    acc, rate = hold_finite(acc, limit=ACC_CLAMP)[0], hold_finite(rate, limit=RATE_CLAMP)[0]
    m1, m2, m3, m4 = np.clip(hold_finite(motors)[0], 0.0, PWM_MAX).T
    mixed = np.column_stack([m3 + m4 - m1 - m2, m1 + m4 - m2 - m3, m1 + m3 - m2 - m4, (m1 + m2 + m3 + m4) / 4])
    thrust = config.vehicle.thrust(np.column_stack([m1, m2, m3, m4])).sum(axis=1)
    airborne = mixed[:, 3] > config.arm_pwm
    gravity = config.vehicle.gravity_mps2
    mean_thrust, lagged, slow = _slow(mixed, thrust, airborne, config)
    raw = np.column_stack([acc[:, :2], acc[:, 2] - gravity, rate, mixed - slow,
                           acc[:, 2] - gravity * lagged / np.maximum(mean_thrust, config.least_thrust_n)])
    scaled = np.clip(raw / np.array(config.scale), -config.limit, config.limit)
    return np.column_stack([scaled, np.zeros(n)]), airborne


def _slow(
    mixed: np.ndarray, thrust: np.ndarray, airborne: np.ndarray, config: MotionConfig
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Slow mean of the lagged thrust (n,), the lagged thrust (n,) and slow means of the motors (n, 4).

    First-order means; until `settle_samples` in the air they follow at once.
    """
    n = len(mixed)
    mean_thrust, lagged, slow = np.zeros(n), np.zeros(n), np.zeros((n, 4))
    if n == 0:
        return mean_thrust, lagged, slow
    state, behind, mean, airborne_steps = mixed[0].copy(), thrust[0], thrust[0], 0
    for t in range(n):
        airborne_steps = airborne_steps + 1 if airborne[t] else 0
        behind += (thrust[max(t - THRUST_DELAY, 0)] - behind) / config.lag_samples
        gain = 1.0 / config.slow_samples if airborne_steps > config.settle_samples else 1.0
        state += gain * (mixed[t] - state)
        mean += gain * (behind - mean)
        mean_thrust[t], lagged[t], slow[t] = mean, behind, state
    return mean_thrust, lagged, slow
