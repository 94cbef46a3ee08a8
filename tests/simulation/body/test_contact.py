"""Legs on the floor against the closed forms of a spring, a damped bounce and sliding friction."""

import numpy as np
import pytest

from airtouch.simulation import signals as at
from airtouch.simulation.body import contact
from airtouch.simulation.plant import from_vehicle


@pytest.fixture
def plant(vehicle):
    return from_vehicle(vehicle)[0]


def force_on(plant, height, velocity=(0.0, 0.0, 0.0), rates=(0.0, 0.0, 0.0), covered=(0, 0, 0, 0), top=0.0):
    """Force and torque (6,) of a level vehicle whose rotors are `height` over the floor, and the depth."""
    s, pose, force = np.zeros(at.COUNT), np.zeros(13), np.zeros(6)
    pose[6], pose[10:] = 1.0, rates
    s[at.ROTATION:at.ROTATION + 9] = np.eye(3).ravel()
    s[at.ROTOR_X:at.ROTOR_X + 4] = np.array([1, -1, -1, 1]) * 0.03
    s[at.ROTOR_Y:at.ROTOR_Y + 4] = np.array([-1, -1, 1, 1]) * 0.03
    s[at.HEIGHT] = s[at.LOWER_HEIGHT:at.LOWER_HEIGHT + 4] = height
    s[at.UPPER_HEIGHT:at.UPPER_HEIGHT + 4] = height - top
    s[at.COVER:at.COVER + 4] = covered
    s[at.HEIGHT] = height - top * any(covered)
    s[at.VELOCITY:at.VELOCITY + 3] = velocity
    deepest = contact.legs(plant, pose, s, force)
    return force, deepest


def leg(plant):
    return float(plant["range_below_rotors"] + plant["leg_below_range"])


def test_the_weight_sinks_in_by_what_is_said(plant):
    force, depth = force_on(plant, leg(plant) - contact.SINK_M)
    assert force[2] == pytest.approx(plant["mass"] * plant["gravity"], rel=1e-6)
    assert depth == pytest.approx(contact.SINK_M, rel=1e-6) and np.allclose(force[[0, 1, 3, 4, 5]], 0.0)


def test_in_the_air_there_is_no_force(plant):
    force, depth = force_on(plant, leg(plant) + 1e-4)
    assert depth == 0.0 and not force.any()


def test_a_small_bounce_is_a_damped_oscillation(plant):
    """x'' = -w^2 x - 2 z w x' about the resting place, w^2 = g / sink: x(t) in closed form."""
    mass, g = float(plant["mass"]), float(plant["gravity"])
    x, v, dt, t = 0.0004, 0.0, 1e-6, 0.02
    for _ in range(round(t / dt)):
        f = force_on(plant, leg(plant) - contact.SINK_M + x, (0.0, 0.0, v))[0][2]
        v += dt * (f / mass - g)
        x += dt * v
    w, z = np.sqrt(g / contact.SINK_M), contact.DAMPING
    wd = w * np.sqrt(1.0 - z * z)
    true = 0.0004 * np.exp(-z * w * t) * (np.cos(wd * t) + z * w / wd * np.sin(wd * t))
    assert x == pytest.approx(true, abs=4e-7)


def test_legs_push_and_never_pull(plant):
    assert force_on(plant, leg(plant) - 1e-4, (0.0, 0.0, 5.0))[0][2] == 0.0


def test_sliding_dies_out_with_its_time_constant(plant):
    force, _ = force_on(plant, leg(plant) - contact.SINK_M, (0.3, -0.2, 0.0))
    np.testing.assert_allclose(force[:2] / plant["mass"], -np.array([0.3, -0.2]) / contact.FRICTION_S, rtol=1e-6)


def test_one_leg_on_a_platform_turns_the_vehicle_over_it(plant):
    """Rotor 1, front right, alone touches: torque is r x F."""
    force, _ = force_on(plant, leg(plant) + 0.01, covered=(1, 0, 0, 0), top=0.01 + contact.SINK_M)
    push = 0.25 * plant["mass"] * plant["gravity"]
    np.testing.assert_allclose(force[3:], np.cross([0.03, -0.03, 0.0], [0.0, 0.0, push]), rtol=1e-6)
