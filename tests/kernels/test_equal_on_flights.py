"""C equals NumPy over every recorded flight; run with -s for the figures."""

import numpy as np
import pytest
from equality import (
    EPS,
    RELATIVE,
    band_power_excess,
    deviation_power,
    same_alerts,
    worst,
)
from numpy.lib.stride_tricks import sliding_window_view

import airtouch.kernels as kernels
import airtouch.reference as reference
from airtouch.vehicle import load

VEHICLE = load("crazyflie-2.1-flow")


def test_band_power_equals_the_reference(real_signals):
    relative, excess, rows = [], 0.0, []
    for flight in real_signals:
        ours = kernels.band_power(flight.channels)[199:].astype(np.float64)
        truth = reference.band_power(flight.channels)[199:]
        excess = max(excess, band_power_excess(ours, truth, flight.channels, 200).max())
        with np.errstate(invalid="ignore", divide="ignore"):
            relative.append(np.where(truth == ours, 0.0, np.abs(ours - truth) / truth).ravel())
        rows.append((truth > 1e-5 * deviation_power(flight.channels, 200)).ravel())
    relative, clear = np.concatenate(relative), np.concatenate(rows)
    print(f"\nband power, {len(real_signals)} flights, {relative.size} outputs: relative error median "
          f"{np.median(relative):.1e}, 99.9 % {np.quantile(relative, 0.999):.1e}, max {relative.max():.1e}; "
          f"{relative[clear].max():.1e} where the band holds over 1e-5 of the window's variance "
          f"({clear.mean():.1%}); {np.sum(relative > RELATIVE)} outputs over 1e-5; "
          f"beyond it at most {excess:.2g} eps of the window's spread")
    assert relative[clear].max() <= RELATIVE
    assert np.mean(relative > RELATIVE) < 1e-3
    assert excess <= 2.0


def test_cascaded_cross_spectrum_equals_the_reference(real_signals):
    error = 0.0
    for flight in real_signals:
        power = kernels.band_power(flight.channels)[199:]
        truth = reference.cascaded_cross_spectrum(power)
        error = max(error, worst(kernels.cascaded_cross_spectrum(power), truth, np.maximum(truth, 1e-37)))
    print(f"\ncascaded cross-spectrum: max relative error {error:.1e}")
    assert error <= RELATIVE


def test_disturbance_force_equals_the_reference(real_signals):
    error = relative = 0.0
    for flight in real_signals:
        truth = reference.disturbance_force(flight.acc, flight.pwm, VEHICLE, thrust_axis=flight.thrust_axis)
        ours = kernels.disturbance_force(flight.acc, flight.pwm, VEHICLE, thrust_axis=flight.thrust_axis)
        terms = _terms(flight)[:, None]
        error = max(error, worst(ours, truth, np.maximum(terms, 1e-9)))
        relative = max(relative, worst(reference.force_norm(ours), reference.force_norm(truth),
                                       np.maximum(reference.force_norm(truth), 1e-9)))
    print(f"\ndisturbance force: max error {error / EPS:.2g} eps of m |a - g| + Psi; of the norm {relative:.1e} "
          "relative")
    assert error <= 4 * EPS < RELATIVE


def test_fr_cfar_equals_the_reference(real_signals):
    error = 0.0
    for flight in real_signals:
        power = np.square(kernels.disturbance_force(flight.acc, flight.pwm, VEHICLE)[:, 2])
        (t_ours, a_ours), (t_truth, a_truth) = kernels.fr_cfar(power), reference.fr_cfar(power)
        error = max(error, worst(t_ours, t_truth, t_truth))
        assert same_alerts(a_ours, a_truth, power, t_truth)
    print(f"\nFR-CFAR: max relative error of the threshold {error:.1e}")
    assert error <= RELATIVE


def test_normalisation_equals_the_reference(real_signals):
    per_window = streaming = 0.0
    for flight in real_signals:
        features = kernels.cascaded_cross_spectrum(kernels.band_power(flight.channels))
        windows = sliding_window_view(features[199:], 100, axis=0)[::50].transpose(0, 2, 1)
        truth = reference.z_score_window(windows)
        per_window = max(per_window, worst(kernels.z_score_window(windows), truth, np.maximum(1, np.abs(truth))))
        truth = reference.streaming_z_score(features, 500.0)
        streaming = max(streaming,
                        worst(kernels.streaming_z_score(features, 500.0), truth, np.maximum(1, np.abs(truth))))
    print(f"\nz-score: max error {per_window:.1e} a window, {streaming:.1e} streaming, in standard deviations")
    assert per_window <= RELATIVE and streaming <= RELATIVE


@pytest.mark.parametrize("cfar_input, step", [("deviation", 1), ("norm", 8)])
def test_edge_pipeline_equals_the_reference(real_signals, cfar_input, step):
    config = reference.EdgePipelineConfig(cfar_input=cfar_input)
    edges = alerts = 0
    for flight in real_signals[::step]:
        probability = np.float32(np.sin(np.arange(len(flight.acc)) / 80.0) / 2 + 0.5)
        ours, truth = (
            pipeline(flight.acc, flight.gyro, flight.pwm, VEHICLE, thrust_axis=flight.thrust_axis,
                     probability=probability, config=config)
            for pipeline in (kernels.edge_pipeline, reference.edge_pipeline)
        )
        resolution = 16 * EPS * _terms(flight)
        if cfar_input == "deviation":
            assert worst(np.sqrt(ours.cfar_power), np.sqrt(truth.cfar_power), resolution + 1e-12) <= 1.0
            resolution = resolution * (2 * np.sqrt(truth.cfar_power) + resolution)
        assert same_alerts(ours.alert, truth.alert, truth.cfar_power, truth.threshold, 20 * resolution)
        for name in ("ready", "edge", "filtered", "armed", "non_finite", "alert_recent"):
            np.testing.assert_array_equal(getattr(ours, name), getattr(truth, name), err_msg=f"{flight.name}: {name}")
        edges, alerts = edges + np.count_nonzero(ours.edge), alerts + ours.alert.sum()
    print(f"\npipeline, {cfar_input}: {edges} edges and {alerts} alerts agree on {len(real_signals[::step])} flights")


def _terms(flight):
    """m |a - g| + Psi, newtons: what the force is the difference of."""
    return (VEHICLE.mass_kg * np.abs(flight.acc).max(axis=1).astype(np.float64)
            + reference.total_thrust(flight.pwm, VEHICLE))
