"""`paper-stream`: its file, its answers against whole windows, and its training."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import short_flights
from airtouch import logs
from airtouch.detector import paper
from airtouch.detector.evaluation.data.dataset import collect
from airtouch.detector.paper import model as model_file
from airtouch.detector.paper import normalisation, rolling
from airtouch.detector.paper.features import feature_windows, flight_features
from airtouch.errors import AirTouchError
from airtouch.kernels.network import infer_float
from airtouch.kernels.rolling import rolling_size
from airtouch.reference.networks import int8_network
from detector.paper.test_training import made_flight


@pytest.fixture(scope="module")
def model():
    return rolling.load(None)


def test_a_real_flight_has_the_answers_of_its_windows(model, flights: Path):
    log = logs.read(collect([flights / "airtouch"])[5].path)
    probability = rolling.run(log, model).probability
    windows, ends = feature_windows(flight_features(log).fused, 100, model.scale)
    logits = int8_network.infer_int8(model.int8, windows).astype(float) * model.int8.layers[-1].output_scale
    of_window = dict(zip(ends, 1 / (1 + np.exp(logits[:, 0] - logits[:, 1])), strict=True))
    stride, ahead = paper.stride(model), rolling_size(model.int8, 4).ahead
    first = int(np.flatnonzero(np.isfinite(probability))[0])
    answers = [i for i in range(first, len(log), stride) if i + ahead in of_window]
    assert len(answers) > 200
    # The logarithm is a float series in C and exact here: an input on a rounding edge may differ by one step.
    differences = np.array([probability[i] - of_window[i + ahead] for i in answers])
    assert (differences == 0).mean() > 0.9 and np.abs(differences).max() < 0.15


def test_in_float_it_answers_when_it_does_in_int8_of_the_same_windows(model):
    """So that only quantisation tells the two apart: the float network over the window of each int8 answer."""
    log = short_flights.fly(1)[0]
    log = log.with_columns({"gyro_x_radps": np.where(np.arange(len(log)) == 700, np.nan, log["gyro_x_radps"])})
    quantised, in_float = rolling.run(log, model).probability, rolling.run_float(log, model).probability
    np.testing.assert_array_equal(np.isnan(quantised), np.isnan(in_float))
    windows, ends = feature_windows(flight_features(log).fused, 100, model.scale)
    logits = infer_float(model.float_layers, windows).astype(float)
    of_window = dict(zip(ends, 1 / (1 + np.exp(logits[:, 0] - logits[:, 1])), strict=True))
    first = int(np.flatnonzero(np.isfinite(quantised))[0])
    answers = np.arange(first, len(log) - 2, 4)
    np.testing.assert_allclose(in_float[answers], [of_window[i + 2] for i in answers], rtol=1e-6)
    assert all(np.ptp(in_float[i:i + 4]) == 0.0 for i in answers)


def test_the_scale_belongs_to_the_file_and_to_the_digest(model, tmp_path: Path):
    model.save(tmp_path / "m.npz")
    reloaded = rolling.load(tmp_path / "m.npz")
    assert reloaded.to_bytes() == model.to_bytes() and reloaded.digest == model.digest
    other = replace(model, scale=normalisation.FixedScale(model.scale.mean + 1, model.scale.deviation))
    assert other.digest != model.digest


def test_a_file_with_a_bad_scale_is_refused(model, tmp_path: Path):
    for scale in (normalisation.FixedScale(model.scale.mean * np.nan, model.scale.deviation),
                  normalisation.FixedScale(model.scale.mean, model.scale.deviation * 0)):
        replace(model, scale=scale).save(tmp_path / "m.npz", force=True)
        with pytest.raises(AirTouchError, match="not finite|must be positive"):
            rolling.load(tmp_path / "m.npz")
    with pytest.raises(AirTouchError, match="stride"):
        paper.stride(replace(model, metadata={**model.metadata, "stride": "4"}))


def test_the_papers_own_model_cannot_run_as_a_stream(tmp_path: Path):
    model_file.load().save(tmp_path / "m.npz")
    with pytest.raises(AirTouchError, match="cannot run as a stream"):
        rolling.load(tmp_path / "m.npz")


def test_the_shipped_network_keeps_its_goals(model):
    costs = rolling.parameters(model)
    assert costs["mac_per_sample"] <= 10_000 and costs["parameter_bytes"] <= 13_000
    assert costs["mac_per_sample"] < int8_network.rolling_multiplications(model.int8, 1) <= 10_000
    assert int8_network.multiplications(model.int8) > 20 * costs["mac_per_sample"]


def test_a_scale_needs_features():
    with pytest.raises(AirTouchError, match="no flight holds"):
        normalisation.fit([np.full((10, 3), np.nan)])
    scale = normalisation.fit([np.array([[1.0, 2.0, 4.0], [4.0, 2.0, 4.0]])])
    np.testing.assert_allclose(scale.mean, [1, 1, 2])
    np.testing.assert_allclose(scale.apply(np.array([[4.0, 2.0, np.inf]])), [[1, 0, np.nan]])


@pytest.mark.slow
def test_training_prunes_both_layers():
    pytest.importorskip("tensorflow", reason="training needs the extra 'train'")
    flights = [made_flight(seed, 700) for seed in range(4)]
    trained = rolling.fit(flights, epochs=2, sparsity=0.9, conv_sparsity=0.5)
    for name, share in (("dense1", 0.9), ("conv2", 0.5)):
        kernel = trained.weights[f"{name}.kernel"]
        assert (kernel == 0).mean() == pytest.approx(share, abs=2e-3)
        blocks = (kernel != 0).reshape(-1, 4, kernel.shape[-1])
        assert blocks.any(axis=1).mean() == pytest.approx(1 - share, abs=2e-3)
    assert np.isfinite(rolling.run(flights[0], trained).probability).any()
