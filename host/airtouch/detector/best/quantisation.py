"""Float weights of `best` to int8, with scales as TensorFlow Lite chooses them."""

import math
from collections.abc import Sequence

import numpy as np

from airtouch.detector.best.network import Weights, window_logits
from airtouch.detector.best.operations import OPERATIONS
from airtouch.detector.best.recipe import Recipe
from airtouch.detector.shared.tensorflow import convert, read_weighted_layers
from airtouch.errors import AirTouchError
from airtouch.kernels.stream import arena_bytes
from airtouch.reference.networks.int8_network import DENSE
from airtouch.reference.networks.stream_int8 import StreamNetwork, int8_layer

REPRESENTATIVE = 400  #: windows that set the range of each activation
FEW = 5  #: windows of a flight; with fewer the two at its ends, on the ground, would be a large share


def windows(flights: Sequence[np.ndarray], recipe: Recipe, count: int = REPRESENTATIVE) -> np.ndarray:
    """Windows that set the range of each activation, (count, receptive samples, channels) float32.

    flights: channels of each flight, [(n, channels), ...]. The windows are evenly spaced over each flight; with fewer
    than FEW windows a flight none is at its ends, where the drone stands on the ground.
    Raises AirTouchError where no flight is as long as a window.
    """
    length = recipe.receptive_samples
    usable = [x for x in flights if len(x) >= length]
    if not usable:
        raise AirTouchError(f"training: no flight is as long as what the network reads, {length} samples")
    each = -(-count // len(usable))
    few = each < FEW
    ends = 0.5 / each if few else 0.0
    windows = [x[s:s + length] for x in usable
               for s in np.linspace(ends * (len(x) - length), (1 - ends) * (len(x) - length), each).astype(int)]
    return np.stack([windows[i * len(windows) // count] for i in range(min(count, len(windows)))]).astype(np.float32)


def quantise_network(weights: Weights, recipe: Recipe, representative: np.ndarray) -> tuple[StreamNetwork, bytes]:
    """The int8 network, and a TFLite file that computes the last row of a window with the same bits.

    representative: windows (n, receptive samples, channels). Weights symmetric, one scale an output channel.
    """
    content = convert(window_logits(weights, recipe.graph), (1, 1, recipe.receptive_samples, recipe.graph[0].inputs),
                      representative[:, None, None])
    return network_of(read_weighted_layers(content), recipe), content


def check_runs_in_c(recipe: Recipe) -> None:
    """Raise AirTouchError unless the C kernels as they are built take the network: its graph, shapes and arithmetic.

    Made weights, all 1, stand for trained ones, so that it is known before a training.
    """
    arrays: list[dict[str, np.ndarray]] = []
    for layer in recipe.graph:
        kernel = OPERATIONS[layer.operation].kernel_shape(layer)
        arrays.append({"weights": np.ones((layer.outputs, math.prod(kernel) // layer.outputs), np.int8),
                       "bias": np.zeros(layer.outputs, np.int32), "weight_scale": np.ones(layer.outputs, np.float32),
                       "scale": np.ones(2, np.float32), "zero_point": np.zeros(2, np.int32)})
    try:
        arena_bytes(network_of(arrays, recipe))
    except AirTouchError as error:
        new = any(OPERATIONS[layer.operation].kind is not DENSE for layer in recipe.graph)
        again = "; after a change of gap8/kernels, `make setup` builds them again" if new else ""
        raise AirTouchError(f"training: the C kernels do not take this network ({error}){again}") from None


def network_of(arrays: Sequence[dict[str, np.ndarray]], recipe: Recipe) -> StreamNetwork:
    """The int8 network from the arrays of each layer (`reference.networks.stream_int8.int8_layer`).

    Raises AirTouchError unless there is one set of arrays a layer, and each layer reads int8 values by the scale and
    the zero point that the layers before it give them.
    """
    graph = recipe.graph
    if len(arrays) != len(graph):
        raise AirTouchError(f"int8: {len(arrays)} operators with weights for {len(graph)} layers; the `window` of an "
                            "operation holds one")
    layers = tuple(int8_layer(layer, OPERATIONS[layer.operation].kind, part)
                   for layer, part in zip(graph, arrays, strict=True))
    for i, (layer, int8) in enumerate(zip(graph, layers, strict=True)):
        for j in layer.reads or range(max(i - 1, 0), i):
            source = layers[j]
            if (int8.input_scale, int8.input_zero_point) != (source.output_scale, source.output_zero_point):
                raise AirTouchError(f"int8: {layer.name} reads values of scale {int8.input_scale:.5g} and zero point "
                                    f"{int8.input_zero_point}, {graph[j].name} gives {source.output_scale:.5g} and "
                                    f"{source.output_zero_point}; in the `window` of an "
                                    "operation only what keeps the scale stands beside the operator with weights")
    return StreamNetwork(graph, layers)
