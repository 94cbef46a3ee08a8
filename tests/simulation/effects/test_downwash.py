"""The wake of another vehicle: a Gaussian jet over each rotor, and a first-order random part."""

import numpy as np
import pytest

from airtouch.simulation import effects, replay
from airtouch.simulation import signals as at

WEIGHT = 0.0362 * 9.81


def wrench(values, signals):
    return replay.wrench_of(effects.activate({"downwash": values})[0], signals)


@pytest.mark.parametrize(("x", "y", "yaw"), [(0.0, 0.0, 0.0), (0.05, -0.02, 0.0), (-0.1, 0.08, 0.7), (0.3, 0.3, -2.0)])
def test_push_and_tilt_are_the_sum_over_the_rotors_of_a_gaussian_jet(signals, x, y, yaw):
    c, s = np.cos(yaw), np.sin(yaw)
    signals[:, at.ROTATION:at.ROTATION + 9] = [c, -s, 0, s, c, 0, 0, 0, 1]
    signals[:, at.POSITION:at.POSITION + 2] = (1.0, -2.0)
    six = wrench({"strength": 0.4, "x": 1.0 + x, "y": -2.0 + y, "width": 0.12, "turbulence": 0.0}, signals)
    arms = np.stack([signals[0, at.ROTOR_X:at.ROTOR_X + 4], signals[0, at.ROTOR_Y:at.ROTOR_Y + 4], np.zeros(4)], axis=1)
    places = arms[:, :2] @ np.array([[c, s], [-s, c]])
    push = 0.1 * WEIGHT * np.exp(-((places - [x, y])**2).sum(axis=1) / 0.12**2)
    force = np.stack([np.zeros(4), np.zeros(4), -push], axis=1)
    expected = np.r_[force.sum(axis=0), np.cross(arms, force).sum(axis=0)]
    np.testing.assert_allclose(six, np.tile(expected, (len(six), 1)), atol=1e-12)


def test_without_a_width_it_is_everywhere(signals):
    signals[:, at.POSITION] = np.linspace(-500, 500, len(signals))
    force = wrench({"strength": 0.3, "width": 0.0, "turbulence": 0.0}, signals)
    np.testing.assert_allclose(force, np.tile([0, 0, -0.3 * WEIGHT, 0, 0, 0], (len(force), 1)), atol=1e-12)


def test_its_unsteady_part_has_the_rms_and_the_correlation_time(signals):
    long_hover = np.tile(signals, (3000, 1))  # 600 s
    values = {"strength": 0.3, "width": 0.0, "turbulence": 0.5, "turbulence_time": 0.04, "swirl": 0.01}
    force = wrench(values, long_hover)
    rotor = 0.3 * WEIGHT / 4 * 0.5
    arm = signals[0, at.ROTOR_Y]
    assert force[:, 2].mean() == pytest.approx(-0.3 * WEIGHT, rel=0.01)
    np.testing.assert_allclose(force[:, [2, 3, 4, 5]].std(axis=0),
                               2 * rotor * np.array([1, abs(arm), abs(arm), 0.01]), rtol=0.03)
    lift = force[:, 2] - force[:, 2].mean()
    lags = np.array([5, 10, 20, 40])
    correlation = [np.mean(lift[:-k] * lift[k:]) / np.mean(lift**2) for k in lags]
    np.testing.assert_allclose(correlation, np.exp(-lags * 0.002 / 0.04), atol=0.03)
