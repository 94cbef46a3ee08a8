"""Int8 networks of made-up shapes and weights, also those that training would never give."""

import numpy as np

from airtouch.reference.networks.int8_network import CONV, DENSE, MAX_POOL, Int8Layer, Int8Network, LayerKind

SCALE, ZERO = 0.05, -7


def weighted(rng: np.random.Generator, kind: LayerKind, before: tuple, after: tuple, kernel: tuple, *, relu: bool,
             sparsity: float, input_zero: int) -> Int8Layer:
    """A convolution or a dense layer; a share of its blocks of four, and of whole outputs, is zero."""
    out = after[2]
    shape = (out, *kernel, before[2]) if kind == CONV else (out, int(np.prod(before)))
    weights = rng.integers(-127, 128, shape).astype(np.int8)
    flat = weights.reshape(out, -1)
    if flat.shape[1] % 4 == 0:
        flat.reshape(out, -1, 4)[rng.random((out, flat.shape[1] // 4)) < sparsity] = 0
    dead = rng.random(out) < 0.1 * sparsity  # as training leaves them: next to no scale and a bias to match
    flat[dead] = 0
    spread = flat.shape[1] ** -0.5 * 0.02
    weight_scale = (spread * rng.uniform(0.3, 3.0, out)).astype(np.float32)
    weight_scale[rng.random(out) < 0.1] *= 40.0  # multipliers above one
    bias = rng.integers(-4000, 4001, out).astype(np.int32)
    weight_scale[dead], bias[dead] = 3e-9, rng.integers(-2**31 + 1, 2**31, dead.sum())
    return Int8Layer(kind, before, after, kernel, SCALE, input_zero, SCALE, -128 if relu else ZERO, relu, weights, bias,
                     weight_scale)


def pool(before: tuple, kernel: tuple, zero: int) -> Int8Layer:
    after = (before[0] // kernel[0], before[1] // kernel[1], before[2])
    return Int8Layer(MAX_POOL, before, after, kernel, SCALE, zero, SCALE, zero)


def network(seed: int, rows: int, columns: int, channels: int, stages: list[tuple], dense: list[int],
            sparsity: float) -> Int8Network:
    """stages: (kernel rows, kernel columns, outputs, pool or None); dense: outputs of each dense layer."""
    rng = np.random.default_rng(seed)
    shape, zero, layers = (rows, columns, channels), ZERO, []
    for kernel_rows, kernel_columns, outputs, pooling in stages:
        after = (shape[0] - kernel_rows + 1, shape[1] - kernel_columns + 1, outputs)
        layers.append(weighted(rng, CONV, shape, after, (kernel_rows, kernel_columns), relu=True, sparsity=sparsity,
                               input_zero=zero))
        shape, zero = after, -128
        if pooling:
            layers.append(pool(shape, pooling, zero))
            shape = layers[-1].output_shape
    for i, outputs in enumerate(dense):
        relu = i + 1 < len(dense)
        layers.append(weighted(rng, DENSE, shape, (1, 1, outputs), (1, 1), relu=relu, sparsity=sparsity,
                               input_zero=zero))
        shape, zero = (1, 1, outputs), -128 if relu else ZERO
    return Int8Network(tuple(layers))
