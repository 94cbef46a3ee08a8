"""C equals NumPy over inputs that no flight has: constants, steps, NaN, infinities, denormals, PWM at its limits."""

from dataclasses import replace

import numpy as np
import pytest
from equality import EPS, RELATIVE, TINY, band_power_excess, same_alerts, worst
from hypothesis import given, settings
from hypothesis import strategies as st

import airtouch.kernels as kernels
import airtouch.reference as reference
from airtouch.errors import AirTouchError
from airtouch.parameters import DEFAULT
from airtouch.reference.fr_cfar import hold_power
from airtouch.vehicle import load

VEHICLE = replace(load("crazyflie-2.1-flow"), nominal_voltage_v=4.0)
SPECIAL = [np.nan, np.inf, -np.inf, 0.0, -0.0, 1e-45, -1e-40, 1.2e-38, 3.4e38, -3.4e38, 1e15, 65535.0, -1.0, 9.81]
checks = settings(max_examples=80, deadline=None, derandomize=True)


ROWS = st.integers(0, 700)


@st.composite
def signals(draw, columns, rows=ROWS):
    """(n, columns) float32: a constant, step, ramp, sine or noise a column, special values strewn over it."""
    n = draw(rows)
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    out = np.empty((n, columns))
    for c in range(columns):
        size = 10.0 ** draw(st.sampled_from([-44, -20, -6, -2, 0, 2, 5, 12]))
        t = np.arange(n)
        kind = draw(st.sampled_from(["constant", "step", "ramp", "sine", "noise", "offset noise", "pwm limits"]))
        out[:, c] = {
            "constant": np.full(n, size), "step": size * (t >= n // 2), "ramp": size * t,
            "sine": size * np.sin(0.43 * t), "noise": size * rng.normal(size=n),
            "offset noise": 1e4 * size + size * rng.normal(size=n), "pwm limits": rng.choice([0.0, 65535.0], size=n),
        }[kind]
    for _ in range(draw(st.sampled_from([0, 0, 1, 5, 40])) if n else 0):
        out[rng.integers(n), rng.integers(columns)] = SPECIAL[rng.integers(len(SPECIAL))]
    with np.errstate(over="ignore"):
        return out.astype(np.float32)


@checks
@given(signals(3), st.sampled_from([(200, (6.0, 8.0)), (32, (10.0, 30.0)), (31, (40.0, 50.0)), (4, (25.0, 50.0))]),
       st.sampled_from([1, 3, 250]))
def test_band_power_equals_the_reference(x, setting, hop):
    window, band = setting
    ours = kernels.band_power(x, window=window, band_hz=band, hop=hop)
    truth = reference.band_power(x, window=window, band_hz=band, hop=hop)
    assert ours.shape == truth.shape
    each_sample = reference.band_power(x, window=window, band_hz=band)
    full = kernels.band_power(x, window=window, band_hz=band)
    assert (np.isnan(full) == np.isnan(each_sample)).all()
    if len(x) >= window:
        np.testing.assert_array_equal(full[reference.window_ends(len(x), window, hop)],
                                      ours[np.isfinite(ours).all(axis=1)])
        clean, _ = reference.hold_finite(x)
        assert band_power_excess(full[window - 1:], each_sample[window - 1:], clean, window).max() <= 16.0


@checks
@given(signals(6, st.integers(0, 60)), st.sampled_from([(3, 3), (1, 2, 3), (6,), (1,) * 6]))
def test_cascaded_cross_spectrum_equals_the_reference(power, groups):
    truth = reference.cascaded_cross_spectrum(power, groups)
    ours = kernels.cascaded_cross_spectrum(power, groups)
    assert worst(ours, truth, np.where(np.isnan(truth), 1.0, truth + 1e-38)) <= RELATIVE


@checks
@given(signals(10), signals(4), st.booleans())
def test_disturbance_force_equals_the_reference(sensors, others, plain):
    n = min(len(sensors), len(others))
    acc, pwm = sensors[:n, :3], sensors[:n, 3:7]
    options = {} if plain else {"vbat_v": others[:n, 3], "thrust_axis": others[:n, :3]}
    truth = reference.disturbance_force(acc, pwm, VEHICLE, **options)
    ours = kernels.disturbance_force(acc, pwm, VEHICLE, **options)
    held_acc, _ = reference.hold_finite(acc)
    axis, _ = reference.hold_finite(others[:n, :3], initial=[0.0, 0.0, 1.0])
    thrust = reference.total_thrust(pwm, VEHICLE, options.get("vbat_v"))[:, None] * (1.0 if plain else np.abs(axis))
    scale = VEHICLE.mass_kg * np.abs(held_acc) + thrust + 1e-30  # products of denormals round coarsely
    with np.errstate(over="ignore"):
        representable = np.isfinite(np.float32(scale)) & np.isfinite(ours)
    assert (np.abs(ours - truth)[representable] / scale[representable]).max(initial=0.0) <= 8 * EPS


@checks
@given(signals(1), st.integers(0, 30), st.integers(1, 80), st.sampled_from([1e-6, 1e-2, 0.5, 1e-30]))
def test_fr_cfar_equals_the_reference(power, guard, leading, p_fa):
    cells = power[:, 0]
    setting = {"guard_cells": guard, "leading_window": leading, "p_fa": p_fa}
    (t_ours, a_ours), (t_truth, a_truth) = kernels.fr_cfar(cells, **setting), reference.fr_cfar(cells, **setting)
    assert worst(t_ours, t_truth, np.where(np.isnan(t_truth), 1.0, t_truth + 1e-37)) <= RELATIVE
    assert same_alerts(a_ours, a_truth, hold_power(cells), t_truth, 1e-37)


@checks
@given(signals(3, st.integers(1, 150)))
def test_z_score_window_equals_the_reference(window):
    truth = reference.z_score_window(window)
    assert worst(kernels.z_score_window(window), truth, np.maximum(1.0, np.abs(truth))) <= RELATIVE


@checks
@given(signals(3, st.integers(0, 400)), st.sampled_from([5.0, 100.0, 1000.0]))
def test_streaming_z_score_equals_the_reference(x, tau):
    truth = reference.streaming_z_score(x, tau)
    ours = kernels.streaming_z_score(x, tau)
    floor = (truth == 0) != (ours == 0)  # a deviation at the floor may count as zero in one of them
    assert worst(ours[~floor], truth[~floor], np.maximum(1.0, np.abs(truth[~floor]))) <= RELATIVE
    assert floor.sum() <= 3


@checks
@given(signals(10), st.sampled_from([1, 4]), st.sampled_from([{}, {"probability_entry": np.nan},
                                                              {"probability_exit": np.nan}]))
def test_edge_pipeline_equals_the_reference(sensors, hop, thresholds):
    acc, gyro, pwm = sensors[:, :3], sensors[:, 3:6], sensors[:, 6:]
    config = reference.EdgePipelineConfig(replace(DEFAULT, band_hop=hop, **thresholds))
    probability = np.float32(np.sin(np.arange(len(sensors)) / 30.0) / 2 + 0.5)
    ours, truth = (pipeline(acc, gyro, pwm, VEHICLE, probability=probability, config=config)
                   for pipeline in (kernels.edge_pipeline, reference.edge_pipeline))
    for name in ("ready", "armed", "non_finite"):
        np.testing.assert_array_equal(getattr(ours, name), getattr(truth, name))
    np.testing.assert_array_equal(ours.edge + 3 * ours.filtered > 0, truth.edge + 3 * truth.filtered > 0)
    for name in ("band_power", "features"):
        np.testing.assert_array_equal(np.isnan(getattr(ours, name)), np.isnan(getattr(truth, name)))
    assert np.isfinite(ours.force).all() and np.isfinite(ours.cfar_power).all()


@pytest.mark.parametrize("thresholds", [{"probability_entry": np.nan}, {"probability_exit": np.nan},
                                        {"probability_entry": np.nan, "probability_exit": np.nan}])
def test_a_threshold_that_is_no_number_is_never_reached(thresholds):
    config = reference.EdgePipelineConfig(replace(DEFAULT, **thresholds), physical_filter=False)
    signals = np.tile([0.0, 0.0, 9.81], (500, 1)), np.zeros((500, 3)), np.full((500, 4), 45000.0)
    probability = np.where(np.arange(500) // 100 % 2, 0.5, 0.9)
    ours, truth = (pipeline(*signals, VEHICLE, probability=probability, config=config)
                   for pipeline in (kernels.edge_pipeline, reference.edge_pipeline))
    np.testing.assert_array_equal(ours.edge, truth.edge)
    assert np.count_nonzero(truth.edge) == ("probability_entry" not in thresholds)


@pytest.mark.parametrize("p_fa", [0.0, 1e-40, 1.0, np.nan])
def test_a_probability_beyond_the_kernels_range_is_refused_by_both(p_fa):
    for module in (kernels, reference):
        with pytest.raises(AirTouchError, match="the probability of false alarm must be"):
            module.fr_cfar(np.ones(10), p_fa=p_fa)


def test_the_smallest_amplitude_told_from_nothing():
    """Denormal signals give zero power rather than noise."""
    assert (kernels.band_power(np.full((300, 1), 1e-44))[199:] == 0).all()
    assert TINY**2 < np.finfo(np.float32).tiny * 100
