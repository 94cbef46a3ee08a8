"""Flights for the cores."""

from dataclasses import replace

import pytest

from airtouch import vehicle as vehicles
from airtouch.detector import best
from airtouch.logs import read
from airtouch.simulation import scenario
from airtouch.simulation.flight import fly
from firmware.drone import signals


@pytest.fixture(scope="session")
def flight():
    """One simulated flight over platforms, without attitude and voltage."""
    log = fly(scenario.load("paper-4cm"), vehicles.load(), seed=3)
    log = replace(log, columns={k: v for k, v in log.columns.items() if k not in ("roll_rad", "pitch_rad", "vbat_V")})
    return signals(log)


@pytest.fixture(scope="session")
def best_edges(flight):
    """Its edges (sample, kind), as the detector that is scored finds them."""
    return [(d.sample, d.kind) for d in best.run(flight[0]).edges]


@pytest.fixture(scope="session")
def recorded(flights):
    """Three recorded flights and their edges, likewise."""
    logs = map(read, sorted((flights / "airtouch").glob("imu_data_02*h79*"))[:3])
    return [(signals(log), [(d.sample, d.kind) for d in best.run(log).edges]) for log in logs]
