"""A light vehicle, which hovers below the 15,000 PWM of the authors' drone, through training, scoring and maps."""

import re
from dataclasses import replace
from importlib import resources

import numpy as np
import pytest
from click.testing import CliRunner

import airtouch
from airtouch import logs
from airtouch import vehicle as vehicles
from airtouch.cli.learning import train
from airtouch.crazyflie import replay
from airtouch.detector import baseline, best
from airtouch.detector.best import batches
from airtouch.detector.evaluation import evaluate
from airtouch.detector.evaluation.data import simulated
from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import PWM, FlightLog
from made_flight import SMALL, made_flight

TRUE = [(1200, "entry"), (1700, "exit")]  #: where `made_flight` steps over its platform


@pytest.fixture
def light(tmp_path):
    """The file of a vehicle that flies above a mean PWM of 6,000."""
    text = (resources.files("airtouch") / "vehicles/crazyflie-2.1-brushless.toml").read_text()
    (tmp_path / "light.toml").write_text(re.sub(r"(?m)^arm_pwm = \d+", "arm_pwm = 6000", text))
    return tmp_path / "light.toml"


def light_flight(vehicle: object = "", seed: int = 0) -> FlightLog:
    """`made_flight`, which hovers at 14,100 and takes off with half a second at 18,000."""
    log = made_flight(seed)
    pwm = {name: 0.3 * log[name] for name in PWM}
    for values in pwm.values():
        values[150:200] = 18000.0
    return FlightLog({**log.columns, **pwm}, {**log.meta, "vehicle": str(vehicle)})


def model_of(light) -> best.BestModel:
    """The shipped model with the vehicle's PWM in the air; its weights do not matter here."""
    shipped = best.load(None)
    return replace(shipped, recipe=replace(shipped.recipe, vehicle=vehicles.load(light)))


def test_it_is_scored_by_a_model_for_it_and_refused_by_one_that_is_not(light, tmp_path):
    log = light_flight(light)
    model_of(light).save(tmp_path / "light.npz")
    assert airtouch.detect(log, model=tmp_path / "light.npz").probability[250:].any()
    (score,) = airtouch.evaluate([log], speed_mps=0.3, model=tmp_path / "light.npz")["per_flight"]
    assert len(score["edges"]) == 2 and score["airborne_s"] == pytest.approx(23.5)
    with pytest.raises(AirTouchError, match="no flight in this log .*15000"):
        airtouch.detect(log)  # the shipped model reports edges above 15,000
    evaluate.check(log)  # the paper's method goes by the log's vehicle
    with pytest.raises(AirTouchError, match="no flight in this log"):
        evaluate.check(light_flight())


def test_its_down_range_labels_it(light):
    named, unnamed = light_flight(light), light_flight()
    for log, vehicle in ((named, None), (unnamed, vehicles.load(light))):
        flight = batches.flight_of(log, replace(SMALL, vehicle=vehicle))
        assert flight.edges.tolist() == [sample for sample, _ in TRUE]
    assert not len(batches.flight_of(unnamed, SMALL).edges)
    assert replay.position(named, 0.3)["x_m"][-1] == pytest.approx(0.3 * 23.5, abs=0.01)


def test_the_map_of_its_true_edges_holds_them(light):
    edge_map = pytest.importorskip("airtouch.detector.evaluation.edge_map", exc_type=ImportError)
    assert [(e.sample, e.kind) for e in edge_map.true_edges_of(light_flight(light)).edges] == TRUE


def test_the_other_detectors_are_trained_by_the_same_edges(light, monkeypatch):
    truths = []
    monkeypatch.setattr(baseline.tuning, "choose", lambda candidates, truth, _: truths.append(truth) or
                        (candidates[0], 0.0, 0.0))
    baseline.fit([light_flight(light)])
    assert [(e.sample, e.kind) for e in truths[0][0]] == TRUE
    training = pytest.importorskip("airtouch.detector.paper.training", exc_type=ImportError)
    windows = training.training_windows([light_flight(light)], lambda *_: None)
    assert windows.over.sum() == 500 and len(windows.over) > 2000


def test_simulated_flights_of_it_can_be_trained_on(light, monkeypatch):
    craft = vehicles.load(light)
    flown = light_flight(craft.name)
    monkeypatch.setattr(simulated.batch, "flights", lambda *_, **__: iter([flown]))
    assert simulated.training_flights(1, vehicle=craft)[0] == [flown]
    with pytest.raises(AirTouchError, match="only 0 of 2"):
        simulated.training_flights(1)


def test_train_takes_its_flights_with_its_file(light, tmp_path):
    pytest.importorskip("tensorflow", reason="training needs the extra 'train'")
    (tmp_path / "mine").mkdir()
    logs.write(light_flight(), tmp_path / "mine" / "f.csv")
    best.fit([made_flight(8)], recipe=SMALL).save(tmp_path / "old.npz")
    arguments = [tmp_path / "mine", "--start", tmp_path / "old.npz", "--steps", SMALL.steps, "--out",
                 tmp_path / "new.npz"]
    refused = CliRunner().invoke(train.command, [str(a) for a in arguments])
    assert "no flight that can be trained on" in str(refused.exception)
    result = CliRunner().invoke(train.command, [str(a) for a in (*arguments, "--vehicle", light)])
    assert result.exit_code == 0, result.output
    assert best.arm_pwm(best.load(tmp_path / "new.npz")) == 6000
    assert np.isfinite(best.load(tmp_path / "new.npz").metadata["lag_s"])
