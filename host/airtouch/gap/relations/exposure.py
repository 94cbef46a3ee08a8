"""Nameless disturbances as they are drawn: what flights look like in which something acts that no effect is.

A force and torque that follows a signal, for the whole flight or for some seconds; or a property of the plant
(`nameless_effects`). Such flights say what `unknown` looks like (outlier exposure: Hendrycks, Mazeika, Dietterich, ICLR
2019).

Probabilities, weights and ranges were chosen with the library of 2026-11-24; no measurement says how often real
disturbances are of each kind, and no other values are recorded as tried. A wider range shows what more disturbances
look like, and fewer flights of each.
"""

import numpy as np

from airtouch.gap.relations.nameless_effects import (
    ADDITIONS,
    DISTURBANCE,
    NAMES,
    PROPERTY,
    UNBOUNDED,
    Follows,
    properties,
)
from airtouch.gap.signatures.random_draws import log_uniform
from airtouch.simulation.effects import Active

#: signals that are drawn more often than the others, and how many times
SIGNAL_WEIGHTS = {Follows.VELOCITY: 3, Follows.BODY_RATE: 3, Follows.NOISE: 3, Follows.TILT: 2}
SIGNAL_URN = tuple(f for f in Follows for _ in range(SIGNAL_WEIGHTS.get(f, 1)))  #: what signals are drawn from
#: bounds of the scale of those signals that have one, log-uniform: height (m), period (s), correlation time (s)
SCALE_BOUNDS = {Follows.NEAR_GROUND: (0.02, 0.4), Follows.WAVE: (0.025, 5.0), Follows.NOISE: (0.004, 2.0)}
WRENCH_PROBABILITY = 0.75  #: that a disturbance is a force and torque, not a property
WHOLE_FLIGHT_PROBABILITY = 0.7  #: that a force and torque acts for the whole flight
BEGIN_S, DURATION_S = (2.0, 20.0), (1.0, 8.0)  #: bounds of the begin and the duration of one that does not, uniform
FORCE_N = (1e-4, 7e-3)  #: bounds of the length of a wrench's six numbers, log-uniform
LEVER_M = 0.01  #: torque (N m) over force (N) of numbers of the same size
LOG_FACTOR = (0.003, 0.5)  #: bounds of the magnitude of the logarithm of a property's factor, log-uniform


def draw(rng: np.random.Generator) -> Active:
    """A disturbance, ready to be flown."""
    return _drawn_property(rng) if rng.random() >= WRENCH_PROBABILITY else _drawn_wrench(rng)


def _drawn_property(rng: np.random.Generator) -> Active:
    """Any property, all its elements or one of them: multiplied or divided, or by ADDITIONS with an amount added."""
    place = int(rng.integers(len(properties())))
    name, log_factor = properties()[place], log_uniform(*LOG_FACTOR, rng)
    amount = ADDITIONS[name] * log_factor / LOG_FACTOR[1] if name in ADDITIONS \
        else np.exp(log_factor * rng.choice([-1, 1]))
    element = float(rng.integers(-1, 4))
    return Active(PROPERTY, {"property": float(place), "element": element, "amount": float(amount)})


def _drawn_wrench(rng: np.random.Generator) -> Active:
    """A force and torque in any direction that follows any signal."""
    follows, axis = Follows(int(rng.choice(SIGNAL_URN))), int(rng.integers(3))
    direction = _direction(rng)
    direction *= log_uniform(*FORCE_N, rng) / np.linalg.norm(direction)
    direction[3:] *= LEVER_M
    has_scale = follows in SCALE_BOUNDS
    scale, rotor = (log_uniform(*SCALE_BOUNDS[follows], rng), 0) if has_scale else (0.0, int(rng.integers(4)))
    begin = float(rng.uniform(*BEGIN_S))
    seconds = (0.0, UNBOUNDED) if rng.random() < WHOLE_FLIGHT_PROBABILITY \
        else (begin, begin + float(rng.uniform(*DURATION_S)))
    values = (follows, axis, scale, rotor, *direction, *seconds)
    return Active(DISTURBANCE, dict(zip(NAMES, map(float, values), strict=True)))


def _direction(rng: np.random.Generator) -> np.ndarray:
    """Force and torque (6,), of any length: a force alone, a torque alone, one component alone, or all six."""
    direction, parts = rng.normal(size=6), int(rng.integers(4))
    if parts == 0:
        direction[3:] = 0.0
    elif parts == 1:
        direction[:3] = 0.0
    elif parts == 2:
        direction *= np.arange(6) == rng.integers(6)
    return direction
