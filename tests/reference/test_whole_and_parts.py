"""The pipeline's output is that of its parts, and the parts take any kind of number, within their limits."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.errors import AirTouchError
from airtouch.parameters import DEFAULT
from airtouch.reference import band_power, disturbance_force, force_norm, total_thrust
from airtouch.reference.band_power import band_bins
from airtouch.reference.cross_spectrum import cascaded_cross_spectrum
from airtouch.reference.edge_pipeline import NONE, EdgePipelineConfig, cfar_input, edge_pipeline
from airtouch.reference.feature_window import deviation_from_mean
from airtouch.reference.finite import ACC_CLAMP, RATE_CLAMP
from airtouch.reference.fr_cfar import POWER_LIMIT, fr_cfar, hold_power
from airtouch.reference.motion_channels import MotionConfig, motion_channels
from airtouch.vehicle import load

VEHICLE = load("crazyflie-2.1-flow")


@pytest.fixture(scope="module")
def signals():
    rng = np.random.default_rng(5)
    acc = rng.normal(0.0, 0.3, (900, 3)) + [0.0, 0.0, 9.81]
    return acc, rng.normal(0.0, 0.2, (900, 3)), rng.uniform(30000.0, 50000.0, (900, 4))


@pytest.mark.parametrize("config", [EdgePipelineConfig(), EdgePipelineConfig(cfar_input="norm"), EdgePipelineConfig(
    replace(DEFAULT, leading_window=17, guard_cells=3, p_fa=0.05))])
def test_every_field_is_that_of_its_part(signals, config):
    acc, gyro, pwm = signals
    axis = np.array([0.1, -0.2, 0.97])
    events = edge_pipeline(acc, gyro, pwm, VEHICLE, vbat_v=3.4, thrust_axis=axis, config=config)
    p = config.parameters
    force = disturbance_force(acc, pwm, VEHICLE, vbat_v=3.4, thrust_axis=axis)
    np.testing.assert_array_equal(events.force, force)
    np.testing.assert_array_equal(events.force_norm, force_norm(force))
    np.testing.assert_array_equal(events.cfar_power, cfar_input(force, config))
    threshold, alert = fr_cfar(events.cfar_power, guard_cells=p.guard_cells, leading_window=p.leading_window,
                               p_fa=p.p_fa)
    np.testing.assert_array_equal(events.threshold, threshold)
    np.testing.assert_array_equal(events.alert, alert)
    # motors count by their differences to the first
    differences = np.column_stack([pwm[:, k] - pwm[:, 0] for k in (1, 2, 3)])
    powers = band_power(np.column_stack([acc, gyro, differences]), hop=1)
    ready = np.flatnonzero(events.ready)
    assert ready[0] == p.band_window - 1 and (np.diff(ready) == p.band_hop).all()
    np.testing.assert_allclose(events.band_power[ready], powers[ready], rtol=1e-9)
    np.testing.assert_array_equal(events.features[ready], cascaded_cross_spectrum(events.band_power)[ready])
    assert np.isnan(events.band_power[:ready[0]]).all()
    for i in range(ready[0], 900):
        np.testing.assert_array_equal(events.band_power[i], events.band_power[ready[ready <= i][-1]])
    assert (events.edge == NONE).all() and not events.filtered.any() and not events.non_finite.any()


def test_values_beyond_what_is_possible_are_those_at_the_limit(signals):
    acc, gyro, pwm = (s.copy() for s in signals)
    for over, at in ((70000.0, 65535.0), (-9.0, 0.0)):
        high, limited = pwm.copy(), pwm.copy()
        high[400, 2], limited[400, 2] = over, at
        beyond, at_limit = (edge_pipeline(acc, gyro, x, VEHICLE) for x in (high, limited))
        np.testing.assert_array_equal(beyond.band_power, at_limit.band_power)
        np.testing.assert_array_equal(beyond.force, at_limit.force)
    wild, limited = acc.copy(), acc.copy()
    wild[300, 0], limited[300, 0] = 50.0 * ACC_CLAMP, ACC_CLAMP
    np.testing.assert_array_equal(disturbance_force(wild, pwm, VEHICLE), disturbance_force(limited, pwm, VEHICLE))
    spun, slow = gyro.copy(), gyro.copy()
    spun[300, 1], slow[300, 1] = -50.0 * RATE_CLAMP, -RATE_CLAMP
    wide = MotionConfig(limit=1e12)
    np.testing.assert_array_equal(motion_channels(acc, spun, pwm, wide)[0], motion_channels(acc, slow, pwm, wide)[0])
    np.testing.assert_array_equal(edge_pipeline(acc, spun, pwm, VEHICLE).band_power,
                                  edge_pipeline(acc, slow, pwm, VEHICLE).band_power)


def test_single_precision_is_reckoned_in_double(signals):
    single = [s.astype(np.float32) for s in signals]
    double = [s.astype(np.float64) for s in single]
    for compute in (lambda a, g, p: disturbance_force(a, p, VEHICLE), lambda a, g, p: total_thrust(p, VEHICLE),
                    lambda a, g, p: force_norm(a), lambda a, g, p: band_power(a), lambda a, g, p: hold_power(a[:, 0]),
                    lambda a, g, p: edge_pipeline(a, g, p, VEHICLE).band_power):
        from_single, from_double = compute(*single), compute(*double)
        assert from_single.dtype == np.float64
        np.testing.assert_array_equal(from_single, from_double)


def test_a_battery_weakens_the_thrust_of_the_force(signals):
    acc, _, pwm = signals
    volts = 0.9 * VEHICLE.nominal_voltage_v
    full, sagging = (disturbance_force(acc, pwm, VEHICLE, vbat_v=v) for v in (None, volts))
    thrust = VEHICLE.thrust(pwm).sum(axis=1)
    np.testing.assert_allclose((sagging - full)[:, 2], (1.0 - 0.81) * thrust, rtol=1e-9)
    for v, share in ((1000.0, 4.0), (1001.0, 1.0), (0.11, 0.25), (0.09, 1.0)):
        np.testing.assert_allclose(total_thrust(pwm, VEHICLE, v), share * thrust)


def test_a_deviation_is_from_the_weighted_mean_before():
    x, tau = np.random.default_rng(2).normal(3.0, 1.0, 60), 7.0
    deviation = deviation_from_mean(x, tau)
    assert deviation[0] == 0.0 and deviation_from_mean(np.zeros(0), tau).shape == (0,)
    for i in range(1, 60):
        weight = np.exp(-np.arange(i - 1, -1, -1) / tau)
        assert deviation[i] == pytest.approx(x[i] - np.average(x[:i], weights=weight), abs=1e-9)
    for invalid_tau in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(AirTouchError, match="the time constant must be positive, not"):
            deviation_from_mean(x, invalid_tau)


def test_nothing_in_nothing_out():
    none = edge_pipeline(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 4)), VEHICLE)
    assert none.band_power.shape == (0, 9) and none.armed.shape == (0,) == none.alert.shape
    with pytest.raises(AirTouchError, match=r"^pipeline: needs \(n, 3\) accelerations, \(n, 3\) rates and \(n, 4\) PWM,"
                                            r" not \(2, 3\), \(2, 3\), \(2, 3\)$"):
        edge_pipeline(np.zeros((2, 3)), np.zeros((2, 3)), np.zeros((2, 3)), VEHICLE)


def test_a_window_is_a_whole_number_of_four_samples_or_more():
    assert band_bins(100.0, 4, (25.0, 50.0)) == (1, 2)
    for window in (3, 4.5, 50.5, 0, -8):
        with pytest.raises(AirTouchError, match="the window must be at least 4 samples"):
            band_bins(100.0, window, (25.0, 50.0))


def test_a_steady_value_has_no_power_in_any_channel():
    x = np.tile([1.0, 1e4, -3.0], (300, 1))
    assert np.nanmax(np.abs(band_power(x, hop=1))) < 1e-16


def test_gaps_before_the_first_cell_are_nothing():
    np.testing.assert_array_equal(hold_power([np.nan, 3.0, np.inf, -2.0, np.nan]), [0.0, 3.0, 3.0, 0.0, 0.0])
    np.testing.assert_array_equal(hold_power([5.0, np.nan, 2.0]), [5.0, 5.0, 2.0])


def test_replaced_samples_are_counted_as_they_come(signals):
    acc, gyro, pwm = (s[:200].copy() for s in signals)
    acc[20, 0], gyro[30, 1], pwm[30, 2] = np.nan, np.inf, np.nan
    events = edge_pipeline(acc, gyro, pwm, VEHICLE)
    assert [events.non_finite[i] for i in (0, 19, 20, 29, 30, 199)] == [0, 0, 1, 1, 3, 3]
    assert events.ready.dtype == bool


def test_limits_and_slow_clocks():
    assert hold_power([1e35, 1.0]).tolist() == [POWER_LIMIT, 1.0] == hold_power([1e35, 1.0, np.nan])[:2].tolist()
    assert band_bins(0.5, 10, (0.1, 0.2)) == (2, 4), "a sample every two seconds is a clock as well"
    single = [np.float32(x) for x in (np.full((50, 3), 0.1), np.full((50, 3), 0.1), np.full((50, 4), 40000.3))]
    for a, b in zip(motion_channels(*single), motion_channels(*map(np.float64, single)), strict=True):
        np.testing.assert_array_equal(a, b)
