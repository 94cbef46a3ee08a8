"""Two nameless effects: what the force of one follows, and which property of the plant the other changes."""

import numpy as np
import pytest

from airtouch.gap.relations.nameless_effects import DISTURBANCE, NAMES, PROPERTY, Follows, properties
from airtouch.simulation import plant, replay
from airtouch.simulation import signals as at
from airtouch.simulation.effects import Active
from airtouch.vehicle import DEFAULT_VEHICLE, load

WEIGHT_N = 0.3
SAMPLES = 400


def signals():
    """A flight of 4 s in which nothing but what a test sets is moving, 0.1 m high."""
    out = np.zeros((SAMPLES, at.COUNT))
    out[:, at.STEP], out[:, at.TIME] = 0.01, 0.01 * np.arange(SAMPLES)
    out[:, at.MASS], out[:, at.GRAVITY] = WEIGHT_N / 9.81, 9.81
    out[:, at.THRUST:at.THRUST + 4], out[:, at.HEIGHT] = 0.25 * WEIGHT_N, 0.1
    return out


def lift(follows, flown, axis=0, scale=0.0, rotor=0, seconds=(0.0, 1e9)):
    """Vertical force over time of a disturbance of 1 N along z."""
    values = dict.fromkeys(NAMES, 0.0) | {"follows": float(follows), "axis": float(axis), "scale": scale,
                                          "rotor": float(rotor), "force_z": 1.0, "begin": seconds[0],
                                          "end": seconds[1]}
    return replay.wrench_of(Active(DISTURBANCE, values), flown, 1)[:, 2]


@pytest.mark.parametrize(("follows", "more", "column", "value", "expected"), [
    (Follows.CONSTANT, {}, at.TIME, 0.0, 1.0),
    (Follows.VELOCITY, {"axis": 1}, at.VELOCITY + 1, 0.6, 2.0),
    (Follows.SPEED, {}, at.VELOCITY + 2, -0.6, 2.0),
    (Follows.BODY_RATE, {"axis": 2}, at.RATES + 2, -0.4, -2.0),
    (Follows.NEAR_GROUND, {"scale": 0.1}, at.HEIGHT, 0.1, np.exp(-1.0)),
    (Follows.TIME, {}, at.TIME, 5.0, 0.5),
    (Follows.WAVE, {"scale": 4.0}, at.TIME, 1.0, 1.0),
    (Follows.TILT, {"axis": 1}, at.ROTATION + 5, 0.1, 2.0),
    (Follows.POSITION, {}, at.POSITION, 0.7, 0.7),
    (Follows.SQUARED_VELOCITY, {}, at.VELOCITY, -0.3, -1.0),
    (Follows.ONE_ROTOR, {"rotor": 2}, at.THRUST + 2, 0.5 * WEIGHT_N, 1.0),
])
def test_the_force_follows_its_signal(follows, more, column, value, expected):
    flown = signals()
    flown[:, column] = value
    assert lift(follows, flown, **more) == pytest.approx(np.full(SAMPLES, expected))


def test_thrust_is_that_beyond_the_weight_and_its_halves_turn():
    flown = signals()
    for follows in (Follows.THRUST, Follows.ROLL_THRUST, Follows.PITCH_THRUST):
        assert lift(follows, flown) == pytest.approx(0.0)
    flown[:, at.THRUST + 3] += 0.01 * WEIGHT_N  # the rotor that both halves have
    assert lift(Follows.THRUST, flown) == pytest.approx(0.01 / 0.05)
    assert lift(Follows.ROLL_THRUST, flown) == pytest.approx(0.01 / 0.02)
    assert lift(Follows.PITCH_THRUST, flown) == pytest.approx(0.01 / 0.02)
    flown[:, at.THRUST + 2] += 0.01 * WEIGHT_N  # the rotor that turns against it in pitch
    assert lift(Follows.PITCH_THRUST, flown) == pytest.approx(0.0)


def test_noise_has_variance_one_and_its_correlation_time():
    flown = np.tile(signals(), (50, 1))
    noise = lift(Follows.NOISE, flown, scale=0.02)
    assert noise.std() == pytest.approx(1.0, abs=0.05)
    assert np.mean(noise[1:] * noise[:-1]) == pytest.approx(np.exp(-0.5), abs=0.05)


def test_a_disturbance_of_some_seconds_acts_in_these_alone():
    force = lift(Follows.CONSTANT, signals(), seconds=(0.995, 2.005))
    assert np.flatnonzero(force).tolist() == list(range(100, 201))


def test_properties_are_those_that_no_effect_of_the_registry_changes():
    names = properties()
    assert "rotor_x" in names and "range_drift" in names
    assert not {"mass", "inertia", "motor_rise", "actuator_delay", "motor_noise", "gravity"} & set(names)


@pytest.mark.parametrize(("element", "factors"), [(-1, [2.0] * 4), (1, [1.0, 2.0, 1.0, 1.0])])
def test_a_property_changes_in_all_its_elements_or_in_one(element, factors):
    row, before = (plant.from_vehicle(load(DEFAULT_VEHICLE)) for _ in range(2))
    assert PROPERTY.settings is not None
    PROPERTY.settings(row[0], {"property": properties().index("rotor_x"), "element": element, "amount": 2.0})
    assert row["rotor_x"][0] == pytest.approx(before["rotor_x"][0] * factors)
