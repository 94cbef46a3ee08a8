"""The streaming int8 network of gap8/kernels, a flight in one call."""

from typing import Any

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.kernels.arrays import pointer
from airtouch.kernels.library import ffi, lib
from airtouch.kernels.network import flat_layers, valid_size
from airtouch.reference.networks.stream_int8 import StreamNetwork


def run_stream(network: StreamNetwork, quantised: np.ndarray) -> np.ndarray:
    """int8 head outputs (ceil(n / stride), outputs) of int8 samples (n, channels).

    Reference: `airtouch.reference.networks.stream_int8.run_stream`. Raises AirTouchError for samples of another
    width and for layers that do not fit each other.
    """
    x = np.ascontiguousarray(quantised, dtype=np.int8)
    if x.ndim != 2 or x.shape[1] != network.channels:
        raise AirTouchError(f"network: needs samples (n, {network.channels}), not {x.shape}")
    flat, keep = flat_stream(network)
    arena = ffi.new("int8_t[]", valid_size(lib.streamInt8BatchArena(flat)))
    outputs = np.empty((-(-len(x) // network.stride), network.outputs), dtype=np.int8)
    lib.streamInt8Flight(flat, pointer(x), len(x), arena, pointer(outputs))
    return outputs


def arena_bytes(network: StreamNetwork) -> int:
    """Bytes of state that the network keeps between samples."""
    flat, keep = flat_stream(network)
    return valid_size(lib.streamInt8BatchArena(flat))


def flat_stream(network: StreamNetwork) -> tuple[Any, list]:
    """The C view of a network, and what must outlive it.

    Raises AirTouchError for a graph other than convolutions in a row, the first one strided, and a head that reads
    the last of them.
    """
    *convs, head = network.graph
    strided = any(layer.stride > 1 for layer in network.graph[1:])
    if strided or any(layer.reads for layer in convs) or not head.reads or head.reads != tuple(
            range(head.reads[0], len(convs))):
        raise AirTouchError("network: the C kernel runs convolutions in a row and a head that reads the last of them")
    layers, keep = flat_layers(network.layers)
    dilations = np.array([layer.dilation for layer in convs], dtype=np.int32)
    zero_points = np.array([layer.input_zero_point for layer in network.layers[:-1]], dtype=np.int32)
    flat = ffi.new("flatStreamInt8_t *", {
        "layers": layers, "dilations": pointer(dilations), "zeroPoints": pointer(zero_points),
        "stride": network.stride, "firstSkip": head.reads[0]})
    return flat, [layers, dilations, zero_points, *keep]
