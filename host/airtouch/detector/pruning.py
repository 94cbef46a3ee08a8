"""Pruning (section 5.3): weights to exact zeros on a polynomial schedule, singly or in blocks of four.

Only the first dense layer is pruned: it holds 35,328 of the 36,944 weights. The two
convolutions hold 1,584, each used 141 to 294 times a window.
"""

import numpy as np

PRUNED = "dense1"
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
    """float32 0 or 1 for each weight of a dense kernel (inputs, outputs).

    The `sparsity` share of lowest magnitude is 0, ties by position. block: 1 for single weights,
    else so many neighbouring inputs of one output are judged by their sum of squares.
    """
    inputs, outputs = kernel.shape
    score = np.square(kernel.astype(np.float64)).reshape(inputs // block, block, outputs).sum(axis=1)
    order = np.argsort(score, axis=None, kind="stable")
    keep = np.ones(score.size, dtype=np.float32)
    keep[order[:int(round(sparsity * score.size))]] = 0.0
    return np.repeat(keep.reshape(score.shape), block, axis=0)


def pruning(final_sparsity: float, steps: int, block: int = BLOCK) -> tuple[object, object]:
    """A Keras kernel constraint for the layer `PRUNED`, and the callback that drives it.

    The callback re-ranks the weights after each batch that Keras reports, until `steps`
    optimiser steps, when `final_sparsity` is reached; the mask then stays. Zeros are exact.
    """
    import keras
    import tensorflow as tf

    mask = tf.Variable(tf.ones((2208, 16)), trainable=False)

    class Mask(keras.constraints.Constraint):
        def __call__(self, kernel):  # noqa: ANN001, ANN204
            return kernel * mask

    class Schedule(keras.callbacks.Callback):
        def on_train_begin(self, logs: dict | None = None) -> None:
            self.finished = False

        def on_train_batch_end(self, batch: int, logs: dict | None = None) -> None:
            step = int(self.model.optimizer.iterations)
            if self.finished:
                return
            self.finished = step >= steps
            kernel = self.model.get_layer(PRUNED).kernel
            values = kernel.numpy()
            keep = keep_mask(values, polynomial_sparsity(step, steps, 0.0, final_sparsity), block)
            mask.assign(keep)
            kernel.assign(values * keep)

    return Mask(), Schedule()
