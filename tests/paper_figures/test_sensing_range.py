"""Curves of ground effect against published values and closed forms."""

import numpy as np
import pytest

from airtouch.paper_figures.figures import sensing_range


def test_curves_are_the_published_ones():
    """At 4, 6, 8 and 12 cm for a Crazyflie (radius 23.1 to 23.5 mm): lift in % as tabulated from the publications."""
    heights = np.array([0.04, 0.06, 0.08, 0.12])
    assert 100 * sensing_range.cheeseman_bennett(heights, 0.0235) == pytest.approx([2.2, 1.0, 0.5, 0.2], abs=0.06)
    assert 100 * sensing_range.sanchez_cuevas(heights, 0.0235, 0.065) == pytest.approx([11.6, 7.5, 5.0, 2.5], rel=0.1)


def test_the_measured_curve_is_what_neural_swarm_flew():
    """34 g: 9.0, 5.2, 2.0 and -0.1 % at 2, 4, 6 and 9 cm above standing, the rotors 29 mm higher."""
    heights = np.array([0.02, 0.04, 0.06, 0.09]) + 0.029
    assert 100 * sensing_range.measured_gain(heights, "crazyflie-34g") == pytest.approx([9.0, 5.2, 2.0, -0.1], abs=0.8)


def test_reach_inverts_a_curve():
    """1 / (1 - (R / 4 h)^2) - 1 = t at h = R / (4 sqrt(t / (1 + t)))."""
    height_m = sensing_range.reach(lambda h: sensing_range.cheeseman_bennett(h, 0.1), 0.01)
    assert height_m == pytest.approx(0.1 / (4 * np.sqrt(0.01 / 1.01)), rel=0.02)
    assert sensing_range.reach(lambda h: 0 * h, 0.01) == 0.0


def test_white_noise_is_averaged_over_so_many_seconds():
    """The mean of n samples has sigma / sqrt(n): lift = 3 sigma / sqrt(n)."""
    seconds = sensing_range.averaging_s(0.001)
    assert 3 * sensing_range.NOISE / np.sqrt(100 * seconds) == pytest.approx(0.001)
