"""The readings at platform edges and the height loop of `tools/detectors/edge_readings.py`, on synthetic signals."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.twin.recorded import channels as ch
from tools.detectors import edge_readings
from twin_courses import made_course


def stepped(fraction: float | None) -> tuple:
    """A course and channels whose down range goes from 80 to 8 cm at sample 500, by one reading at `fraction`."""
    x = np.zeros((1000, 12))
    x[:500, ch.DOWN], x[500:, ch.DOWN] = 80.0, 8.0
    if fraction is not None:
        x[500:503, ch.DOWN] = 80.0 - 72.0 * fraction
    return replace(made_course(0, 0.08), entry=500, exit=900, level=100), x


@pytest.mark.parametrize("fraction", [0.1, 0.5, 1.4])
def test_the_reading_in_passing_comes_back(fraction):
    assert edge_readings.mixed_fractions([stepped(fraction)], "entry") == pytest.approx([fraction], abs=1e-9)


def test_a_clean_step_has_none():
    assert np.isnan(edge_readings.mixed_fractions([stepped(None)], "entry")).all()


def test_the_height_loop_holds_still_and_pushes_against_a_lower_reading():
    """Nothing where the reading is the set height; over a platform the module adds its 0.75 m; 1 cm less than set
    asks for more thrust, in the end by both integrals."""
    command, heights = edge_readings.height_loop(np.full(400, 0.8), np.zeros(400), 0.8)
    assert np.abs(command).max() < 1e-6 and np.ptp(heights) == 0.0
    over = np.r_[np.full(200, 0.8), np.full(200, 0.05)]
    assert edge_readings.height_loop(over, np.zeros(400), 0.8)[1] == pytest.approx(np.full(400, 0.8))
    low = np.r_[np.full(200, 0.8), np.full(400, 0.79)]
    command = edge_readings.height_loop(low, np.zeros(600), 0.8)[0]
    assert command[199] == pytest.approx(0.0, abs=1e-6) and command[215] > 500.0
    # settled: off by 0.01 m; the velocity loop is asked for 2 x 0.01 + 0.5 x 0.01 t, which its own integral sums up
    slope = np.diff(command[500:]).mean() / 0.01
    t = 3.5
    assert slope == pytest.approx(1000.0 * (25.0 * 0.005 + 15.0 * (0.02 + 0.005 * t)), rel=0.05)
