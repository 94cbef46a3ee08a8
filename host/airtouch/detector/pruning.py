"""Pruning (section 5.3): weights to exact zeros on a polynomial schedule, singly or in blocks of four.

The first dense layer holds 35,328 of the 36,944 weights. The second convolution holds 1,536, each used 138
times a window: most of the arithmetic, so that it is worth pruning too where a network runs as a stream.
"""

from collections.abc import Mapping

import numpy as np

PRUNED = "dense1"
PRUNED_CONV = "conv2"
BLOCK = 4  #: neighbouring inputs that live or die together


def polynomial_sparsity(step: float, steps: float, initial: float, final: float, power: float = 3.0) -> float:
    """Share of zeros at a step: final + (initial - final) (1 - step / steps)^power.

    The paper writes theta = s_i + (s_f - s_i) (1 - t_i / t_e)^p, which starts at the final
    sparsity and ends at the initial one, and then compares weights with theta as if a
    sparsity were a magnitude. Implemented is what that schedule is known as elsewhere
    (Zhu and Gupta 2017, the polynomial decay of TensorFlow's pruning): from initial to
    final, the threshold being the magnitude below which that share of the weights lies.
    """
    left = 1.0 - min(max(step / steps, 0.0), 1.0)
    return final + (initial - final) * left**power


def keep_mask(kernel: np.ndarray, sparsity: float, block: int = BLOCK) -> np.ndarray:
    """float32 0 or 1 for each weight of a kernel (..., outputs); blocks lie along the flattened inputs.

    The `sparsity` share of lowest magnitude is 0, ties by position. block: 1 for single weights,
    else so many neighbouring inputs of one output are judged by their sum of squares.
    """
    outputs = kernel.shape[-1]
    inputs = kernel.size // outputs
    score = np.square(kernel.astype(np.float64)).reshape(inputs // block, block, outputs).sum(axis=1)
    order = np.argsort(score, axis=None, kind="stable")
    keep = np.ones(score.size, dtype=np.float32)
    keep[order[:int(round(sparsity * score.size))]] = 0.0
    return np.repeat(keep.reshape(score.shape), block, axis=0).reshape(kernel.shape)


def pruning(final_sparsity: Mapping[str, float], steps: int, block: int = BLOCK) -> tuple[dict, object]:
    """A Keras kernel constraint for each layer named, and the callback that drives them all.

    final_sparsity: share of zeros at the end, by layer. The callback re-ranks the weights after each batch
    that Keras reports, until `steps` optimiser steps; the masks then stay. Zeros are exact.
    """
    import keras
    import tensorflow as tf

    from airtouch.detector.network import KERNEL_SHAPES

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
