"""The torques of `gap_fan.py`, against those of the simulator's rotors."""

import numpy as np
import pytest

from airtouch import vehicle as vehicles
from airtouch.simulation.body.rigid_body import SPIN
from airtouch.simulation.flight import prepare
from tools.diagnosis import gap_fan

VEHICLE = vehicles.load("crazyflie-2.1")


@pytest.mark.parametrize("rotor", range(4))
def test_one_rotors_thrust_turns_the_vehicle_by_its_place_and_spin(rotor):
    """Roll torque is y times thrust; yaw is against the rotor's turn."""
    thrust = np.zeros(4)
    thrust[rotor] = 0.1
    row = prepare(VEHICLE, ())[0][0]
    roll, yaw = gap_fan.angular_accelerations(thrust, VEHICLE)
    assert roll == pytest.approx(0.1 * row["rotor_y"][rotor] / VEHICLE.inertia_kg_m2[0], rel=1e-3)
    assert yaw == pytest.approx(-SPIN[rotor] * 0.1 * VEHICLE.yaw_torque_over_thrust_m / VEHICLE.inertia_kg_m2[2])


def test_equal_thrusts_turn_nothing():
    assert gap_fan.angular_accelerations(np.full(4, 0.08), VEHICLE) == pytest.approx((0.0, 0.0))
