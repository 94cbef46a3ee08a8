"""The estimate that the controllers get against SciPy's rotations."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from airtouch.simulation import state as states
from airtouch.simulation.firmware import autopilot, setpoint
from airtouch.simulation.plant import from_vehicle


@pytest.mark.parametrize("seed", range(5))
def test_angles_and_world_velocity_are_those_of_the_filters_rotation(vehicle, seed):
    rng = np.random.default_rng(seed)
    plant, state = from_vehicle(vehicle)[0], states.empty()[0]
    yaw, pitch, roll = rng.uniform(-1.4, 1.4, 3)
    turn = Rotation.from_euler("ZYX", [yaw, pitch, roll])
    est = state["firmware"]["kalman"]
    est["r"], est["v"], est["x"] = turn.as_matrix(), rng.normal(size=3), rng.normal(size=3)
    row = np.zeros(8)
    autopilot.steer(plant, state, row, 0)
    angles = state["firmware"]["angles"]
    np.testing.assert_allclose(angles, [roll, pitch, yaw], atol=1e-12)
    estimate = state["firmware"]["estimate"]
    np.testing.assert_allclose(estimate["velocity"], turn.apply(est["v"]), atol=1e-12)
    np.testing.assert_allclose(estimate["position"], est["x"], atol=0)
    np.testing.assert_allclose(estimate["attitude"], np.degrees([roll, -pitch, yaw]), atol=1e-9)  # pitch: nose up


def test_it_counts_as_flying_for_two_seconds_after_the_motors_last_turn(vehicle):
    """thrust_tick is the tick of the last row whose motors were on, whatever the attitude controller's own rate."""
    plant, state = from_vehicle(vehicle)[0], states.empty()[0]
    state["firmware"]["kalman"]["r"] = np.eye(3)
    on, off = np.zeros(8), np.zeros(8)
    on[setpoint.MOTORS] = 1.0
    for tick in range(40):
        autopilot.steer(plant, state, on if tick < 17 else off, tick)
    assert state["firmware"]["thrust_tick"] == 16 and autopilot.FLYING_MS == 2000
    assert not state["motors"]["pwm"].any()
