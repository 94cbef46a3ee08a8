"""The paper's network (section 5.2): its weights, and Keras and C views of it. `graph` is the list of its layers.

Input (100, 3, 1); 16 filters of 3 x 1, ReLU, pool 2 x 1; 32 filters of 3 x 1, ReLU, pool
2 x 1; dense 16, ReLU; dense 2. It gives logits: softmax comes after, outside the network.
36,944 weights and 66 biases.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from airtouch.detector.paper.graph import GRAPH, INPUT_SHAPE, OPERATIONS
from airtouch.detector.shared.pruning import BLOCK, keep_mask, polynomial_sparsity
from airtouch.kernels.network import FloatLayer

if TYPE_CHECKING:
    import keras

#: Keras kernels by layer: convolutions (rows, columns, in, out), dense (in, out).
KERNEL_SHAPES = {layer.name: layer.kernel_shape for layer in GRAPH if layer.kernel_shape}
WEIGHTED = tuple(KERNEL_SHAPES)
#: The first dense layer holds 35,328 of the 36,944 weights.
PRUNED = "dense1"
#: Holds 1,536, each used 138 times a window: most of the arithmetic where a network rolls over samples.
PRUNED_CONV = "conv2"

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
    return [FloatLayer(layer.operation, layer.input_shape, layer.output_shape, layer.kernel, layer.relu,
                       *((kernel_of_c(weights[f"{layer.name}.kernel"]), weights[f"{layer.name}.bias"])
                         if layer.kernel_shape else ()))
            for layer in GRAPH]


def kernel_of_c(kernel: np.ndarray) -> np.ndarray:
    """A Keras kernel with its output channel first, as the C kernels and TFLite lay it out."""
    return np.ascontiguousarray(np.moveaxis(kernel, -1, 0))


def build_keras(constraints: Mapping[str, object] | None = None, rows: int = INPUT_SHAPE[0]) -> "keras.Model":
    """The network in Keras, with a kernel constraint for each layer named, for windows of `rows` samples."""
    import keras

    constraints = constraints or {}
    layers = [one for layer in GRAPH
              for one in OPERATIONS[layer.operation].keras(layer, **(
                  {"kernel_constraint": constraints.get(layer.name)} if layer.kernel_shape else {}))]
    return keras.Sequential([keras.Input((rows, *INPUT_SHAPE[1:])), *layers], name="airtouch_paper")


def weights_of_keras(model: "keras.Model") -> dict[str, np.ndarray]:
    """The weights of a Keras model, with the names of `weight_shapes`."""
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

    final_sparsity: fraction of zeros after training, by layer. The callback re-ranks the weights after each batch
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
