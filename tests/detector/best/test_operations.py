"""Every operation: NumPy, Keras, the window and int8 are one function; a convolution is SciPy's filter."""

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from airtouch.detector.best import operations
from airtouch.detector.best.operations import CAUSAL_CONV, HEAD
from airtouch.reference.networks.int8_network import Int8Layer, requantise
from airtouch.reference.networks.stream_graph import StreamLayer, taps_of
from airtouch.reference.networks.stream_int8 import int8_layer
from skips import needs

ROWS, WIDTH = 40, 4
PAGE = Path(__file__).parents[3] / "host/docs/change-the-network.md"


def of_the_page():
    """The operation that the page adds, as its reader has it in `operations`."""
    (code,) = re.findall(r"```python\n(DEPTHWISE = .*?)```", PAGE.read_text(encoding="utf-8"), re.S)
    scope = {**vars(operations), "Int8Layer": Int8Layer, "requantise": requantise}
    exec(code, scope)
    return {scope["DEPTHWISE"]: scope["DEPTHWISE_OPERATION"]}


OPERATIONS = operations.OPERATIONS | of_the_page()


def case(name):
    """A layer of this operation that keeps the width, its random kernel and bias, and an input (rows, inputs)."""
    rng = np.random.default_rng(5)
    layer = StreamLayer("made", name, 3, WIDTH, WIDTH, dilation=1 if name == HEAD else 2, relu=False,
                        reads=(0, 1, 2) if name == HEAD else ())
    inputs = WIDTH * (len(layer.reads) or 1)
    kernel = rng.normal(size=OPERATIONS[name].kernel_shape(layer)).astype(np.float32)
    return layer, kernel, rng.normal(size=WIDTH).astype(np.float32), rng.normal(size=(ROWS, inputs)).astype(np.float32)


def test_a_convolution_is_a_filter_of_each_channel_added_up():
    layer, kernel, bias, x = case(CAUSAL_CONV)
    taps = np.zeros((2 * layer.dilation + 1, WIDTH, WIDTH))
    taps[::layer.dilation] = kernel[::-1]  # newest first
    true = sum(np.column_stack([lfilter(taps[:, i, o], 1.0, x[:, i]) for o in range(WIDTH)]) for i in range(WIDTH))
    np.testing.assert_allclose(OPERATIONS[CAUSAL_CONV].rows(layer, kernel, bias, x), true + bias, atol=1e-5)


@needs("tensorflow")
@pytest.mark.parametrize("name", OPERATIONS)
def test_keras_and_numpy_agree(name):
    import keras

    layer, kernel, bias, x = case(name)
    inputs = keras.Input((None, x.shape[1]))
    of = OPERATIONS[name].keras(layer)
    model = keras.Model(inputs, of(inputs))
    of.set_weights([kernel.reshape(of.get_weights()[0].shape), bias])
    np.testing.assert_allclose(np.asarray(model(x[None]))[0], OPERATIONS[name].rows(layer, kernel, bias, x), atol=1e-5)


@needs("tensorflow")
@pytest.mark.parametrize("name", OPERATIONS)
def test_the_window_is_what_needs_no_past(name):
    layer, kernel, bias, x = case(name)
    y = np.asarray(OPERATIONS[name].window(layer, kernel, bias, x[None, None]))[0, 0]
    np.testing.assert_allclose(y, OPERATIONS[name].rows(layer, kernel, bias, x)[-len(y):], atol=1e-5)
    assert len(y) == ROWS - (0 if name == HEAD else (layer.taps - 1) * layer.dilation)


@pytest.mark.parametrize("name", OPERATIONS)
def test_int8_is_the_float_operation_to_a_step_of_its_output(name):
    """Inputs and weights that int8 holds exactly: the only difference is the rounding of the output."""
    layer, kernel, _, x = case(name)
    weights = np.clip(np.round(40 * kernel), -127, 127)
    q = np.clip(np.round(30 * x), -128, 127).astype(np.int8)
    int8 = int8_layer(layer, OPERATIONS[name].kind, {
        "weights": np.moveaxis(weights, -1, 0).astype(np.int8), "bias": np.zeros(WIDTH, np.int32),
        "weight_scale": np.full(WIDTH, 0.01, np.float32), "scale": np.array([0.02, 0.25], np.float32),
        "zero_point": np.zeros(2, np.int32)})
    patches = q if layer.reads else np.hstack(taps_of(layer, q, 0))
    output = 0.25 * OPERATIONS[name].kind.run(int8, patches).reshape(ROWS, WIDTH)
    true = OPERATIONS[name].rows(layer, 0.01 * weights, np.zeros(WIDTH), 0.02 * q)
    assert np.abs(output - np.clip(true, -32.0, 31.75)).max() <= 0.126
