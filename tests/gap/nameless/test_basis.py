"""The flight's own signals, in which a model without names looks for what is left: against closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.gap.nameless.basis import BASIS, HEIGHT_M, LAG_S, TIME_S, basis
from airtouch.simulation import signals as at
from gap_flights import VEHICLE, flight, fly

REST_S, TILT = 1.0, 0.3
WEIGHT_N = VEHICLE.mass_kg * VEHICLE.gravity_mps2


def columns(hover):
    """Each signal by its name, (n, 3)."""
    return dict(zip(BASIS, basis(hover, VEHICLE).transpose(1, 0, 2), strict=True))


@pytest.fixture(scope="module")
def lift_off():
    """1 s at rest, then all motors at one command."""
    return flight(3.0, resting_s=REST_S)


def test_thrust_rises_as_the_motors_do(lift_off):
    t = np.arange(len(lift_off)) * 0.01 - REST_S
    full = 4.0 * float(VEHICLE.thrust(np.array([40000.0]))[0]) / WEIGHT_N
    column = columns(lift_off)
    late = t > 0.05
    thrust = full * (1.0 - np.exp(-(t[late] + 0.01) / VEHICLE.motor_time_constant_s))
    np.testing.assert_allclose(column["thrust"][late, 0], thrust, rtol=1e-9)
    slope = full / VEHICLE.motor_time_constant_s * np.exp(-(t[late] + 0.01) / VEHICLE.motor_time_constant_s) * LAG_S
    np.testing.assert_allclose(column["d_thrust"][late, 0], slope, rtol=0.05, atol=1e-6)
    for name in ("roll", "pitch", "yaw"):
        np.testing.assert_allclose(column[name], 0.0, atol=1e-12)


def test_on_the_ground_only_the_constant_is_left(lift_off):
    ground = basis(lift_off, VEHICLE)[np.arange(len(lift_off)) * 0.01 < REST_S]
    assert (ground[:, BASIS.index("one")] == 1.0).all()
    assert not np.delete(ground, BASIS.index("one"), axis=1).any()


@pytest.mark.parametrize(("motor", "roll", "pitch", "yaw"), [(0, -1, -1, -1), (1, -1, 1, 1), (2, 1, 1, -1),
                                                               (3, 1, -1, 1)])
def test_one_motor_more_is_a_roll_a_pitch_and_a_yaw(motor, roll, pitch, yaw):
    """Motors front right, rear right, rear left, front left: the left side lifts to a positive roll."""
    hover = flight(3.0)
    pwm = hover.pwm.copy()
    pwm[:, motor] = 45000.0
    column = columns(replace(hover, pwm=pwm))
    stronger, nominal = VEHICLE.thrust(np.array([45000.0, 40000.0])) / WEIGHT_N
    for name, sign in (("roll", roll), ("pitch", pitch), ("yaw", yaw)):
        np.testing.assert_allclose(column[name][-1], sign * (stronger - nominal), rtol=1e-9)
    np.testing.assert_allclose(column["thrust"][-1], 3.0 * nominal + stronger, rtol=1e-9)


def test_time_height_and_axes_of_the_world():
    hover = flight(3.0)
    signals = hover.signals.copy()
    signals[:, at.LOWER_HEIGHT:at.LOWER_HEIGHT + 4] = 2.0 * HEIGHT_M
    c, s = np.cos(TILT), np.sin(TILT)
    turn = np.tile([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]], (len(hover), 1, 1))
    column = columns(replace(hover, signals=signals, body_to_world=turn))
    t = np.arange(len(hover)) * 0.01
    np.testing.assert_allclose(column["time"][:, 0], t / TIME_S)
    np.testing.assert_allclose(column["time_thrust"][:, 0], t / TIME_S * column["thrust"][:, 0])
    np.testing.assert_allclose(column["near"], 0.25)  # a quarter at twice the height
    np.testing.assert_allclose(column["near_roll"], 0.0, atol=1e-12)
    # a push along x of the world is felt along the body's x by cos, along its y by -sin of the yaw
    np.testing.assert_allclose(column["world_x"][0], [c, -s, 0.0], atol=1e-12)
    np.testing.assert_allclose(column["world_y"][0], [s, c, 0.0], atol=1e-12)


def test_columns_are_the_signals_that_they_are_named_after():
    simulated = fly(1, 43)[0]
    column = columns(simulated)
    hover = np.flatnonzero(simulated.phase == 2)
    assert np.all(column["in_air"][simulated.on_ground] == 0.0) and np.all(column["one"] == 1.0)
    assert abs(column["thrust"][hover, 0].mean() - 1.0) < 0.1  # of its weight
    np.testing.assert_allclose(column["vx"][hover, 1], simulated.signals[hover, at.VELOCITY])
    rows = np.stack([column[k][hover] for k in ("world_x", "world_y", "world_z")], axis=1)
    np.testing.assert_allclose(np.linalg.norm(rows, axis=2), 1.0, rtol=1e-9)  # rows of a rotation
