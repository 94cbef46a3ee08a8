"""The paper's pipeline with the shipped model, on a simulated flight."""

from dataclasses import asdict, replace

import numpy as np
import pytest

import short_flights
from airtouch import reference, vehicle
from airtouch.detector import paper, registry
from airtouch.detector.paper import features
from airtouch.detector.paper.decoding import detections
from airtouch.detector.shared.channels import level_acceleration, thrust_axis
from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import GYRO, PWM, FlightLog
from airtouch.parameters import DEFAULT
from airtouch.reference.edge_pipeline import EdgePipelineConfig
from made_flight import made_flight


@pytest.fixture(scope="module")
def log():
    return short_flights.fly(1)[0]


@pytest.fixture(scope="module")
def model():
    return paper.load(None)


def easy(model, **changes):
    """The model with settings under which edges are plenty."""
    parameters = asdict(replace(DEFAULT, probability_entry=0.5, probability_exit=0.45, **changes))
    return replace(model, metadata={**model.metadata, "parameters": parameters, "physical_filter": False})


def test_edges_are_those_of_the_reference_pipeline(log, model):
    loose = easy(model)
    trace = paper.run(log, loose)
    settings, physical = paper.decoding_settings(loose)
    events = reference.edge_pipeline(
        level_acceleration(log), log.stack(GYRO), log.stack(PWM), vehicle.load(), vbat_v=log["vbat_V"],
        thrust_axis=thrust_axis(log), probability=trace.probability,
        config=EdgePipelineConfig(settings, physical_filter=physical))
    assert trace.edges and trace.edges == detections(events.edge, trace.probability)
    assert not physical


def test_a_vehicle_is_in_the_air_above_its_own_pwm():
    """At a mean PWM of 13,000 the brushless Crazyflie flies (its file says above 11,700), the other one does not."""
    log = made_flight(4)
    low = log.with_columns({name: np.full(len(log), 13000.0) for name in PWM})
    assert features.pipeline(low, vehicle=vehicle.load("crazyflie-2.1-brushless")).armed.any()
    assert features.pipeline(FlightLog(low.columns, {**low.meta, "vehicle": "crazyflie-2.1-brushless"})).armed.any()
    assert not features.pipeline(low).armed.any()


def test_the_filter_drops_edges_and_changes_no_probability(log, model):
    loose = easy(model)
    strict = replace(loose, metadata={**loose.metadata, "physical_filter": True})
    unfiltered, filtered = paper.run(log, loose), paper.run(log, strict)
    assert set(filtered.edges) <= set(unfiltered.edges)
    assert np.array_equal(unfiltered.probability, filtered.probability, equal_nan=True)


def test_probabilities_and_edges_do_not_depend_on_later_samples(log, model):
    loose = easy(model)
    length = 1200
    full, part = paper.run(log, loose), paper.run(log.slice(0, length), loose)
    assert np.array_equal(full.probability[:length], part.probability, equal_nan=True)
    assert part.edges == [e for e in full.edges if e.sample < length]


def test_the_down_range_is_no_input(log, model):
    blind = log.with_columns({"zrange_m": np.zeros(len(log))})
    assert paper.run(blind, easy(model)).edges == paper.run(log, easy(model)).edges


def test_tuning_states_what_it_chose(log, model):
    tuned = paper.tune(model, [log])
    assert tuned.metadata["tuned_on"] == [log.source.rsplit("/", 1)[-1]]
    assert 0.0 <= tuned.metadata["tuned_timed_f1"] <= 1.0 and np.isfinite(paper.lag_s(tuned))
    off = paper.tune(model, [log], physical_filter=False)
    assert off.metadata["physical_filter"] is False
    assert off.metadata["tuned_timed_f1"] >= 0.0 and paper.decoding_settings(off)[1] is False


def test_a_model_of_another_version_is_refused(log, model):
    foreign = replace(model, metadata={**model.metadata, "parameters": {"window": 3}})
    with pytest.raises(AirTouchError, match="train it again"):
        paper.run(log, foreign)


def test_every_registered_detector_offers_all(log):
    for name in registry.DETECTORS:
        module = registry.get(name)
        functions = ("run", "fit", "load", "lag_s", "parameters")
        assert all(callable(getattr(module, function)) for function in functions), name
    with pytest.raises(AirTouchError, match="known: "):
        registry.get("oracle")


def test_the_baseline_tells_edges_of_no_kind_and_no_probability(log):
    trace = registry.get("baseline").run(log)
    assert len(trace.probability) == len(log) and np.isnan(trace.probability).all()
    assert trace.edges and {e.kind for e in trace.edges} == {"edge"}
    assert all(0 <= e.sample < len(log) for e in trace.edges)


def test_the_disturbance_force_is_that_of_the_vehicle_which_the_log_names():
    log = made_flight(0)
    of = {name: log.with_columns({}, **({"vehicle": name} if name else {}))
          for name in ("", vehicle.DEFAULT_VEHICLE, "crazyflie-2.1-brushless", "house")}
    force = {name: features.flight_features(named).force for name, named in of.items()}
    assert np.array_equal(force[""], force[vehicle.DEFAULT_VEHICLE]) and np.array_equal(force[""], force["house"])
    brushless = features.flight_features(log, vehicle.load("crazyflie-2.1-brushless")).force
    assert np.array_equal(force["crazyflie-2.1-brushless"], brushless) and not np.array_equal(force[""], brushless)
    notes = {name: paper.run(named).note for name, named in of.items()}
    assert "vehicle 'house', of which no file is known" in notes.pop("house") and not any(notes.values())
