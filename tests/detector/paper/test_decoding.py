"""Decoding: its promises, and the physical filter against the reference pipeline."""

from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from airtouch import vehicle
from airtouch.detector.paper.decoding import decode, detections, edge_codes, physical_filter
from airtouch.detector.trace import Detection
from airtouch.parameters import DEFAULT
from airtouch.reference.edge_pipeline import EdgePipelineConfig, edge_pipeline
from airtouch.reference.edge_pipeline import decode as reference_decode

levels = st.sampled_from([0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0, float("nan")])


@st.composite
def flights(draw):
    """Probabilities that dwell at levels, and stretches armed and with alerts."""
    def runs(values):
        return [v for v, k in draw(st.lists(st.tuples(values, st.integers(1, 12)), min_size=1, max_size=12))
                for _ in range(k)]

    p, armed, alert = runs(levels), runs(st.booleans()), runs(st.booleans())
    n = min(len(p), len(armed), len(alert))
    settings = replace(DEFAULT, probability_entry=draw(st.sampled_from([0.5, 0.7, 0.9])),
                       probability_exit=draw(st.sampled_from([0.1, 0.3, 0.45])),
                       dwell_samples=draw(st.integers(1, 6)), alert_hold=draw(st.integers(1, 5)))
    return np.array(p[:n]), np.array(armed[:n]), np.array(alert[:n]), settings


@given(flights())
def test_edges_are_those_of_the_reference_that_steps_through_the_samples(flight):
    p, armed, _, settings = flight
    assert edge_codes(p, armed, settings).tolist() == reference_decode(p, armed, settings).tolist()


@given(flights(), st.integers(0, 100))
def test_edges_do_not_depend_on_later_samples(flight, length):
    p, armed, alert, settings = flight
    full = decode(p, armed, alert, settings)
    length = min(length, len(p))
    assert decode(p[:length], armed[:length], alert[:length], settings) == [e for e in full if e.sample < length]


@given(flights())
def test_edges_are_armed_sure_apart_and_in_turn(flight):
    p, armed, _, settings = flight
    edges = decode(p, armed, None, settings)
    assert all(armed[e.sample] for e in edges)
    for e in edges:
        assert e.probability >= (settings.probability_entry if e.kind == "entry" else 1 - settings.probability_exit)
    for a, b in zip(edges, edges[1:], strict=False):
        if armed[a.sample:b.sample].all():
            assert a.kind != b.kind and b.sample - a.sample >= settings.dwell_samples


@given(flights())
def test_the_filter_only_drops(flight):
    p, armed, alert, settings = flight
    unfiltered = decode(p, armed, None, settings)
    filtered = decode(p, armed, alert, settings)
    assert [e for e in unfiltered if e in filtered] == filtered
    for e in unfiltered:
        recent = alert[max(e.sample + 1 - settings.alert_hold, 0):e.sample + 1].any()
        assert (e in filtered) == recent


def test_a_clean_pass_by_hand():
    p = np.r_[np.zeros(50), np.ones(30), np.zeros(50)]
    assert decode(p, np.ones(130, bool)) == [Detection(50, "entry", 1.0), Detection(80, "exit", 1.0)]
    short = replace(DEFAULT, dwell_samples=40)
    assert [e.sample for e in decode(p, np.ones(130, bool), None, short)] == [50, 90]


def test_physical_filter_needs_a_recent_alert():
    alert = np.zeros(100, bool)
    alert[40] = True
    edges = [Detection(s, "entry", 1.0) for s in (39, 40, 49, 50)]
    assert [e.sample for e in physical_filter(edges, alert, 10)] == [40, 49]


def test_equal_to_the_whole_pipeline():
    rng = np.random.default_rng(0)
    n = 1500
    acc = rng.normal(0, 0.05, (n, 3)) + [0, 0, 9.81]
    acc[[700, 1100], 2] += 4.0
    pwm = np.full((n, 4), 45000.0)
    p = np.repeat(rng.uniform(0, 1, 30), 50)
    for physical in (True, False):
        events = edge_pipeline(acc, rng.normal(0, 0.1, (n, 3)), pwm, vehicle.load(), probability=p,
                               config=EdgePipelineConfig(physical_filter=physical))
        decoded = decode(p, events.armed, events.alert if physical else None)
        assert decoded == detections(events.edge, p)
        assert decoded
