"""The streaming network: C equals NumPy to the last bit, and both the windowed form."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from airtouch.errors import AirTouchError
from airtouch.kernels.stream import arena_bytes
from airtouch.kernels.stream import run_stream as run_c
from airtouch.reference.networks.int8_network import DENSE, Int8Layer
from airtouch.reference.networks.stream_graph import StreamLayer
from airtouch.reference.networks.stream_int8 import StreamNetwork, run_stream


def dense(rng, taps, channels, outputs, *, relu=True, sparsity=0.0, zero_point=-128) -> Int8Layer:
    """A layer of random weights, a share of its blocks of four zero."""
    weights = rng.integers(-127, 128, (outputs, taps * channels)).astype(np.int8)
    if sparsity:
        weights.reshape(outputs, -1, 4)[rng.random((outputs, taps * channels // 4)) < sparsity] = 0
    scale = np.float32(0.002) * rng.uniform(0.5, 2, outputs).astype(np.float32)
    return Int8Layer(DENSE, (taps, 1, channels), (1, 1, outputs), (1, 1), 0.02, zero_point, 0.03,
                     -128 if relu else 3, relu, weights, rng.integers(-3000, 3000, outputs).astype(np.int32), scale)


def network(seed, *, width=8, channels=4, taps=3, dilations=(1, 2, 4), stride=2, first_skip=1, sparsity=0.0,
            outputs=3):
    """A random network: one strided convolution, then the dilated ones, then a head."""
    rng = np.random.default_rng(seed)
    layers = [dense(rng, 4, channels, width, zero_point=-1, sparsity=sparsity)]
    layers += [dense(rng, taps, width, width, sparsity=sparsity) for _ in dilations]
    reads = tuple(range(first_skip, len(layers)))
    layers.append(dense(rng, len(reads), width, outputs, relu=False, sparsity=sparsity))
    graph = (StreamLayer("first", "conv", 4, channels, width, stride=stride),
             *(StreamLayer(f"conv{i}", "conv", taps, width, width, d) for i, d in enumerate(dilations)),
             StreamLayer("head", "head", len(reads), width, outputs, relu=False, reads=reads))
    return StreamNetwork(graph, tuple(layers))


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**31), width=st.sampled_from([4, 8, 12]), taps=st.integers(1, 4),
       stride=st.integers(1, 3), first_skip=st.integers(0, 2), sparsity=st.sampled_from([0.0, 0.7, 1.0]),
       outputs=st.integers(1, 6), dilations=st.lists(st.integers(1, 9), min_size=1, max_size=4),
       samples=st.integers(0, 120))
def test_c_has_the_bits_of_numpy(seed, width, taps, stride, first_skip, sparsity, dilations, samples, outputs):
    first_skip = min(first_skip, len(dilations))
    net = network(seed, width=width, taps=taps, dilations=tuple(dilations), stride=stride,
                  first_skip=first_skip, sparsity=sparsity, outputs=outputs)
    x = np.random.default_rng(seed).integers(-128, 128, (samples, net.channels)).astype(np.int8)
    assert np.array_equal(run_c(net, x), run_stream(net, x))


def test_an_output_depends_on_the_receptive_field_and_nothing_else():
    net = network(1)
    rng = np.random.default_rng(2)
    x = rng.integers(-128, 128, (200, net.channels)).astype(np.int8)
    last = run_stream(net, x)[-1]
    at = (len(x) - 1) // net.stride * net.stride  # the last sample that is computed
    perturbed = x.copy()
    perturbed[:at - net.receptive_samples + 1] = rng.integers(-128, 128, (at - net.receptive_samples + 1, 4))
    assert np.array_equal(run_stream(net, perturbed)[-1], last)
    influence = [not np.array_equal(run_stream(net, _bump(x, at - net.receptive_samples + 1, s))[-1], last)
                 for s in range(1, 40)]
    assert any(influence), "the oldest sample of the receptive field has no influence at all"


def _bump(x, row, step):
    perturbed = x.copy()
    perturbed[row] = (perturbed[row].astype(int) + 6 * step + 128) % 256 - 128
    return perturbed


def test_the_windowed_form_gives_the_same_bits():
    net = network(3, sparsity=0.5)
    x = np.random.default_rng(4).integers(-128, 128, (300, net.channels)).astype(np.int8)
    streamed = run_c(net, x)
    length = net.receptive_samples + -(net.receptive_samples - 1) % net.stride  # whole strides before the last
    for end in range(length + -length % net.stride + 1, len(x), 7 * net.stride):
        assert np.array_equal(run_stream(net, x[end - length:end])[-1], streamed[(end - 1) // net.stride])


def test_bad_networks_are_refused():
    valid = network(5)
    with pytest.raises(AirTouchError, match="needs samples"):
        run_c(valid, np.zeros((10, 5), np.int8))
    wider = StreamNetwork(valid.graph, valid.layers[:1] + network(6, width=12).layers[1:-1] + valid.layers[-1:])
    with pytest.raises(AirTouchError, match="layer 1 does not fit"):
        arena_bytes(wider)
    *convs, head = valid.graph
    with pytest.raises(AirTouchError, match="layer 4 does not fit"):
        arena_bytes(StreamNetwork((*convs, replace(head, reads=(2, 3))), valid.layers))
    for graph in ((*convs, replace(head, reads=(1, 3))), (*convs, replace(head, reads=())),
                  (convs[0], replace(convs[1], stride=2), *valid.graph[2:]), valid.graph[:1]):
        with pytest.raises(AirTouchError, match="convolutions in a row and a head"):
            arena_bytes(StreamNetwork(graph, valid.layers))
