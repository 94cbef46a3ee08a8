"""Presets of the ground effect against lift that was measured in flight on two vehicles."""

import math

import numpy as np
import pytest

from airtouch.errors import AirTouchError
from airtouch.simulation import effects, replay, scenario
from airtouch.simulation import signals as at

#: lift in % of weight against height above standing, medians of 20 and 23 flights (neural-swarm, Shi et al. 2020)
HEIGHT_CM = np.array([1, 2, 3, 4, 5, 6, 7.3, 9])
MEASURED = {
    # preset: rotor radius m, rotor spacing m, lift
    "crazyflie-34g": (0.0235, 0.0650, [13.0, 9.0, 6.7, 5.2, 3.5, 2.0, 0.6, -0.1]),
    "frame-67g": (0.0330, 0.120 / math.sqrt(2), [14.5, 10.4, 8.1, 6.5, 5.3, 4.3, 3.4, 2.0]),
}
STANDING_M = 0.029  #: rotors over the floor, of a stock Crazyflie; not measured on the larger frame
EDGE = (1.0, 0.0, 0.0, 1.0)  #: share of each disc over the platform: the two front rotors


def wrench(values, signals):
    return replay.wrench_of(effects.activate({"ground_effect": {"turbulence": 0.0, **values}})[0], signals)[0]


@pytest.mark.parametrize("preset", MEASURED)
def test_preset_is_the_measured_curve(preset, signals):
    radius, spacing, lift = MEASURED[preset]
    signals[:, at.ROTOR_RADIUS], signals[:, at.ROTOR_SPACING] = radius, spacing
    errors = []
    for height, measured in zip(HEIGHT_CM, lift, strict=True):
        signals[:, at.LOWER_HEIGHT:at.LOWER_HEIGHT + 4] = 0.01 * height + STANDING_M
        gain = wrench({"preset": preset}, signals)[2] / signals[0, at.THRUST:at.THRUST + 4].sum()
        errors.append(100 * gain - measured)
        print(f"{preset} at {height:g} cm: {100 * gain:.2f} % of weight, measured {measured:g}, residual "
              f"{errors[-1]:+.2f}")
    assert np.abs(errors).max() < 0.8
    assert np.sqrt(np.mean(np.square(errors))) < 0.45


def test_presets_are_named_in_scenarios_and_on_the_command_line():
    for text in ("preset=frame-67g", "preset=frame-67g,even=0.5"):
        values = effects.parse(f"ground_effect:{text}")[1]
        assert values["strength"] == 0.95 and values["fade"] == 0.129
    assert values["even"] == 0.5
    scene = scenario.parse("""
[effects]
ground_effect = { preset = "crazyflie-34g", fade = 0.1 }
[[mission.step]]
do = "take-off"
height_m = 0.5
""", "preset")
    assert scenario.draw_flight(scene, 0, 0).effects[0][1]["strength"] == 1.45
    assert scenario.draw_flight(scene, 0, 0).effects[0][1]["fade"] == 0.1
    for text in ("ground_effect:preset=eagle", "wind:preset=storm"):
        with pytest.raises(AirTouchError, match="no preset"):
            effects.parse(text)


def test_even_takes_the_moment_of_an_edge_and_leaves_the_lift(signals):
    """Half of the rotors over a surface: the moment falls in proportion, the force stays."""
    signals[:, at.UPPER_HEIGHT:at.UPPER_HEIGHT + 4] = 0.05
    signals[:, at.COVER:at.COVER + 4] = EDGE
    uneven, half, even = (wrench({"even": share}, signals) for share in (0.0, 0.5, 1.0))
    assert uneven[4] < -1e-4  # the nose goes up
    assert half[4] == pytest.approx(0.5 * uneven[4], rel=1e-9)
    assert even[4] == pytest.approx(0.0, abs=1e-15)
    assert half[2] == pytest.approx(uneven[2], rel=1e-12) == even[2]


def test_even_changes_nothing_where_all_rotors_see_the_same(signals):
    signals[:, at.LOWER_HEIGHT:at.LOWER_HEIGHT + 4] = 0.05
    np.testing.assert_allclose(wrench({"even": 1.0}, signals), wrench({}, signals), atol=1e-17)


def test_strength_zero_is_bit_identical_whatever_the_rest(signals):
    signals[:, at.UPPER_HEIGHT:at.UPPER_HEIGHT + 4] = 0.05
    signals[:, at.COVER:at.COVER + 4] = EDGE
    values = {"strength": 0.0, "even": 1.0, "fade": 0.1, "turbulence": 0.5, "swirl": 0.01}
    assert not replay.wrench_of(effects.activate({"ground_effect": values})[0], signals).any()
