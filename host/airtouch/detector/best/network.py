"""The network of `best` in float: what each operation of its graph is in NumPy, in Keras and over one window.

The graph itself is `Recipe.graph`; `reference.stream_int8` has the same operations in int8.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from airtouch.detector.best.outputs import OUTPUTS
from airtouch.reference.stream_graph import CONV, HEAD, StreamLayer, follow, taps_of

if TYPE_CHECKING:
    import keras

Graph = Sequence[StreamLayer]
Weights = Mapping[str, np.ndarray]  #: "<layer>.kernel" (taps, inputs, outputs) and "<layer>.bias" (outputs,), float32
#: names of a layer's arrays, in the order of Keras' variables
PARTS = ("kernel", "bias")


@dataclass(frozen=True)
class Operation:
    """What one operation is in float.

    rows(layer, kernel, bias, x): NumPy, a row of output for each row of input. keras(layer): a new Keras layer.
    window(layer, kernel, bias, x): TensorFlow, over a window (1, 1, rows, inputs) without a past. All without ReLU but
    `keras`, whose layer has it.
    """

    rows: Callable[[StreamLayer, np.ndarray, np.ndarray, np.ndarray], np.ndarray]
    keras: Callable[[StreamLayer], "keras.Layer"]
    window: Callable[[StreamLayer, np.ndarray, np.ndarray, Any], Any]


def weight_shapes(graph: Graph) -> dict[str, tuple[int, ...]]:
    """Name and shape of each float array: kernels (taps, inputs, outputs), then biases (outputs,)."""
    return {f"{layer.name}.kernel": layer.shape for layer in graph} | {
        f"{layer.name}.bias": layer.shape[-1:] for layer in graph}


def weight_names(graph: Graph) -> list[str]:
    """The float arrays' names in the order of the Keras model's variables."""
    return [f"{layer.name}.{part}" for layer in graph for part in PARTS]


def float_logits(weights: Weights, graph: Graph, x: np.ndarray) -> np.ndarray:
    """Logits (ceil(n / stride), outputs) of channels (n, channels) float; before the first sample lie zeros."""
    def apply(layer: StreamLayer, x: np.ndarray) -> np.ndarray:
        kernel, bias = _arrays(weights, layer)
        y = OPERATIONS[layer.operation].rows(layer, kernel, bias, x)
        return (np.maximum(y, 0.0) if layer.relu else y)[::layer.stride]

    return follow(graph, np.asarray(x, dtype=np.float64), apply, np.hstack)


def keras_model(graph: Graph) -> "keras.Model":
    """Keras model: (batch, samples, channels) -> logits (batch, samples / stride, outputs), causal."""
    import keras

    def join(parts: list) -> Any:
        return keras.layers.Concatenate()(parts)

    inputs = keras.Input((None, graph[0].inputs))
    return keras.Model(inputs, follow(graph, inputs, lambda layer, x: OPERATIONS[layer.operation].keras(layer)(x),
                                      join))


def window_logits(weights: Weights, graph: Graph) -> Callable[[Any], Any]:
    """TensorFlow function of a window (1, 1, samples, channels): its last row of logits, (1, 1, 1, outputs)."""
    import tensorflow as tf

    def apply(layer: StreamLayer, x: Any) -> Any:
        kernel, bias = _arrays(weights, layer)
        y = OPERATIONS[layer.operation].window(layer, kernel, bias, x)
        return tf.nn.relu(y) if layer.relu else y

    def join(parts: list) -> Any:
        return tf.concat([part[:, :, -1:, :] for part in parts], -1)

    return lambda x: follow(graph, x, apply, join)


def _arrays(weights: Weights, layer: StreamLayer) -> tuple[np.ndarray, np.ndarray]:
    kernel, bias = (weights[f"{layer.name}.{part}"] for part in PARTS)
    return kernel, bias


def _conv_rows(layer: StreamLayer, kernel: np.ndarray, bias: np.ndarray, x: np.ndarray) -> np.ndarray:
    return sum(rows @ values for rows, values in zip(taps_of(layer, x, 0.0), kernel, strict=True)) + bias


def _conv_keras(layer: StreamLayer) -> "keras.Layer":
    import keras

    return keras.layers.Conv1D(layer.outputs, layer.taps, strides=layer.stride, dilation_rate=layer.dilation,
                               padding="causal", activation="relu" if layer.relu else None)


def _conv_window(layer: StreamLayer, kernel: np.ndarray, bias: np.ndarray, x: Any) -> Any:
    import tensorflow as tf

    return tf.nn.conv2d(x, kernel[None], (1, layer.stride), "VALID", dilations=(1, layer.dilation)) + bias


def _head_rows(layer: StreamLayer, kernel: np.ndarray, bias: np.ndarray, x: np.ndarray) -> np.ndarray:
    return x @ kernel.reshape(-1, layer.outputs) + bias


def _head_keras(layer: StreamLayer) -> "keras.Layer":
    import keras

    start = keras.initializers.Constant([output.start_bias for output in OUTPUTS])
    return keras.layers.Dense(layer.outputs, activation="relu" if layer.relu else None, bias_initializer=start)


def _head_window(layer: StreamLayer, kernel: np.ndarray, bias: np.ndarray, x: Any) -> Any:
    import tensorflow as tf

    return tf.nn.conv2d(x, kernel.reshape(1, 1, -1, layer.outputs), 1, "VALID") + bias


OPERATIONS = {CONV: Operation(_conv_rows, _conv_keras, _conv_window),
              HEAD: Operation(_head_rows, _head_keras, _head_window)}
