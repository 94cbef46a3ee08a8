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
from airtouch.twin.recorded.channels import ROTOR_SIGNS
from airtouch.twin.recorded.near_range import NearRange
from airtouch.vehicle import Vehicle

#: `Lever.of` of a vehicle's field, and of an argument of `missions.course_values`
VEHICLE, MISSION = "vehicle", "mission"
TRIM_UNIT = "thrust loss"  #: unit of a trim: fraction of a rotor's thrust
#: kg m², of a Crazyflie's rotor and propeller: `python tools/calibration/rotor_inertia.py
#: ../shared/flights/imrclab/brushed_jana04.csv.gz` prints 4.1e-8
ROTOR_INERTIA = 4e-8
#: Hz, corner of the low-pass in the Crazyflie's firmware through which the logged acceleration passes; fits gave 33 and
#: 35 (host/docs/twin-findings.md, what tells the twin from the drone)
ACC_LOWPASS_HZ = 30.0
#: effects that every twin has: a log's rows are at any phase of the position controller's 10 ms, another one in each
#: flight (host/docs/twin-method.md, phase of the log)
FIXED: dict[str, Any] = {"time_jitter": {"rms": 0.0, "behind": {"low": 0.0, "high": 0.01}}}
#: error of the down range to start from where the flights do not tell it; found on folds 0 to 2
DEFAULT_NEAR = NearRange(0.0, -0.045, 0.03, 0.035)


@dataclass(frozen=True)
class Lever:
    """A parameter of the simulator.

    of: an effect, "vehicle", "mission" or "trim". key: its parameter, a vehicle's field (with `.0` to `.2` for an
    axis), or a direction of `channels.ROTOR_SIGNS`. start, low, high, step and spread in `unit`. step: typical change
    in a round. spread: half width of the range from which each flight draws it, None for one value in all flights.
    Names and order of the fields are part of `fit.key`: a change makes stored fits those of other settings.
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
        Lever(MISSION, "height_m", start=0.0, low=-0.1, high=0.1, step=0.01, unit="m"),
        Lever(MISSION, "pulse_mps", start=-0.2, low=-0.6, high=0.6, step=0.03, unit="m/s"),
        Lever("thrust_coefficient", "loss", start=0.0, low=-0.3, high=0.3, step=0.02, unit="1", spread=0.03),
        *(Lever("trim", key,
                start=0.0, low=-0.15, high=0.15, step=0.01, unit=TRIM_UNIT, spread=0.02)
          for key in ROTOR_SIGNS),
        Lever("battery_sag", "capacity", start=0.6, low=0.2, high=2.0, step=0.1, unit="1"),
        Lever("battery_sag", "charge", start=0.7, low=0.3, high=1.0, step=0.1, unit="1", spread=0.2),
        Lever("motor_lag", "factor", start=1.0, low=0.4, high=2.0, step=0.1, unit="1"),
        Lever("actuator_delay", "delay", start=0.004, low=0.0, high=0.03, step=0.002, unit="s"),
        Lever("sensor_latency", "delay", start=0.001, low=0.0, high=0.006, step=0.0005, unit="s"),
        Lever(VEHICLE, "yaw_torque_over_thrust_m", start=yaw, low=0.3 * yaw, high=3 * yaw, step=0.15 * yaw, unit="m"),
        Lever(VEHICLE, "rotor_inertia_kg_m2",
              start=vehicle.rotor_inertia_kg_m2 or ROTOR_INERTIA, low=0.0, high=3e-7, step=1e-8, unit="kg m²"),
        Lever(VEHICLE, "acc_lowpass_hz",
              start=vehicle.acc_lowpass_hz or ACC_LOWPASS_HZ, low=15.0, high=80.0, step=2.0, unit="Hz"),
        *(Lever(VEHICLE, f"inertia_kg_m2.{i}",
                start=value, low=0.5 * value, high=2.0 * value, step=0.06 * value, unit="kg m²")
          for i, value in enumerate(vehicle.inertia_kg_m2)),
    )


def _of_free_air() -> tuple[Lever, ...]:
    """Noise of the motors, gusts, drag and flapping."""
    return (
        Lever("motor_noise", "rms", start=0.006, low=0.0, high=0.05, step=0.0015, unit="1"),
        Lever("motor_noise", "time", start=0.8, low=0.05, high=2.0, step=0.15, unit="s"),
        Lever("motor_noise", "fast", start=0.005, low=0.0, high=0.05, step=0.0015, unit="1"),
        Lever("motor_noise", "fast_time", start=0.005, low=0.002, high=0.1, step=0.002, unit="s"),
        Lever("gust", "rms", start=0.1, low=0.0, high=1.0, step=0.03, unit="m/s"),
        Lever("gust", "lever", start=0.0, low=-0.1, high=0.1, step=0.01, unit="m"),
        Lever("gust", "shear", start=0.0, low=0.0, high=5.0, step=0.5, unit="1"),
        Lever("rotor_drag", "horizontal", start=0.0147, low=0.0, high=0.08, step=0.004, unit="N s/m"),
        Lever("blade_flapping", "tilt", start=0.01, low=0.0, high=0.1, step=0.01, unit="rad s/m"),
        Lever("blade_flapping", "hub", start=0.02, low=0.0, high=0.1, step=0.02, unit="m"),
    )


def _of_sensor_noise(vehicle: Vehicle) -> tuple[Lever, ...]:
    """Noise of IMU, optical flow and range."""
    gyro, acc = vehicle.gyro_noise_rms_radps, vehicle.acc_noise_rms_mps2
    return (
        *(Lever(VEHICLE, f"acc_noise_ratio.{i}",
                start=vehicle.acc_noise_ratio[i], low=0.05, high=6.0, step=0.1, unit=f"of {acc:g} m/s²")
          for i in range(3)),
        *(Lever(VEHICLE, f"gyro_noise_ratio.{i}",
                start=vehicle.gyro_noise_ratio[i], low=0.05, high=6.0, step=0.1, unit=f"of {gyro:g} rad/s")
          for i in range(3)),
        *(Lever(VEHICLE, f"flow_noise_mps.{i}",
                start=vehicle.flow_noise_mps[i], low=0.0, high=0.5, step=0.015, unit="m/s")
          for i in range(2)),
        Lever(VEHICLE, "flow_noise_time_s", start=vehicle.flow_noise_time_s, low=0.02, high=3.0, step=0.1, unit="s"),
        Lever(VEHICLE, "range_drift_rms", start=vehicle.range_drift_rms, low=0.0, high=0.05, step=0.002, unit="1"),
        Lever(VEHICLE, "range_drift_time_s", start=vehicle.range_drift_time_s, low=0.05, high=3.0, step=0.1, unit="s"),
    )


def _of_edges() -> tuple[Lever, ...]:
    """The air over a platform and at its edges."""
    return (
        Lever("ground_effect", "strength", start=1.4, low=0.0, high=3.0, step=0.15, unit="1", spread=0.3),
        Lever("ground_effect", "fade", start=0.08, low=0.03, high=0.3, step=0.01, unit="m"),
        Lever("ground_effect", "even", start=0.3, low=0.0, high=1.0, step=0.2, unit="1", spread=0.3),
        Lever("ground_effect", "turbulence", start=0.6, low=0.0, high=3.0, step=0.1, unit="1"),
        Lever("ground_effect", "turbulence_time", start=0.04, low=0.005, high=0.3, step=0.006, unit="s"),
        Lever("ground_effect", "heave", start=0.6, low=0.0, high=2.0, step=0.1, unit="1"),
        Lever("ground_effect", "pitch", start=0.8, low=0.0, high=2.0, step=0.1, unit="1"),
        Lever("ground_effect", "swirl", start=0.004, low=0.0, high=0.05, step=0.001, unit="m"),
        Lever("ground_effect", "leaving", start=0.02, low=-0.1, high=0.1, step=0.006, unit="1", spread=0.01),
    )


def _of_flow_and_range(near: NearRange) -> tuple[Lever, ...]:
    """What optical flow and range read over a platform and at its edges."""
    return (
        Lever("flow_scale", "share", start=-0.04, low=-0.1, high=1.0, step=0.03, unit="1", spread=0.02),
        Lever("flow_scale", "transient", start=0.7, low=-1.0, high=1.0, step=0.08, unit="1", spread=0.25),
        Lever("flow_scale", "time", start=0.15, low=0.02, high=1.0, step=0.04, unit="s"),
        Lever("flow_scale", "wait", start=0.14, low=0.0, high=0.4, step=0.015, unit="s", spread=0.04),
        Lever("flow_scale", "above", start=0.07, low=0.03, high=0.15, step=0.005, unit="m"),
        Lever("flow_scale", "focus", start=0.06, low=0.01, high=0.3, step=0.008, unit="m"),
        Lever("flow_latency", "delay", start=0.02, low=0.0, high=0.2, step=0.008, unit="s"),
        Lever("range_bias", "near", start=near.near, low=-0.2, high=0.1, step=0.008, unit="m", spread=0.012),
        Lever("range_bias", "fade", start=near.fade, low=0.01, high=0.2, step=0.006, unit="m"),
        Lever("range_bias", "dip", start=-0.035, low=-0.1, high=0.1, step=0.006, unit="m"),
        Lever("range_bias", "dip_fade", start=0.06, low=0.02, high=0.3, step=0.008, unit="m"),
        Lever("range_bias", "time", start=0.06, low=0.03, high=1.0, step=0.02, unit="s"),
        Lever("range_bias", "reach", start=0.02, low=0.0, high=0.1, step=0.006, unit="m", spread=0.01),
        Lever("range_bias", "delay", start=near.delay, low=0.0, high=0.15, step=0.008, unit="s", spread=0.012),
        Lever("range_step", "residual", start=0.0, low=-0.1, high=0.1, step=0.008, unit="m", spread=0.012),
        Lever("range_step", "kick", start=0.0, low=-0.1, high=0.1, step=0.006, unit="m"),
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

    spread: write levers with a spread as ranges. The levers of "trim" become the effect `weak_motor`, their sum within
    what it takes. Raises AirTouchError for a lever of an unknown effect or parameter.
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
        loss = next(p for p in registry.get("weak_motor").parameters if p.name == "thrust_loss")
        out["weak_motor"] = [{"rotor": i + 1, "thrust_loss": _range(min(max(-trims[i], loss.low), loss.high),
                                                                    trim_spread if spread else 0.0,
                                                                    loss.low, loss.high)} for i in range(4)]
    return out


def _node(lever: Lever, value: float, spread: bool) -> Any:
    """A lever's value, or its range where it has a spread, as a scenario file has it."""
    return _range(value, lever.spread if spread and lever.spread else 0.0, lever.low, lever.high)


def _range(centre: float, half_width: float, low: float, high: float) -> Any:
    """A range within bounds, or the centre alone where it has no width."""
    centre = round(float(centre), 6)
    if half_width <= 0.0:
        return centre
    return {"low": round(max(centre - half_width, low), 6), "high": round(min(centre + half_width, high), 6)}
