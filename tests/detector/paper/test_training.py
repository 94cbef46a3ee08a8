"""The paper's network, its losses and its pruning, against what the paper says of them."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.detector.paper import detector, losses, network, training
from airtouch.detector.shared import pruning, training_set
from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import ACC, GYRO, PWM, FlightLog
from small_model import random_model, random_weights


def test_the_network_has_the_papers_weights() -> None:
    model = network.build_keras()
    assert model.input_shape == (None, 100, 3, 1) and model.output_shape == (None, 2)
    shapes = network.weight_shapes()
    assert sum(np.prod(s) for n, s in shapes.items() if n.endswith("kernel")) == 36_944
    assert model.count_params() == 36_944 + 66
    weights = random_weights()
    network.set_weights_of_keras(model, weights)
    assert all((network.weights_of_keras(model)[name] == weights[name]).all() for name in shapes)


def test_the_disturbance_force_loss_is_the_papers_equation() -> None:
    predicted = np.linspace(0, 1, 11)
    over = losses.disturbance_force_loss(np.ones(11), predicted, np)
    beside = losses.disturbance_force_loss(np.zeros(11), predicted, np)
    np.testing.assert_allclose(over, np.exp(np.abs(predicted - 1)) - 1)
    np.testing.assert_allclose(beside, np.exp(np.abs(predicted)) - 1)


@pytest.mark.parametrize("df_lambda", [0.0, 0.1, 2.0])
def test_the_whole_loss_is_cross_entropy_and_lambda_times_the_force_loss(df_lambda: float) -> None:
    logits = np.array([[2.0, -1.0], [0.3, 0.4], [-3.0, 1.0]], np.float32)
    target = np.array([[1, 0], [0, 1], [1, 1]], np.float32)
    p = np.exp(logits[:, 1]) / np.exp(logits).sum(axis=1)
    y, alert = target.T
    expected = (-y * np.log(p) - (1 - y) * np.log(1 - p)
                + df_lambda * np.where(alert == 1, np.exp(np.abs(p - 1)) - 1, np.exp(np.abs(p)) - 1))
    np.testing.assert_allclose(losses.edge_loss(df_lambda)(target, logits), expected, rtol=1e-5)
    with_weights = losses.edge_loss(df_lambda, (0.5, 4.0))(target, logits)
    np.testing.assert_allclose(with_weights, expected * np.where(y == 1, 4.0, 0.5), rtol=1e-5)


def test_the_schedule_rises_from_initial_to_final() -> None:
    steps = [pruning.polynomial_sparsity(t, 100, 0.1, 0.9) for t in range(121)]
    assert steps[0] == pytest.approx(0.1) and steps[100] == steps[120] == pytest.approx(0.9)
    assert steps[50] == pytest.approx(0.9 - 0.8 * 0.125)
    assert (np.diff(steps) >= 0).all()


@pytest.mark.parametrize("block", [1, 4])
def test_the_mask_drops_the_smallest(block: int) -> None:
    kernel = np.random.default_rng(0).normal(size=(2208, 16))
    mask = pruning.keep_mask(kernel, 0.8, block)
    assert mask.mean() == pytest.approx(0.2, abs=1e-4)
    blocks = mask.reshape(-1, block, 16)
    assert (blocks == blocks[:, :1]).all()
    energy = np.square(kernel).reshape(-1, block, 16).sum(axis=1)
    assert energy[blocks[:, 0] == 0].max() <= energy[blocks[:, 0] == 1].min()


def test_one_cycle_rises_and_falls() -> None:
    rates = [training.one_cycle(step, 100, peak=1.0) for step in range(101)]
    assert rates[0] == pytest.approx(0.04) and rates[30] == pytest.approx(1.0)
    assert rates[100] == pytest.approx(1e-4)
    assert int(np.argmax(rates)) == 30


def test_flights_are_held_out_whole_and_by_seed() -> None:
    assert len(training.held_out(3, 0)) == 0
    hold_out = training.held_out(80, 1)
    assert len(hold_out) == len(set(hold_out)) == 12
    assert (hold_out == training.held_out(80, 1)).all() and (hold_out != training.held_out(80, 2)).any()


def made_flight(seed: int, n: int = 900) -> FlightLog:
    """A hover in which the air shakes the drone at 7 Hz over a platform from sample 400 to 650."""
    rng, t = np.random.default_rng(seed), np.arange(n) / 100
    over = (np.arange(n) >= 400) & (np.arange(n) < 650)
    shake = np.where(over, 8.0, 1.0)[:, None] * np.sin(2 * np.pi * 7 * t[:, None] + rng.uniform(0, 6, 10))
    values = shake + 0.3 * rng.normal(size=(n, 10))
    columns = {name: values[:, i] * 0.1 for i, name in enumerate(ACC)} | {
        name: values[:, 3 + i] * 0.05 for i, name in enumerate(GYRO)} | {
        name: 45000 + 300 * values[:, 6 + i] for i, name in enumerate(PWM)}
    columns["acc_z_mps2"] = columns["acc_z_mps2"] + 9.81
    columns["zrange_m"] = np.where(over, 0.05, 0.8)
    return FlightLog({"t_s": t, **columns}, {"source": f"made-{seed}.csv", "sample_period_s": 0.01})


@pytest.mark.slow
def test_training_learns_prunes_and_repeats_to_the_bit() -> None:
    flights = [made_flight(seed) for seed in range(6)]
    reports: list[tuple[str, int, int]] = []
    model = training.train_paper(flights, epochs=6, progress=lambda *report: reports.append(report[:3]))
    assert ("features", 6, 6) in reports and any(stage == "epochs" for stage, _, _ in reports)
    assert model.metadata["held_out_accuracy"]["int8"] > 0.75
    kernel = model.weights["dense1.kernel"]
    assert (kernel == 0).mean() == pytest.approx(0.8, abs=1e-3)
    blocks = (kernel != 0).reshape(-1, 4, 16)
    assert (blocks.any(axis=1).mean()) == pytest.approx(0.2, abs=1e-3)
    layer = model.int8.layers[4]
    assert (layer.weights[kernel.T == 0] == 0).all()
    assert training.train_paper(flights, epochs=6).to_bytes() == model.to_bytes()


def test_training_settings_out_of_range_are_refused() -> None:
    for setting in ({"epochs": 0}, {"sparsity": 1.0}, {"block": 3}, {"df_lambda": -1.0}):
        with pytest.raises(AirTouchError, match="training"):
            training.train_paper([], **setting)
    with pytest.raises(AirTouchError, match="no setting 'steps'; known: epochs, "):
        training.train_paper([], steps=3)
    with pytest.raises(AirTouchError, match="no flight"):
        training.train_paper([])


def test_a_training_flight_is_not_taken_for_the_held_out_one_of_the_same_name(monkeypatch) -> None:
    trained, unseen = made_flight(0), made_flight(1)
    for folder, log in (("a", trained), ("b", unseen)):
        log.meta["source"] = f"{folder}/f.csv"
    monkeypatch.setattr(detector, "tune", lambda model, flights, physical_filter: flights)
    model = random_model()
    named = replace(model, metadata={"held_out": ["f.csv"]})
    assert detector.retune(named, [trained, unseen]) == [trained, unseen], "an older model has names only"
    hashed = replace(model, metadata={**named.metadata, "held_out_hashes": [training_set.flight_hash(unseen)]})
    assert detector.retune(hashed, [trained, unseen]) == [unseen]
