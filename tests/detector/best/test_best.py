"""The streaming network: quantised, saved, run; against tflite-micro, NumPy and its own windowed form."""

import inspect
import io
import re
import sys
from dataclasses import asdict, replace

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from airtouch import kernels, logs
from airtouch.cli.learning import export as export_command
from airtouch.detector import best
from airtouch.detector.best import batches, export, quantisation, training
from airtouch.detector.best import model as model_file
from airtouch.detector.best.network import float_logits, keras_model, weight_names
from airtouch.detector.best.outputs import OUTPUTS, training_targets
from airtouch.detector.best.recipe import CHANNELS, ROW_STRIDE, Recipe
from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import COLUMNS, FlightLog
from airtouch.reference.edge_decoder import LOGITS
from airtouch.reference.motion_channels import NAMES
from airtouch.reference.networks.int8_network import quantise
from airtouch.reference.networks.stream_int8 import StreamNetwork, run_stream
from made_flight import SMALL, SMALL_SEED, made_flight


def test_the_same_arguments_give_the_same_bits(small):
    best.fit([made_flight(2)], seed=4, recipe=SMALL)  # what was compiled is used again and must remember nothing
    repeat = best.fit([made_flight(0), made_flight(1)], SMALL_SEED, best.FitSettings(recipe=SMALL))
    assert repeat.to_bytes() == small.to_bytes()


def test_what_is_compiled_is_known_by_all_that_it_reads():
    """A field that the compiled step read and COMPILED lacked would be taken from another recipe."""
    attributes = {name for part in (training.compiled_step.__wrapped__, *(o.weight for o in OUTPUTS), Recipe.graph.fget)
                  for name in re.findall(r"(?:recipe|self)\.(\w+)", inspect.getsource(part))}
    assert attributes - {"graph"} == set(training.COMPILED)


def test_the_small_network_of_the_tests_has_every_operation_of_the_shipped_graph():
    """Else an operation of a layer that SMALL lacks would be trained, quantised and compared nowhere."""
    assert {layer.operation for layer in SMALL.graph} == {layer.operation for layer in Recipe().graph}


def test_pruned_blocks_are_whole_and_exact(small):
    pruned = [i for i, layer in enumerate(SMALL.graph) if layer.pruned]
    assert len(pruned) >= 2
    for i in pruned:
        blocks = small.int8.layers[i].weights.reshape(-1, 4)
        assert np.mean(~blocks.any(axis=1)) >= SMALL.sparsity - 1e-9


def values_of_layers(network, quantised):
    """How many values each layer takes over these samples, by its name."""
    return {layer.name: len(np.unique(run_stream(StreamNetwork(network.graph[:i], network.layers[:i]), quantised)))
            for i, layer in enumerate(network.graph, 1)}


def test_c_equals_numpy_and_tflite_micro_on_windows(small):
    """Of a layer that is constant, as with ReLU where all weights are negative, nothing would be compared."""
    _check_against_tflite_micro(small, batches.channels_of(made_flight(5))[0], 200)


def test_the_shipped_model_equals_tflite_micro_on_real_windows(flights):
    model = best.load(None)
    windows = 0
    for path in sorted((flights / "airtouch").glob("*_h8*.csv.gz"))[:10]:
        windows += _check_against_tflite_micro(model, batches.channels_of(logs.read(path))[0], 100)
    assert windows > 0
    print(f"bit for bit equal to tflite-micro on {windows} windows of real flights")


def _check_against_tflite_micro(model, x: np.ndarray, count: int) -> int:
    """The stream's row at a sample equals tflite-micro over the window that ends there."""
    pytest.importorskip("tflite_micro")
    first = model.int8.layers[0]
    quantised = quantise(x, first.input_scale, first.input_zero_point)
    streamed = kernels.run_stream(model.int8, quantised)
    assert np.array_equal(streamed, run_stream(model.int8, quantised))
    few = {name: values for name, values in values_of_layers(model.int8, quantised).items() if values < 10}
    assert not few, f"layers that take few values, so that little is compared: {few}; choose another SMALL_SEED"
    rows = np.linspace(-(-model.recipe.receptive_samples // ROW_STRIDE), len(streamed) - 1, count).astype(int)
    assert np.array_equal(export.rows_of_tflite_micro(model, quantised, rows), streamed[rows])
    return len(rows)


def test_an_export_tells_of_a_model_that_is_not_tflite_micros(small, tmp_path):
    """A bias of one hidden layer is another one than in the TFLite file; the file is exported no more."""
    pytest.importorskip("tflite_micro")
    small.save(tmp_path / "own.npz")
    arguments = ["--out", str(tmp_path / "model")]
    result = CliRunner().invoke(export_command.command, [str(tmp_path / "own.npz"), *arguments])
    assert result.exit_code == 0 and "tflite-micro gives the same bits on 20 windows" in result.output
    layers = list(small.int8.layers)
    layers[2] = replace(layers[2], bias=layers[2].bias + 2000)
    replace(small, int8=replace(small.int8, layers=tuple(layers))).save(tmp_path / "other.npz")
    result = CliRunner().invoke(export_command.command, [str(tmp_path / "other.npz"), *arguments, "--force"])
    assert isinstance(result.exception, AirTouchError)
    assert re.search(r"tflite-micro differ on \d+ of 20", str(result.exception))


def test_an_export_without_tflite_micro_says_that_nothing_was_compared(small, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "tflite_micro", None)
    small.save(tmp_path / "own.npz")
    result = CliRunner().invoke(export_command.command, [str(tmp_path / "own.npz"), "--out", str(tmp_path / "model")])
    assert result.exit_code == 0 and "not compared with tflite-micro, which is not installed" in result.output


def test_the_float_network_is_what_was_quantised(small):
    """int8 logits follow the float ones within a few steps of the output scale."""
    x = batches.channels_of(made_flight(6))[0]
    logits = float_logits(small.weights, SMALL.graph, x)
    head = small.int8.head
    first = small.int8.layers[0]
    out = kernels.run_stream(small.int8, quantise(x, first.input_scale, first.input_zero_point))
    error = np.abs(head.output_scale * (out.astype(float) - head.output_zero_point) - logits)
    assert np.median(error) < 3 * head.output_scale


def test_the_float_network_is_the_one_that_keras_trained(small):
    model = keras_model(SMALL.graph)
    shapes = [v.shape for v in model.trainable_variables]
    model.set_weights([small.weights[name].reshape(shape)
                       for name, shape in zip(weight_names(SMALL.graph), shapes, strict=True)])
    x = batches.channels_of(made_flight(6))[0]
    expected = np.asarray(model(x[None]))[0]
    assert np.allclose(float_logits(small.weights, SMALL.graph, x), expected, atol=1e-4)


def test_it_is_causal_and_never_looks_at_the_range(small):
    log = made_flight(7)
    full = best.run(log, small)
    beginning = best.run(log.slice(0, 1500), small)
    assert beginning.edges == [e for e in full.edges if e.sample < 1500]
    assert np.array_equal(beginning.probability, full.probability[:1500])
    blind = FlightLog({k: v for k, v in log.columns.items() if k != "zrange_m"}, log.meta)
    assert best.run(blind, small).edges == full.edges


def test_a_mirrored_flight_has_mirrored_channels():
    """Reflection of the whole drone in its x-z plane: positions y, rotations about x and z turn over."""
    log = made_flight(8)
    mirrored = log.with_columns({
        "acc_y_mps2": -log["acc_y_mps2"], "gyro_x_radps": -log["gyro_x_radps"],
        "gyro_z_radps": -log["gyro_z_radps"], "m1_pwm": log["m4_pwm"], "m4_pwm": log["m1_pwm"],
        "m2_pwm": log["m3_pwm"], "m3_pwm": log["m2_pwm"]})
    assert np.allclose(batches.channels_of(mirrored)[0], batches.channels_of(log)[0] * batches.MIRROR, atol=1e-5)
    assert len(batches.MIRROR) == len(NAMES) == CHANNELS and "zrange_m" in COLUMNS


def test_the_file_gives_the_model_back(small, tmp_path):
    small.save(tmp_path / "m.npz")
    reloaded = best.load(tmp_path / "m.npz")
    assert reloaded.to_bytes() == small.to_bytes() and reloaded.digest == small.digest
    with pytest.raises(AirTouchError, match="--force"):
        small.save(tmp_path / "m.npz")


def test_a_file_with_a_layer_at_another_scale_than_the_layer_before_is_refused(small):
    layers = list(small.int8.layers)
    layers[2] = replace(layers[2], input_scale=1.5 * layers[2].input_scale)
    wrong = replace(small, int8=replace(small.int8, layers=tuple(layers)))
    with pytest.raises(AirTouchError, match=r"m.npz: int8: layer2 reads values of scale"):
        model_file.parse(wrong.to_bytes(), "m.npz")


@settings(max_examples=80, deadline=None)
@given(st.data())
def test_a_damaged_file_is_one_clear_line(small, data):
    content = bytearray(small.to_bytes())
    for _ in range(data.draw(st.integers(1, 8))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    content = bytes(content[:data.draw(st.integers(0, len(content)))])
    try:
        best.run(made_flight(0, 500), model_file.parse(content, "m.npz"))
    except AirTouchError as error:
        assert "\n" not in str(error) and "m.npz" in str(error) or "model" in str(error)


def in_the_file(model, **fields):
    """The model with these fields of its recipe in the file, which a recipe itself refuses."""
    return replace(model, metadata={**model.metadata, "recipe": {**asdict(model.recipe), **fields}})


@pytest.mark.parametrize(("change", "message"), [
    (lambda m: replace(m, recipe=replace(m.recipe, width=12)), "another shape"),
    (lambda m: in_the_file(m, dilations=[1, 2, 999]), "shape is missing"),
    (lambda m: in_the_file(m, width=68), "shape is missing"),
    (lambda m: replace(m, metadata={**m.metadata, "lag_s": "soon"}), "not a number"),
    (lambda m: replace(m, metadata={**m.metadata, "decoder": {"a": 1}}), "decoder settings"),
])
def test_a_wrong_model_is_named(small, change, message):
    with pytest.raises(AirTouchError, match=message):
        model_file.parse(change(small).to_bytes(), "m.npz")


def test_a_model_of_the_other_detector_is_refused(small):
    from airtouch.detector.paper import model as paper

    with pytest.raises(AirTouchError, match="this detector needs"):
        paper.parse(small.to_bytes(), "m.npz")
    assert io.BytesIO(small.to_bytes()).read(2) == b"PK"


def test_unknown_settings_are_refused():
    with pytest.raises(AirTouchError, match="known: width"):
        best.fit([made_flight()], epochs=3)


def test_representative_windows_cover_every_flight():
    recipe = Recipe(width=8, dilations=(1,))
    windows = quantisation.windows([np.full((50, CHANNELS), k) for k in range(4)], recipe, 8)
    assert windows.shape == (8, recipe.receptive_samples, CHANNELS)
    assert sorted(set(windows[:, 0, 0])) == [0, 1, 2, 3]


def test_the_first_outputs_are_what_the_decoder_reads():
    assert [output.name for output in OUTPUTS[:len(LOGITS)]] == list(LOGITS)


def test_goals_peak_where_their_edge_is_due():
    over = np.zeros(400, dtype=np.uint8)
    over[100:300] = 1
    edges = [logs.Edge(100, "entry", 0.8, 0.05), logs.Edge(300, "exit", 0.05, 0.8)]
    targets = training_targets(over, edges, SMALL)
    assert targets.shape == (400, len(OUTPUTS)) and targets.dtype == np.float32
    assert np.array_equal(np.flatnonzero(targets[:, 0]), np.arange(100, 300) + SMALL.over_delay)
    for column, edge in ((1, edges[0]), (2, edges[1])):
        assert targets[:, column].argmax() == edge.sample + SMALL.delay
        assert targets[:, column].max() == 1.0


@pytest.mark.parametrize("changed, message", [
    ({"dwell_steps": 20.5}, "dwell_steps is 20.5, not a whole number"), ({"arm_steps": -1}, "arm_steps is -1"),
    ({"hold_steps": 2**40}, "hold_steps"), ({"over_share": True}, "over_share is True")])
@pytest.mark.parametrize("where", ["decoder", "decoder_without"])
def test_decoder_settings_of_the_wrong_kind_are_named(small, changed, message, where):
    table = {**small.metadata["decoder"], **changed}
    wrong = replace(small, metadata={**small.metadata, where: table if where == "decoder" else {"motors": table}})
    with pytest.raises(AirTouchError, match=message):
        model_file.parse(wrong.to_bytes(), "m.npz")
