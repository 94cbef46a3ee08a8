"""Training that goes on from a model, with labels of its own, and free air; which flights a model knows."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from airtouch import logs
from airtouch.detector import best
from airtouch.detector.best import free_air, training
from airtouch.detector.evaluation import evaluate
from airtouch.detector.evaluation.data.dataset import Condition, FlightFile
from airtouch.detector.shared import sensors, training_set
from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import FlightLog
from airtouch.reference.edge_decoder import LOGITS
from made_flight import SMALL, made_flight


def blind(log: FlightLog) -> FlightLog:
    return FlightLog({k: v for k, v in log.columns.items() if k != "zrange_m"}, log.meta)


def test_labels_that_are_given_train_like_the_down_range(small):
    """The same edges, once read from the down range and once given, lead to the same bits."""
    flights = [made_flight(0), made_flight(1)]
    labels = [[logs.Edge(e.sample, e.kind, np.nan, np.nan) for e in logs.true_edges(log)] for log in flights]
    recipe = replace(SMALL, balance=1.0)
    by_labels = best.fit([blind(log) for log in flights], seed=3, recipe=recipe, pseudo_labels=labels)
    by_range = best.fit(flights, seed=3, recipe=recipe)
    assert by_labels.to_bytes() == by_range.to_bytes()


def test_training_goes_on_from_a_model(small):
    flights = [made_flight(2)]
    tuned = best.fit(flights, start=small, steps=SMALL.steps, peak_rate=1e-3)
    assert tuned.recipe.steps == SMALL.steps and tuned.recipe.width == small.recipe.width
    changes = [np.abs(tuned.weights[name] - small.weights[name]).max() for name in small.weights]
    assert 0 < max(changes) < 0.5
    for name in (layer.name for layer in SMALL.graph if layer.pruned):
        kernel = small.weights[f"{name}.kernel"]
        zero = ~kernel.reshape(-1, 4, kernel.shape[-1]).any(axis=1)
        blocks = tuned.weights[f"{name}.kernel"].reshape(-1, 4, kernel.shape[-1])
        assert zero.any() and not blocks.any(axis=1)[zero].any()
    assert best.fit(flights, start=small, steps=SMALL.steps, peak_rate=1e-3).to_bytes() == tuned.to_bytes()
    assert training_set.contains(tuned.metadata, made_flight(0)) and training_set.contains(tuned.metadata, flights[0])


def test_without_a_step_of_learning_the_weights_stay(small):
    tuned = best.fit([made_flight(2)], start=small, steps=2, peak_rate=1e-12, weight_decay=0.0)
    assert all(np.allclose(tuned.weights[name], small.weights[name], atol=1e-9) for name in small.weights)


def test_wrong_calls_are_one_line(small):
    with pytest.raises(AirTouchError, match="another shape"):
        best.fit([made_flight(2)], start=small, width=16)
    with pytest.raises(AirTouchError, match="1 pseudo-labels for 2 flights"):
        best.fit([made_flight(2), made_flight(3)], pseudo_labels=[None])


def test_pseudo_labels_are_the_detections_without_the_lag(small):
    model = replace(small, metadata={**small.metadata, "lag_s": 0.2, "decoder": {
        **small.metadata["decoder"], "entry_score": -6.0, "exit_score": -6.0}})
    log = blind(made_flight(7))
    labels, own = best.pseudo_labels([log, made_flight(7)], model)
    edges = best.run(log, model).edges
    assert own is None and edges and [e.sample for e in labels] == [max(e.sample - 20, 0) for e in edges]
    assert [e.kind for e in labels] == [e.kind for e in edges]


def test_pseudo_labels_of_a_log_without_a_sensor_are_less_the_lag_of_the_model_that_serves_it(small):
    keen = replace(small, metadata={**small.metadata, "lag_s": 0.5, "decoder_without": {}, "decoder": {
        **small.metadata["decoder"], "entry_score": -6.0, "exit_score": -6.0}})
    log = sensors.without(blind(made_flight(7)), ("motors",))
    ((*labels,),) = best.pseudo_labels([log], replace(small, spares={"motors": keen}))
    edges = best.run(log, keen).edges
    assert edges and [e.sample for e in labels] == [max(e.sample - 50, 0) for e in edges]


def test_free_air_is_drawn_and_has_no_targets():
    from airtouch.detector.best import batches

    recipe = best.Recipe(batch=16, crop=64, warm_up=16, free_air_share=0.5, edge_share=1.0)
    flight = batches.flight_of(made_flight(0), recipe)
    calm = batches.flight_of(made_flight(1), recipe, ())
    assert not calm.targets[:, :len(LOGITS)].any() and not len(calm.edges)

    def share_with_edges(free_air):
        """Share of the crops in which an output that the decoder reads has anything to say."""
        targets = [batches.batch([flight], recipe, np.random.default_rng(k), free_air)[1] for k in range(20)]
        return np.mean([y[..., :len(LOGITS)].any(axis=(1, 2)) for y in targets])

    sweeps_only, with_free_air = share_with_edges([]), share_with_edges([calm])
    assert with_free_air == pytest.approx(0.5 * sweeps_only, abs=0.12)


def test_free_air_is_read_from_folders_and_a_bad_file_is_told(tmp_path):
    calm = made_flight(0)
    calm.columns["zrange_m"] = np.full(len(calm), 0.8)
    logs.write(calm, tmp_path / "calm.csv")
    logs.write(sensors.without(calm, ("rates",)), tmp_path / "no_gyro.csv")
    logs.write(sensors.without(calm, ("rates", "motors")), tmp_path / "bare.csv")
    (tmp_path / "manifest.csv").write_text("file\n")
    messages = []
    assert len(free_air.read([tmp_path], messages.append)) == 2 and len(messages) == 1 and "bare.csv" in messages[0]
    logs.write(made_flight(1), tmp_path / "edge.csv")
    with pytest.raises(AirTouchError, match="edge.csv.*not free air"):
        free_air.read([tmp_path])
    with pytest.raises(AirTouchError, match="no such folder"):
        free_air.read([tmp_path / "nowhere"])


def test_a_score_says_that_the_model_knows_the_flight(small, tmp_path):
    for i, name in ((0, "renamed.csv"), (5, "new.csv")):
        logs.write(made_flight(i), tmp_path / name)
    files = [FlightFile(tmp_path / name, Condition(speed_mps=0.3)) for name in ("renamed.csv", "new.csv")]
    scores, _ = evaluate.evaluate(files, best, small)
    assert [s.in_training for s in scores] == [True, False]
    assert evaluate.as_json("best", scores, (), 0.0, {})["in_training"] == ["renamed.csv"]


def test_a_model_without_hashes_knows_names():
    log = made_flight(0)
    assert training_set.contains({"flights": ["made0.csv"]}, log)
    assert not training_set.contains({"flights": ["made0.csv"], "flight_hashes": ["0" * 16]}, log)
    assert not training_set.contains({}, log)


def test_a_model_knows_the_free_air_that_it_and_its_start_learnt_silence_from():
    start = SimpleNamespace(metadata=training_set.of([made_flight(0)], None, [made_flight(1)]))
    metadata = training_set.of([made_flight(2)], start, [made_flight(3)])
    assert [training_set.contains(metadata, made_flight(i)) for i in range(5)] == [True] * 4 + [False]


def test_a_training_that_was_stopped_goes_on_to_the_same_bits(tmp_path, monkeypatch):
    """As one that was not stopped, in the same process: the bits depend on how many threads TensorFlow has there."""
    from airtouch.detector.best import training

    pytest.importorskip("tensorflow")
    monkeypatch.setattr(training, "KEEP_EVERY", 10)
    flights = [made_flight(0), made_flight(1)]
    reports = []

    def stop(stage, step, _total, _note):
        reports.append((stage, step))
        if (stage, step) == ("steps", 50):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        best.fit(flights, seed=3, recipe=SMALL, work=tmp_path, progress=stop)
    (state,) = tmp_path.iterdir()
    with np.load(state) as saved:
        assert int(saved["step"]) == 50 and ("steps", 50) in reports
    reports.clear()
    resumed = best.fit(flights, seed=3, recipe=SMALL, work=tmp_path, progress=stop)
    assert ("steps", 50) not in reports and not list(tmp_path.iterdir())
    whole = best.fit(flights, seed=3, recipe=SMALL)
    for name, values in whole.weights.items():
        np.testing.assert_array_equal(resumed.weights[name], values, err_msg=name)
    assert resumed.to_bytes() == whole.to_bytes()


def test_a_damaged_state_starts_anew_and_says_so(tmp_path):
    state, rng = [_Variable(np.arange(6.0).reshape(2, 3))], np.random.default_rng(3)
    path, before = tmp_path / "state.npz", rng.bit_generator.state
    training._save_state(path, [variable.value for variable in state], np.random.default_rng(4), 7)
    whole = path.read_bytes()
    for damaged in (b"PK nothing", whole[:len(whole) // 2], b""):
        path.write_bytes(damaged)
        with pytest.warns(UserWarning, match="the training starts anew"):
            assert training._resume(path, state, rng) == 0
        assert rng.bit_generator.state == before
    path.write_bytes(whole)
    assert training._resume(path, state, rng) == 7 and rng.bit_generator.state != before


class _Variable:
    """What `training` uses of a TensorFlow variable."""

    def __init__(self, value):
        self.value, self.shape = value, value.shape

    def assign(self, value):
        self.value = value
