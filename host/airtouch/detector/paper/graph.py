"""The paper's network as a list of layers, and what each operation is in Keras and in TensorFlow over a window.

C (`kernels.network`), NumPy (`reference.networks.int8_network`), training, quantisation and export follow the list.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from airtouch.reference.networks.int8_network import CONV, DENSE, MAX_POOL, LayerKind

if TYPE_CHECKING:
    import keras

Shape = tuple[int, int, int]  #: rows, columns, channels

INPUT_SHAPE: Shape = (100, 3, 1)  #: samples, sensors, one value


class LayerSpec(NamedTuple):
    """One layer as it is written in LAYERS, before its shapes are known.

    kernel: rows and columns that an output reads. outputs: channels; 0 for as many as the layer before has.
    """

    name: str
    operation: LayerKind
    kernel: tuple[int, int] = (1, 1)
    outputs: int = 0
    relu: bool = False


LAYERS = (
    LayerSpec("conv1", CONV, (3, 1), 16, relu=True),
    LayerSpec("pool1", MAX_POOL, (2, 1)),
    LayerSpec("conv2", CONV, (3, 1), 32, relu=True),
    LayerSpec("pool2", MAX_POOL, (2, 1)),
    LayerSpec("dense1", DENSE, outputs=16, relu=True),
    LayerSpec("dense2", DENSE, outputs=2),
)


@dataclass(frozen=True)
class PaperLayer:
    """One layer with its shapes. kernel_shape: of its weights as Keras lays them out, () for a layer without."""

    name: str
    operation: LayerKind
    input_shape: Shape
    output_shape: Shape
    kernel: tuple[int, int]
    relu: bool
    kernel_shape: tuple[int, ...]


@dataclass(frozen=True)
class Operation:
    """What one operation is.

    output_shape, kernel_shape (input shape, spec): of a layer. keras(layer, **options): new Keras layers, the last one
    with these options. window(layer, kernel, bias, x): TensorFlow, of (1, rows, columns, channels), without ReLU.
    """

    output_shape: Callable[[Shape, LayerSpec], Shape]
    kernel_shape: Callable[[Shape, LayerSpec], tuple[int, ...]]
    keras: Callable[..., list["keras.Layer"]]
    window: Callable[[PaperLayer, np.ndarray | None, np.ndarray | None, Any], Any]


def graph_of(specs: Sequence[LayerSpec], input_shape: Shape) -> tuple[PaperLayer, ...]:
    """The layers of a list, each with the shape that the one before leaves it."""
    layers: list[PaperLayer] = []
    for spec in specs:
        before, operation = layers[-1].output_shape if layers else input_shape, OPERATIONS[spec.operation]
        layers.append(PaperLayer(spec.name, spec.operation, before, operation.output_shape(before, spec), spec.kernel,
                                 spec.relu, operation.kernel_shape(before, spec)))
    return tuple(layers)


def _conv_shape(before: Shape, spec: LayerSpec) -> Shape:
    """Without padding, so a kernel of k rows leaves k - 1 fewer."""
    return before[0] - spec.kernel[0] + 1, before[1] - spec.kernel[1] + 1, spec.outputs


def _conv_kernel(before: Shape, spec: LayerSpec) -> tuple[int, ...]:
    return *spec.kernel, before[2], spec.outputs


def _conv_keras(layer: PaperLayer, **options: Any) -> list["keras.Layer"]:
    import keras

    return [keras.layers.Conv2D(layer.output_shape[2], layer.kernel, activation="relu" if layer.relu else None,
                                name=layer.name, **options)]


def _conv_window(layer: PaperLayer, kernel: np.ndarray | None, bias: np.ndarray | None, x: Any) -> Any:
    import tensorflow as tf

    return tf.nn.conv2d(x, kernel, 1, "VALID") + bias


def _pool_shape(before: Shape, spec: LayerSpec) -> Shape:
    """The rows and columns that fill no kernel are left out."""
    return before[0] // spec.kernel[0], before[1] // spec.kernel[1], before[2]


def _pool_kernel(before: Shape, spec: LayerSpec) -> tuple[int, ...]:
    return ()


def _pool_keras(layer: PaperLayer, **options: Any) -> list["keras.Layer"]:
    import keras

    return [keras.layers.MaxPooling2D(layer.kernel, name=layer.name, **options)]


def _pool_window(layer: PaperLayer, kernel: np.ndarray | None, bias: np.ndarray | None, x: Any) -> Any:
    import tensorflow as tf

    return tf.nn.max_pool2d(x, layer.kernel, layer.kernel, "VALID")


def _dense_shape(before: Shape, spec: LayerSpec) -> Shape:
    return 1, 1, spec.outputs


def _dense_kernel(before: Shape, spec: LayerSpec) -> tuple[int, ...]:
    return int(np.prod(before)), spec.outputs


def _dense_keras(layer: PaperLayer, **options: Any) -> list["keras.Layer"]:
    import keras

    flat = [keras.layers.Flatten()] if layer.input_shape[:2] != (1, 1) else []
    return [*flat, keras.layers.Dense(layer.output_shape[2], activation="relu" if layer.relu else None, name=layer.name,
                                      **options)]


def _dense_window(layer: PaperLayer, kernel: np.ndarray | None, bias: np.ndarray | None, x: Any) -> Any:
    import tensorflow as tf

    return tf.matmul(tf.reshape(x, (1, int(np.prod(layer.input_shape)))), kernel) + bias


OPERATIONS = {
    CONV: Operation(_conv_shape, _conv_kernel, _conv_keras, _conv_window),
    MAX_POOL: Operation(_pool_shape, _pool_kernel, _pool_keras, _pool_window),
    DENSE: Operation(_dense_shape, _dense_kernel, _dense_keras, _dense_window),
}

GRAPH = graph_of(LAYERS, INPUT_SHAPE)
