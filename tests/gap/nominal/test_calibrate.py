"""Which baseline flights are left out: one whose mean lies off the others', by less where flights are simulated."""

from dataclasses import replace

import pytest

from airtouch import logs
from airtouch import vehicle as vehicles
from airtouch.gap.flights.flight import ready
from airtouch.gap.nominal import calibrate
from airtouch.gap.nominal.calibrate import calibrated
from airtouch.gap.signatures.scatter_estimates import scatter_of
from airtouch.simulation.effects import EFFECTS
from gap_flights import VEHICLE, fly, without_fits

LAST = 100  #: samples: the landing


@pytest.fixture(scope="module")
def nominal():
    return fly(4, seed=91)


@pytest.fixture(name="without_fits")
def _without_fits(monkeypatch):
    without_fits(monkeypatch)


@pytest.fixture(scope="module")
def of_nominal(nominal):
    """The study of nominal flights, and the calibration."""
    return calibrated(VEHICLE, nominal)


def with_a_push(flight, metres_per_second2):
    """The flight with a lift in its last second in the air, as where it lands on an edge."""
    air = ((flight.phase > 0) & flight.usable).nonzero()[0][-LAST:]
    acceleration = flight.acceleration.copy()
    acceleration[air, 2] += metres_per_second2
    return replace(flight, name="landing on an edge", acceleration=acceleration)


def recorded(flight):
    return replace(flight, log=replace(flight.log, meta={**flight.log.meta, "format": "usd"}))


def test_nominal_simulated_flights_all_count(of_nominal):
    study, calibration = of_nominal
    assert study.simulated and not calibration.notes


def test_scatter_is_measured_when_it_is_asked_for_and_once(nominal, monkeypatch):
    """Of simulated flights; of recorded ones it is measured before, as it tells whether they are simulated."""
    measured = []
    monkeypatch.setattr(calibrate, "kept_scatter", lambda *_: measured.append("once") or scatter_of(()))
    study, _ = calibrated(VEHICLE, nominal)
    assert study.simulated and study.relations is not None and not measured
    assert study.scatter is replace(study, overhead=(("a", 0.0, 1.0),)).scatter and measured == ["once"]
    assert study.with_scatter(study.scatter).simulated, "whichever class of the table fits best"
    study, _ = calibrated(VEHICLE, [recorded(f) for f in nominal])
    assert not study.simulated and len(measured) == 2


def test_a_single_baseline_flight_counts_as_recorded(nominal, without_fits):
    study, _ = calibrated(VEHICLE, nominal[:1])
    assert not study.simulated and study.relations is None


def test_flights_for_which_no_library_holds_may_be_simulated_too(nominal, without_fits):
    """The library knows no such vehicle: what nominal flights show of effects tells, and is measured at once."""
    study, _ = calibrated(replace(VEHICLE, acc_noise_rms_mps2=1.01 * VEHICLE.acc_noise_rms_mps2), nominal)
    assert study.simulated and study.relations is None


def test_a_simulated_flight_that_lands_on_an_edge_is_left_out(nominal, of_nominal, without_fits):
    """Its mean lift is off by 0.08 m/s^2, as no nominal simulated flight's; the others' floor stays."""
    flights = [*nominal, with_a_push(nominal[0], 2.0)]
    study, calibration = calibrated(VEHICLE, flights)
    (note,) = calibration.notes
    assert note.startswith("landing on an edge: declared nominal") and note.endswith("left out")
    assert [f.name for f in calibration.flights] == [f.name for f in nominal]
    alone, of_nominal_alone = of_nominal
    assert study.offset == pytest.approx(alone.offset)
    assert calibration.declared.offset == pytest.approx(of_nominal_alone.declared.offset)


def test_no_more_than_a_third_is_left_out_in_all_passes_together(nominal, without_fits, monkeypatch):
    """Each pass finds one more flight unlike the others: of four, the first alone may go."""
    def split(vehicle, flights, far):
        return (flights[1:], [flights[0].name]) if far is calibrate.FAR_SIMULATED else (flights, [])

    monkeypatch.setattr(calibrate, "split_unlike", split)
    _, calibration = calibrated(VEHICLE, nominal)
    assert len(calibration.flights) == 3 and calibration.notes[0] == nominal[0].name


def test_recorded_flights_differ_by_as_much_and_count(nominal, without_fits):
    flights = [recorded(f) for f in (*nominal, with_a_push(nominal[0], 2.0))]
    assert not [n for n in calibrated(VEHICLE, flights)[1].notes if "left out" in n]


def test_recorded_flights_whose_table_does_not_say_so_count_as_well(flights):
    """Converted logs of a group that differ by more than simulated flights may."""
    folder = flights / "neuralswarm"
    vehicle = vehicles.load(folder / "ns-67g.toml")
    baseline = [ready(logs.read(path), vehicle) for path in sorted((folder / "flights").glob("cal_cf101d20_*.csv.gz"))]
    study, calibration = calibrated(vehicle, baseline, without=[n for n in EFFECTS if n != "mass"])
    assert len(baseline) > 2 and not study.simulated
    assert not [n for n in calibration.notes if "left out" in n]
