"""A flight's clock: what is lost, what comes late, and what nobody can tell."""

import numpy as np
import pytest

import gap_flights
from airtouch import vehicle as vehicles
from airtouch.gap.flights.flight import ready_flights
from airtouch.logs.flight_log import FlightLog
from airtouch.logs.segments import KINDS
from airtouch.simulation import signals as at

VEHICLE = vehicles.load("crazyflie-2.1-flow")


@pytest.fixture(scope="module")
def log():
    return gap_flights.fly(1, 31)[0].log


def without(log, *rows):
    """The same without some rows; its times go on."""
    return FlightLog({k: np.delete(v, rows) for k, v in log.columns.items()}, log.meta)


def as_flight(log):
    (flight,) = ready_flights([log], VEHICLE, [])
    return flight


def test_a_row_lost_in_mid_flight_is_lost_and_no_jitter(log):
    flight = as_flight(without(log, 700, 701))
    assert np.flatnonzero(flight.lost).tolist() == [700, 701]
    assert np.abs(flight.clock_s).max() < 1e-6


def test_a_row_missing_among_the_last_ones_is_no_jitter(log):
    """Too few rows follow to say whether it was lost or the rest came late: these tell nothing of the clock."""
    n = len(log)
    flight = as_flight(without(log, n - 8))
    assert not flight.lost.any() and len(flight.clock_s) == n - 8
    assert np.abs(flight.clock_s).max() < 1e-6


def test_rows_that_come_late_by_turns_are_jitter(log):
    late = np.random.default_rng(0).normal(0.0, 1e-3, len(log))
    flight = as_flight(FlightLog({**log.columns, "t_s": log["t_s"] + late}, log.meta))
    assert flight.clock_s.std() == pytest.approx(1e-3, rel=0.05) and not flight.lost.any()


def test_without_a_down_range_the_height_comes_from_the_position(log):
    """In a hover over the flat floor, 2 s before the platform: the simulated range is the truth, within its noise."""
    ranged = as_flight(log)
    unranged = as_flight(FlightLog({k: v for k, v in log.columns.items() if k != "zrange_m"}, log.meta))
    hover = ranged.phase == KINDS.index("hover")
    assert hover.sum() > 100 and log["z_m"][hover].max() < 2.0
    difference = unranged.signals[hover, at.HEIGHT] - ranged.signals[hover, at.HEIGHT]
    assert np.abs(np.median(difference)) < 0.03
