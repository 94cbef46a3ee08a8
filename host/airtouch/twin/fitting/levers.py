"""Levers: the parameters of the simulator that a fit may change, with bounds and units.

Where the numbers of a lever come from: the start is the vehicle's value or the effect's default, whose source
host/docs/effects.md names; where it is neither, it was found on the authors' folds 0 to 2 (host/docs/looks.md,
2026-11-22 and 2026-11-24). Bounds, steps and spreads have no source: round numbers, the bounds wide enough for another
drone of this size.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.simulation import effects as registry
from airtouch.twin.recorded.near_range import NearRange
from airtouch.vehicle import Vehicle

#: `Lever.of` of a vehicle's field, and of an argument of `missions.course_values`
VEHICLE, MISSION = "vehicle", "mission"
#: signs of rotors 1 to 4 in each direction of trim
ROTOR_SIGNS = {"roll": (-1, -1, 1, 1), "pitch": (1, -1, -1, 1), "yaw": (1, -1, 1, -1)}
TRIM_UNIT = "thrust loss"  #: unit of a trim: fraction of a rotor's thrust
#: kg m², of a Crazyflie's rotor and propeller: `python tools/rotor_inertia.py
#: ../shared/flights/imrclab/brushed_jana04.csv.gz` prints 4.1e-8
ROTOR_INERTIA = 4e-8
#: Hz, corner of the low-pass in the Crazyflie's firmware through which the logged acceleration passes; fits gave 33 and
#: 35 (host/docs/twin-findings.md, what tells the twin from the drone)
ACC_LOWPASS_HZ = 30.0
#: effects that every twin has: a log's rows are at any phase of the position controller's 10 ms, another one in each
#: flight (host/docs/twin-findings.md, phase of the log)
FIXED: dict[str, Any] = {"time_jitter": {"rms": 0.0, "behind": {"low": 0.0, "high": 0.01}}}
#: error of the down range to start from where the flights do not tell it; found on folds 0 to 2
DEFAULT_NEAR = NearRange(0.0, -0.045, 0.03, 0.035)


@dataclass(frozen=True)
class Lever:
    """A parameter of the simulator.

    of: an effect, "vehicle", "mission" or "trim". key: its parameter, a vehicle's field (with `.0` to `.2` for an
    axis), or a direction of ROTOR_SIGNS. start, low, high, step and spread in `unit`. step: typical change in a round.
    spread: half width of the range from which each flight draws it, None for one value in all flights. Names and
    order of the fields are part of `fit.key`: a change makes stored fits those of other settings.
    """

    of: str
    key: str
    start: float
    low: float
    high: float
    step: float
    unit: str
    spread: float | None = None

    @property
    def name(self) -> str:
        """Name in output and files."""
        return f"{self.of}.{self.key}"


def default(vehicle: Vehicle, near: NearRange | None = None) -> tuple[Lever, ...]:
    """The levers of a fit, with the values of a vehicle and of plain effects as start.

    near: error of the recorded flights' down range near the platform.
    """
    return (*_of_vehicle(vehicle), *_of_free_air(), *_of_sensor_noise(vehicle), *_of_edges(),
            *_of_flow_and_range(near or DEFAULT_NEAR))


def _of_vehicle(vehicle: Vehicle) -> tuple[Lever, ...]:
    """Mission, thrust, battery, motors and inertia."""
    yaw = vehicle.yaw_torque_over_thrust_m
    return (
        Lever(MISSION, "height_m", 0.0, -0.1, 0.1, 0.01, "m"),
        Lever(MISSION, "pulse_mps", -0.2, -0.6, 0.6, 0.03, "m/s"),
        Lever("thrust_coefficient", "loss", 0.0, -0.3, 0.3, 0.02, "1", 0.03),
        *(Lever("trim", key, 0.0, -0.15, 0.15, 0.01, TRIM_UNIT, 0.02) for key in ROTOR_SIGNS),
        Lever("battery_sag", "capacity", 0.6, 0.2, 2.0, 0.1, "1"),
        Lever("battery_sag", "charge", 0.7, 0.3, 1.0, 0.1, "1", 0.2),
        Lever("motor_lag", "factor", 1.0, 0.4, 2.0, 0.1, "1"),
        Lever("actuator_delay", "delay", 0.004, 0.0, 0.03, 0.002, "s"),
        Lever("sensor_latency", "delay", 0.001, 0.0, 0.006, 0.0005, "s"),
        Lever(VEHICLE, "yaw_torque_over_thrust_m", yaw, 0.3 * yaw, 3 * yaw, 0.15 * yaw, "m"),
        Lever(VEHICLE, "rotor_inertia_kg_m2", vehicle.rotor_inertia_kg_m2 or ROTOR_INERTIA, 0.0, 3e-7, 1e-8, "kg m²"),
        Lever(VEHICLE, "acc_lowpass_hz", vehicle.acc_lowpass_hz or ACC_LOWPASS_HZ, 15.0, 80.0, 2.0, "Hz"),
        *(Lever(VEHICLE, f"inertia_kg_m2.{i}", value, 0.5 * value, 2.0 * value, 0.06 * value, "kg m²")
          for i, value in enumerate(vehicle.inertia_kg_m2)),
    )


def _of_free_air() -> tuple[Lever, ...]:
    """Noise of the motors, gusts, drag and flapping."""
    return (
        Lever("motor_noise", "rms", 0.006, 0.0, 0.05, 0.0015, "1"),
        Lever("motor_noise", "time", 0.8, 0.05, 2.0, 0.15, "s"),
        Lever("motor_noise", "fast", 0.005, 0.0, 0.05, 0.0015, "1"),
        Lever("motor_noise", "fast_time", 0.005, 0.002, 0.1, 0.002, "s"),
        Lever("gust", "rms", 0.1, 0.0, 1.0, 0.03, "m/s"),
        Lever("gust", "lever", 0.0, -0.1, 0.1, 0.01, "m"),
        Lever("gust", "shear", 0.0, 0.0, 5.0, 0.5, "1"),
        Lever("rotor_drag", "horizontal", 0.0147, 0.0, 0.08, 0.004, "N s/m"),
        Lever("blade_flapping", "tilt", 0.01, 0.0, 0.1, 0.01, "rad s/m"),
        Lever("blade_flapping", "hub", 0.02, 0.0, 0.1, 0.02, "m"),
    )


def _of_sensor_noise(vehicle: Vehicle) -> tuple[Lever, ...]:
    """Noise of IMU, optical flow and range."""
    gyro, acc = vehicle.gyro_noise_rms_radps, vehicle.acc_noise_rms_mps2
    return (
        *(Lever(VEHICLE, f"acc_noise_ratio.{i}", vehicle.acc_noise_ratio[i], 0.05, 6.0, 0.1, f"of {acc:g} m/s²")
          for i in range(3)),
        *(Lever(VEHICLE, f"gyro_noise_ratio.{i}", vehicle.gyro_noise_ratio[i], 0.05, 6.0, 0.1, f"of {gyro:g} rad/s")
          for i in range(3)),
        *(Lever(VEHICLE, f"flow_noise_mps.{i}", vehicle.flow_noise_mps[i], 0.0, 0.5, 0.015, "m/s") for i in range(2)),
        Lever(VEHICLE, "flow_noise_time_s", vehicle.flow_noise_time_s, 0.02, 3.0, 0.1, "s"),
        Lever(VEHICLE, "range_drift_rms", vehicle.range_drift_rms, 0.0, 0.05, 0.002, "1"),
        Lever(VEHICLE, "range_drift_time_s", vehicle.range_drift_time_s, 0.05, 3.0, 0.1, "s"),
    )


def _of_edges() -> tuple[Lever, ...]:
    """The air over a platform and at its edges."""
    return (
        Lever("ground_effect", "strength", 1.4, 0.0, 3.0, 0.15, "1", 0.3),
        Lever("ground_effect", "fade", 0.08, 0.03, 0.3, 0.01, "m"),
        Lever("ground_effect", "even", 0.3, 0.0, 1.0, 0.2, "1", 0.3),
        Lever("ground_effect", "turbulence", 0.6, 0.0, 3.0, 0.1, "1"),
        Lever("ground_effect", "turbulence_time", 0.04, 0.005, 0.3, 0.006, "s"),
        Lever("ground_effect", "heave", 0.6, 0.0, 2.0, 0.1, "1"),
        Lever("ground_effect", "pitch", 0.8, 0.0, 2.0, 0.1, "1"),
        Lever("ground_effect", "swirl", 0.004, 0.0, 0.05, 0.001, "m"),
        Lever("ground_effect", "leaving", 0.02, -0.1, 0.1, 0.006, "1", 0.01),
    )


def _of_flow_and_range(near: NearRange) -> tuple[Lever, ...]:
    """What optical flow and range read over a platform and at its edges."""
    return (
        Lever("flow_scale", "share", -0.04, -0.1, 1.0, 0.03, "1", 0.02),
        Lever("flow_scale", "transient", 0.7, -1.0, 1.0, 0.08, "1", 0.25),
        Lever("flow_scale", "time", 0.15, 0.02, 1.0, 0.04, "s"),
        Lever("flow_scale", "wait", 0.14, 0.0, 0.4, 0.015, "s", 0.04),
        Lever("flow_scale", "above", 0.07, 0.03, 0.15, 0.005, "m"),
        Lever("flow_scale", "focus", 0.06, 0.01, 0.3, 0.008, "m"),
        Lever("flow_latency", "delay", 0.02, 0.0, 0.2, 0.008, "s"),
        Lever("range_bias", "near", near.near, -0.2, 0.1, 0.008, "m", 0.012),
        Lever("range_bias", "fade", near.fade, 0.01, 0.2, 0.006, "m"),
        Lever("range_bias", "dip", -0.035, -0.1, 0.1, 0.006, "m"),
        Lever("range_bias", "dip_fade", 0.06, 0.02, 0.3, 0.008, "m"),
        Lever("range_bias", "time", 0.06, 0.03, 1.0, 0.02, "s"),
        Lever("range_bias", "reach", 0.02, 0.0, 0.1, 0.006, "m", 0.01),
        Lever("range_bias", "delay", near.delay, 0.0, 0.15, 0.008, "s", 0.012),
        Lever("range_step", "residual", 0.0, -0.1, 0.1, 0.008, "m", 0.012),
        Lever("range_step", "kick", 0.0, -0.1, 0.1, 0.006, "m"),
    )


def starts(levers: Sequence[Lever]) -> np.ndarray:
    """The start values, (levers,)."""
    return np.array([lever.start for lever in levers])


def clip(levers: Sequence[Lever], values: np.ndarray) -> np.ndarray:
    """Values (levers,) clipped to their bounds."""
    return np.clip(values, [lever.low for lever in levers], [lever.high for lever in levers])


def craft(vehicle: Vehicle, levers: Sequence[Lever], values: Sequence[float] | np.ndarray) -> Vehicle:
    """The vehicle with its levers at values (levers,)."""
    changes: dict[str, Any] = {}
    for lever, value in zip(levers, values, strict=True):
        if lever.of != VEHICLE:
            continue
        field, _, axis = lever.key.partition(".")
        if axis:
            numbers = list(changes.get(field, getattr(vehicle, field)))
            numbers[int(axis)] = float(value)
            changes[field] = tuple(numbers)
        else:
            changes[field] = float(value)
    return replace(vehicle, **changes)


def mission(levers: Sequence[Lever], values: Sequence[float] | np.ndarray) -> dict[str, float]:
    """Arguments of `missions.course_values`: height_m, added to the set height, and pulse_mps, of pulses in hover."""
    return {lever.key: float(v) for lever, v in zip(levers, values, strict=True) if lever.of == MISSION}


def table(levers: Sequence[Lever], values: Sequence[float] | np.ndarray, fixed: Mapping[str, Any] | None = None,
          spread: bool = True) -> dict[str, Any]:
    """The table of a scenario's effects with the levers set. fixed: effects without levers.

    spread: write levers with a spread as ranges. The levers of "trim" become the effect `weak_motor`. Raises
    AirTouchError for a lever of an unknown effect or parameter.
    """
    out: dict[str, Any] = {name: dict(settings) if isinstance(settings, Mapping) else list(settings)
                           for name, settings in (fixed or {}).items()}
    trims = np.zeros(4)
    trim_spread = 0.0
    for lever, value in zip(levers, values, strict=True):
        if lever.of == "trim":
            trims += np.array(ROTOR_SIGNS[lever.key]) * float(value)
            trim_spread = max(trim_spread, lever.spread or 0.0)
        elif lever.of not in (VEHICLE, MISSION):
            out.setdefault(lever.of, {})[lever.key] = _node(lever, float(value), spread)
    for name, settings in out.items():
        valid = {p.name for p in registry.get(name).parameters} | {"preset"}
        for setting in settings if isinstance(settings, list) else [settings]:
            if set(setting) - valid:
                raise AirTouchError(f"levers: {name} has no parameter {', '.join(sorted(set(setting) - valid))}")
    if any(lever.of == "trim" for lever in levers):
        out["weak_motor"] = [{"rotor": i + 1, "thrust_loss": _range(-trims[i], trim_spread if spread else 0.0)}
                             for i in range(4)]
    return out


def _node(lever: Lever, value: float, spread: bool) -> Any:
    """A lever's value, or its range where it has a spread, as a scenario file has it."""
    return _range(value, lever.spread if spread and lever.spread else 0.0, lever.low, lever.high)


def _range(centre: float, half_width: float, low: float = -1.0, high: float = 1.0) -> Any:
    """A range within bounds, or the centre alone where it has no width."""
    centre = round(float(centre), 6)
    if half_width <= 0.0:
        return centre
    return {"low": round(max(centre - half_width, low), 6), "high": round(min(centre + half_width, high), 6)}
