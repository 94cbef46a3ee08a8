"""NumPy arrays as the kernels want them: float32, row-major."""

from typing import Any

import numpy as np

from airtouch.kernels.library import ffi
from airtouch.reference.shapes import repeated
from airtouch.vehicle import Vehicle


def float32(x: Any) -> np.ndarray:
    """x as a contiguous float32 array; values too large for it become infinite."""
    with np.errstate(over="ignore"):
        return np.ascontiguousarray(x, dtype=np.float32)


C_TYPES = {np.dtype(np.float32): "float *", np.dtype(np.int8): "int8_t *", np.dtype(np.uint8): "uint8_t *",
           np.dtype(np.uint16): "uint16_t *", np.dtype(np.int32): "int32_t *"}


def pointer(x: np.ndarray, c_type: str | None = None) -> Any:
    """The address of a contiguous array, as a pointer to its own type or to c_type; the array must outlive the call."""
    return ffi.cast(c_type or C_TYPES[x.dtype], x.ctypes.data)


def vehicle_struct(vehicle: Vehicle) -> Any:
    """An airtouchVehicle_t from an airtouch.vehicle.Vehicle."""
    return ffi.new("airtouchVehicle_t *", {
        "mass": vehicle.mass_kg,
        "gravity": vehicle.gravity_mps2,
        "thrust": list(vehicle.thrust_of_pwm_n),
        "nominalVoltage": vehicle.nominal_voltage_v or 0.0,
    })


def column(values: Any, n: int, name: str) -> np.ndarray:
    """(n,) float32 from (n,), one value, or None for NaN throughout.

    Raises AirTouchError for another shape; name: of the signal, for the error.
    """
    return float32(repeated(np.nan if values is None else values, (n,), name))


def axes(thrust_axis: Any, n: int) -> np.ndarray:
    """(n, 3) float32 from (n, 3), (3,), or None for NaN throughout: the kernels then take (0, 0, 1).

    Raises AirTouchError for another shape.
    """
    return float32(repeated(np.nan if thrust_axis is None else thrust_axis, (n, 3), "thrust axis"))
