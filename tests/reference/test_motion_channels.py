"""The streaming detector's channels against explicit recursions and closed forms."""

import numpy as np
import pytest

from airtouch import vehicle as vehicles
from airtouch.errors import AirTouchError
from airtouch.reference.motion_channels import NAMES, MotionConfig, motion_channels

CRAFT = vehicles.load()
UNIT = MotionConfig(scale=(1.0,) * 11, limit=1e9, settle_samples=20, slow_samples=50.0)
G = CRAFT.gravity_mps2


def still(n, pwm=40000.0, up=None):
    """n samples of a hover: level acceleration, rates, commands."""
    acc = np.zeros((n, 3))
    acc[:, 2] = G if up is None else up
    return acc, np.zeros((n, 3)), np.full((n, 4), pwm)


def column(channels, name):
    return channels[:, NAMES.index(name)]


def test_a_steady_hover_is_nothing():
    channels, airborne = motion_channels(*still(300), UNIT)
    assert channels.shape == (300, 12) and airborne.all()
    np.testing.assert_allclose(channels, 0.0, atol=1e-9)


def test_each_signal_has_its_channel_and_its_amplitude():
    acc, rate, pwm = still(100)
    acc += [0.1, 0.2, 0.3]
    rate += [0.01, 0.02, 0.03]
    channels, _ = motion_channels(acc, rate, pwm)
    config = MotionConfig()
    for name, value in zip(NAMES, (0.1, 0.2, 0.3, 0.01, 0.02, 0.03), strict=False):
        scale = config.scale[NAMES.index(name)]
        np.testing.assert_allclose(column(channels, name), value / scale, rtol=1e-9)
    np.testing.assert_allclose(column(channels, "unexplained az"), 0.3 / config.scale[10])
    assert (column(channels, "zero") == 0.0).all()
    clipped, _ = motion_channels(acc + 100.0, rate - 100.0, pwm)
    assert (column(clipped, "ax") == config.limit).all() and (column(clipped, "gyro y") == -config.limit).all()


@pytest.mark.parametrize(("motor", "signs"), [(0, (-1, 1, 1)), (1, (-1, -1, -1)), (2, (1, -1, 1)), (3, (1, 1, -1))])
def test_motors_are_mixed_as_the_firmware_does(motor, signs):
    """1 front right, 2 back right, 3 back left, 4 front left; the slow mean is all but unmoved by one sample."""
    acc, rate, pwm = still(100)
    pwm[60, motor] += 1000.0
    channels, _ = motion_channels(acc, rate, pwm, UNIT)
    remaining = 1.0 - 1.0 / UNIT.slow_samples
    for name, sign in zip(("motor roll", "motor pitch", "motor yaw"), signs, strict=True):
        assert column(channels, name)[60] == pytest.approx(1000.0 * sign * remaining)
        assert column(channels, name)[61] == pytest.approx(-1000.0 * sign / UNIT.slow_samples * remaining)
    assert column(channels, "motor mean")[60] == pytest.approx(250.0 * remaining)


def test_slow_means_follow_at_once_until_settled_and_then_slowly():
    acc, rate, pwm = still(200)
    pwm[10:] += 4000.0
    pwm[100:] += 4000.0
    mean = column(motion_channels(acc, rate, pwm, UNIT)[0], "motor mean")
    np.testing.assert_allclose(mean[:100], 0.0, atol=1e-6)
    k = np.arange(1, 101)
    np.testing.assert_allclose(mean[100:], 4000.0 * (1.0 - 1.0 / UNIT.slow_samples) ** k, rtol=1e-9)
    at = UNIT.settle_samples
    for step, share in ((at - 1, 0.0), (at, 1.0 - 1.0 / UNIT.slow_samples)):
        acc, rate, pwm = still(60)
        pwm[step:] += 4000.0
        mean = column(motion_channels(acc, rate, pwm, UNIT)[0], "motor mean")
        assert mean[step] == pytest.approx(4000.0 * share, abs=1e-6)


def test_the_ground_begins_the_settling_anew():
    acc, rate, pwm = still(200)
    pwm[80:90] = 15000.0  # not more than arm_pwm: on the ground
    pwm[100:] += 3000.0
    pwm[150:] += 3000.0
    channels, airborne = motion_channels(acc, rate, pwm, UNIT)
    assert not airborne[80:90].any() and airborne[:80].all() and airborne[90:].all()
    mean = column(channels, "motor mean")
    assert np.abs(mean[80:110]).max() < 1e-6 < 1000.0 < mean[150]
    one_more, up = motion_channels(*still(5, 15000.1), UNIT)
    assert up.all() and not motion_channels(*still(5, 15000.0), UNIT)[1].any() and one_more.shape == (5, 12)


def test_unexplained_acceleration_is_that_of_the_lagged_thrust_over_its_slow_mean():
    """By an explicit recursion: two samples of delay, a first-order lag of six, a slow mean."""
    rng = np.random.default_rng(0)
    acc, rate, pwm = still(400)
    acc[:, 2] += rng.normal(0.0, 0.3, 400)
    pwm += rng.normal(0.0, 1500.0, (400, 4))
    unexplained = column(motion_channels(acc, rate, pwm, UNIT)[0], "unexplained az")
    thrust = CRAFT.thrust(pwm).sum(axis=1)
    lagged, slow = thrust[0], thrust[0]
    for t in range(400):
        lagged = lagged * (1.0 - 1.0 / 6.0) + thrust[max(t - 2, 0)] / 6.0
        gain = 1.0 if t + 1 <= UNIT.settle_samples else 1.0 / UNIT.slow_samples
        slow = slow + gain * (lagged - slow)
        assert unexplained[t] == pytest.approx(acc[t, 2] - G * lagged / slow, abs=1e-9)
    first = np.repeat(CRAFT.thrust(np.array([[30000.0] * 4, [50000.0] * 4])).sum(axis=1), (30, 30))
    assert first[0] < first[-1]


def test_thrust_comes_two_samples_after_its_command():
    acc, rate, pwm = still(100)
    pwm[50:] += 5000.0
    unexplained = column(motion_channels(acc, rate, pwm, UNIT)[0], "unexplained az")
    np.testing.assert_allclose(unexplained[:52], 0.0, atol=1e-9)
    assert unexplained[52] < -0.05 and (np.diff(unexplained[51:58]) < 0.0).all()


def test_motors_that_stand_still_divide_by_the_least_thrust():
    acc, rate, pwm = still(10, 0.0, up=0.5)
    thrust = float(CRAFT.thrust(np.zeros((1, 4))).sum())
    assert thrust < UNIT.least_thrust_n
    unexplained = column(motion_channels(acc, rate, pwm, UNIT)[0], "unexplained az")
    np.testing.assert_allclose(unexplained, 0.5 - G * thrust / UNIT.least_thrust_n, atol=1e-12)


def test_values_that_are_no_numbers_hold_the_last_and_commands_stay_in_their_range():
    acc, rate, pwm = still(60)
    acc[:, 0], rate[:, 1] = 0.25, 0.125
    with_gaps = [x.copy() for x in (acc, rate, pwm)]
    with_gaps[0][30], with_gaps[1][31], with_gaps[2][32] = np.nan, np.inf, np.nan
    np.testing.assert_array_equal(motion_channels(*with_gaps, UNIT)[0], motion_channels(acc, rate, pwm, UNIT)[0])
    high = still(60, 70000.0)
    np.testing.assert_array_equal(motion_channels(*high, UNIT)[0], motion_channels(*still(60, 65535.0), UNIT)[0])
    pwm[40, 0] = -5000.0
    low, _ = motion_channels(acc, rate, pwm, UNIT)
    assert column(low, "motor roll")[40] == pytest.approx(40000.0 * (1.0 - 1.0 / UNIT.slow_samples))


def test_shapes_are_checked_and_nothing_is_nothing():
    acc, rate, pwm = still(5)
    for signals in ((acc[:4], rate, pwm), (acc, rate[:, :2], pwm), (acc, rate, pwm[:, :3])):
        with pytest.raises(AirTouchError, match="needs \\(n, 3\\), \\(n, 3\\) and \\(n, 4\\), not \\("):
            motion_channels(*signals)
    channels, airborne = motion_channels(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 4)))
    assert channels.shape == (0, 12) and airborne.shape == (0,)
