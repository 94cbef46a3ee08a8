"""The response at an edge against made logs whose steps are known."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch import vehicle as vehicles
from airtouch.gap.edges import edge_response
from airtouch.gap.edges.edge_response import (
    BINS,
    SHRINKAGE,
    edge_floor_of,
    edges_of,
    logged,
    response,
    response_covariance,
)
from airtouch.logs.flight_log import PWM, FlightLog
from gap_flights import fly

VEHICLE = vehicles.load()
EDGE, N = 50, 200
THRUST, SPEED, HEIGHT = np.split(np.arange(20), np.cumsum([n for _, n in BINS])[:-1])


def log_of(**columns):
    pwm = columns.pop("pwm", np.full(N, 40000.0))
    return FlightLog({"t_s": 0.01 * np.arange(N), **dict.fromkeys(PWM, pwm), **columns}, {})


def after(step):
    """Zeros before the edge, a step from it on."""
    return np.where(np.arange(N) < EDGE, 0.0, step)


def test_thrust_speed_and_height_are_those_after_the_edge_less_those_before():
    """A turn to the left at the edge: along the way flown before it, 0.4 m/s are left of 0.5."""
    log = log_of(pwm=40000.0 + after(5000.0), vx_mps=0.3 - after(0.06), vy_mps=0.4 - after(0.08), z_m=0.5 + after(0.1))
    values = response(log, VEHICLE, EDGE)
    assert values[THRUST] == pytest.approx(float(np.diff(VEHICLE.thrust(np.array([40000.0, 45000.0])))[0]))
    assert values[SPEED] == pytest.approx(-0.1) and values[HEIGHT] == pytest.approx(0.1)


def test_without_a_position_the_height_is_the_down_range_without_the_edge_itself():
    log = log_of(zrange_m=0.8 - after(0.3) + 0.01 * after(1.0) * np.arange(N) / N)
    values = response(log, VEHICLE, EDGE)
    assert np.isnan(values[SPEED]).all() and np.flatnonzero(~logged(log)).tolist() == SPEED.tolist()
    assert values[HEIGHT] == pytest.approx(0.01 * (np.arange(6) * 20 + 9.5) / N, abs=1e-4)


def test_edges_widen_the_scatter_of_stretches_without_one():
    """Stretches of variance 1; edges, of two kinds with other means, of variance 9 in the first number alone."""
    rng = np.random.default_rng(1)
    stretches, edges = rng.normal(size=(4000, 20)), rng.normal(size=(4000, 20))
    edges[:, 0] *= 3.0
    covariance = response_covariance(stretches, {"entry": edges[::2] + 5.0, "exit": edges[1::2] - 5.0})
    assert np.diag(covariance) == pytest.approx([9.0, *np.ones(19)], rel=0.15)
    correlated = rng.normal(size=(4000, 1)) + rng.normal(size=(4000, 20))  # covariance 1 beside a variance of 2
    assert response_covariance(correlated, {})[0, 1] == pytest.approx(1.0 - SHRINKAGE, rel=0.1)


@pytest.mark.parametrize(("name", "samples", "counts"), [
    ("usable", 1, False), ("usable", 60, False), ("lost", 10, True), ("lost", 60, False)])
def test_an_edge_that_is_hit_or_lost_is_no_evidence(name, samples, counts):
    """usable: touched, for some samples from the edge on; lost: so many rows of the 1.6 s around it."""
    flight = fly(1, 31)[0]
    edges = edges_of(flight)
    at = edges[0].sample + np.arange(samples)
    usable, lost = flight.usable.copy(), flight.lost.copy()
    usable[at] = False
    if name == "lost":
        lost[at] = True
    of_evidence = edges_of(replace(flight, usable=usable, lost=lost))
    assert (edges[0] in of_evidence) == counts and set(edges[2:]) <= set(of_evidence)


@pytest.mark.parametrize("name", ["usable", "lost"])
def test_a_scatter_is_not_measured_where_the_flight_is_hit_or_lost(name):
    """The flight is evidence at its edges, and nowhere else: of a stretch without an edge nothing is known."""
    flight = fly(1, 31)[0]
    edges = edges_of(flight)
    assert {e.kind for e in edges} == {"entry", "exit"} and edge_floor_of([flight], VEHICLE, ()) is not None
    samples = np.arange(len(flight))
    at_an_edge = np.any([(samples >= e.sample - 30) & (samples < e.sample + 130) for e in edges], axis=0)
    away = {"usable": at_an_edge} if name == "usable" else {"usable": at_an_edge, "lost": ~at_an_edge}
    hit = replace(flight, **away)
    assert edges_of(hit) == edges and edge_floor_of([hit], VEHICLE, ()) is None


def test_a_stretch_without_an_edge_shares_no_sample_with_a_response_to_one(monkeypatch):
    """A response has the 0.3 s before its sample and the 1.3 s after it."""
    flight, at = fly(1, 31)[0], []
    edges = [e.sample for e in edges_of(flight)]
    monkeypatch.setattr(edge_response, "response",
                        lambda log, vehicle, sample: at.append(sample) or response(log, vehicle, sample))
    assert edge_floor_of([flight], VEHICLE, ()) is not None and set(edges) < set(at)
    near_edges = {k for e in edges for k in range(e - 30, e + 130)}
    assert not [a for a in set(at) - set(edges) if near_edges & set(range(a - 30, a + 130))]
