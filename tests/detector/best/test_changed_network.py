"""A network of another graph and with a fourth output is trained, scored, saved and exported, as the page says."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.detector import best
from airtouch.detector.best import batches, export, model, network, outputs, recipe, training
from airtouch.detector.best.operations import CAUSAL_CONV
from airtouch.detector.best.outputs import OUTPUTS, Output
from airtouch.detector.best.recipe import CHANNELS, Recipe
from airtouch.detector.shared import sensors
from airtouch.reference.networks.stream_graph import StreamLayer
from made_flight import SMALL, made_flight
from skips import needs


@pytest.fixture
def changed(monkeypatch):
    """The package after the page's changes: `layer2` reads one row, and there is a fourth output."""
    shipped_graph = Recipe.graph.fget

    def graph(self):
        layers = list(shipped_graph(self))
        layers[2] = StreamLayer("layer2", CAUSAL_CONV, 1, self.width, self.width, pruned=True)
        return tuple(layers)

    anew = (*OUTPUTS, Output("beside", 0.0, lambda _: 0.5, lambda over, *_: (1 - over).astype(np.float32)))
    for module in (batches, export, network, outputs, recipe, training):
        monkeypatch.setattr(module, "OUTPUTS", anew)
    monkeypatch.setattr(Recipe, "graph", property(graph))
    model._shipped.cache_clear()
    training.compiled_step.cache_clear()
    yield
    model._shipped.cache_clear()
    training.compiled_step.cache_clear()


@needs("tensorflow")
@pytest.mark.usefixtures("changed")
def test_a_changed_network_is_trained_saved_run_and_exported(tmp_path):
    log = made_flight(2)
    trained = best.fit([made_flight(0), made_flight(1)], seed=3, recipe=replace(SMALL, steps=3))
    assert trained.int8.layers[-1].weights.shape[0] == len(outputs.OUTPUTS)
    assert trained.int8.layers[2].weights.shape == (SMALL.width, SMALL.width)
    trained.save(tmp_path / "mine.npz")
    again = best.load(tmp_path / "mine.npz")
    assert best.run_float(log, again).signals["logits"].shape == (len(log), len(outputs.OUTPUTS))
    assert best.run(log, again).note == ""
    without = best.run(sensors.without(log, ("acceleration",)), again)
    assert without.note == "no acceleration in this log"  # without the figures of the shipped model
    assert again.c_sources() and CHANNELS == trained.int8.layers[0].weights.shape[1] // SMALL.first_taps
