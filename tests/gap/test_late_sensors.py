"""Late sensors are named by the echo of noise where no library of relations holds, once, and with a wider interval."""

from types import SimpleNamespace

import pytest

from airtouch import vehicle as vehicles
from airtouch.gap.answer.estimates import ROW_VARIANCE_S2, from_spectra
from airtouch.gap.diagnosis import diagnose
from airtouch.gap.evidence import sensing
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.sensing import LEAST_CHANGED, changed_echo_nats, sensing_gain, unexplained_outside
from airtouch.gap.flights.flight import ready_flights
from airtouch.gap.naming.judging import PricedVariant, cross_validated, trial_of
from airtouch.gap.naming.rounds import round_of
from airtouch.gap.signatures.candidates import all_candidates, terms
from airtouch.gap.workspace import Workspace
from airtouch.simulation import batch
from airtouch.simulation.effects import Active, get

VEHICLE = vehicles.load("crazyflie-2.1-flow")
LATE = "sensor_latency"
LATE_TERMS, MASS_TERMS = terms(LATE)[:1], terms("mass")[:1]
SURE = LEAST_CHANGED + 10.0


@pytest.fixture(scope="module")
def diagnosed():
    """A hover whose sensors are 4 ms late, against four without: its log, its diagnosis and that without the effect."""
    baseline = list(batch.flights("hover", range(900, 904), vehicle=VEHICLE, workers=1))
    active = [Active(get(LATE), get(LATE).values({"delay": 0.004}))]
    log, = batch.flights("hover", [950], vehicle=VEHICLE, effects=active, workers=1)
    with_it = diagnose([log], VEHICLE, baseline)
    return log, with_it, diagnose([log], VEHICLE, baseline, without=(LATE,))


@pytest.fixture(scope="module")
def trial(diagnosed):
    log, with_it, _ = diagnosed
    return trial_of(Data(with_it.calibrated[0], list(ready_flights([log], VEHICLE, []))))


def hypothesis(trial, name, base=None):
    return cross_validated(trial, PricedVariant(name, all_candidates(())[name][0], 0.0), base)


def test_late_sensors_are_named_first(diagnosed):
    _, with_it, _ = diagnosed
    assert with_it.effects[0].name == LATE and any("echo" in note for note in with_it.notes)
    delay = with_it.effects[0].parameters["delay"]
    assert delay.low <= 0.004 <= delay.high


def test_without_the_effect_the_echo_is_left(diagnosed):
    assert diagnosed[2].verdict == "unknown"


def test_the_echo_is_gained_once(trial):
    echo = changed_echo_nats(trial.data)
    late = hypothesis(trial, LATE)
    in_spectra = late.gain - echo
    beside = hypothesis(trial, "mass", late)
    assert echo > 20.0 and abs(in_spectra) < 20.0
    assert abs(beside.gain - late.gain) < 15.0, "a mass beside it gains nothing, and the echo is not gained again"
    assert hypothesis(trial, "mass").gain < 15.0
    evidence = round_of(trial, {LATE: all_candidates(())[LATE]}, None)[LATE].evidence
    assert evidence >= 20.0, "how rare the delay is in nominal flights does not limit what the echo gains"


def test_the_delay_is_known_to_a_row(trial, monkeypatch):
    late = hypothesis(trial, LATE)
    fitted = late.fits[0]
    term, = fitted.terms
    wide = from_spectra(trial.data, term, fitted, late.fits).covariance
    monkeypatch.setattr("airtouch.gap.answer.estimates.sensing_gain", lambda *_: 0.0)
    narrow = from_spectra(trial.data, term, fitted, late.fits).covariance
    assert (wide - narrow) * term.step("delay") ** 2 == pytest.approx(ROW_VARIANCE_S2)


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
    assert sensing_gain(data, LATE_TERMS) == SURE == sensing_gain(data, [*MASS_TERMS, *LATE_TERMS])
    assert sensing_gain(data, MASS_TERMS) == 0.0 == sensing_gain(data, ())


def test_what_no_effect_explains_is_left_beside_the_times(flown):
    data = flown(SURE)
    assert unexplained_outside(data, ()) == SURE + 3.0 == unexplained_outside(data, MASS_TERMS)
    assert unexplained_outside(data, LATE_TERMS) == 3.0


@pytest.mark.parametrize("data", [
    {"nats": LEAST_CHANGED - 0.1}, {"nats": -20.0},  # as in nominal flights
    {"nats": SURE, "simulated": False},  # the fast noise of recorded flights differs from flight to flight
    {"nats": None},  # too few nominal flights
    {"nats": SURE, "flights": ("a flight", None)}])  # one is too short for an echo
def test_no_other_echo(flown, data):
    assert changed_echo_nats(flown(**data)) == 0.0 == sensing_gain(flown(**data), LATE_TERMS)
    assert unexplained_outside(flown(**data), ()) == 3.0
