"""The streaming detector on logs that lack a sensor."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import airtouch
from airtouch import logs
from airtouch.crazyflie import replay
from airtouch.detector import best
from airtouch.detector.best import batches, sensor_note
from airtouch.detector.evaluation import evaluate
from airtouch.detector.evaluation.data.dataset import Condition, FlightFile
from airtouch.detector.shared import sensors
from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import GYRO, PWM, FlightLog
from made_flight import SMALL, made_flight


@pytest.mark.parametrize("sensor", sensors.SENSORS)
def test_the_channels_of_a_missing_sensor_are_zero_and_the_others_as_they_were(sensor):
    log = made_flight(3)
    complete, _ = batches.channels_of(log)
    x, _ = batches.channels_of(sensors.without(log, (sensor,)))
    silent = list(sensors.CHANNELS_OF[sensor])
    remaining = [i for i in range(12) if i not in silent]
    assert not x[:, silent].any() and complete[:, [i for i in silent if i != 11]].any(axis=0).all()
    assert np.array_equal(x[:, remaining], complete[:, remaining])


@pytest.mark.parametrize("sensor", sensors.SENSORS)
def test_the_shipped_model_runs_without_one_sensor_and_says_so(sensor):
    trace = best.run(sensors.without(made_flight(4), (sensor,)))
    assert f"no {sensor}" in trace.note and np.isfinite(trace.probability).all()
    assert not best.run(made_flight(4)).note


def test_two_missing_sensors_are_named():
    log = sensors.without(made_flight(4), ("acceleration", "motors"))
    with pytest.raises(AirTouchError, match="m1_pwm"):
        best.run(log)
    with pytest.raises(AirTouchError, match="m1_pwm"):
        evaluate.check(log, 1)
    with pytest.raises(AirTouchError, match="no sensor 'lidar'"):
        sensors.without(log, ("lidar",))


def test_a_detector_that_needs_all_sensors_refuses_a_log_without_one():
    log = sensors.without(made_flight(4), ("acceleration",))
    evaluate.check(log, 1)
    with pytest.raises(AirTouchError, match="acc_x_mps2"):
        evaluate.check(log)


def test_a_vehicle_that_flies_below_the_threshold_of_the_detectors_is_refused():
    """Its height tells that it flies, but the pipeline goes by the motors: each edge would be missed."""
    log = made_flight(4)
    low = log.with_columns({name: log[name] * 14000.0 / log[name].max() for name in PWM})
    assert logs.airborne(low).any()
    with pytest.raises(AirTouchError, match="no flight in this log"):
        evaluate.check(low)


def test_the_rates_alone_tell_flight_from_ground(flights):
    """Against the motors of recorded flights, a second before take-off and after it."""
    paths = sorted((flights / "airtouch").glob("*_h8*.csv.gz"))
    paths += sorted((flights / "airtouch-november").glob("*.gz"))[::6]
    for path in paths:
        log = logs.read(path)
        air = np.flatnonzero(logs.airborne(log))
        airborne = sensors.is_flying(log.stack(GYRO))
        assert not airborne[:max(air[0] - 30, 0)].any(), path
        assert airborne[air[0] + 100:air[-1]].mean() > 0.999, path


def test_a_log_without_motors_and_down_range_is_scored_where_its_rates_show_flight(flights):
    """Against the seconds in which the motors ran; there is no truth, so edges are neither missed nor false."""
    path = sorted((flights / "airtouch").glob("*_h8*.csv.gz"))[0]
    whole = logs.read(path)
    deaf = sensors.without(whole, ("motors",))
    log = FlightLog({name: x for name, x in deaf.columns.items() if name not in ("zrange_m", "z_m")}, deaf.meta)
    result = airtouch.evaluate([log])["per_flight"][0]
    assert result["airborne_s"] == pytest.approx(logs.airborne(whole).sum() * 0.01, rel=0.03)
    assert replay.position(FlightLog({n: x for n, x in log.columns.items() if n not in ("x_m", "y_m")}, log.meta),
                           0.3)["x_m"][-1] == pytest.approx(0.3 * result["airborne_s"])
    rng = np.random.default_rng(0)
    parked = log.with_columns({n: rng.normal(x[0], 1e-4, len(x)) for n, x in log.columns.items() if n != "t_s"})
    with pytest.raises(AirTouchError, match="no flight in this log.* rates"):
        evaluate.check(parked, 1)


def test_a_stuck_sensor_with_a_lost_sample_is_still_stuck():
    log = made_flight(4)
    stuck = np.full(len(log), 0.25)
    stuck[[700, 1300]] = np.nan
    with pytest.raises(AirTouchError, match="gyro y is constant"):
        evaluate.check(log.with_columns({"gyro_y_radps": stuck}))


def test_flight_is_told_causally():
    gyro = made_flight(5).stack(GYRO)
    assert np.array_equal(sensors.is_flying(gyro[:1000]), sensors.is_flying(gyro)[:1000])


def test_a_sensor_that_no_training_flight_has_is_silent_for_good():
    pytest.importorskip("tensorflow")
    logs = [sensors.without(made_flight(i), ("acceleration",)) for i in (0, 1)]
    model = best.fit(logs, recipe=SMALL)
    assert set(sensors.CHANNELS_OF["acceleration"]) <= set(model.recipe.muted)
    log = made_flight(6)
    assert best.run(log, model).edges == best.run(sensors.without(log, ("acceleration",)), model).edges


def test_crops_hold_whole_sensors_at_zero_as_often_as_the_recipe_says():
    recipe = best.Recipe(batch=8, crop=64, warm_up=16, silent_acceleration=0.3, silent_rates=0.2, silent_motors=0.4)
    flight = batches.flight_of(made_flight(0), recipe)
    rng, count = np.random.default_rng(0), np.zeros(3)
    for _ in range(150):
        x, _ = batches.batch([flight], recipe, rng)
        zero = ~x.any(axis=1)
        count += [zero[:, list(sensors.CHANNELS_OF[s])].all(axis=1).sum() for s in sensors.SENSORS]
    assert np.allclose(count / 1200, [0.3, 0.2, 0.4], atol=0.05)


def test_landings_and_take_offs_are_in_the_crops():
    """The last second is in view far more often than where crops lie anywhere."""
    recipe = best.Recipe(batch=1, crop=512, warm_up=128, warp=0.0, mirror=0.0, phases=0.3, edge_share=0.4)
    flight = batches.flight_of(made_flight(0), recipe)
    rng = np.random.default_rng(0)
    starts = np.array([batches.crop_start(flight, recipe, 1.0, rng) for _ in range(2000)])
    last = np.mean(starts + recipe.crop >= len(flight.x) - 1)
    first = np.mean(starts <= np.argmax(flight.airborne) - batches.AHEAD)
    assert 0.10 < last < 0.25 and 0.10 < first < 0.25


@pytest.mark.parametrize("sensor", sensors.SENSORS)
def test_sample_by_sample_is_the_same_as_at_once(sensor):
    from airtouch.crazyflie.view.host_detector import HostDetector

    log = sensors.without(made_flight(4, 1500), (sensor,))
    pieces = HostDetector(missing=sensors.missing_sensors(log))
    for first in range(0, len(log), 7):
        pieces.next({name: values[first:first + 7] for name, values in log.columns.items()})
    at_once = best.run(log)
    assert np.array_equal(pieces.trace(log).probability, at_once.probability)
    assert pieces.trace(log).edges == at_once.edges
    with pytest.raises(AirTouchError, match="no column"):
        HostDetector().next(log.columns)


def test_a_model_may_decode_otherwise_without_a_sensor(small, tmp_path):
    deaf = {**small.metadata["decoder"], "entry_score": 99.0, "exit_score": 99.0, "late_entry": 99.0,
            "late_exit": -99.0}
    keen = {**deaf, "entry_score": -9.0, "exit_score": -9.0}
    model = replace(small, metadata={**small.metadata, "decoder": deaf, "decoder_without": {"motors": keen}})
    model.save(tmp_path / "m.npz")
    model = best.load(tmp_path / "m.npz")
    log = made_flight(4)
    assert not best.run(log, model).edges and best.run(sensors.without(log, ("motors",)), model).edges
    assert not best.run(sensors.without(log, ("acceleration",)), model).edges
    faulty = replace(small, metadata={**small.metadata, "decoder_without": {"motors": {"entry_score": "high"}}})
    faulty.save(tmp_path / "w.npz")
    with pytest.raises(AirTouchError, match="entry_score is 'high', not a number"):
        best.load(tmp_path / "w.npz")


def test_a_log_without_a_sensor_is_served_by_the_spare_and_scored_with_its_lag(small):
    spare = replace(small, metadata={**small.metadata, "lag_s": small.metadata["lag_s"] + 0.2})
    model = replace(small, spares={"motors": spare})
    log, file = made_flight(0), FlightFile(Path("f.csv"), Condition(speed_mps=0.3))
    assert best.model_for(model, log) is model
    deaf = sensors.without(log, ("motors",))
    assert best.model_for(model, deaf) is spare
    with_it = evaluate.evaluate_flight(file, deaf, best, model).score
    by_spare = evaluate.evaluate_flight(file, deaf, best, spare).score
    assert with_it.as_dict() == by_spare.as_dict()


def test_the_note_has_the_measured_figures():
    all_sensors, no_acceleration = sensor_note.figures()["all"], sensor_note.figures()["acceleration"]
    text = sensor_note.note(("acceleration",), shipped=True)
    first = text.index(f"{no_acceleration['missed']:.1%} missed of {no_acceleration['edges']}")
    assert first < text.index(f"{all_sensors['missed']:.1%} missed of")
    assert "\n" not in text
    assert not sensor_note.note((), shipped=True)
    log = made_flight(0)
    one_axis = FlightLog({name: log[name] for name in log.columns if not name.startswith("acc_") or "_z_" in name}, {})
    absent = sensors.missing_sensors(one_axis)
    columns = sensors.columns_missing_in_part(one_axis, absent)
    assert sensor_note.note(absent, False, columns) == "acceleration without acc_x_mps2, acc_y_mps2 in this log"
    assert not sensors.columns_missing_in_part(sensors.without(log, ("acceleration",)), absent)
    assert set(sensor_note.figures()) == {"all", *sensors.SENSORS}


def test_only_the_shipped_model_is_said_to_have_the_measured_figures(small):
    log = sensors.without(made_flight(4), ("motors",))
    shipped = best.load(None)
    assert "unseen edges" in best.run(log).note and "unseen edges" in best.run(log, shipped).note
    other_decoder = replace(shipped, metadata={**shipped.metadata, "decoder_without": {}})
    for model in (small, other_decoder):
        assert best.run(log, model).note == "no motors in this log"
