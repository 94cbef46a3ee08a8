"""Set-point packets as cflib packs them, and the rows that the virtual drone flies by them."""

import warnings
from types import SimpleNamespace

import numpy as np
import pytest

from airtouch.simulation.firmware import setpoint as row
from airtouch.sitl.commander import Commander
from skips import needs

pytestmark = needs("cflib")
PERIOD_S = 0.01


class Drone:
    """A commander whose packets come from cflib; it stands at x 1, y 2, z 0.4 m with a heading of 90 degrees."""

    def __init__(self, protocol=12):
        from cflib.crazyflie.commander import Commander as Client

        self.commander, self.t = Commander(), 0.0
        self.estimate = np.array([0.0, 0.0, np.pi / 2, 0.0, 0.0, 0.0, 1.0, 2.0, 0.4])
        platform = SimpleNamespace(get_protocol_version=lambda: protocol)
        self.client = Client(SimpleNamespace(send_packet=self.receive, platform=platform))

    def receive(self, packet):
        from cflib.crtp.crtpstack import CRTPPort

        take = self.commander.take_rpyt if packet.port == CRTPPort.COMMANDER else self.commander.take_generic
        take(bytes(packet.data), self.t, self.estimate)

    def fly(self, seconds=PERIOD_S):
        """The last of the rows of these seconds."""
        for _ in range(round(seconds / PERIOD_S)):
            self.t += PERIOD_S
            set_point = self.commander.setpoint(self.t, self.estimate)
        return set_point


@pytest.mark.parametrize("protocol", [8, 12])  # cflib turns the sign of the yaw rate for firmware that wants it so
def test_a_hover_is_flown_in_body_axes(protocol):
    drone = Drone(protocol)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for _ in range(10):
            drone.client.send_hover_setpoint(0.3, 0.1, 30.0, 0.5)
            set_point = drone.fly(0.1)
    assert set_point[row.MODE] == row.FLY and set_point[row.MOTORS] == 1.0 and set_point[row.Z] == pytest.approx(0.5)
    assert set_point[[row.VX, row.VY]] == pytest.approx([-0.1, 0.3])  # forward is world y, left is minus world x
    assert np.degrees(set_point[row.YAW]) == pytest.approx(90.0 + 30.0)


def test_a_velocity_is_flown_in_world_axes_and_climbs():
    drone = Drone()
    for _ in range(10):
        drone.client.send_velocity_world_setpoint(0.3, 0.1, 0.2, 0.0)
        set_point = drone.fly(0.1)
    assert set_point[[row.VX, row.VY]] == pytest.approx([0.3, 0.1]) and set_point[row.Z] == pytest.approx(0.4 + 0.2)
    for _ in range(50):
        drone.client.send_velocity_world_setpoint(0.0, 0.0, 0.2, 0.0)
        set_point = drone.fly(0.1)
    assert set_point[row.Z] == pytest.approx(0.4 + 0.5)  # it never runs away from a drone that does not follow


def test_a_position_is_held():
    drone = Drone()
    drone.client.send_position_setpoint(0.7, -0.2, 0.9, 45.0)
    set_point = drone.fly()
    assert set_point[row.MODE] == row.HOLD and set_point[[row.X, row.Y, row.Z]] == pytest.approx([0.7, -0.2, 0.9])
    assert np.degrees(set_point[row.YAW]) == pytest.approx(45.0)


def test_without_packets_it_levels_out_and_then_stops():
    drone = Drone()
    drone.client.send_hover_setpoint(0.3, 0.0, 0.0, 0.5)
    assert drone.fly(0.4)[row.MODE] == row.FLY
    level = drone.fly(0.2)
    assert level[row.MODE] == row.TILT and (level[[row.VX, row.VY]] == 0.0).all() and level[row.MOTORS] == 1.0
    assert drone.fly(1.5)[row.MOTORS] == 0.0
    drone.client.send_hover_setpoint(0.3, 0.0, 0.0, 0.5)
    assert drone.fly()[row.MOTORS] == 1.0


def test_stop_stops_and_wrong_numbers_change_nothing():
    drone = Drone()
    drone.client.send_hover_setpoint(0.3, 0.0, 0.0, 0.5)
    drone.client.send_hover_setpoint(float("nan"), 0.0, 0.0, 0.5)
    assert drone.fly()[row.VY] == pytest.approx(0.3)
    drone.client.send_stop_setpoint()
    assert drone.fly()[row.MOTORS] == 0.0


def test_thrust_is_locked_until_it_was_zero():
    drone = Drone()
    drone.client.send_setpoint(0.0, 0.0, 0.0, 40000)
    assert drone.fly()[row.MOTORS] == 0.0
    drone.client.send_setpoint(0.0, 0.0, 0.0, 0)
    drone.client.send_setpoint(5.0, 60.0, 0.0, 40000)
    set_point = drone.fly()
    assert (set_point[row.MODE], set_point[row.MOTORS], set_point[row.Z]) == (row.TILT_THRUST, 1.0, 40000.0)
    assert set_point[[row.VX, row.VY]] == pytest.approx([5.0, 30.0])  # degrees; the pitch is limited


def test_manual_angles_are_flown_and_manual_rates_are_not():
    drone = Drone()
    drone.client.send_setpoint_manual(5.0, 0.0, 0.0, 50.0, rate=False)
    set_point = drone.fly()
    assert set_point[row.MODE] == row.TILT_THRUST and set_point[row.VX] == pytest.approx(5.0)
    drone.client.send_setpoint_manual(90.0, 0.0, 0.0, 50.0, rate=True)  # 90 degrees a second, no angle
    assert drone.fly()[row.VX] == pytest.approx(5.0)


def test_of_a_full_state_the_position_is_flown():
    drone = Drone()
    drone.client.send_full_state_setpoint((0.7, -0.2, 0.9), (1.0, 0.0, 0.0), (0.0,) * 3, (0.0, 0.0, 0.0, 1.0), 0, 0, 0)
    set_point = drone.fly()
    assert set_point[row.MODE] == row.HOLD
    assert set_point[[row.X, row.Y, row.Z]] == pytest.approx([0.7, -0.2, 0.9], abs=0.001)  # whole millimetres
    assert np.degrees(set_point[row.YAW]) == pytest.approx(90.0)
