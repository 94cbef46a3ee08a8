"""The disturbance force in C: see `airtouch.reference.disturbance_force`."""

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.kernels.arrays import axes, column, float32, pointer, vehicle_struct
from airtouch.kernels.library import lib
from airtouch.vehicle import Vehicle


def disturbance_force(
    acc_world: np.ndarray,
    pwm: np.ndarray,
    vehicle: Vehicle,
    *,
    vbat_v: np.ndarray | float | None = None,
    thrust_axis: np.ndarray | None = None,
) -> np.ndarray:
    """f_w = m a - m g - R f_u in newtons, (n, 3) float32, as the reference."""
    acc, motors = float32(acc_world), float32(pwm)
    n = len(acc)
    if acc.shape != (n, 3) or motors.shape != (n, 4):
        raise AirTouchError(f"disturbance force: needs (n, 3) accelerations and (n, 4) PWM, "
                            f"not {acc.shape} and {motors.shape}")
    volts, axis, out = column(vbat_v, n, "battery voltage"), axes(thrust_axis, n), np.empty((n, 3), dtype=np.float32)
    lib.disturbanceForceBatch(pointer(acc), pointer(motors), pointer(volts), pointer(axis), n,
                              vehicle_struct(vehicle), pointer(out))
    return out


def total_thrust(pwm: np.ndarray, vehicle: Vehicle, vbat_v: np.ndarray | float | None = None) -> np.ndarray:
    """Psi, the four motors' thrust in newtons, (n,) float32, as the reference."""
    motors = float32(pwm)
    n = len(motors)
    if motors.shape != (n, 4):
        raise AirTouchError(f"thrust: needs (n, 4) PWM, not {motors.shape}")
    volts, out = column(vbat_v, n, "battery voltage"), np.empty(n, dtype=np.float32)
    lib.totalThrustBatch(pointer(motors), pointer(volts), n, vehicle_struct(vehicle), pointer(out))
    return out


def force_norm(force: np.ndarray) -> np.ndarray:
    """||f_w|| in newtons, (n,) float32, for forces (n, 3)."""
    forces = float32(force)
    if forces.shape != (len(forces), 3):
        raise AirTouchError(f"force norm: needs (n, 3) forces, not {forces.shape}")
    out = np.empty(len(forces), dtype=np.float32)
    lib.forceNormBatch(pointer(forces), len(forces), pointer(out))
    return out
