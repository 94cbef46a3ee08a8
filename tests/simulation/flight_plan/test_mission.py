"""Missions: what is flown is what the file says, and what cannot be flown is refused."""

import numpy as np
import pytest

from airtouch.simulation import scenario
from airtouch.simulation.firmware import setpoint as c

UP = {"do": "take-off", "height_m": 0.8}


def rows(*steps, **mission):
    """Set-points (rows, 8) of a mission of these steps over a floor."""
    scene = scenario.Scenario("mine", "", {"mission": {"step": list(steps), **mission}})
    return scenario.draw_flight(scene, 0, 0).setpoints


@pytest.mark.parametrize(("width", "spacing", "lines"), [
    (0.6, 0.2, 4), (1.0, 0.1, 11), (0.9, 0.3, 4), (2.0, 0.25, 9), (0.65, 0.2, 4), (0.59, 0.2, 3), (0.1, 0.2, 1)])
def test_a_zigzag_has_all_its_lines(width, spacing, lines):
    """Lines at 0, spacing, 2 spacing and so on, up to the width: 0.6 m in steps of 0.2 m are four."""
    flown = rows(UP, {"do": "zigzag", "size_m": [1.0, width], "spacing_m": spacing, "speed_mps": 0.5})
    along_x = np.abs(flown[:, c.VX]) > 0.1
    assert len(np.unique(flown[along_x, c.Y].round(6))) == lines
    assert flown[:, c.Y].max() == pytest.approx((lines - 1) * spacing)
