"""How each effect is drawn where flights with it are simulated: a direction and a strength within a plausible range.

Sealed sets draw from it, and so do the flights by which the diagnosis learns what an effect does to the signals.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from airtouch.gap.signatures.signature import SIGNATURES, free_of
from airtouch.gap.signatures.term import neutral_of, unit
from airtouch.simulation import effects
from airtouch.simulation.effects import Active, Effect

#: values of an effect's parameters, in their units, by name
Values = dict[str, float]


def log_uniform(low: float, high: float, rng: np.random.Generator) -> float:
    """A number between two, whose logarithm is as likely anywhere."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


@dataclass(frozen=True)
class Kind:
    """An effect, or one variant of it, as it is drawn: highest plausible strength, and values of a strength.

    make(strength, rng): values whose distance from neutral grows with the strength; the rest (direction, rotor,
    length) is drawn. The unit of strengths is that of the parameter that they scale.
    """

    effect: str
    highest: float
    make: Callable[[float, np.random.Generator], Values]

    def active(self, strength: float, rng: np.random.Generator) -> Active:
        """The effect at a strength, with a random direction, rotor or length."""
        effect = effects.get(self.effect)
        neutral = effect.scaled(effect.values(), 0.0)
        return Active(effect, effect.values(neutral | self.make(strength, rng)))


def _equal(parameter: str, signed: bool = False) -> Callable[[float, np.random.Generator], Values]:
    """A parameter equal to the strength, with a random sign where it is signed."""
    return lambda s, rng: {parameter: s * (rng.choice([-1.0, 1.0]) if signed else 1.0)}


def _factor(parameter: str, signed: bool = True) -> Callable[[float, np.random.Generator], Values]:
    """A parameter that is a factor: 1 + s, or, where it is signed, that or 1 / (1 + s) by chance."""
    return lambda s, rng: {parameter: (1.0 + s) ** (rng.choice([-1.0, 1.0]) if signed else 1.0)}


def _in_classes(effect: str, parameter: str) -> Callable[[float, np.random.Generator], Values]:
    """A parameter equal to the strength, in one of the effect's classes (`Signature.class_by`) by chance."""
    signature = SIGNATURES[effect]
    return lambda s, rng: {parameter: s, signature.class_by: float(rng.choice(signature.class_values))}


def _horizontal(s: float, rng: np.random.Generator) -> Values:
    """A horizontal vector of length s and random direction."""
    angle = rng.uniform(0.0, 2.0 * np.pi)
    return {"x": s * float(np.cos(angle)), "y": s * float(np.sin(angle))}


def _bias(s: float, rng: np.random.Generator) -> Values:
    """Biases of accelerometer (0.25 m/s^2 for s = 1) and gyro (0.03 rad/s) in random directions."""
    acc, gyro = (x / np.linalg.norm(x) for x in rng.normal(size=(2, 3)))
    return {f"{k}_{a}": float(v * s * size) for k, part, size in (("acc", acc, 0.25), ("gyro", gyro, 0.03))
            for a, v in zip("xyz", part, strict=True)}


#: each effect as drawn; the number is its highest plausible strength, in the unit of the parameter that it scales;
#: chosen for a small quadrotor that still flies; no measurement
KINDS: dict[str, Kind] = {
    "ground_effect": Kind("ground_effect", 2.0, lambda s, rng: {"strength": s, "turbulence": 0.3}),
    "rotor_drag": Kind("rotor_drag", 0.06, _equal("horizontal")),
    "wind": Kind("wind", 0.8, _horizontal),
    "gust": Kind("gust", 1.0, _in_classes("gust", "rms")),
    "blade_flapping": Kind("blade_flapping", 0.1, _equal("tilt")),
    "motor_lag": Kind("motor_lag", 1.0, _factor("factor")),
    "motor_noise": Kind("motor_noise", 0.1, _in_classes("motor_noise", "rms")),
    "thrust_coefficient": Kind("thrust_coefficient", 0.2, _equal("loss", signed=True)),
    "weak_motor": Kind("weak_motor", 0.3, _in_classes("weak_motor", "thrust_loss")),
    "battery_sag": Kind("battery_sag", 1.5, lambda s, rng: {"strength": s, "charge": float(rng.uniform(0.6, 0.95))}),
    "mass": Kind("mass", 0.25, _equal("fraction")),
    "com_offset": Kind("com_offset", 0.006, _horizontal),
    "inertia": Kind("inertia", 1.0, _equal("fraction")),
    "slung_load": Kind("slung_load", 0.008, _in_classes("slung_load", "load")),
    "imu_bias": Kind("imu_bias", 3.0, _bias),
    "imu_noise": Kind("imu_noise", 4.0, _factor("factor", signed=False)),
    "vibration": Kind("vibration", 3.0, _equal("amplitude")),
    "sensor_latency": Kind("sensor_latency", 0.012, _equal("delay")),
    "actuator_delay": Kind("actuator_delay", 0.02, _equal("delay")),
    "time_jitter": Kind("time_jitter", 0.01, _equal("rms")),
    "packet_loss": Kind("packet_loss", 0.1, _equal("share")),
    "range_step": Kind("range_step", 0.12,
                       lambda s, rng: {"residual": s * float(rng.choice([-1.0, 1.0])), "kick": 0.0}),
    "flow_scale": Kind("flow_scale", 0.3, _equal("share")),
    **{f"controller_gain {loop}": Kind("controller_gain", 1.0, _factor(loop))
       for loop in ("rate", "attitude", "position", "height")},
}
STEPS = 3.0  #: natural steps of a parameter up to which an effect that KINDS lacks is drawn; chosen


def kinds_of(effect: Effect) -> dict[str, Kind]:
    """The kinds of an effect by their names.

    One that KINDS lacks, such as a user's own, has one: all its free parameters together, up to STEPS natural steps in
    any direction.
    """
    known = {name: kind for name, kind in KINDS.items() if kind.effect == effect.name}
    return known or {effect.name: Kind(effect.name, STEPS, _any_direction(effect))}


def own_parameter(effect: str, kind: str) -> str | None:
    """The parameter that a kind of an effect scales alone, None where it scales all that are free.

    The name of such a kind is that of the effect, a blank and that of the parameter (`controller_gain rate`).
    """
    return kind.removeprefix(f"{effect} ") if kind.startswith(f"{effect} ") else None


def _any_direction(effect: Effect) -> Callable[[float, np.random.Generator], Values]:
    """Values of an effect at a strength in natural steps: a random direction of its free parameters."""
    free = [p for p in effect.parameters if p.name in free_of(effect)]

    def make(s: float, rng: np.random.Generator) -> Values:
        """Values at a strength; of a parameter that lies on one side of neutral alone, on that side."""
        direction = rng.normal(size=len(free)) if len(free) > 1 else np.ones(len(free))
        direction /= np.linalg.norm(direction)
        out = {}
        for p, share in zip(free, direction, strict=True):
            if p.high <= neutral_of(p):  # it has values below neutral alone
                share = -abs(share)
            elif p.low >= neutral_of(p):
                share = abs(share)
            else:
                share *= rng.choice([-1.0, 1.0])
            out[p.name] = float(np.clip(neutral_of(p) + s * share * unit(p), p.low, p.high))
        return out

    return make
