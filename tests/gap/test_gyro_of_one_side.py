"""Flights with a gyro against baseline flights without one, and the other way round: a nominal flight has no effect."""

import pytest

from airtouch import vehicle
from airtouch.gap import example
from airtouch.gap.diagnosis import diagnose
from airtouch.gap.flights.flight import ready_alike
from airtouch.gap.measurement import curves_of_measurement, measure
from airtouch.logs import read
from airtouch.logs.flight_log import FlightLog

VEHICLE = vehicle.load("crazyflie-2.1-flow")


def bare(log):
    """The log as a drone without a gyro would write it."""
    return FlightLog({k: v for k, v in log.columns.items() if not k.startswith("gyro")}, log.meta)


@pytest.fixture(scope="module")
def nominal():
    return [read(path) for path in example.nominal()]


@pytest.fixture(scope="module")
def real():
    return read(example.real())


def test_a_nominal_flight_is_none_where_the_baseline_alone_has_no_gyro(nominal):
    result = diagnose([nominal[3]], VEHICLE, [bare(log) for log in nominal[:3]])
    assert (result.verdict, result.effects) == ("none", ())
    assert any("the baseline flights have no gyro" in note for note in result.notes)
    assert result.ranking == diagnose([bare(nominal[3])], VEHICLE, [bare(log) for log in nominal[:3]]).ranking


@pytest.mark.parametrize("baseline_is_bare", [True, False])
def test_the_effect_is_named_where_one_side_has_no_gyro(real, nominal, baseline_is_bare):
    result = diagnose([real if baseline_is_bare else bare(real)], VEHICLE,
                      [bare(log) if baseline_is_bare else log for log in nominal])
    assert [e.name for e in result.effects] == list(example.answer())
    assert sum("have no gyro: that of" in note for note in result.notes) == 1


def test_with_a_gyro_in_both_or_in_neither_nothing_is_dropped(real, nominal):
    for prepare, has_gyro in ((lambda log: log, True), (bare, False)):
        reasons = []
        flights, base = ready_alike([prepare(real)], [prepare(n) for n in nominal], VEHICLE, reasons, reasons)
        assert {f.has_gyro for f in (*flights, *base)} == {has_gyro} and len(base) == 4 and not reasons


def test_flights_without_a_gyro_among_others_stay_where_the_baseline_has_none(real, nominal):
    of_flights = []
    flights, base = ready_alike([real, bare(real)], [bare(n) for n in nominal], VEHICLE, of_flights, [])
    assert len(flights) == 2 and len(base) == 4 and not any(f.has_gyro for f in (*flights, *base))
    assert len(of_flights) == 1 and "is not used" in of_flights[0]


def test_a_map_against_a_baseline_without_a_gyro_has_no_channel_of_it(nominal):
    base = [bare(log) for log in nominal[:3]]
    with_gyro, without = (measure([log], VEHICLE, base, calibrated=False) for log in (nominal[3], bare(nominal[3])))
    assert with_gyro.map.cells == without.map.cells and with_gyro.headline is None
    assert any("the baseline flights have no gyro" in note for note in with_gyro.notes)
    assert not any("not used" in note for note in without.notes)
    assert not any(cell.channel.startswith("rate") for cell in with_gyro.map.cells)


@pytest.mark.parametrize(("baseline_is_bare", "drawn"), [(True, False), (False, True)])
def test_the_gyro_is_drawn_where_the_map_has_it(real, nominal, baseline_is_bare, drawn):
    base = [bare(log) if baseline_is_bare else log for log in nominal[:3]]
    signal = curves_of_measurement(measure([real], VEHICLE, base, calibrated=False), [real], VEHICLE).signal
    assert signal.channel == "torque_z" and (signal.measured is not None) == drawn
