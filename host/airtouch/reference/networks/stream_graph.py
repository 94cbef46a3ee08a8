"""The graph of a stream's network: its layers, and how a row of samples passes through them.

A stream's network takes one sample at a time and gives one row of outputs for every `stride`-th sample. This
module holds what float, int8, Keras, TensorFlow and C have in common: the list of layers and the way through it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

Rows = TypeVar("Rows")


@dataclass(frozen=True)
class StreamLayer:
    """One layer of a stream's network.

    name: prefix of its arrays in a model file. operation: what it does with the rows that it reads
    (`detector.best.operations`). inputs: values of a row that it reads, of each tap. outputs: values of a row that it
    gives. taps: rows that it reads; with `reads` one of each of those layers. dilation: rows between two taps. stride:
    rows of its input to one of its own. relu: negative outputs become 0. pruned: training sets blocks of its weights to
    zero. reads: indices of the layers whose newest rows it reads side by side; () is the past of the layer before, or
    of the network's input.
    """

    name: str
    operation: str
    taps: int
    inputs: int
    outputs: int
    dilation: int = 1
    stride: int = 1
    relu: bool = True
    pruned: bool = False
    reads: tuple[int, ...] = ()

    @property
    def shape(self) -> tuple[int, int, int]:
        """(taps, inputs, outputs): the shape of a kernel that has a weight for each of them."""
        return self.taps, self.inputs, self.outputs


def follow(graph: Sequence[StreamLayer], x: Rows, apply: Callable[[StreamLayer, Rows], Rows],
           join: Callable[[list[Rows]], Rows]) -> Rows:
    """The last layer's output for an input x.

    apply(layer, x): a layer's output for its input. join(parts): the outputs of several layers side by side.
    """
    outputs: list[Rows] = []
    for layer in graph:
        before = join([outputs[i] for i in layer.reads]) if layer.reads else (outputs[-1] if outputs else x)
        outputs.append(apply(layer, before))
    return outputs[-1]


def taps_of(layer: StreamLayer, x: np.ndarray, past: float) -> list[np.ndarray]:
    """What a convolution multiplies with each of its taps, oldest first: [(n, inputs), ...] of its input x (n, inputs).

    past: what lies before the first row.
    """
    before = np.full(((layer.taps - 1) * layer.dilation, x.shape[1]), past, dtype=x.dtype)
    padded = np.vstack([before, x])
    return [padded[k * layer.dilation:][:len(x)] for k in range(layer.taps)]


def receptive_samples(graph: Sequence[StreamLayer]) -> int:
    """Samples of the past, the newest included, that an output depends on."""
    samples, stride = 1, 1
    for layer in graph:
        if not layer.reads:
            samples += (layer.taps - 1) * layer.dilation * stride
        stride *= layer.stride
    return samples
