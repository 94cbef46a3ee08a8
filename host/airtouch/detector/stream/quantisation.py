"""Float weights of the streaming network to int8, with scales as TensorFlow Lite chooses them."""

from collections.abc import Sequence

import numpy as np

from airtouch.detector.quantisation import convert, read_weighted
from airtouch.detector.stream.recipe import CHANNELS, STRIDE, Recipe
from airtouch.reference.int8_network import Int8Layer
from airtouch.reference.stream_int8 import StreamConv, StreamNetwork

REPRESENTATIVE = 400  #: windows that set the range of each activation
FEW = 5  #: windows of a flight


def windows(flights: Sequence[np.ndarray], recipe: Recipe, count: int = REPRESENTATIVE) -> np.ndarray:
    """Windows (count, receptive samples, 12), evenly spaced over the flights' channels [(n, 12), ...].

    Where there are few of each flight none is at its ends, which lie on the ground.
    """
    length = recipe.receptive_samples
    usable = [x for x in flights if len(x) >= length]
    each = -(-count // max(len(usable), 1))
    few = each < FEW
    ends = 0.5 / each if few else 0.0
    found = [x[s:s + length] for x in usable
             for s in np.linspace(ends * (len(x) - length), (1 - ends) * (len(x) - length), each).astype(int)]
    if few:
        found = [found[i * len(found) // count] for i in range(min(count, len(found)))]
    return np.stack(found[:count]).astype(np.float32)


def quantise(weights: dict[str, np.ndarray], recipe: Recipe, representative: np.ndarray) -> tuple[StreamNetwork, bytes]:
    """The streaming int8 network, and a TFLite file that computes the last row of a window with the same bits.

    representative: windows (n, receptive samples, 12). Weights symmetric, one scale an output channel.
    """
    content = convert(_graph(weights, recipe), (1, 1, recipe.receptive_samples, CHANNELS),
                      representative[:, None, None])
    return network_of(read_weighted(content), recipe), content


def _graph(weights: dict[str, np.ndarray], recipe: Recipe):
    """The network over one window (1, 1, samples, 12): its last row only, (1, 1, 1, 3)."""
    import tensorflow as tf

    def kernel(i: int) -> np.ndarray:
        return weights[f"layer{i}.kernel"][None]

    def network(x):
        x = tf.nn.relu(tf.nn.conv2d(x, kernel(0), (1, STRIDE), "VALID") + weights["layer0.bias"])
        rows = []
        for i, dilation in enumerate(recipe.dilations, start=1):
            x = tf.nn.conv2d(x, kernel(i), 1, "VALID", dilations=(1, dilation)) + weights[f"layer{i}.bias"]
            x = tf.nn.relu(x)
            rows.append(x[:, :, -1:, :])
        last = len(recipe.shapes) - 1
        head = kernel(last).reshape(1, 1, -1, recipe.shapes[-1][-1])
        return tf.nn.conv2d(tf.concat(rows, -1), head, 1, "VALID") + weights[f"layer{last}.bias"]

    return network


def network_of(arrays: Sequence[dict[str, np.ndarray]], recipe: Recipe) -> StreamNetwork:
    """The network from each layer's arrays: weights, bias, weight_scale, scale (in, out), zero_point (in, out)."""
    layers = [_layer(a, shape, relu=i < len(recipe.shapes) - 1)
              for i, (a, shape) in enumerate(zip(arrays, recipe.shapes, strict=True))]
    dilations = (1, *recipe.dilations)
    return StreamNetwork(tuple(StreamConv(la, d) for la, d in zip(layers[:-1], dilations, strict=True)), layers[-1],
                         STRIDE, 1)


def _layer(arrays: dict[str, np.ndarray], shape: tuple[int, int, int], relu: bool) -> Int8Layer:
    taps, before, after = shape
    (scale_in, scale_out), (zero_in, zero_out) = arrays["scale"], arrays["zero_point"]
    return Int8Layer("dense", (taps, 1, before), (1, 1, after), (1, 1), float(scale_in), int(zero_in),
                     float(scale_out), int(zero_out), relu, arrays["weights"].reshape(after, -1),
                     arrays["bias"], arrays["weight_scale"])
