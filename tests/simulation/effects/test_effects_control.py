"""Effects on the controller: each gain scales the loops that it names."""

import numpy as np
import pytest

from airtouch.simulation.firmware import controller
from airtouch.simulation.plant import from_vehicle


def commanded(vehicle, gains, *, attitude=(0.0, 0.0, 0.0), velocity=(0.0, 0.0, 0.0), position=(0.0, 0.0, 0.0)):
    """The firmware's controller, once, with a plant's gains: its state after a level, resting estimate."""
    plant, state = from_vehicle(vehicle), np.zeros(1, controller.STATE)[0]
    setpoint = np.zeros(1, controller.SETPOINT)[0]
    for field, value in gains.items():
        plant[field] = value
    tilted = any(attitude)
    setpoint["mode"] = [1 + (not tilted)] * 2 + [1, tilted, tilted, 1]
    if tilted:
        setpoint["mode"][:2] = 0
    setpoint["attitude"], setpoint["velocity"], setpoint["position"] = attitude, velocity, position
    state["mode"] = setpoint["mode"]
    controller.run(plant[0], state, setpoint, np.zeros(1, controller.ESTIMATE)[0], 0)
    return state


@pytest.mark.parametrize("field", ["rate_gain", "attitude_gain"])
def test_controller_gain_scales_the_loops(vehicle, field):
    def turn(gain):
        return commanded(vehicle, {field: gain}, attitude=(0.5, 0.0, 0.0))["command"][0]
    assert turn(2.0) == pytest.approx(2.0 * turn(1.0), abs=2.0)  # commands are whole numbers


def test_position_and_height_gain_scale_the_outer_loops(vehicle):
    def outer_loops(**gains):
        state = commanded(vehicle, gains, velocity=(0.1, 0.0, 0.0), position=(0.0, 0.0, 0.05))
        return state["attitude"][1], state["thrust"] - from_vehicle(vehicle)[0]["thrust_base"]
    pitch, thrust = outer_loops()
    assert outer_loops(position_gain=2.0) == pytest.approx((2 * pitch, thrust))
    assert outer_loops(height_gain=2.0)[1] == pytest.approx(4 * thrust, rel=0.05)  # two loops in series
