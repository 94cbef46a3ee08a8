"""C, NumPy and tflite-micro give the same bits; float C and Keras the same numbers."""

import math
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from airtouch import kernels, logs
from airtouch.detector.evaluation.data.dataset import collect
from airtouch.detector.paper import model as model_file
from airtouch.detector.paper import network
from airtouch.detector.paper.features import flight_features
from airtouch.errors import AirTouchError
from airtouch.kernels import network as c_network
from airtouch.reference.networks import int8_network
from small_model import random_model, random_weights, random_windows

WINDOWS = 5200


@pytest.fixture(scope="module")
def real_windows(flights: Path) -> np.ndarray:
    """(n, 100, 3), every eighth window of clean flights until there are enough, of every height."""
    windows: list[np.ndarray] = []
    for file in collect([flights / "airtouch"])[::3]:
        fused = flight_features(logs.read(file.path)).fused
        ends = [i for i in range(99, len(fused), 8) if np.isfinite(fused[i - 99:i + 1]).all()]
        windows.append(kernels.z_score_window(np.stack([fused[i - 99:i + 1] for i in ends])))
        if sum(map(len, windows)) >= WINDOWS:
            break
    return np.concatenate(windows)[:WINDOWS]


def tflite_micro(content: bytes, quantised: np.ndarray) -> np.ndarray:
    from tflite_micro import runtime

    interpreter = runtime.Interpreter.from_bytes(content)
    out = []
    for window in quantised.reshape(-1, 1, *network.INPUT_SHAPE):
        interpreter.set_input(window, 0)
        interpreter.invoke()
        out.append(interpreter.get_output(0)[0].copy())
    return np.array(out)


def quantised_of(model: model_file.Model, windows: np.ndarray) -> np.ndarray:
    first = model.int8.layers[0]
    return int8_network.quantise(windows, first.input_scale, first.input_zero_point)


def test_real_windows_equal_tflite_micro_to_the_last_bit(real_windows: np.ndarray) -> None:
    assert len(real_windows) >= 5000
    model = model_file.load()
    quantised = quantised_of(model, real_windows)
    expected = tflite_micro(model.tflite, quantised)
    assert len(np.unique(expected, axis=0)) > 100
    np.testing.assert_array_equal(int8_network.run(model.int8, quantised), expected)
    np.testing.assert_array_equal(c_network.run_int8(model.int8, quantised), expected)
    np.testing.assert_array_equal(c_network.infer_int8(model, real_windows), expected)


@pytest.mark.parametrize("sparsity", [0.0, 0.8, 0.995])
def test_made_up_networks_equal_tflite_micro_to_the_last_bit(sparsity: float) -> None:
    model = random_model(seed=3, sparsity=sparsity)
    noise = np.random.default_rng(1).integers(-128, 128, size=(200, 300), dtype=np.int8)
    extreme = np.array([[-128] * 300, [127] * 300, [-128, 127] * 150], dtype=np.int8)
    quantised = np.concatenate([quantised_of(model, random_windows(300)).reshape(300, -1), noise, extreme])
    expected = tflite_micro(model.tflite, quantised)
    np.testing.assert_array_equal(int8_network.run(model.int8, quantised), expected)
    np.testing.assert_array_equal(c_network.run_int8(model.int8, quantised), expected)


def test_float_c_is_within_1e_5_of_keras() -> None:
    import keras

    weights, windows = random_weights(5), random_windows(500)
    model = network.build_keras()
    network.set_weights_of_keras(model, weights)
    expected = keras.ops.convert_to_numpy(model(windows[..., None]))
    logits = c_network.infer_float(network.float_layers(weights), windows)
    np.testing.assert_allclose(logits, expected, rtol=0, atol=1e-5)
    assert np.abs(expected).max() > 0.5


def test_a_flight_in_one_call_is_every_window_by_itself() -> None:
    model = random_model(seed=2, sparsity=0.8)
    features = np.random.default_rng(0).gamma(1.0, 1e6, size=(400, 3)).astype(np.float32)
    features[:50] = np.nan
    features[250, 1] = np.inf
    probability = c_network.probability_of_flight(model, features)
    answered = np.zeros(400, bool)
    answered[149:250] = answered[350:] = True
    np.testing.assert_array_equal(np.isfinite(probability), answered)
    windows = np.stack([features[i - 99:i + 1] for i in np.flatnonzero(answered)])
    expected = c_network.probability(model, kernels.z_score_window(windows))
    np.testing.assert_array_equal(probability[answered], expected)


def test_probability_is_the_softmax_of_the_logits() -> None:
    from scipy.special import softmax

    model = random_model()
    windows = random_windows(50)
    logits = c_network.infer_int8(model, windows).astype(float) * model.int8.layers[-1].output_scale
    expected = softmax(logits, axis=1)[:, 1]
    np.testing.assert_allclose(c_network.probability(model, windows), expected, rtol=1e-12)


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 6), st.integers(1, 700), st.floats(0, 1), st.integers(0, 1000))
def test_blocks_of_four_give_back_the_weights(outputs: int, blocks: int, density: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    weights = rng.integers(-127, 128, size=(outputs, blocks, 4)).astype(np.int8)
    weights[rng.random((outputs, blocks)) > density] = 0
    values, counts, skips = int8_network.sparse_blocks(weights.reshape(outputs, -1))
    restored, at = np.zeros_like(weights), 0
    for output, count in enumerate(counts):
        place = 0
        for _ in range(count):
            place += int(skips[at])
            restored[output, place] = values[at]
            place, at = place + 1, at + 1
    assert at == len(values)
    np.testing.assert_array_equal(restored, weights)


@settings(max_examples=200, deadline=None)
@given(st.integers(-2**31, 2**31 - 1), st.integers(2**30, 2**31 - 1), st.integers(0, 31))
def test_requantise_rounds_twice(accumulator: int, mantissa: int, exponent: int) -> None:
    product = math.floor(Fraction(accumulator * mantissa, 2**31) + Fraction(1, 2))
    away = math.floor(abs(Fraction(product, 2**exponent)) + Fraction(1, 2))
    high = int8_network.rounding_doubling_high_multiply(
        np.array(accumulator, np.int32), np.array(mantissa, np.int32))
    rounded = int8_network.rounding_shift_right(high, np.array(exponent))
    assert int(rounded) == (-away if product < 0 else away)


@settings(max_examples=100, deadline=None)
@given(st.floats(1e-6, 60.0))
def test_a_multiplier_is_its_real_value_to_31_bits(real: float) -> None:
    mantissa, exponent = int8_network.quantised_multiplier(np.array([real]))
    assert 2**30 <= int(mantissa[0]) < 2**31
    assert abs(float(mantissa[0]) * 2.0 ** (int(exponent[0]) - 31) / real - 1) <= 2.0**-31


def test_windows_of_another_shape_are_refused() -> None:
    model = random_model()
    with pytest.raises(AirTouchError, match="needs windows"):
        c_network.infer_int8(model, np.zeros((4, 50, 3), np.float32))
    with pytest.raises(AirTouchError, match="needs features"):
        c_network.probability_of_flight(model, np.zeros((400, 4), np.float32))


def test_a_network_without_weights_runs() -> None:
    """A pool alone: the largest of each two."""
    shape = int8_network.Int8Layer(int8_network.MAX_POOL, (4, 1, 1), (2, 1, 1), (2, 1), 1.0, 0, 1.0, 0)
    inputs = np.array([[3, -5, -7, -2], [1, 2, 3, 4]], np.int8)
    assert c_network.run_int8(int8_network.Int8Network((shape,)), inputs).tolist() == [[3, -2], [2, 4]]
