"""Missions: what is flown is what the file says, and what cannot be flown is refused."""

import numpy as np
import pytest

from airtouch.errors import AirTouchError
from airtouch.simulation import scenario
from airtouch.simulation.firmware import setpoint as c

UP = {"do": "take-off", "height_m": 0.8}


def rows(*steps, platform=(), **mission):
    """Set-points (rows, 8) of a mission of these steps over a floor, or platforms."""
    scene = scenario.Scenario("mine", "", {"mission": {"step": list(steps), **mission}, "platform": list(platform)})
    return scenario.draw_flight(scene, 0, 0).setpoints


@pytest.mark.parametrize(("width", "spacing", "lines"), [
    (0.6, 0.2, 4), (1.0, 0.1, 11), (0.9, 0.3, 4), (2.0, 0.25, 9), (0.65, 0.2, 4), (0.59, 0.2, 3), (0.1, 0.2, 1)])
def test_a_zigzag_has_all_its_lines(width, spacing, lines):
    """Lines at 0, spacing, 2 spacing and so on, up to the width: 0.6 m in steps of 0.2 m are four."""
    flown = rows(UP, {"do": "zigzag", "size_m": [1.0, width], "spacing_m": spacing, "speed_mps": 0.5})
    along_x = np.abs(flown[:, c.VX]) > 0.1
    assert len(np.unique(flown[along_x, c.Y].round(6))) == lines
    assert flown[:, c.Y].max() == pytest.approx((lines - 1) * spacing)


@pytest.mark.parametrize(("steps", "message"), [
    ([{**UP, "height_m": 2.0, "time_s": 0.01}], "step 1: 200 m/s is faster than the firmware flies, 1 m/s; give time_s "
                                                "of 2.0 s or more"),
    ([UP, {"do": "land", "time_s": 0.1}], "step 2: 9 m/s is faster"),
    ([UP, {"do": "hover", "time_s": 1.0, "pulse_mps": -50.0, "every_s": 0.5}], "step 2: 50 m/s is faster"),
    ([{"do": "wait", "time_s": 3.0}], "mine: this mission never takes off"),
    ([{"do": "land"}], "mine: this mission never takes off"),
    ([UP, {"do": "go", "to_m": [1.0, 0.0], "distance_m": 3.0, "speed_mps": 0.5}], "step 2: go takes to_m, or"),
    ([UP, {"do": "go", "to_m": [1.0, 0.0], "direction_deg": 9.0, "speed_mps": 0.5}], "step 2: go takes to_m, or"),
    ([UP, {"do": "go", "height_m": 1.0, "direction_deg": 9.0, "speed_mps": 0.5}], "step 2: go with direction_deg"),
    ([UP, {"do": "go", "speed_mps": 0.5}], "step 2: go needs to_m, distance_m or height_m")])
def test_what_cannot_be_flown_is_refused(steps, message):
    with pytest.raises(AirTouchError) as error:
        rows(*steps)
    assert message in str(error.value)


def test_the_fastest_take_off_and_a_go_that_climbs_are_flown():
    flown = rows({**UP, "height_m": 0.7, "time_s": 0.7}, {"do": "go", "height_m": 1.0, "speed_mps": 0.5})
    assert flown[70, c.Z] > flown[69, c.Z] == pytest.approx(0.7) and flown[-1, c.Z] == pytest.approx(1.0)


@pytest.mark.parametrize("yaw_deg", [0.0, 90.0, -30.0])
def test_a_pulse_is_forward_whatever_the_heading(yaw_deg):
    """Of its speed along the body's x axis, which the yaw turns from the world's."""
    flown = rows(UP, {"do": "hover", "time_s": 1.0, "pulse_mps": 0.3, "every_s": 0.5}, yaw_deg=yaw_deg)
    pulse = flown[np.hypot(flown[:, c.VX], flown[:, c.VY]) > 0.0, c.VX:c.VY + 1]
    assert len(pulse) == 4
    np.testing.assert_allclose(pulse[:, 0] + 1j * pulse[:, 1], 0.3 * np.exp(1j * np.radians(yaw_deg)), atol=1e-12)


def test_a_hover_shorter_than_the_time_between_pulses_has_none():
    flown = rows(UP, {"do": "hover", "time_s": 1.0, "pulse_mps": 0.3, "every_s": 5.0})
    assert not flown[:, c.VX:c.VY + 1].any()


def test_a_thin_bar_in_the_way_is_seen():
    """2 cm wide, crossed at 1 m/s in two rows."""
    bar = {"size_m": [0.02, 2.0], "centre_m": [1.025, 0.0], "top_m": 0.9}
    with pytest.raises(AirTouchError, match="0.80 m high through a surface 0.90 m high"):
        rows(UP, {"do": "go", "distance_m": 2.0, "speed_mps": 1.0}, platform=[bar])
