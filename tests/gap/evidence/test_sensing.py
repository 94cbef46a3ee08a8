"""Evidence in another echo of the gyro's noise: which effects gain it, and where it counts."""

from types import SimpleNamespace

import pytest

from airtouch.gap.evidence import sensing
from airtouch.gap.evidence.sensing import LEAST_CHANGED, changed_echo_nats, outside_spectra, sensing_gain
from airtouch.gap.signatures.candidates import terms
from airtouch.gap.workspace import Workspace

LATE, MASS = terms("sensor_latency")[:1], terms("mass")[:1]
SURE = LEAST_CHANGED + 10.0


@pytest.fixture
def flown(monkeypatch):
    """A function that makes a stand-in for flights whose echo is another one by so many nats."""
    monkeypatch.setattr(sensing, "echo_of", lambda flight, _: flight)
    monkeypatch.setattr(sensing, "changed_nats", lambda nats, _: nats)
    monkeypatch.setattr(sensing, "unexplained_clock_gain", lambda *_: 3.0)

    def data(nats, simulated=True, flights=("a flight",)):
        study = SimpleNamespace(echo=nats, simulated=simulated, vehicle="any")
        return SimpleNamespace(study=study, flights=flights, workspace=Workspace())
    return data


def test_late_sensors_gain_what_another_echo_gains(flown):
    data = flown(SURE)
    assert sensing_gain(data, LATE) == SURE == sensing_gain(data, [*MASS, *LATE])
    assert sensing_gain(data, MASS) == 0.0 == sensing_gain(data, ())


def test_what_no_effect_explains_is_left_beside_the_times(flown):
    data = flown(SURE)
    assert outside_spectra(data, ()) == SURE + 3.0 == outside_spectra(data, MASS)
    assert outside_spectra(data, LATE) == 3.0


@pytest.mark.parametrize("data", [
    {"nats": LEAST_CHANGED - 0.1}, {"nats": -20.0},  # as in nominal flights
    {"nats": SURE, "simulated": False},  # the fast noise of recorded flights differs from flight to flight
    {"nats": None},  # too few nominal flights
    {"nats": SURE, "flights": ("a flight", None)}])  # one is too short for an echo
def test_no_other_echo(flown, data):
    assert changed_echo_nats(flown(**data)) == 0.0 == sensing_gain(flown(**data), LATE)
    assert outside_spectra(flown(**data), ()) == 3.0
