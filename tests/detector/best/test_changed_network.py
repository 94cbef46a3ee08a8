"""A network of another graph and with a fourth output is trained, scored, saved and exported, as the page says."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from airtouch import logs
from airtouch.cli.learning import train
from airtouch.detector import best
from airtouch.detector.best import batches, export, fit_settings, model, network, operations, outputs, recipe, training
from airtouch.detector.best.operations import CAUSAL_CONV
from airtouch.detector.best.outputs import OUTPUTS, Output
from airtouch.detector.best.quantisation import check_runs_in_c
from airtouch.detector.best.recipe import CHANNELS, Recipe
from airtouch.detector.evaluation.data import simulated
from airtouch.detector.shared import sensors
from airtouch.errors import AirTouchError
from airtouch.reference.motion_channels import NAMES
from airtouch.reference.networks.int8_network import LayerKind
from airtouch.reference.networks.stream_graph import StreamLayer
from made_flight import SMALL, made_flight
from skips import needs

PAGE = Path(__file__).parents[3] / "host/docs/change-the-network.md"


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
def test_a_changed_network_is_trained_saved_run_and_exported(tmp_path, monkeypatch):
    """By the page's own command on recorded flights; the shipped models no longer fit and have no part in it."""
    log = made_flight(2)
    (tmp_path / "flights").mkdir()
    for i in range(2):
        logs.write(made_flight(i), tmp_path / "flights" / f"{i}.csv")
    monkeypatch.setattr(fit_settings, "Recipe", lambda: replace(SMALL, steps=3))
    result = CliRunner().invoke(train.command, [str(tmp_path / "flights"), "--out", str(tmp_path / "mine.npz")])
    assert result.exit_code == 0, result.output + str(result.exception)
    again = best.load(tmp_path / "mine.npz")
    assert again.int8.layers[-1].weights.shape[0] == len(outputs.OUTPUTS)
    assert again.int8.layers[2].weights.shape == (SMALL.width, SMALL.width)
    assert best.run_float(log, again).signals["logits"].shape == (len(log), len(outputs.OUTPUTS))
    assert best.run(log, again).note == ""
    without = best.run(sensors.without(log, ("acceleration",)), again)
    assert without.note == "no acceleration in this log"  # without the figures of the shipped model
    assert again.c_sources() and CHANNELS == again.int8.layers[0].weights.shape[1] // SMALL.first_taps


def test_a_model_of_other_channels_is_refused_though_its_shape_is_the_same(small, monkeypatch, tmp_path):
    """As after the page's change of channels: one in the place of the empty one."""
    small.save(tmp_path / "old.npz")
    monkeypatch.setattr(model, "NAMES", (*NAMES[:-1], "pressure"))
    with pytest.raises(AirTouchError, match=r"old.npz: a model of other motion channels than ax, .*, pressure"):
        best.load(tmp_path / "old.npz")
    small.save(tmp_path / "own.npz")
    assert best.load(tmp_path / "own.npz").metadata == small.metadata
    monkeypatch.undo()
    with pytest.raises(AirTouchError, match="own.npz: a model of other motion channels"):
        best.load(tmp_path / "own.npz")


@needs("tensorflow")
@pytest.mark.parametrize("of_layer2, message", [
    ({"reads": (0, 1)}, r"reads the last of them\)$"), ({"outputs": 12}, r"layer 3 [^`]*$"),
    ({"operation": "unknown to C"}, r"layer 2 .* `make setup`")])
def test_a_network_that_the_built_kernels_do_not_take_is_refused_at_once(monkeypatch, tmp_path, of_layer2, message):
    """A graph of another form, and an arithmetic that the C library was built without."""
    graph = tuple(replace(layer, **of_layer2) if layer.name == "layer2" else layer for layer in SMALL.graph)
    without_c = replace(operations.OPERATIONS[CAUSAL_CONV], kind=LayerKind("new", 99, lambda layer, x: x))
    monkeypatch.setitem(operations.OPERATIONS, "unknown to C", without_c)
    monkeypatch.setattr(Recipe, "graph", property(lambda _: graph))
    monkeypatch.setattr(training, "fit", lambda *_, **__: pytest.fail("the training began"))
    with pytest.raises(AirTouchError, match=message):
        best.fit([made_flight()], recipe=SMALL)
    monkeypatch.setattr(simulated, "training_flights", lambda *_, **__: pytest.fail("flights were simulated"))
    result = CliRunner().invoke(train.command, ["--simulated", "4", "--out", str(tmp_path / "mine.npz")])
    assert isinstance(result.exception, AirTouchError) and re.search(message, str(result.exception))


def test_layers_of_other_widths_fit_the_kernels_with_the_head_of_the_page(monkeypatch):
    (line,) = re.findall(r'`(StreamLayer\("layer4", HEAD.*)`', PAGE.read_text(encoding="utf-8"))
    widths = (SMALL.width, 20, 16, 12)
    inner = [replace(layer, inputs=before, outputs=after)
             for layer, before, after in zip(SMALL.graph[1:4], widths[:-1], widths[1:], strict=True)]
    too_narrow, fits = ((SMALL.graph[0], *inner, head) for head in (SMALL.graph[-1], eval(line, vars(recipe))))
    monkeypatch.setattr(Recipe, "graph", property(lambda _: too_narrow))
    with pytest.raises(AirTouchError, match="layer 4 does not fit"):
        check_runs_in_c(SMALL)
    monkeypatch.setattr(Recipe, "graph", property(lambda _: fits))
    check_runs_in_c(SMALL)


@pytest.mark.parametrize("change, message", [
    ({"width": 10}, "multiple of 4, not 10"), ({"width": 68}, "4 to 64, not 68"), ({"width": 24.0}, "not 24.0"),
    ({"first_taps": 0}, "first_taps"), ({"taps": 9}, "1 to 8, not 9"), ({"dilations": ()}, "number of dilations"),
    ({"dilations": (1,) * 10}, "1 to 9, not 10"), ({"dilations": (1, 512)}, "1 to 256, not 512"),
    ({"muted": (CHANNELS,)}, "muted"), ({"sparsity": 1.0}, "below 1"), ({"sparsity": float("nan")}, "below 1")])
def test_a_shape_that_no_model_file_holds_is_refused_before_the_training(change, message):
    with pytest.raises(AirTouchError, match=message):
        best.fit([made_flight()], **change)


def test_the_widest_and_the_deepest_network_fit_the_kernels():
    """The C takes 10 convolutions and a window of at most 65,535 samples (gap8/kernels/stream_int8.h)."""
    widest = Recipe(width=64, first_taps=16, taps=8, dilations=(256,) * 9)
    assert sum(not layer.reads for layer in widest.graph) == 10
    assert widest.receptive_samples < 65_535
