"""The force on the vehicle that neither gravity nor its motors explain (paper, equation 3)."""

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.reference.finite import ACC_CLAMP, AXIS_LIMIT, PWM_MAX, hold_finite
from airtouch.reference.shapes import repeated
from airtouch.vehicle import Vehicle

VOLTAGE_RANGE = np.float32(0.1), np.float32(1000.0)  #: what can be a battery's voltage, V
FACTOR_RANGE = 0.25, 4.0  #: of thrust, for half to twice the nominal voltage


def disturbance_force(
    acc_world: np.ndarray,
    pwm: np.ndarray,
    vehicle: Vehicle,
    *,
    vbat_v: np.ndarray | float | None = None,
    thrust_axis: np.ndarray | None = None,
) -> np.ndarray:
    """f_w = m a - m g - R f_u in newtons, world axes, shape (n, 3).

    acc_world: (n, 3) specific force a - g in world axes, m/s^2 (+g along z at rest).
    pwm: (n, 4), clamped to 0..65535. vbat_v: battery voltage, (n,) or one value,
    V; thrust scales with (vbat / nominal)^2 where both are known, not at all
    elsewhere; gaps hold the last known voltage. thrust_axis: (n, 3) or (3,), R e_z, default
    (0, 0, 1). Other non-finite samples: `hold_finite`.
    Raises AirTouchError when the shapes disagree.
    """
    acc_world, pwm = np.asarray(acc_world, dtype=np.float64), np.asarray(pwm, dtype=np.float64)
    n = len(acc_world)
    if acc_world.shape != (n, 3) or pwm.shape != (n, 4):
        raise AirTouchError(f"disturbance force: needs (n, 3) accelerations and (n, 4) PWM, "
                            f"not {acc_world.shape} and {pwm.shape}")
    acc = hold_finite(acc_world, limit=ACC_CLAMP)[0]
    thrust = total_thrust(pwm, vehicle, vbat_v)
    axis = np.array([0.0, 0.0, 1.0])
    if thrust_axis is not None:
        axis = hold_finite(repeated(thrust_axis, (n, 3), "thrust axis"), initial=axis, limit=AXIS_LIMIT)[0]
    return vehicle.mass_kg * acc - thrust[:, None] * axis


def total_thrust(pwm: np.ndarray, vehicle: Vehicle, vbat_v: np.ndarray | float | None = None) -> np.ndarray:
    """Psi = H_0 W(m): the four motors' thrust in newtons, (n,), for PWM (n, 4)."""
    pwm = np.asarray(pwm, dtype=np.float64)
    if pwm.shape != (len(pwm), 4):
        raise AirTouchError(f"thrust: needs (n, 4) PWM, not {pwm.shape}")
    pwm = np.clip(hold_finite(pwm)[0], 0.0, PWM_MAX)
    return vehicle.thrust(pwm).sum(axis=1) * voltage_factor(len(pwm), vehicle, vbat_v)


def voltage_factor(n: int, vehicle: Vehicle, vbat_v: np.ndarray | float | None) -> np.ndarray:
    """(vbat / nominal)^2, (n,), 0.25 to 4; 1 where either is unknown, the last known (0.1 to 1000 V) voltage held."""
    if vbat_v is None or vehicle.nominal_voltage_v is None:
        return np.ones(n)
    volts = repeated(vbat_v, (n,), "battery voltage")
    known = np.where((volts >= VOLTAGE_RANGE[0]) & (volts <= VOLTAGE_RANGE[1]), volts, np.nan)
    volts = hold_finite(known, initial=vehicle.nominal_voltage_v)[0]
    return np.clip(np.square(volts / vehicle.nominal_voltage_v), *FACTOR_RANGE)


def force_norm(force: np.ndarray) -> np.ndarray:
    """||f_w|| in newtons, (n,), for forces (n, 3)."""
    force = np.asarray(force, dtype=np.float64)
    if force.shape != (len(force), 3):
        raise AirTouchError(f"force norm: needs (n, 3) forces, not {force.shape}")
    return np.sqrt(np.square(force).sum(axis=1))
