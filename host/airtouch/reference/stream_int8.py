"""The streaming int8 network, defined over a whole flight at once: causal dilated convolutions.

Row t of a convolution reads rows t, t - d, t - 2 d, ... of its input; before the first row lies
zero (the zero point). gap8/kernels/stream_int8 computes the same, one row at a time.
"""

from dataclasses import dataclass

import numpy as np

from airtouch.reference.int8_network import Int8Layer, requantise


@dataclass(frozen=True)
class StreamConv:
    """One causal convolution: a dense `layer` over its taps, and the rows between two taps.

    layer: kind "dense", input_shape (taps, 1, channels), weights (out, taps * channels), oldest tap first.
    """

    layer: Int8Layer
    dilation: int


@dataclass(frozen=True)
class StreamNetwork:
    """Convolutions in a row and a dense head that reads the newest row of each from `first_skip` on.

    The first convolution is computed on every `stride`-th sample, the first sample included.
    """

    convs: tuple[StreamConv, ...]
    head: Int8Layer
    stride: int
    first_skip: int

    @property
    def layers(self) -> tuple[Int8Layer, ...]:
        """All layers, the head last."""
        return (*(conv.layer for conv in self.convs), self.head)

    @property
    def channels(self) -> int:
        """Values a sample."""
        return self.convs[0].layer.input_shape[2]

    @property
    def receptive_samples(self) -> int:
        """Samples of the past, the newest included, that an output depends on."""
        rows = sum((conv.layer.input_shape[0] - 1) * conv.dilation for conv in self.convs[1:])
        return rows * self.stride + self.convs[0].layer.input_shape[0]

    @property
    def multiplications(self) -> int:
        """Multiplications with weights that are not zero, for one computed row."""
        return int(sum(np.count_nonzero(layer.weights) for layer in self.layers))


def run_stream(network: StreamNetwork, quantised: np.ndarray) -> np.ndarray:
    """int8 head outputs (ceil(n / stride), outputs) of int8 samples (n, channels)."""
    x = np.asarray(quantised, dtype=np.int8)
    rows = []
    for index, conv in enumerate(network.convs):
        x = _causal(conv, x)
        if index == 0:
            x = x[::network.stride]
        if index >= network.first_skip:
            rows.append(x)
    return _dense(network.head, np.hstack(rows))


def _causal(conv: StreamConv, x: np.ndarray) -> np.ndarray:
    taps, channels = conv.layer.input_shape[0], x.shape[1]
    reach = (taps - 1) * conv.dilation
    past = np.full((reach, channels), conv.layer.input_zero_point, dtype=np.int8)
    padded = np.vstack([past, x])
    return _dense(conv.layer, np.hstack([padded[k * conv.dilation:][:len(x)] for k in range(taps)]))


def _dense(layer: Int8Layer, x: np.ndarray) -> np.ndarray:
    centred = x.astype(np.int32) - layer.input_zero_point
    accumulator = centred @ layer.weights.T.astype(np.int32) + layer.bias
    multiplier, shift = layer.multipliers()
    return requantise(accumulator, multiplier, shift, layer.output_zero_point, layer.output_min)
