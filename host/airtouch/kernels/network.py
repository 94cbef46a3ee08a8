"""The int8 and float network of gap8/kernels, whole batches and whole flights in one call."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.kernels.arrays import pointer
from airtouch.kernels.library import ffi, lib
from airtouch.reference.networks.int8_network import CONV, Int8Layer, Int8Network, LayerKind, runs_sparse, sparse_blocks
from airtouch.reference.networks.stream_int8 import StreamNetwork


class Model(Protocol):
    """What these functions need of a trained model."""

    @property
    def int8(self) -> Int8Network:
        """The network that flies."""


@dataclass(frozen=True)
class FloatLayer:
    """One layer in float; shapes and weights laid out as `Int8Layer` does, a pool has no weights."""

    kind: LayerKind
    input_shape: tuple[int, int, int]
    output_shape: tuple[int, int, int]
    kernel: tuple[int, int]
    relu: bool = False
    weights: np.ndarray = field(default_factory=lambda: np.zeros(0, np.float32))
    bias: np.ndarray = field(default_factory=lambda: np.zeros(0, np.float32))

    @property
    def weighted(self) -> bool:
        """Whether it has weights."""
        return self.weights.size > 0


def infer_int8(model: Model, windows: np.ndarray) -> np.ndarray:
    """int8 outputs (n, outputs) of normalised windows (n, rows, columns). Reference: `int8_network.infer_int8`.

    Raises AirTouchError for windows of another shape than the model takes.
    """
    flat, keep = _flat_int8(model.int8)
    x = np.ascontiguousarray(_windows(model.int8.input_shape, windows), dtype=np.float32)
    quantised = np.empty(x.shape, dtype=np.int8)
    lib.networkInt8BatchQuantise(flat, pointer(x), x.size, pointer(quantised))
    return _outputs(flat, model.int8, quantised)


def run_int8(network: Int8Network, quantised: np.ndarray) -> np.ndarray:
    """int8 outputs (n, outputs) of quantised inputs (n, ...). Reference: `int8_network.run`."""
    flat, keep = _flat_int8(network)
    return _outputs(flat, network, np.ascontiguousarray(_windows(network.input_shape, quantised), dtype=np.int8))


def infer_float(layers: Sequence[FloatLayer], windows: np.ndarray) -> np.ndarray:
    """float32 outputs (n, outputs) of normalised windows, through the float kernels.

    Raises AirTouchError for windows of another shape and for layers that do not fit each other.
    """
    x = np.ascontiguousarray(_windows(layers[0].input_shape, windows), dtype=np.float32)
    shapes = np.array([[layer.kind.number, *layer.input_shape, *layer.output_shape, *layer.kernel,
                        layer.relu, 0, 0] for layer in layers], dtype=np.int32)
    weighted = [layer for layer in layers if layer.weighted]
    weights = _joined([layer.weights for layer in weighted], np.float32)
    bias = _joined([layer.bias for layer in weighted], np.float32)
    flat = ffi.new("flatNetworkFloat_t *", {
        "layerCount": len(layers), "weightCount": weights.size, "channelCount": bias.size,
        "shapes": pointer(shapes), "weights": pointer(weights), "bias": pointer(bias)})
    size = valid_size(lib.networkFloatBatchArena(flat))
    outputs = np.empty((len(x), int(np.prod(layers[-1].output_shape))), dtype=np.float32)
    lib.networkFloatBatch(flat, pointer(x), len(x), ffi.new("float[]", size), pointer(outputs))
    return outputs


def probability(model: Model, windows: np.ndarray) -> np.ndarray:
    """P(over a platform), (n,), of normalised windows (n, rows, columns) of the model's input."""
    return platform_probability(infer_int8(model, windows), model.int8.layers[-1].output_scale)


def platform_probability(logits: np.ndarray, scale: float) -> np.ndarray:
    """P(over a platform), (n,): softmax of the second of two logits, (n, 2), in units of `scale`."""
    difference = logits[:, 1].astype(np.float64) - logits[:, 0]
    return 1.0 / (1.0 + np.exp(-scale * difference))


def probability_of_flight(model: Model, features: np.ndarray) -> np.ndarray:
    """P(over a platform) at each sample of a flight, (n,), from its fused features (n, columns).

    Row i: the window that ends at i, as many rows as the network takes, z-scored by itself, quantised, through the
    network, all in C, on two threads. NaN where that window is not full or holds a value that is not finite.
    """
    network = model.int8
    rows, columns, channels = network.input_shape
    x = np.ascontiguousarray(features, dtype=np.float32)
    if x.ndim != 2 or x.shape[1] != columns * channels:
        raise AirTouchError(f"network: needs features (n, {columns * channels}), not {x.shape}")
    flat, keep = _flat_int8(network)

    def logits_from(start: int, end: int) -> tuple[np.ndarray, np.ndarray]:
        """int8 logits (end - start, outputs) of the samples from start to end, and whether each is valid."""
        before = min(start, rows - 1)  # samples that the first window needs
        part = x[start - before:end]
        window, quantised = np.empty(rows * x.shape[1], np.float32), np.empty(rows * x.shape[1], np.int8)
        logits, valid = np.zeros((len(part), network.outputs), np.int8), np.zeros(len(part), np.uint8)
        lib.networkInt8Flight(flat, pointer(part), len(part), x.shape[1], rows, pointer(window), pointer(quantised),
                              _arena(flat), pointer(logits), pointer(valid))
        return logits[before:], valid[before:]

    middle = len(x) // 2
    with ThreadPoolExecutor(2) as threads:  # the C call leaves Python's lock to the other half
        first, second = threads.map(logits_from, (0, middle), (middle, len(x)))
    logits, valid = (np.concatenate(pair) for pair in zip(first, second, strict=True))
    return np.where(valid, platform_probability(logits, network.layers[-1].output_scale), np.nan)


def parameter_bytes(network: Int8Network | StreamNetwork) -> int:
    """Bytes that the network's constants take on the GAP8: weights, block skips and counts, bias,
    multiplier and shift."""
    total = 0
    for layer in network.layers:
        if layer.weighted:
            weights, counts, skips = packed_weights(layer)
            total += weights.size + 2 * counts.size + skips.size + 9 * len(layer.bias)
    return total


def arena_bytes(network: Int8Network) -> int:
    """Bytes of working memory of one inference, the input not counted."""
    flat, keep = flat_layers(network.layers)
    return valid_size(lib.networkInt8BatchArena(flat))


def packed_weights(layer: Int8Layer) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A layer's weights, block counts and block skips as the C kernels take them; the last two are
    empty where the layer keeps all its weights. A convolution's filters are filled up to a multiple of four."""
    if runs_sparse(layer):
        return sparse_blocks(layer.weights)
    weights = layer.weights.reshape(len(layer.weights), -1)
    fill = -weights.shape[1] % 4 if layer.kind == CONV else 0
    return np.pad(weights, ((0, 0), (0, fill))), np.zeros(0, np.uint16), np.zeros(0, np.uint8)


def layer_shape(layer: Int8Layer) -> list[int]:
    """The twelve integers of `flatNetworkInt8_t.shapes`."""
    sparse = layer.kind.sparse_number if runs_sparse(layer) else None
    return [layer.kind.number if sparse is None else sparse, *layer.input_shape, *layer.output_shape, *layer.kernel,
            layer.output_zero_point, layer.output_min, 127]


def flat_layers(layers: Sequence[Int8Layer]) -> tuple[Any, list[np.ndarray]]:
    """The C view of layers, one after the other, and the arrays that must outlive it."""
    weighted = [layer for layer in layers if layer.weighted]
    packed = [packed_weights(layer) for layer in weighted]
    constants = [layer.c_constants() for layer in weighted]
    weights = _joined([np.pad(np.ravel(w), (0, -w.size % 4)) for w, _, _ in packed], np.int8)
    counts = _joined([count for _, count, _ in packed], np.uint16)
    skips = _joined([skip for _, _, skip in packed], np.uint8)
    bias = _joined([b for b, _, _ in constants], np.int32)
    multiplier = _joined([m for _, m, _ in constants], np.int32)
    shift = _joined([s for _, _, s in constants], np.int8)
    shapes = np.array([layer_shape(layer) for layer in layers], dtype=np.int32)
    flat = ffi.new("flatNetworkInt8_t *", {
        "layerCount": len(layers), "weightCount": weights.size, "channelCount": bias.size,
        "blockCount": skips.size, "shapes": pointer(shapes), "weights": pointer(weights),
        "bias": pointer(bias), "multiplier": pointer(multiplier), "shift": pointer(shift),
        "blockCounts": pointer(counts), "blockSkips": pointer(skips),
        "inputScale": layers[0].input_scale, "inputZeroPoint": layers[0].input_zero_point})
    return flat, [shapes, weights, bias, multiplier, shift, counts, skips]


def valid_size(size: int) -> int:
    """The size that the library returned. Raises AirTouchError where it is -1 less the number of a wrong layer."""
    if size < 0:
        raise AirTouchError(f"network: layer {-size - 1} does not fit its weights or its neighbours")
    return size


def _flat_int8(network: Int8Network) -> tuple[Any, list[np.ndarray]]:
    """The C view of a network whose layers fit each other, and the arrays that must outlive it."""
    flat, keep = flat_layers(network.layers)
    valid_size(lib.networkInt8BatchArena(flat))
    return flat, keep


def _outputs(flat: Any, network: Int8Network, x: np.ndarray) -> np.ndarray:
    """int8 outputs (n, outputs) of quantised inputs (n, inputs) by the C view of a network."""
    outputs = np.empty((len(x), network.outputs), dtype=np.int8)
    lib.networkInt8Batch(flat, pointer(x), len(x), _arena(flat), pointer(outputs))
    return outputs


def _windows(shape: tuple[int, int, int], windows: np.ndarray) -> np.ndarray:
    """(n, inputs) from (n, rows, columns) or anything with as many values a row."""
    windows = np.asarray(windows)
    size = int(np.prod(shape))
    if windows.ndim < 2 or int(np.prod(windows.shape[1:])) != size:
        raise AirTouchError(f"network: needs windows (n, {shape[0]}, {shape[1] * shape[2]}), "
                            f"not {windows.shape}")
    return windows.reshape(len(windows), size)


def _arena(flat: Any) -> Any:
    return ffi.new("int8_t[]", lib.networkInt8BatchArena(flat))


def _joined(parts: list[np.ndarray], dtype: type) -> np.ndarray:
    """One flat array; never empty, so that its pointer is valid."""
    joined = np.concatenate([np.ravel(part) for part in parts] + [np.zeros(0)])
    return np.ascontiguousarray(joined if joined.size else np.zeros(1), dtype=dtype)
