"""The vehicle as the loop of one axis sees it: what a row of the plant gives that loop beside its controller."""

from typing import NamedTuple

import numpy as np

#: A row of `simulation.flight.prepare`: the vehicle's numbers, effects in them. Its fields, with unit and meaning, are
#: `simulation.plant.FIELDS`. The loop reads actuator_delay, sensor_delay, motor_rise, motor_fall (s), gain (thrust over
#: nominal, by rotor), rotor_x, rotor_y (m), inertia (kg m^2), mass (kg), gravity (m/s^2), the factors height_gain,
#: rate_gain, attitude_gain and position_gain; `controller` and `disturbed` those of the firmware and the battery too.
PlantRow = np.void


class AxisPlant(NamedTuple):
    """The plant of one of `controller.AXES`. Two rows with the same AxisPlant have the same spectra for a controller.

    acceleration: of a command, by motors that follow at once: rad/s^2 (thrust: m/s^2) per N a motor. Delays and time
    constants in s; gains: factors on those of the controller.
    """

    axis: str
    acceleration: float
    actuator_delay_s: float
    motor_rise_s: float
    motor_fall_s: float
    sensor_delay_s: float
    height_gain: float
    rate_gain: float
    attitude_gain: float
    position_gain: float
    gravity_mps2: float


def axis_plant(row: PlantRow, axis: str) -> AxisPlant:
    """The plant of an axis, "thrust", "roll" or "pitch"."""
    lift = 4.0 * mean_of_rotors(row["gain"])
    if axis == "thrust":
        acceleration = lift / float(row["mass"])
    else:
        i = ("roll", "pitch").index(axis)
        acceleration = lift * arm_of(row, i) / float(row["inertia"][i])
    return AxisPlant(
        axis=axis, acceleration=acceleration, actuator_delay_s=float(row["actuator_delay"]),
        motor_rise_s=float(row["motor_rise"]), motor_fall_s=float(row["motor_fall"]),
        sensor_delay_s=float(row["sensor_delay"]), height_gain=float(row["height_gain"]),
        rate_gain=float(row["rate_gain"]), attitude_gain=float(row["attitude_gain"]),
        position_gain=float(row["position_gain"]), gravity_mps2=float(row["gravity"]))


def arm_of(row: PlantRow, i: int) -> float:
    """Mean distance of the rotors from the axis of roll (0) or pitch (1), m."""
    return mean_of_rotors(np.abs(row["rotor_y" if i == 0 else "rotor_x"]))


def mean_of_rotors(values: np.ndarray) -> float:
    """Mean (4,); NumPy's own takes ten times as long."""
    a, b, c, d = values.tolist()
    return (a + b + c + d) / 4.0
