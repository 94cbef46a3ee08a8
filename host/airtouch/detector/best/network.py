"""The network of `best` in float: arrays of weights, NumPy, Keras for training, TensorFlow over one window.

The graph is `Recipe.graph`; what each of its operations does is in `operations`.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from airtouch.detector.best.operations import OPERATIONS
from airtouch.detector.best.outputs import OUTPUTS
from airtouch.reference.networks.stream_graph import StreamLayer, follow

if TYPE_CHECKING:
    import keras

Graph = Sequence[StreamLayer]
Weights = Mapping[str, np.ndarray]  #: "<layer>.kernel" and "<layer>.bias" by `weight_shapes`, float32
#: names of a layer's arrays, in the order of Keras' variables
PARTS = ("kernel", "bias")


def weight_shapes(graph: Graph) -> dict[str, tuple[int, ...]]:
    """Name and shape of each float array: kernels as their operation has them, then biases (outputs,)."""
    return {f"{layer.name}.kernel": OPERATIONS[layer.operation].kernel_shape(layer) for layer in graph} | {
        f"{layer.name}.bias": (layer.outputs,) for layer in graph}


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

    start = keras.initializers.Constant([output.start_bias for output in OUTPUTS])

    def apply(layer: StreamLayer, x: Any) -> Any:
        options = {"bias_initializer": start} if layer is graph[-1] else {}
        return OPERATIONS[layer.operation].keras(layer, **options)(x)

    inputs = keras.Input((None, graph[0].inputs))
    return keras.Model(inputs, follow(graph, inputs, apply, join))


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
    """Kernel and bias of a layer."""
    kernel, bias = (weights[f"{layer.name}.{part}"] for part in PARTS)
    return kernel, bias
