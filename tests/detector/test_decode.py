"""Decoding against a state machine written sample by sample, and its promises."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from airtouch.detector.decode import Decoding, armed, decode, physical_filter, run_lengths
from airtouch.detector.trace import Detection

levels = st.sampled_from([0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0, float("nan")])


@st.composite
def flights(draw):
    """Probabilities that dwell at levels, and stretches in the air."""
    def runs(values):
        return [v for v, k in draw(st.lists(st.tuples(values, st.integers(1, 12)), min_size=1, max_size=12))
                for _ in range(k)]

    p, air, alert = runs(levels), runs(st.booleans()), runs(st.booleans())
    n = min(len(p), len(air), len(alert))
    settings = Decoding(draw(st.sampled_from([0.5, 0.7, 0.9])), draw(st.sampled_from([0.1, 0.3, 0.45])),
                        draw(st.integers(1, 6)), draw(st.integers(0, 5)), draw(st.sampled_from([None, 0, 3])))
    return np.array(p[:n]), np.array(air[:n]), np.array(alert[:n]), settings


def step_by_step(p, air, alert, s):
    """The same machine, one sample at a time."""
    edges, over, high, low, in_air, since_alert = [], False, 0, 0, 0, 10**9
    for i in range(len(p)):
        since_alert = 0 if alert[i] else since_alert + 1
        in_air = in_air + 1 if air[i] else 0
        if in_air <= s.arm:
            over, high, low = False, 0, 0
            continue
        high = high + 1 if p[i] >= s.enter else 0
        low = low + 1 if p[i] <= s.leave else 0
        if (low if over else high) >= s.dwell:
            over = not over
            if s.alert_memory is None or since_alert <= s.alert_memory:
                edges.append((i, "entry" if over else "exit"))
    return edges


@given(flights())
def test_equal_to_the_machine_step_by_step(flight):
    p, air, alert, settings = flight
    assert [(e.sample, e.kind) for e in decode(p, air, settings, alert)] == step_by_step(*flight[:3], settings)


@given(flights(), st.integers(0, 100))
def test_causal(flight, cut):
    p, air, alert, settings = flight
    whole = decode(p, air, settings, alert)
    cut = min(cut, len(p))
    assert decode(p[:cut], air[:cut], settings, alert[:cut]) == [e for e in whole if e.sample < cut]


@given(flights())
def test_kinds_alternate_within_a_flight_without_the_filter(flight):
    p, air, _, settings = flight
    unfiltered = Decoding(settings.enter, settings.leave, settings.dwell, settings.arm, None)
    edges = decode(p, np.ones_like(air), unfiltered)
    assert [e.kind for e in edges] == ["entry", "exit"] * (len(edges) // 2) + ["entry"] * (len(edges) % 2)
    assert all(e.probability >= 0.5 for e in edges)


def test_a_clean_pass_by_hand():
    p = np.r_[np.zeros(50), np.ones(30), np.zeros(50)]
    edges = decode(p, np.ones(130, bool), Decoding(0.7, 0.3, dwell=5, arm=10, alert_memory=None))
    assert edges == [Detection(54, "entry", 1.0), Detection(84, "exit", 1.0)]


def test_physical_filter_needs_a_recent_alert():
    alert = np.zeros(100, bool)
    alert[40] = True
    edges = [Detection(s, "entry", 1.0) for s in (39, 40, 50, 51)]
    assert [e.sample for e in physical_filter(edges, alert, 10)] == [40, 50]


def test_run_lengths_and_arming():
    air = np.array([1, 1, 0, 1, 1, 1], bool)
    assert run_lengths(air).tolist() == [1, 2, 0, 1, 2, 3]
    assert armed(air, 2).tolist() == [False] * 5 + [True]
    assert decode(np.array([]), np.array([], bool), Decoding()) == []
