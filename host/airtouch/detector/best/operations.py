"""The operations of the network of `best`: each in NumPy, in Keras, in TensorFlow over a window, and its int8 kernel.

host/docs/change-the-network.md says how to add one.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from airtouch.reference.networks.int8_network import DENSE, LayerKind
from airtouch.reference.networks.stream_graph import StreamLayer, taps_of

if TYPE_CHECKING:
    import keras

CAUSAL_CONV = "conv"  #: causal convolution: row t reads rows t, t - dilation, t - 2 dilation, ... of the layer before
HEAD = "head"  #: dense layer: row t reads row t of several layers


@dataclass(frozen=True)
class Operation:
    """One operation in all its forms.

    kind: the int8 arithmetic, also in C; DENSE multiplies the rows that a layer reads with weights.
    kernel_shape(layer): shape of its float weights; the last axis is the outputs. rows(layer, kernel, bias, x): float
    NumPy, a row of output for each row of input. keras(layer, **options): a new Keras layer. window(layer, kernel,
    bias, x): TensorFlow, over a window (1, 1, rows, inputs) without a past. Only `keras` includes ReLU; only `keras`
    and `window` include the stride.
    """

    kind: LayerKind
    kernel_shape: Callable[[StreamLayer], tuple[int, ...]]
    rows: Callable[[StreamLayer, np.ndarray, np.ndarray, np.ndarray], np.ndarray]
    keras: Callable[..., "keras.Layer"]
    window: Callable[[StreamLayer, np.ndarray, np.ndarray, Any], Any]


def _conv_rows(layer: StreamLayer, kernel: np.ndarray, bias: np.ndarray, x: np.ndarray) -> np.ndarray:
    return sum(rows @ values for rows, values in zip(taps_of(layer, x, 0.0), kernel, strict=True)) + bias


def _conv_keras(layer: StreamLayer, **options: Any) -> "keras.Layer":
    import keras

    return keras.layers.Conv1D(layer.outputs, layer.taps, strides=layer.stride, dilation_rate=layer.dilation,
                               padding="causal", activation="relu" if layer.relu else None, **options)


def _conv_window(layer: StreamLayer, kernel: np.ndarray, bias: np.ndarray, x: Any) -> Any:
    import tensorflow as tf

    return tf.nn.conv2d(x, kernel[None], (1, layer.stride), "VALID", dilations=(1, layer.dilation)) + bias


def _head_rows(layer: StreamLayer, kernel: np.ndarray, bias: np.ndarray, x: np.ndarray) -> np.ndarray:
    return x @ kernel.reshape(-1, layer.outputs) + bias


def _head_keras(layer: StreamLayer, **options: Any) -> "keras.Layer":
    import keras

    return keras.layers.Dense(layer.outputs, activation="relu" if layer.relu else None, **options)


def _head_window(layer: StreamLayer, kernel: np.ndarray, bias: np.ndarray, x: Any) -> Any:
    import tensorflow as tf

    return tf.nn.conv2d(x, kernel.reshape(1, 1, -1, layer.outputs), 1, "VALID") + bias


#: operation of a `StreamLayer` -> what it is
OPERATIONS = {CAUSAL_CONV: Operation(DENSE, lambda layer: layer.shape, _conv_rows, _conv_keras, _conv_window),
              HEAD: Operation(DENSE, lambda layer: layer.shape, _head_rows, _head_keras, _head_window)}
