"""The disturbance force against Newton's second law, the other way round."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from airtouch.errors import AirTouchError
from airtouch.reference import disturbance_force, force_norm, total_thrust
from airtouch.vehicle import load

VEHICLE = load("crazyflie-2.1-flow")


def test_recovers_the_force_that_moved_the_vehicle():
    rng = np.random.default_rng(0)
    pwm, truth = rng.uniform(0, 65535, (100, 4)), rng.normal(0, 0.1, (100, 3))
    axis = Rotation.random(100, rng=rng).apply([0.0, 0.0, 1.0])
    thrust = VEHICLE.thrust(pwm).sum(axis=1)
    specific = (truth + thrust[:, None] * axis) / VEHICLE.mass_kg  # a - g
    np.testing.assert_allclose(disturbance_force(specific, pwm, VEHICLE, thrust_axis=axis), truth, atol=1e-14)


def test_at_rest_on_the_ground_it_is_the_weight():
    gravity = np.tile([0.0, 0.0, 9.81], (5, 1))
    force = disturbance_force(gravity, np.zeros((5, 4)), VEHICLE)
    np.testing.assert_allclose(force, np.tile([0, 0, VEHICLE.mass_kg * 9.81], (5, 1)))
    np.testing.assert_allclose(force_norm(force), VEHICLE.mass_kg * 9.81)


def test_thrust_falls_with_the_square_of_the_voltage_where_it_is_known():
    vehicle = replace(VEHICLE, nominal_voltage_v=4.0)
    pwm = np.full((5, 4), 40000.0)
    full = total_thrust(pwm, vehicle)
    volts = np.array([np.nan, 3.6, np.nan, 0.0, 4.0])
    np.testing.assert_allclose(total_thrust(pwm, vehicle, volts) / full, [1.0, 0.81, 0.81, 0.81, 1.0])
    unknown = replace(VEHICLE, nominal_voltage_v=None)
    np.testing.assert_array_equal(total_thrust(pwm, unknown, volts), full)


def test_pwm_is_limited_to_what_a_motor_can_be_sent():
    beyond = np.array([[70000.0, 65535.0, -5.0, 0.0]])
    assert total_thrust(beyond, VEHICLE) == pytest.approx(2 * VEHICLE.thrust(np.array(65535.0)))


def test_a_motor_off_has_no_thrust_whatever_it_is_sent_below_zero():
    assert total_thrust(np.full((1, 4), -500.0), VEHICLE) == pytest.approx(4 * VEHICLE.thrust(np.array(0.0)))


def test_a_level_vehicle_pushes_straight_up_also_before_its_axis_is_known():
    pwm = np.full((2, 4), 40000.0)
    lift = 4.0 * float(VEHICLE.thrust(np.array(40000.0)))
    still, sideways = np.zeros((2, 3)), np.array([[np.nan] * 3, [1.0, 0.0, 0.0]])
    np.testing.assert_allclose(disturbance_force(still, pwm, VEHICLE), [[0.0, 0.0, -lift]] * 2)
    np.testing.assert_allclose(disturbance_force(still, pwm, VEHICLE, thrust_axis=sideways),
                               [[0.0, 0.0, -lift], [-lift, 0.0, 0.0]])
    np.testing.assert_allclose(disturbance_force(still, pwm, VEHICLE, thrust_axis=3.0 * sideways[1]),
                               [[-lift, 0.0, 0.0]] * 2, err_msg="no longer than a unit vector")


def test_shapes_that_disagree_are_refused():
    with pytest.raises(AirTouchError, match=r"not \(4, 3\) and \(5, 4\)"):
        disturbance_force(np.zeros((4, 3)), np.zeros((5, 4)), VEHICLE)
    with pytest.raises(AirTouchError, match=r"not \(4, 3\)"):
        total_thrust(np.zeros((4, 3)), VEHICLE)
    with pytest.raises(AirTouchError, match=r"not \(4, 2\)"):
        force_norm(np.zeros((4, 2)))
