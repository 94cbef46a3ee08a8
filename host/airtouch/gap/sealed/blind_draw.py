"""What a blind set draws from: for every effect a direction and a strength within a plausible range."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from airtouch.simulation import effects
from airtouch.simulation.effects import Active

Values = dict[str, float]


@dataclass(frozen=True)
class Kind:
    """An effect, or one variant of it, as it is drawn: highest plausible strength, and values of a strength.

    make(strength, rng): values whose distance from neutral grows with the strength; the
    rest (direction, rotor, length) is drawn.
    """

    effect: str
    highest: float
    make: Callable[[float, np.random.Generator], Values]

    def active(self, strength: float, rng: np.random.Generator) -> Active:
        effect = effects.get(self.effect)
        neutral = effect.scaled(effect.values(), 0.0)
        return Active(effect, effect.values(neutral | self.make(strength, rng)))


def _one(parameter: str, signed: bool = False) -> Callable[[float, np.random.Generator], Values]:
    return lambda s, rng: {parameter: s * (rng.choice([-1.0, 1.0]) if signed else 1.0)}


def _times(parameter: str, signed: bool = True) -> Callable[[float, np.random.Generator], Values]:
    """A factor 1 + s or 1 / (1 + s)."""
    return lambda s, rng: {parameter: (1.0 + s) ** (rng.choice([-1.0, 1.0]) if signed else 1.0)}


def _around(s: float, rng: np.random.Generator) -> Values:
    angle = rng.uniform(0.0, 2.0 * np.pi)
    return {"x": s * float(np.cos(angle)), "y": s * float(np.sin(angle))}


def _bias(s: float, rng: np.random.Generator) -> Values:
    acc, gyro = (x / np.linalg.norm(x) for x in rng.normal(size=(2, 3)))
    return {f"{k}_{a}": float(v * s * size) for k, part, size in (("acc", acc, 0.25), ("gyro", gyro, 0.03))
            for a, v in zip("xyz", part, strict=True)}


KINDS: dict[str, Kind] = {
    "ground_effect": Kind("ground_effect", 2.0, lambda s, rng: {"strength": s, "turbulence": 0.3}),
    "rotor_drag": Kind("rotor_drag", 0.06, _one("horizontal")),
    "wind": Kind("wind", 0.8, _around),
    "gust": Kind("gust", 1.0, lambda s, rng: {"rms": s, "length": float(rng.choice([0.2, 0.5, 1.5]))}),
    "blade_flapping": Kind("blade_flapping", 0.1, _one("tilt")),
    "motor_lag": Kind("motor_lag", 1.0, _times("factor")),
    "motor_noise": Kind("motor_noise", 0.1, lambda s, rng: {"rms": s, "time": float(rng.choice([0.005, 0.02, 0.1]))}),
    "thrust_coefficient": Kind("thrust_coefficient", 0.2, _one("loss", signed=True)),
    "weak_motor": Kind("weak_motor", 0.3, lambda s, rng: {"rotor": float(rng.integers(1, 5)), "thrust_loss": s}),
    "battery_sag": Kind("battery_sag", 1.5, lambda s, rng: {"strength": s, "charge": float(rng.uniform(0.6, 0.95))}),
    "mass": Kind("mass", 0.25, _one("fraction")),
    "com_offset": Kind("com_offset", 0.006, _around),
    "inertia": Kind("inertia", 1.0, _one("fraction")),
    "slung_load": Kind("slung_load", 0.008, lambda s, rng: {"load": s, "length": float(rng.choice([0.1, 0.2, 0.4]))}),
    "imu_bias": Kind("imu_bias", 3.0, _bias),
    "imu_noise": Kind("imu_noise", 4.0, _times("factor", signed=False)),
    "vibration": Kind("vibration", 3.0, _one("amplitude")),
    "sensor_latency": Kind("sensor_latency", 0.012, _one("delay")),
    "actuator_delay": Kind("actuator_delay", 0.02, _one("delay")),
    "time_jitter": Kind("time_jitter", 0.01, _one("rms")),
    "packet_loss": Kind("packet_loss", 0.1, _one("share")),
    "range_step": Kind("range_step", 0.12,
                       lambda s, rng: {"residual": s * float(rng.choice([-1.0, 1.0])), "kick": 0.0}),
    "flow_scale": Kind("flow_scale", 0.3, _one("share")),
    **{f"controller_gain {loop}": Kind("controller_gain", 1.0, _times(loop))
       for loop in ("rate", "attitude", "position", "height")},
}
