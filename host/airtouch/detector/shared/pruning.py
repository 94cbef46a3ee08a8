"""Pruning (section 5.3): weights to exact zeros on a polynomial schedule, singly or in blocks of four."""

import numpy as np

BLOCK = 4  #: neighbouring inputs that are pruned together; the C kernels skip such blocks


def polynomial_sparsity(step: float, steps: float, initial: float, final: float, power: float = 3.0) -> float:
    """Share of zeros at a step: final + (initial - final) (1 - step / steps)^power.

    The paper writes theta = s_i + (s_f - s_i) (1 - t_i / t_e)^p, which starts at the final
    sparsity and ends at the initial one, and then compares weights with theta as if a
    sparsity were a magnitude. Implemented is what that schedule is known as elsewhere
    (Zhu and Gupta 2017, the polynomial decay of TensorFlow's pruning): from initial to
    final, the threshold being the magnitude below which that share of the weights lies.
    """
    remaining = 1.0 - min(max(step / steps, 0.0), 1.0)
    return final + (initial - final) * remaining**power


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
