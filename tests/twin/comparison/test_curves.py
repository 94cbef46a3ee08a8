"""The curves of a report on flights whose medians are known."""

from types import SimpleNamespace

import numpy as np
import pytest

from airtouch.parameters import SAMPLE_RATE_HZ
from airtouch.twin.comparison import curves
from airtouch.twin.comparison.compare import SimulatedFlight
from airtouch.twin.recorded.features import names
from airtouch.twin.recorded.flights import RecordedFlights

ENTRY, EXIT, ROWS = 400, 700, 1200


def flight(level, lift, clearance=0.04, longer=0):
    """A course, and channels (ROWS, 12) that are `level`, over the platform `level + lift`."""
    course = SimpleNamespace(entry=ENTRY, exit=EXIT + longer, clearance_m=clearance, free=slice(100, ENTRY - 10),
                             landing=ROWS - 100)  # what curves read of a course: samples and m
    data = np.full((ROWS, 12), float(level))
    data[ENTRY:EXIT + longer] += lift
    return course, data


def curves_of(recorded, simulated):
    features = np.zeros((len(recorded), len(names())))
    return curves.curves(
        RecordedFlights("v", [c for c, _ in recorded], [x for _, x in recorded], features, []),
        [SimulatedFlight(c, i, x, features[0]) for i, (c, x) in enumerate(simulated)])


def test_edges_are_taken_against_the_level_before_the_entry():
    recorded = [flight(level, lift) for level, lift in ((5, 1), (7, 2), (9, 6))]
    result = curves_of(recorded, [flight(0, 3)] * 3)
    assert list(result.edges) == ["low"]
    real, fake = result.edges["low"]["entry"]
    assert (real.flights, fake.flights) == (3, 3)
    before, after = real.quartiles[:, curves.BEFORE - 1, 0], real.quartiles[:, curves.BEFORE, 0]
    assert before == pytest.approx([0, 0, 0]) and after == pytest.approx([1.5, 2, 4])  # of 1, 2 and 6
    assert fake.quartiles[1, curves.BEFORE:, 0] == pytest.approx(3)


def test_a_height_class_that_one_side_lacks_is_left_out():
    curves = curves_of([flight(0, 1, 0.04), flight(0, 1, 0.05)] * 2, [flight(0, 1, 0.05)] * 3)
    assert list(curves.edges) == ["mid"]


def test_the_overlaid_flight_has_the_median_time_over_the_platform():
    simulated = [flight(1, 1, longer=50), flight(2, 2, longer=0), flight(3, 3, longer=20)]
    real, fake = curves_of([flight(10 * i, i + 1) for i in range(3)], simulated).overlaid
    at = np.searchsorted(fake.time_s, 0.0)
    assert fake.channels[at, 0] == 3 and real.channels[at, 0] == 3  # the third of each, less its level
    assert fake.time_s[0] == -curves.MARGIN / SAMPLE_RATE_HZ
    assert fake.time_s[-1] == pytest.approx((EXIT + 20 - ENTRY + curves.MARGIN - 1) / SAMPLE_RATE_HZ)


def test_spectra_are_quartiles_over_flights():
    flights = [flight(0, 1)] * 3
    at = [k for k, f in enumerate(names()) if f.group == "spectrum"]
    features = np.zeros((3, len(names())))
    features[:, at] = np.array([[1.0], [2.0], [6.0]])
    recorded = RecordedFlights("v", [c for c, _ in flights], [x for _, x in flights], features, [])
    simulated = [SimulatedFlight(c, i, x, features[0]) for i, (c, x) in enumerate(flights)]
    real, fake = curves.curves(recorded, simulated).spectra
    assert real.shape[0] == 3 and np.allclose(real.T, [1.5, 2.0, 4.0]) and np.allclose(fake, 1.0)
