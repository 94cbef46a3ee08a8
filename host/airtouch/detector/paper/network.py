"""The paper's network (section 5.2): its shapes, its weights, and Keras and C views of them.

Input (100, 3, 1); 16 filters of 3 x 1, ReLU, pool 2 x 1; 32 filters of 3 x 1, ReLU, pool
2 x 1; dense 16, ReLU; dense 2. It gives logits: softmax comes after, outside the network.
36,944 weights and 66 biases.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from airtouch.detector.shared.pruning import BLOCK, keep_mask, polynomial_sparsity
from airtouch.kernels.network import FloatLayer

if TYPE_CHECKING:
    import keras

INPUT_SHAPE = (100, 3, 1)  #: rows (samples), columns (sensors), channels
WEIGHTED = ("conv1", "conv2", "dense1", "dense2")
#: The first dense layer holds 35,328 of the 36,944 weights.
PRUNED = "dense1"
#: Holds 1,536, each used 138 times a window: most of the arithmetic where a network rolls over samples.
PRUNED_CONV = "conv2"
#: Keras kernels: convolutions (rows, columns, in, out), dense (in, out).
KERNEL_SHAPES = {"conv1": (3, 1, 1, 16), "conv2": (3, 1, 16, 32), "dense1": (2208, 16), "dense2": (16, 2)}
#: kind, weights, input shape, output shape, kernel, ReLU: what every view is made of.
GRAPH = (
    ("conv", "conv1", (100, 3, 1), (98, 3, 16), (3, 1), True),
    ("max_pool", None, (98, 3, 16), (49, 3, 16), (2, 1), False),
    ("conv", "conv2", (49, 3, 16), (47, 3, 32), (3, 1), True),
    ("max_pool", None, (47, 3, 32), (23, 3, 32), (2, 1), False),
    ("dense", "dense1", (23, 3, 32), (1, 1, 16), (1, 1), True),
    ("dense", "dense2", (1, 1, 16), (1, 1, 2), (1, 1), False),
)

Weights = Mapping[str, np.ndarray]  #: "conv1.kernel", "conv1.bias", ... float32, as Keras lays them out


def weight_shapes() -> dict[str, tuple[int, ...]]:
    """Name and shape of each float array of the network."""
    shapes: dict[str, tuple[int, ...]] = {}
    for name, shape in KERNEL_SHAPES.items():
        shapes[f"{name}.kernel"] = shape
        shapes[f"{name}.bias"] = shape[-1:]
    return shapes


def float_layers(weights: Weights) -> list[FloatLayer]:
    """The network for `airtouch.kernels.network.infer_float`."""
    return [FloatLayer(kind, before, after, kernel, relu) if name is None else
            FloatLayer(kind, before, after, kernel, relu, kernel_of_c(weights[f"{name}.kernel"]),
                       weights[f"{name}.bias"])
            for kind, name, before, after, kernel, relu in GRAPH]


def kernel_of_c(kernel: np.ndarray) -> np.ndarray:
    """A Keras kernel with its output channel first, as the C kernels and TFLite lay it out."""
    return np.ascontiguousarray(np.moveaxis(kernel, -1, 0))


def build_keras(constraints: Mapping[str, object] | None = None, rows: int = INPUT_SHAPE[0]) -> "keras.Model":
    """The network in Keras, with a kernel constraint for each layer named, for windows of `rows` samples."""
    import keras

    constraints = constraints or {}

    def conv(name: str) -> keras.Layer:
        rows, columns, _, filters = KERNEL_SHAPES[name]
        return keras.layers.Conv2D(filters, (rows, columns), activation="relu", name=name,
                                   kernel_constraint=constraints.get(name))

    def dense(name: str, activation: str | None) -> keras.Layer:
        return keras.layers.Dense(KERNEL_SHAPES[name][1], activation=activation, name=name,
                                  kernel_constraint=constraints.get(name))

    return keras.Sequential([
        keras.Input((rows, *INPUT_SHAPE[1:])), conv("conv1"), keras.layers.MaxPooling2D((2, 1)),
        conv("conv2"), keras.layers.MaxPooling2D((2, 1)), keras.layers.Flatten(),
        dense("dense1", "relu"), dense("dense2", None),
    ], name="airtouch_paper")


def weights_of_keras(model: "keras.Model") -> dict[str, np.ndarray]:
    """The arrays of `weight_shapes` out of a Keras model."""
    arrays = {}
    for name in WEIGHTED:
        kernel, bias = model.get_layer(name).get_weights()
        arrays[f"{name}.kernel"], arrays[f"{name}.bias"] = kernel, bias
    return arrays


def set_weights_of_keras(model: "keras.Model", weights: Weights) -> None:
    """The inverse of `weights_of_keras`."""
    for name in WEIGHTED:
        model.get_layer(name).set_weights([weights[f"{name}.kernel"], weights[f"{name}.bias"]])


def pruning_of(final_sparsity: Mapping[str, float], steps: int, block: int = BLOCK
               ) -> tuple[dict, object]:
    """A Keras kernel constraint for each layer named, and the callback that drives them all.

    final_sparsity: share of zeros at the end, by layer. The callback re-ranks the weights after each batch
    that Keras reports, until `steps` optimiser steps; the masks then stay. Zeros are exact.
    """
    import keras
    import tensorflow as tf

    masks = {name: tf.Variable(tf.ones(KERNEL_SHAPES[name]), trainable=False) for name in final_sparsity}

    class Mask(keras.constraints.Constraint):
        def __init__(self, mask: object):
            self.mask = mask

        def __call__(self, kernel):
            return kernel * self.mask

    class Schedule(keras.callbacks.Callback):
        def on_train_begin(self, logs: dict | None = None) -> None:
            self.finished = False

        def on_train_batch_end(self, batch: int, logs: dict | None = None) -> None:
            step = int(self.model.optimizer.iterations)
            if self.finished:
                return
            self.finished = step >= steps
            for name, final in final_sparsity.items():
                kernel = self.model.get_layer(name).kernel
                values = kernel.numpy()
                keep = keep_mask(values, polynomial_sparsity(step, steps, 0.0, final), block)
                masks[name].assign(keep)
                kernel.assign(values * keep)

    return {name: Mask(mask) for name, mask in masks.items()}, Schedule()
