"""The int8 network, defined: integers in, integers out, equal to tflite-micro and to gap8/kernels.

A real value is r = scale (q - zero point) (paper, section 5.3). Weights are symmetric with
one scale per output channel; biases are int32 at input scale x weight scale; an accumulator
becomes an activation by gemmlowp's double rounding (`requantise`).
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

_CHUNK = 256  # windows at a time, for memory


@dataclass(frozen=True)
class LayerKind:
    """The arithmetic of a layer: CONV, MAX_POOL, DENSE, or that of an operation of `best` that has its own.

    name, number: in `gap8/kernels/layer_int8.h`, LAYER_<NAME>. run(layer, x): int8 output (n, *output shape) of its
    int8 input (n, ...), of as many values as its input shape. sparse_number: the number of the kernel that does the
    same with weights in blocks of four (`runs_sparse`), None where there is none.
    """

    name: str
    number: int
    run: Callable[["Int8Layer", np.ndarray], np.ndarray]
    sparse_number: int | None = None


@dataclass(frozen=True)
class Int8Layer:
    """One layer; shapes are (rows, columns, channels).

    weights: int8, conv (out, kernel rows, kernel columns, in), dense (out, inputs).
    bias: int32 (out,). weight_scale: float32 (out,). A pool has none of them (size 0), and keeps the scale.
    """

    kind: LayerKind
    input_shape: tuple[int, int, int]
    output_shape: tuple[int, int, int]
    kernel: tuple[int, int]
    input_scale: float
    input_zero_point: int
    output_scale: float
    output_zero_point: int
    relu: bool = False
    weights: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int8))
    bias: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int32))
    weight_scale: np.ndarray = field(default_factory=lambda: np.zeros(0, np.float32))

    @property
    def weighted(self) -> bool:
        """Whether it has weights."""
        return self.weights.size > 0

    @property
    def output_min(self) -> int:
        """Lower clamp of the output: its zero point for a ReLU."""
        return max(self.output_zero_point, -128) if self.relu else -128

    def multipliers(self) -> tuple[np.ndarray, np.ndarray]:
        """int32 mantissa and int8 exponent of input scale x weight scale / output scale, (out,)."""
        real = np.float64(np.float32(self.input_scale)) * self.weight_scale.astype(np.float64)
        return quantised_multiplier(real / np.float64(np.float32(self.output_scale)))

    def c_constants(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """bias, multiplier and shift (out,) as the C kernels take them: int32, int32, int8.

        The input's zero point is folded into the bias. An output whose weights pruning took has a weight scale of
        next to nothing and a bias to match; it gets that constant as a bias at scale 1 instead.
        """
        weights = self.weights.astype(np.int64).reshape(len(self.bias), -1)
        bias = (self.bias - self.input_zero_point * weights.sum(axis=1)).astype(np.int32)
        multiplier, shift = self.multipliers()
        constant = requantise(bias, multiplier, shift, self.output_zero_point, self.output_min)
        dead = ~weights.any(axis=1)
        return (np.where(dead, constant.astype(np.int32) - self.output_zero_point, bias).astype(np.int32),
                np.where(dead, 2**30, multiplier).astype(np.int32), np.where(dead, 1, shift).astype(np.int8))


@dataclass(frozen=True)
class Int8Network:
    """Layers in order, each reading what the one before wrote."""

    layers: tuple[Int8Layer, ...]

    @property
    def input_shape(self) -> tuple[int, int, int]:
        return self.layers[0].input_shape

    @property
    def outputs(self) -> int:
        return int(np.prod(self.layers[-1].output_shape))


def multiplications(network: Int8Network) -> int:
    """Multiplications of one inference as the C kernels do it: pruned layers skip their empty blocks, and
    no position is computed that the pool after a convolution drops."""
    total = 0
    for layer, after in zip(network.layers, (*network.layers[1:], None), strict=True):
        rows, columns, _ = layer.output_shape
        if after is not None and after.kind == MAX_POOL:
            rows, columns = (n - n % k for n, k in zip((rows, columns), after.kernel, strict=True))
        total += rows * columns * _weights_used(layer)
    return total


def rolling_multiplications(network: Int8Network, stride: int) -> float:
    """Multiplications a sample where the network rolls over samples, mean over `stride` samples.

    A layer's row is computed on each sample, or on as few as the pools before it and the stride let it.
    """
    total, period = 0.0, 1
    for layer in network.layers:
        if layer.kind == MAX_POOL:
            period = min(period * layer.kernel[0], stride)
        columns = layer.output_shape[1] if layer.kind == CONV else 1
        total += columns * _weights_used(layer) / period
    return total


def _weights_used(layer: Int8Layer) -> int:
    """Weights that are multiplied with one position of the input."""
    if not layer.weighted:
        return 0
    return 4 * len(sparse_blocks(layer.weights)[0]) if runs_sparse(layer) else layer.weights.size


def quantised_multiplier(real: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(mantissa int32 in [2^30, 2^31), exponent int8) with mantissa 2^(exponent - 31) ~ real > 0."""
    fraction, exponent = np.frexp(np.asarray(real, dtype=np.float64))
    mantissa = np.floor(fraction * 2.0**31 + 0.5).astype(np.int64)
    full = mantissa == 2**31
    mantissa, exponent = np.where(full, mantissa // 2, mantissa), exponent + full
    tiny = exponent < -31
    return np.where(tiny, 0, mantissa).astype(np.int32), np.where(tiny, 0, exponent).astype(np.int8)


def rounding_doubling_high_multiply(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """round(a b / 2^31) for int32 a and int32 b >= 0, ties up."""
    return ((a.astype(np.int64) * b.astype(np.int64) + (1 << 30)) >> 31).astype(np.int32)


def rounding_shift_right(x: np.ndarray, exponent: np.ndarray) -> np.ndarray:
    """round(x / 2^exponent) for int32 x, ties away from zero."""
    x, exponent = x.astype(np.int64), exponent.astype(np.int64)
    mask = (np.int64(1) << exponent) - 1
    return ((x >> exponent) + ((x & mask) > (mask >> 1) + (x < 0))).astype(np.int32)


def requantise(accumulator: np.ndarray, multiplier: np.ndarray, shift: np.ndarray,
               zero_point: int, low: int = -128, high: int = 127) -> np.ndarray:
    """int32 accumulators (..., out) to int8 activations, gemmlowp's double rounding."""
    shift = np.asarray(shift, dtype=np.int32)
    scaled = (accumulator.astype(np.int64) << np.maximum(shift, 0)).astype(np.int32)
    value = rounding_shift_right(rounding_doubling_high_multiply(scaled, multiplier), np.maximum(-shift, 0))
    return np.clip(value.astype(np.int64) + zero_point, low, high).astype(np.int8)


def quantise(x: np.ndarray, scale: float, zero_point: int) -> np.ndarray:
    """int8 floor(x / scale + 0.5) + zero point in float32, clamped; NaN counts as 0."""
    value = np.floor(np.asarray(x, dtype=np.float32) / np.float32(scale) + np.float32(0.5))
    value = np.where(np.isnan(value), np.float32(0), value)
    return np.clip(value + np.float32(zero_point), -128, 127).astype(np.int8)


def infer_int8(network: Int8Network, windows: np.ndarray) -> np.ndarray:
    """int8 logits (n, outputs) of float windows (n, rows, columns), normalised."""
    first = network.layers[0]
    return run(network, quantise(windows, first.input_scale, first.input_zero_point))


def run(network: Int8Network, quantised: np.ndarray) -> np.ndarray:
    """int8 outputs (n, outputs) of int8 inputs (n, ...), each of as many values as the input shape."""
    x = np.asarray(quantised, dtype=np.int8).reshape(-1, *network.input_shape)
    chunks = [_run_chunk(network, x[i:i + _CHUNK]) for i in range(0, len(x), _CHUNK)]
    return np.concatenate(chunks) if chunks else np.zeros((0, network.outputs), dtype=np.int8)


def _run_chunk(network: Int8Network, x: np.ndarray) -> np.ndarray:
    for layer in network.layers:
        x = layer.kind.run(layer, x)
    return x.reshape(len(x), -1)


def _conv(layer: Int8Layer, x: np.ndarray) -> np.ndarray:
    windows = sliding_window_view(_centre(layer, x), layer.kernel, axis=(1, 2))  # n, rows, columns, in, kernel
    return _product(layer, np.moveaxis(windows, 3, 5).reshape(*windows.shape[:3], -1))


def _dense(layer: Int8Layer, x: np.ndarray) -> np.ndarray:
    return _product(layer, _centre(layer, x).reshape(-1, 1, 1, layer.weights[0].size))


def _centre(layer: Int8Layer, x: np.ndarray) -> np.ndarray:
    return x.reshape(-1, *layer.input_shape).astype(np.int32) - layer.input_zero_point


def _product(layer: Int8Layer, patches: np.ndarray) -> np.ndarray:
    """One matrix product of patches (n, rows, columns, inputs of an output) and weights, as activations."""
    accumulator = patches @ layer.weights.reshape(len(layer.bias), -1).T.astype(np.int32) + layer.bias
    multiplier, shift = layer.multipliers()
    return requantise(accumulator, multiplier, shift, layer.output_zero_point, layer.output_min)


def _max_pool(layer: Int8Layer, x: np.ndarray) -> np.ndarray:
    (height, width), (rows, columns, channels) = layer.kernel, layer.output_shape
    whole = x[:, :rows * height, :columns * width]
    return whole.reshape(-1, rows, height, columns, width, channels).max(axis=(2, 4))


CONV = LayerKind("conv", 0, _conv, sparse_number=4)
MAX_POOL = LayerKind("max_pool", 1, _max_pool)
DENSE = LayerKind("dense", 2, _dense, sparse_number=3)


def sparse_blocks(weights: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A layer's weights (out, ...) as blocks of four neighbouring inputs that run where they lie.

    Returns blocks int8 (b, 4), counts uint16 (out,): blocks of each output, and skips
    uint8 (b,): blocks of four inputs passed over before each. A gap of more than 255
    is bridged by blocks of zeros. The inputs of an output must be divisible by four.
    """
    blocks, counts, skips = [], [], []
    for row in weights.reshape(len(weights), -1, 4):
        before, start = len(blocks), 0
        for index in map(int, np.flatnonzero(row.any(axis=1))):
            while index - start > 255:
                blocks.append(row[start + 255])
                skips.append(255)
                start += 256
            blocks.append(row[index])
            skips.append(index - start)
            start = index + 1
        counts.append(len(blocks) - before)
    return (np.array(blocks, dtype=np.int8).reshape(-1, 4), np.array(counts, dtype=np.uint16),
            np.array(skips, dtype=np.uint8))


def runs_sparse(layer: Int8Layer) -> bool:
    """Whether blocks of four (five bytes each, two an output for their count) take less room."""
    if not layer.weighted or layer.kind.sparse_number is None or layer.weights[0].size % 4:
        return False
    _, counts, skips = sparse_blocks(layer.weights)
    return 5 * len(skips) + 2 * len(counts) < layer.weights.size
