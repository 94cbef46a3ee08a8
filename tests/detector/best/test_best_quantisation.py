"""Int8 scales of `best`: the windows that set them, and that a layer reads what the layer before it gives."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.detector.best import operations
from airtouch.detector.best.network import weight_shapes
from airtouch.detector.best.operations import CAUSAL_CONV
from airtouch.detector.best.quantisation import quantise_network, windows
from airtouch.detector.best.recipe import CHANNELS, Recipe
from airtouch.errors import AirTouchError
from made_flight import SMALL
from skips import needs


@pytest.mark.parametrize("flights", [3, 87, 100, 150, 300])
def test_windows_are_not_all_at_the_ends_of_flights(flights):
    recipe = Recipe()
    spare_rows = 600
    length = recipe.receptive_samples + spare_rows
    along = np.repeat(np.arange(length, dtype=np.float32)[:, None], CHANNELS, axis=1)
    chosen = windows([along + 10000 * i for i in range(flights)], recipe)
    assert chosen.shape == (400, recipe.receptive_samples, CHANNELS)
    starts, of_flight = chosen[:, 0, 0] % 10000, chosen[:, 0, 0] // 10000
    assert np.mean((starts > 0) & (starts < spare_rows)) >= 0.5
    counts = np.bincount(of_flight.astype(int), minlength=flights)
    assert counts.max() - counts.min() <= 1, "every flight has its part"


def test_flights_that_are_all_too_short_are_told():
    recipe = Recipe()
    with pytest.raises(AirTouchError, match="no flight is as long as what the network reads"):
        windows([np.zeros((recipe.receptive_samples - 1, CHANNELS), np.float32)], recipe)


def larger_of_two(x):  # TensorFlow Lite gives it a scale of its own
    import tensorflow as tf

    return tf.maximum(x, tf.reverse(x, [2]))


def larger_of_neighbours(x):
    import tensorflow as tf

    return tf.nn.max_pool2d(tf.pad(x[:, :, 1:], ((0, 0), (0, 0), (2, 0), (0, 0))), (1, 2), 1, "VALID")


def twice(x):
    import tensorflow as tf

    return tf.nn.conv2d(x, np.eye(x.shape[-1], dtype=np.float32)[None, None], 1, "VALID") + np.ones(x.shape[-1], "f4")


def quantised(before, monkeypatch):
    """The int8 network of SMALL with random weights, where this stands before the weights of `layer2`."""
    conv = operations.OPERATIONS[CAUSAL_CONV]
    changed = replace(conv, window=lambda layer, kernel, bias, x: conv.window(layer, kernel, bias, before(x)))
    graph = tuple(replace(layer, operation="changed") if layer.name == "layer2" else layer for layer in SMALL.graph)
    monkeypatch.setitem(operations.OPERATIONS, "changed", changed)
    monkeypatch.setattr(Recipe, "graph", property(lambda _: graph))
    rng = np.random.default_rng(0)
    weights = {name: rng.normal(0.1, 1.0, shape).astype(np.float32) for name, shape in weight_shapes(graph).items()}
    samples = rng.normal(size=(20, SMALL.receptive_samples, CHANNELS)).astype(np.float32)
    return quantise_network(weights, SMALL, samples)[0]


@needs("tensorflow")
def test_a_layer_that_reads_at_another_scale_than_the_layer_before_gives_is_refused(monkeypatch):
    with pytest.raises(AirTouchError, match="int8: layer2 reads values of scale .* layer1 gives"):
        quantised(larger_of_two, monkeypatch)


@needs("tensorflow")
def test_a_window_with_two_operators_with_weights_is_refused(monkeypatch):
    with pytest.raises(AirTouchError, match="6 operators with weights for 5 layers"):
        quantised(twice, monkeypatch)


@needs("tensorflow")
def test_a_window_may_hold_what_keeps_the_scale(monkeypatch):
    assert len(quantised(larger_of_neighbours, monkeypatch).layers) == len(SMALL.graph)
