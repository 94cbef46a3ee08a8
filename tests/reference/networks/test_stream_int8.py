"""The streaming network against its definition, one output at a time in whole numbers (`exact_int8`)."""

import numpy as np
import pytest

import exact_int8
from airtouch.reference.networks.int8_network import DENSE
from airtouch.reference.networks.stream_graph import StreamLayer, follow, receptive_samples, taps_of
from airtouch.reference.networks.stream_int8 import StreamNetwork, int8_layer, run_stream

GRAPH = (StreamLayer("first", "conv", 3, 2, 4, stride=2), StreamLayer("second", "conv", 2, 4, 4, dilation=3),
         StreamLayer("third", "conv", 2, 4, 4, dilation=1, pruned=True),
         StreamLayer("head", "head", 2, 4, 3, relu=False, reads=(1, 2)))
SCALES = (0.05, 0.04, 0.03, 0.03, 0.08)  #: of the input, then of each layer's output
ZEROS = (-5, -128, -128, -128, 7)


def arrays_of(layer: StreamLayer, place: int, rng: np.random.Generator) -> dict[str, np.ndarray]:
    inputs = layer.taps * layer.inputs
    before = 3 if layer.name == "head" else place
    return {"weights": rng.integers(-127, 128, (layer.outputs, layer.taps, layer.inputs)).astype(np.int8),
            "bias": rng.integers(-400, 400, layer.outputs).astype(np.int32),
            "weight_scale": (0.05 / inputs * rng.uniform(0.5, 2.0, layer.outputs)).astype(np.float32),
            "scale": np.array([SCALES[before], SCALES[place + 1]], np.float32),
            "zero_point": np.array([ZEROS[before], ZEROS[place + 1]], np.int32)}


@pytest.fixture(scope="module")
def network() -> StreamNetwork:
    rng = np.random.default_rng(1)
    return StreamNetwork(GRAPH, tuple(int8_layer(layer, DENSE, arrays_of(layer, i, rng))
                                      for i, layer in enumerate(GRAPH)))


def by_definition(network: StreamNetwork, x: np.ndarray) -> list[list[int]]:
    """Rows of the head, by loops over time, taps and channels."""
    rows = {-1: [[int(v) for v in sample] for sample in x]}
    for i, (layer, int8) in enumerate(zip(network.graph, network.layers, strict=True)):
        outputs = []
        if layer.reads:
            for parts in zip(*(rows[k] for k in layer.reads), strict=True):
                inputs = [v for part in parts for v in part]
                outputs.append([exact_int8.output(int8, o, inputs) for o in range(layer.outputs)])
        else:
            before = rows[i - 1]
            past = [int8.input_zero_point] * layer.inputs
            for t in range(0, len(before), layer.stride):
                at = [t - (layer.taps - 1 - k) * layer.dilation for k in range(layer.taps)]
                inputs = [v for a in at for v in (before[a] if a >= 0 else past)]
                outputs.append([exact_int8.output(int8, o, inputs) for o in range(layer.outputs)])
        rows[i] = outputs
    return rows[len(network.graph) - 1]


@pytest.mark.parametrize("samples", [1, 2, 9, 60])
def test_a_flight_is_its_definition(network, samples):
    x = np.random.default_rng(samples).integers(-128, 128, (samples, 2)).astype(np.int8)
    outputs = run_stream(network, x)
    assert outputs.dtype == np.int8 and outputs.shape == (-(-samples // 2), 3)
    assert outputs.tolist() == by_definition(network, x)
    np.testing.assert_array_equal(run_stream(network, x.astype(np.int64)), outputs)


def test_each_output_takes_more_than_twenty_values(network):
    x = np.random.default_rng(9).integers(-128, 128, (200, 2)).astype(np.int8)
    outputs = run_stream(network, x)
    assert all(len(np.unique(column)) > 20 for column in outputs.T)


def test_what_a_network_says_of_itself(network):
    assert (network.channels, network.outputs, network.stride) == (2, 3, 2)
    assert network.head is network.layers[-1]
    # the first layer sees 3 samples; the second 3 rows further back, the third 1, each of 2 samples
    assert network.receptive_samples == 3 + 2 * 3 + 2 * 1 == receptive_samples(GRAPH)
    assert network.multiplications == sum(int(np.count_nonzero(layer.weights)) for layer in network.layers) > 90


def test_a_layer_of_the_graph_as_an_int8_layer():
    layer = StreamLayer("conv", "conv", 3, 2, 5, dilation=4)
    rng = np.random.default_rng(2)
    arrays = {"weights": rng.integers(-127, 128, (5, 3, 2)).astype(np.int8), "bias": np.arange(5, dtype=np.int32),
              "weight_scale": np.linspace(0.1, 0.5, 5).astype(np.float32),
              "scale": np.array([0.25, 0.5], np.float32), "zero_point": np.array([-3, 11], np.int32)}
    int8 = int8_layer(layer, DENSE, arrays)
    assert (int8.input_shape, int8.output_shape, int8.kernel) == ((3, 1, 2), (1, 1, 5), (1, 1))
    assert (int8.input_scale, int8.output_scale) == (0.25, 0.5)
    assert (int8.input_zero_point, int8.output_zero_point) == (-3, 11)
    assert int8.kind is DENSE and int8.relu and int8.output_min == 11
    assert not int8_layer(StreamLayer("head", "head", 1, 6, 5, relu=False), DENSE, arrays).relu
    np.testing.assert_array_equal(int8.weights, arrays["weights"].reshape(5, 6))
    np.testing.assert_array_equal(int8.bias, arrays["bias"])
    np.testing.assert_array_equal(int8.weight_scale, arrays["weight_scale"])


# the graph


def test_follow_gives_each_layer_what_it_reads():
    graph = (StreamLayer("a", "", 1, 1, 1), StreamLayer("b", "", 1, 1, 1), StreamLayer("c", "", 2, 1, 1, reads=(0, 1)),
             StreamLayer("d", "", 1, 1, 1))
    expression = follow(graph, "x", lambda layer, x: f"{layer.name}({x})", "+".join)
    assert expression == "d(c(a(x)+b(a(x))))"


def test_taps_come_oldest_first_with_the_past_before_the_first_row():
    x = np.arange(8, dtype=np.int8).reshape(4, 2)
    taps = taps_of(StreamLayer("a", "", 3, 2, 1, dilation=2), x, -9)
    assert [tap.tolist() for tap in taps] == [
        [[-9, -9]] * 4, [[-9, -9], [-9, -9], [0, 1], [2, 3]], [[0, 1], [2, 3], [4, 5], [6, 7]]]
    assert {tap.dtype for tap in taps} == {np.dtype(np.int8)}


def test_a_stride_spreads_the_taps_behind_it():
    graph = (StreamLayer("a", "", 4, 1, 1, stride=3), StreamLayer("b", "", 2, 1, 1, dilation=5, stride=2),
             StreamLayer("c", "", 3, 1, 1, reads=(0, 1)), StreamLayer("d", "", 2, 1, 1))
    assert receptive_samples(graph) == 1 + 3 + 1 * 5 * 3 + 0 + 1 * 6
    assert graph[0].shape == (4, 1, 1)
