"""A windowed int8 network that rolls over a flight: the answers of its windows, a sample at a time."""

from typing import Any, NamedTuple, Protocol

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.kernels.arrays import pointer
from airtouch.kernels.library import ffi, lib
from airtouch.kernels.network import Model, flat_layers, platform_probability
from airtouch.reference.networks.int8_network import Int8Network, quantise


class ScaledModel(Model, Protocol):
    """A model whose inputs are on a fixed scale, each with a mean and a deviation."""

    @property
    def scale(self) -> Any:
        """The scale; None for a model of windows, which does not roll."""


class Rolling(NamedTuple):
    """What a network needs to roll at a stride."""

    arena_bytes: int  #: of state
    ahead: int        #: samples by which an answer is earlier than its window's end
    receptive: int    #: samples that an answer depends on


def rolling_size(network: Int8Network, stride: int = 1) -> Rolling:
    """State and reach of a rolling network. Raises AirTouchError where it cannot roll at this stride."""
    flat, keep = flat_layers(network.layers)
    ahead, receptive = ffi.new("int32_t *"), ffi.new("int32_t *")
    size = lib.rollingInt8BatchArena(flat, stride, ahead, receptive)
    if not size:
        raise AirTouchError(f"network: cannot roll at stride {stride}; use one that its pools make together")
    return Rolling(size, ahead[0], receptive[0])


def run_rolling(network: Int8Network, quantised: np.ndarray, stride: int = 1,
                usable: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """int8 outputs (n, outputs) of int8 samples (n, columns), and where there is one, (n,) bool.

    Row i is what `run_int8` gives for the window that ends `ahead` samples after i. usable: (n,) bool;
    the network starts anew after each sample that is not.
    """
    x = np.ascontiguousarray(quantised, dtype=np.int8)
    rows, columns, channels = network.input_shape
    if x.ndim != 2 or x.shape[1] != columns * channels:
        raise AirTouchError(f"network: needs samples (n, {columns * channels}), not {x.shape}")
    size = rolling_size(network, stride)
    flat, keep = flat_layers(network.layers)
    good = np.ones(len(x), np.uint8) if usable is None else np.ascontiguousarray(usable, dtype=np.uint8)
    if good.shape != (len(x),):
        raise AirTouchError(f"network: usable must be ({len(x)},) as the samples, not {good.shape}")
    outputs, valid = np.zeros((len(x), network.outputs), np.int8), np.zeros(len(x), np.uint8)
    lib.rollingInt8Flight(flat, pointer(x), pointer(good), len(x), stride, ffi.new("int8_t[]", size.arena_bytes),
                          pointer(outputs), pointer(valid))
    return outputs, valid.astype(bool)


def fixed_scale(mean: np.ndarray, deviation: np.ndarray, features: np.ndarray) -> np.ndarray:
    """float32 inputs (n, columns) of features on a fixed scale. Reference: `paper.normalisation.FixedScale`."""
    x = np.ascontiguousarray(features, dtype=np.float32)
    if x.ndim != 2 or x.shape[1] != len(mean) or x.shape[1] > 8:
        raise AirTouchError(f"fixed scale: needs features (n, {len(mean)}), not {x.shape}")
    mean, inverse = np.asarray(mean, np.float32), (1.0 / np.asarray(deviation, np.float64)).astype(np.float32)
    out = np.empty_like(x)
    lib.fixedScaleBatch(pointer(mean), pointer(inverse), pointer(x), *x.shape, pointer(out))
    return out


def probability_of_samples(model: ScaledModel, features: np.ndarray, stride: int) -> np.ndarray:
    """P(over a platform), (n,), from fused features (n, c), by a model on a fixed scale that rolls over them.

    Held between two outputs; NaN before the first one and where a feature is not finite.
    """
    outputs, valid = answers_of_samples(model, features, stride)
    return held(platform_probability(outputs, model.int8.layers[-1].output_scale), valid, features)


def answers_of_samples(model: ScaledModel, features: np.ndarray, stride: int) -> tuple[np.ndarray, np.ndarray]:
    """int8 outputs (n, outputs) of fused features (n, c), and where there is one, (n,) bool, as `run_rolling` does."""
    inputs = fixed_scale(model.scale.mean, model.scale.deviation, features)
    first = model.int8.layers[0]
    return run_rolling(model.int8, quantise(inputs, first.input_scale, first.input_zero_point), stride,
                       np.isfinite(features).all(axis=1))


def held(probability: np.ndarray, valid: np.ndarray, features: np.ndarray) -> np.ndarray:
    """The probabilities (n,), each held until the next valid one; NaN until the first after features not finite."""
    usable = np.isfinite(features).all(axis=1)
    latest = np.maximum.accumulate(np.where(valid, np.arange(len(valid)), -1))
    broken = np.maximum.accumulate(np.where(usable, -1, np.arange(len(valid))))
    return np.where(latest > broken, probability[latest], np.nan)
