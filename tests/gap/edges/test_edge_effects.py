"""What effects add at edges against flights that were flown with them, and what is left of it without a velocity."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from airtouch import vehicle as vehicles
from airtouch.gap.edges import edge_effects
from airtouch.gap.edges.edge_effects import added_response
from airtouch.gap.edges.edge_response import KINDS, edge_floor_of, edges_of, logged, whitened
from airtouch.gap.flights.flight import ready
from airtouch.logs.edges import Edge
from airtouch.logs.flight_log import VELOCITY, FlightLog
from airtouch.simulation import batch, scenario
from airtouch.simulation.effects import activate

VEHICLE = vehicles.load("crazyflie-2.1-flow")
STEP = {"range_step": {"residual": 0.02, "kick": 0.05}}
FLOW = {"flow_scale": {"share": 0.0, "transient": 0.3}}


def fly(count, effects=()):
    """Flights of one seed over platforms, with these effects alone."""
    left_out = [e for e in scenario.load("paper-mixed").table.get("effects", {}) if e not in dict(effects)]
    logs = batch.flights("paper-mixed", count, vehicle=VEHICLE, effects=effects, without=left_out, seed=2, workers=1)
    return [ready(log, VEHICLE) for log in logs]


def without_velocity(flight):
    """The flight as a log without velocities has it."""
    kept = {name: values for name, values in flight.log.columns.items() if name not in VELOCITY}
    return ready(FlightLog(kept, flight.log.meta), VEHICLE)


def mean_response(floor, flights, kind):
    """Mean whitened response of all edges of a kind."""
    return np.mean([whitened(floor, f, e) for f in flights for e in edges_of(f) if e.kind == kind], axis=0)


def mean_added(floor, flights, kind, effects):
    """What effects add to it by the simulator."""
    return np.mean([added_response(floor, f, e, activate(effects)) for f in flights for e in edges_of(f)
                    if e.kind == kind], axis=0)


@pytest.mark.parametrize(("height", "platform"), [(0.34, 0.13), (0.449, 0.2), (0.45, 0.31)])
def test_the_platform_simulated_is_as_high_as_the_one_flown_over(monkeypatch, height, platform):
    monkeypatch.setattr(edge_effects, "edges_of", lambda _: [Edge("entry", 100, height, height - platform)])
    crossing = edge_effects.crossing_of(SimpleNamespace(log=FlightLog({}, {})))
    assert crossing.height_m - crossing.clearance_m == pytest.approx(platform, abs=0.011)


@pytest.fixture(scope="module")
def nominal():
    return fly(6)


@pytest.fixture(scope="module")
def floor(nominal):
    return edge_floor_of(nominal, VEHICLE, ())


@pytest.mark.parametrize(("effects", "kinds"), [(STEP, KINDS), (FLOW, KINDS[:1])])
def test_what_an_effect_adds_is_what_flights_with_it_have_beyond_those_without(floor, nominal, effects, kinds):
    """Other flights than those of which it is made: their sensors err, and their platforms are of other sizes."""
    flown = fly(6, effects)
    for kind in kinds:
        measured = mean_response(floor, flown, kind) - mean_response(floor, nominal, kind)
        added = mean_added(floor, flown, kind, effects)
        assert measured @ added > 0.8 * np.linalg.norm(measured) * np.linalg.norm(added)
        assert measured @ added / (added @ added) == pytest.approx(1.0, abs=0.3)


def test_it_grows_with_its_parameters_and_effects_add_up(floor, nominal):
    flight, edge = nominal[0], edges_of(nominal[0])[0]
    once, half = (added_response(floor, flight, edge, activate({"range_step": {"residual": a, "kick": 0.0}}))
                  for a in (0.02, 0.01))
    both = added_response(floor, flight, edge, activate({**STEP, **FLOW}))
    alone = [added_response(floor, flight, edge, activate(e)) for e in (STEP, FLOW)]
    np.testing.assert_allclose(once, 2.0 * half, rtol=1e-9)
    np.testing.assert_allclose(both, alone[0] + alone[1], rtol=1e-9)
    assert not added_response(floor, flight, edge, activate({"mass": {"fraction": 0.1}})).any()


@pytest.mark.parametrize("lacking", [0, 1])
def test_an_edge_that_was_not_simulated_adds_nothing(monkeypatch, floor, nominal, lacking):
    """The down range sees no platform in the flights without the effect (0), or in those with it (1)."""
    def simulated(*args, effects, **options):
        logs = list(batch.flights(*args, effects=effects, **options))
        is_flat = len(effects) == lacking
        return [log.with_columns({"zrange_m": np.full(len(log), 0.5)}) for log in logs] if is_flat else logs

    assert added_response(floor, nominal[0], edges_of(nominal[0])[0], activate(STEP)).any()
    monkeypatch.setattr(edge_effects, "simulated", simulated)
    another = replace(floor)  # nothing is simulated yet
    for edge in edges_of(nominal[0]):
        assert not added_response(another, nominal[0], edge, activate(STEP)).any()


@pytest.mark.parametrize("effects", [STEP, FLOW])
def test_without_a_velocity_an_effect_adds_no_more_than_with_it(floor, nominal, effects):
    """Fewer normal numbers never lie farther from their mean: the whitened length (Mahalanobis) can only fall."""
    blind = [without_velocity(f) for f in nominal]
    blind_floor = edge_floor_of(blind, VEHICLE, ())
    for kind in KINDS:
        full, part = mean_added(floor, nominal, kind, effects), mean_added(blind_floor, nominal, kind, effects)
        assert 0.0 < np.linalg.norm(part) <= np.linalg.norm(full)
        assert not part[~logged(blind[0].log)].any()
        squares = np.mean([whitened(blind_floor, f, e) ** 2 for f in blind for e in edges_of(f) if e.kind == kind])
        assert 0.1 < squares < 2.0  # 14 of 20 numbers of variance 1


def test_flights_and_baseline_of_which_one_has_a_velocity_are_compared_without_it(floor, nominal):
    """The same numbers however it came that the velocity is not known on both sides, but for the ridge of the sum."""
    blind = [without_velocity(f) for f in nominal]
    one_blind = edge_floor_of([*nominal[:-1], blind[-1]], VEHICLE, ())
    edge = edges_of(nominal[0])[0]
    expected = whitened(edge_floor_of(blind, VEHICLE, ()), blind[0], edge)
    for mixed, flight in ((floor, blind[0]), (one_blind, nominal[0])):
        np.testing.assert_allclose(whitened(mixed, flight, edge), expected, atol=1e-6)
        assert np.linalg.norm(added_response(mixed, flight, edge, activate(STEP))) < 5.0
