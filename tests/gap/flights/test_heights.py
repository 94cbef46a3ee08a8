"""Heights of the rotors against motions over a floor whose truth is given."""

import numpy as np
import pytest

from airtouch.gap.flights.clock import PERIOD_S
from airtouch.gap.flights.heights import MARKER_M, rotor_heights, standing_z
from airtouch.logs.flight_log import FlightLog
from airtouch.simulation.body.rotation import as_matrix


def log_of(**columns):
    n = len(next(iter(columns.values())))
    return FlightLog({"t_s": np.arange(n) * PERIOD_S, **columns}, {})


def row_of(x, y):
    """A vehicle whose range sensor is 2 cm below its rotors, and whose legs are 2 cm below that."""
    return {"rotor_x": x, "rotor_y": y, "range_below_rotors": 0.02, "leg_below_range": 0.02}


def test_the_edge_passes_under_each_rotor_when_it_is_there():
    """At 0.5 m/s over a step of the floor: a rotor 5 cm ahead meets it 0.1 s earlier than the range sensor."""
    n, edge = 400, 200
    log = log_of(zrange_m=np.where(np.arange(n) < edge, 0.8, 0.3), z_m=np.full(n, 0.8), vx_mps=np.full(n, 0.5),
                 vy_mps=np.zeros(n))
    turn = np.tile(np.eye(3), (n, 1, 1))
    x, y = np.array([0.05, -0.05, -0.05, 0.05]), np.array([-0.05, -0.05, 0.05, 0.05])
    height = rotor_heights(log, turn, row_of(x, y), np.zeros(n, bool))
    low = height - (0.8 - 0.02) < -0.24
    first = np.argmax(low[50:], axis=0) + 50
    np.testing.assert_allclose(first, edge - np.round(x / 0.5 / PERIOD_S), atol=1)


@pytest.mark.parametrize("degrees", [0.0, 10.0, 25.0])
def test_the_beam_of_a_tilted_vehicle_is_longer_than_its_height(degrees):
    """Rotors in one plane, 2 cm along the body's axis above the sensor, which is 0.3 m over the floor."""
    n, tilt = 20, np.radians(degrees)
    turn = as_matrix(np.zeros(n), np.full(n, tilt), np.zeros(n))
    log = log_of(zrange_m=np.full(n, 0.3 / np.cos(tilt)))
    height = rotor_heights(log, turn, row_of(np.zeros(4), np.zeros(4)), np.zeros(n, bool))
    np.testing.assert_allclose(height, 0.3 + 0.02 * np.cos(tilt))


def test_without_a_range_the_floor_is_flat_and_standing_is_known():
    n = 50
    z = np.r_[np.full(10, 0.03), np.full(40, 0.5)]
    ground = np.arange(n) < 10
    turn = np.tile(np.eye(3), (n, 1, 1))
    height = rotor_heights(log_of(z_m=z), turn, row_of(np.zeros(4), np.zeros(4)), ground)
    np.testing.assert_allclose(height[20], 0.51)
    assert rotor_heights(log_of(x_m=z), turn, row_of(np.zeros(4), np.zeros(4)), ground) is None
    assert standing_z(z, ground) == 0.03 and standing_z(z + 1.0, np.zeros(n, bool)) == MARKER_M
    assert standing_z(z - 0.02, np.zeros(n, bool)) == pytest.approx(0.01)
    carried = np.r_[np.linspace(1.2, 0.1, 40), z]
    assert standing_z(carried, np.r_[np.ones(40, bool), ground]) == 0.03, "carried to its place before"
