"""Trajectories: against SciPy's polynomials with given derivatives, and their ends."""

import errno
import struct

import numpy as np
import pytest
from scipy.interpolate import BPoly

from airtouch.sitl.planner import FLYING, IDLE, LANDING, Planner, polynomial


def test_polynomials_are_those_of_scipy():
    rng = np.random.default_rng(0)
    for _ in range(20):
        seconds, start, end = float(rng.uniform(0.1, 20)), rng.normal(size=3), rng.normal(size=3)
        mine = polynomial(seconds, tuple(start), tuple(end))
        theirs = BPoly.from_derivatives([0.0, seconds], [[*start, 0.0], [*end, 0.0]])
        t = np.linspace(0.0, seconds, 50)
        np.testing.assert_allclose(np.polynomial.polynomial.polyval(t / seconds, mine), theirs(t), atol=1e-9)


def fly(planner, begin, seconds):
    """Goals at 100 Hz: position (n, 3) and velocity (n, 3)."""
    goals = [planner.goal(begin + t) for t in np.arange(0.0, seconds, 0.01)]
    return np.array([g.position for g in goals]), np.array([g.velocity for g in goals])


def test_take_off_go_and_land():
    planner = Planner()
    planner.tell(np.array([0.2, -0.1, 0.0]), np.zeros(3), 0.3)
    assert planner.command(struct.pack("<BBff?f", 7, 0, 0.8, 0.0, True, 2.0), 10.0) == 0
    assert planner.command(struct.pack("<BBff?f", 7, 0, 0.8, 0.0, True, 2.0), 10.0) == 1  # not idle
    place, speed = fly(planner, 10.0, 2.5)
    np.testing.assert_allclose(place[-1], [0.2, -0.1, 0.8], atol=1e-12)
    np.testing.assert_allclose(np.gradient(place[:, 2], 0.01)[5:-5], speed[5:-5, 2], atol=1e-3)
    assert (np.diff(place[:, 2]) >= 0.0).all() and planner.finished(12.0)
    # a second go-to while the first is flown: no jump in place or velocity
    planner.command(struct.pack("<BBBBfffff", 12, 0, 1, 0, 1.0, 0.0, 0.0, 0.0, 4.0), 13.0)
    first, _ = fly(planner, 13.0, 2.0)
    planner.command(struct.pack("<BBBBfffff", 12, 0, 0, 0, 0.0, 1.0, 0.8, 0.0, 3.0), 15.0)
    second, speed = fly(planner, 15.0, 3.5)
    assert np.abs(second[0] - first[-1]).max() < 0.01
    np.testing.assert_allclose(second[-1], [0.0, 1.0, 0.8], atol=1e-9)
    np.testing.assert_array_equal(speed[-1], 0.0)
    assert planner.command(struct.pack("<BBff?f", 8, 0, 0.0, 0.0, True, 1.0), 20.0) == 0
    assert planner.state == LANDING
    fly(planner, 20.0, 1.0)
    assert planner.goal(21.01).position[2] == pytest.approx(0.0, abs=1e-12)
    assert planner.state == IDLE and planner.goal(21.02) is None


def test_a_linear_go_to_keeps_its_speed():
    planner = Planner()
    planner.command(struct.pack("<BBff?f", 7, 0, 0.5, 0.0, False, 1.0), 0.0)
    planner.goal(2.0)
    planner.command(struct.pack("<BBBBfffff", 12, 0, 0, 1, 3.0, 0.0, 0.5, 0.0, 10.0), 2.0)
    _, speed = fly(planner, 2.0, 9.9)
    np.testing.assert_allclose(speed[:, 0], 0.3, atol=1e-9)


@pytest.mark.parametrize("sideways", [0, 1])
@pytest.mark.parametrize("clockwise", [0, 1])
def test_a_quarter_spiral_stays_on_its_circle(sideways, clockwise):
    planner = Planner()
    planner.command(struct.pack("<BBff?f", 7, 0, 0.5, 0.0, False, 1.0), 0.0)
    planner.goal(2.0)
    angle, radius = np.pi / 2, 0.6
    spiral = struct.pack("<BBBBfffff", 11, 0, sideways, clockwise, angle, radius, radius, 0.1, 4.0)
    assert planner.command(spiral, 2.0) == 0
    assert planner.state == FLYING
    place, speed = fly(planner, 2.0, 4.01)
    centre = np.array([[0.0, radius], [0.0, -radius]][clockwise] if not sideways
                      else [[-radius, 0.0], [radius, 0.0]][clockwise])
    # not quite a circle: the jerk is 0 at both ends
    np.testing.assert_allclose(np.linalg.norm(place[:, :2] - centre, axis=1), radius, atol=6e-3)
    np.testing.assert_allclose(np.linalg.norm(speed[10:-10, :2], axis=1), radius * angle / 4.0, rtol=0.05)
    assert place[-1, 2] == pytest.approx(0.6)
    assert planner.goal(6.0).yaw == pytest.approx([angle, -angle][clockwise])


@pytest.mark.parametrize("data", [b"", b"\x07", b"\x63" + bytes(20),
                                  struct.pack("<BBff?f", 7, 0, np.nan, 0, False, 1),
                                  struct.pack("<BBff?f", 7, 0, 1.0, 0, False, np.inf)])
def test_commands_that_make_no_sense_are_refused(data):
    planner = Planner()
    assert planner.command(data, 0.0) in (errno.ENOEXEC, errno.EINVAL)
    assert planner.state == IDLE


def test_a_command_for_another_group_is_not_flown():
    planner = Planner()
    planner.command(bytes([0, 2]), 0.0)
    planner.command(struct.pack("<BBff?f", 7, 4, 0.5, 0.0, False, 1.0), 0.0)  # for others
    assert planner.state == IDLE
    planner.command(struct.pack("<BBff?f", 7, 6, 0.5, 0.0, False, 1.0), 0.0)
    assert planner.state == FLYING
