"""How probability becomes edges, and what the physical filter drops."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.errors import AirTouchError
from airtouch.parameters import DEFAULT
from airtouch.reference.edge_pipeline import (
    ENTRY,
    EXIT,
    EdgePipelineConfig,
    cfar_input,
    decode,
    edge_pipeline,
)
from airtouch.vehicle import load

VEHICLE = load("crazyflie-2.1-flow")
HOVER = 48000.0


def flight(n=1500, kick=None):
    """A noisy hover with a push of 0.1 N upwards at sample `kick` and one down 300 later."""
    rng = np.random.default_rng(0)
    lift = np.zeros(n)
    if kick is not None:
        lift[kick:kick + 300] = 0.1
    pwm = np.full((n, 4), HOVER)
    pwm[:100] = 0.0
    acc = rng.normal(0, 0.02, (n, 3))
    acc[:, 2] += (VEHICLE.thrust(pwm).sum(axis=1) + lift) / VEHICLE.mass_kg
    acc[:100, 2] = 9.81
    return acc, rng.normal(0, 0.01, (n, 3)), pwm


def over(n, start, stop):
    p = np.zeros(n)
    p[start:stop] = 1.0
    return p


def test_an_edge_needs_its_threshold_and_the_dwell_since_the_last():
    p = np.array([0.1, 0.59, 0.6, 0.5, 0.41, 0.4, 0.9, 0.1, 0.7, 0.0])
    armed = np.ones(10, dtype=bool)
    edges = decode(p, armed, replace(DEFAULT, dwell_samples=0))
    assert {i: e for i, e in enumerate(edges) if e} == {2: ENTRY, 5: EXIT, 6: ENTRY, 7: EXIT, 8: ENTRY, 9: EXIT}
    edges = decode(p, armed, replace(DEFAULT, dwell_samples=4))
    assert {i: e for i, e in enumerate(edges) if e} == {2: ENTRY, 7: EXIT}


def test_no_probability_changes_nothing():
    assert not decode(np.full(50, np.nan), np.ones(50, dtype=bool)).any()


def test_edges_need_the_air():
    acc, gyro, pwm = flight()
    events = edge_pipeline(acc, gyro, pwm, VEHICLE, probability=over(1500, 150, 600),
                           config=EdgePipelineConfig(physical_filter=False))
    assert np.flatnonzero(events.armed)[0] == 100 + DEFAULT.arm_samples - 1
    assert {int(i): int(events.edge[i]) for i in np.flatnonzero(events.edge)} == {199: ENTRY, 600: EXIT}


def test_the_physical_filter_keeps_edges_with_an_alert_and_drops_the_others():
    acc, gyro, pwm = flight(kick=800)
    events = edge_pipeline(acc, gyro, pwm, VEHICLE, probability=over(1500, 805, 1105))
    assert {int(i): int(events.edge[i]) for i in np.flatnonzero(events.edge)} == {805: ENTRY, 1105: EXIT}
    assert not events.filtered.any() and events.alert[800]
    without_alert = edge_pipeline(*flight(), VEHICLE, probability=over(1500, 805, 1105))
    assert not without_alert.edge.any() and np.flatnonzero(without_alert.filtered).tolist() == [805, 1105]


def test_an_offset_of_the_force_does_not_reach_the_default_cfar_input():
    force = np.random.default_rng(0).normal(0, 0.002, (500, 3))
    biased = force + [0.0, 0.0, 0.05]
    np.testing.assert_allclose(cfar_input(biased), cfar_input(force), atol=1e-15)
    norm = EdgePipelineConfig(cfar_input="norm")
    assert cfar_input(biased, norm).mean() > 5 * cfar_input(force, norm).mean()


def test_bad_input_is_refused():
    with pytest.raises(AirTouchError):
        EdgePipelineConfig(cfar_input="other")
    with pytest.raises(AirTouchError):
        edge_pipeline(np.zeros((4, 3)), np.zeros((5, 3)), np.zeros((4, 4)), VEHICLE)
