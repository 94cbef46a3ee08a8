"""The int8 network of a stream, defined over a whole flight at once.

Before the first row lies zero (the zero point). gap8/kernels/stream_int8 computes the same, one row at a time.
"""

from dataclasses import dataclass

import numpy as np

from airtouch.reference.networks.int8_network import Int8Layer, LayerKind
from airtouch.reference.networks.stream_graph import StreamLayer, follow, receptive_samples, taps_of


@dataclass(frozen=True)
class StreamNetwork:
    """A graph and the int8 layer of each of its layers.

    layers: input_shape (taps, 1, inputs); of kind DENSE, weights (outputs, taps * inputs), oldest tap first.
    """

    graph: tuple[StreamLayer, ...]
    layers: tuple[Int8Layer, ...]

    @property
    def head(self) -> Int8Layer:
        """The last layer."""
        return self.layers[-1]

    @property
    def channels(self) -> int:
        """Values a sample."""
        return self.graph[0].inputs

    @property
    def outputs(self) -> int:
        """Values of a row of the last layer."""
        return self.graph[-1].outputs

    @property
    def stride(self) -> int:
        """Samples to one row of outputs."""
        return int(np.prod([layer.stride for layer in self.graph]))

    @property
    def receptive_samples(self) -> int:
        """Samples of the past, the newest included, that an output depends on."""
        return receptive_samples(self.graph)

    @property
    def multiplications(self) -> int:
        """Multiplications with weights that are not zero, for one computed row."""
        return sum(int(np.count_nonzero(layer.weights)) for layer in self.layers)


def int8_layer(layer: StreamLayer, kind: LayerKind, arrays: dict[str, np.ndarray]) -> Int8Layer:
    """The int8 layer of a layer of the graph.

    arrays: weights int8 (outputs, ...), bias int32 (outputs,), weight_scale float32
    (outputs,), scale float32 and zero_point int32 of input and output, (2,).
    """
    (scale_in, scale_out), (zero_in, zero_out) = arrays["scale"], arrays["zero_point"]
    return Int8Layer(kind, (layer.taps, 1, layer.inputs), (1, 1, layer.outputs), (1, 1), float(scale_in),
                     int(zero_in), float(scale_out), int(zero_out), layer.relu,
                     arrays["weights"].reshape(layer.outputs, -1), arrays["bias"], arrays["weight_scale"])


def run_stream(network: StreamNetwork, quantised: np.ndarray) -> np.ndarray:
    """int8 head outputs (ceil(n / stride), outputs) of int8 samples (n, channels)."""
    int8 = iter(network.layers)  # `follow` takes the layers in order

    def apply(layer: StreamLayer, x: np.ndarray) -> np.ndarray:
        arrays = next(int8)
        patches = x if layer.reads else np.hstack(taps_of(layer, x, arrays.input_zero_point))
        return arrays.kind.run(arrays, patches).reshape(len(x), layer.outputs)[::layer.stride]

    return follow(network.graph, np.asarray(quantised, dtype=np.int8), apply, np.hstack)
