"""The struct that flies: its size, its speed, its recovery, and that it joins the kernels and nothing else."""

import time
from pathlib import Path

import numpy as np
import pytest

import airtouch.kernels as kernels
from airtouch.errors import AirTouchError
from airtouch.kernels.edge_pipeline import MOST_BINS
from airtouch.kernels.library import ffi
from airtouch.parameters import DEFAULT, Parameters
from airtouch.reference import EdgePipelineConfig
from airtouch.vehicle import load

VEHICLE = load("crazyflie-2.1-flow")


def hover(n=2000, seed=0):
    rng = np.random.default_rng(seed)
    pwm = 48000 + rng.normal(0, 300, (n, 4))
    acc = rng.normal(0, 0.05, (n, 3)) + [0, 0, 9.81]
    return [np.float32(a) for a in (acc, rng.normal(0, 0.05, (n, 3)), pwm)]


def test_ram_of_the_whole_pipeline():
    size = kernels.pipeline_ram_bytes()
    print(f"\nRAM of the whole 9-channel pipeline: {size} bytes, pointers of {ffi.sizeof('void *')} bytes")
    assert size <= 12_000


def test_a_flight_is_one_quick_call():
    signals = hover(4000)
    start = time.process_time()  # not the wall's: other programs may run
    kernels.edge_pipeline(*signals, VEHICLE)
    took = time.process_time() - start
    print(f"\n40 s of flight through the pipeline: {took * 1e3:.1f} ms")
    assert took < 1.0


def test_its_parts_are_the_kernels():
    acc, gyro, pwm = hover()
    events = kernels.edge_pipeline(acc, gyro, pwm, VEHICLE)
    power = kernels.band_power(np.column_stack([acc, gyro, pwm[:, 1:] - pwm[:, :1]]))
    np.testing.assert_array_equal(events.band_power, power)
    np.testing.assert_array_equal(events.features, kernels.cascaded_cross_spectrum(power))
    np.testing.assert_array_equal(events.force, kernels.disturbance_force(acc, pwm, VEHICLE))
    threshold, alert = kernels.fr_cfar(events.cfar_power)
    np.testing.assert_array_equal(events.threshold, threshold)
    np.testing.assert_array_equal(events.alert, alert)


@pytest.mark.parametrize("poison", [np.nan, np.inf, -np.inf, 3e38, 1e-45])
def test_recovers_from_any_value_within_two_windows(poison):
    clean, dirty = hover(), hover()
    for signal in dirty:
        signal[500:520] = poison
    ours = kernels.edge_pipeline(*dirty, VEHICLE)
    truth = kernels.edge_pipeline(*clean, VEHICLE)
    settled = slice(520 + 2 * DEFAULT.band_window, None)
    np.testing.assert_allclose(ours.features[settled], truth.features[settled], rtol=1e-5)
    np.testing.assert_array_equal(ours.force[settled], truth.force[settled])
    assert np.isfinite(ours.band_power[199:]).all() and np.isfinite(ours.threshold[65:]).all()
    assert ours.non_finite[-1] == (0 if np.isfinite(poison) else 20 * 10)


@pytest.mark.parametrize("parameters", [
    Parameters(band_window=256), Parameters(band_high_hz=9.0), Parameters(leading_window=51),
    Parameters(force_mean_samples=0.0), Parameters(band_hop=0), Parameters(alert_hold=-1), Parameters(p_fa=2.0),
])
def test_settings_beyond_the_build_are_refused(parameters):
    with pytest.raises(AirTouchError):
        kernels.edge_pipeline(*hover(10), VEHICLE, config=EdgePipelineConfig(parameters))


def test_a_refusal_names_the_rooms_of_the_header():
    header = (Path(__file__).parents[2] / "firmware/kernels/edge_pipeline.h").read_text()
    assert f"#define EDGE_PIPELINE_MAX_BINS {MOST_BINS}\n" in header
    assert "EDGE_PIPELINE_MAX_WINDOW AIRTOUCH_BAND_WINDOW\n" in header
    assert "EDGE_PIPELINE_MAX_CELLS (AIRTOUCH_LEADING_WINDOW + AIRTOUCH_GUARD_CELLS)\n" in header
