"""What a log must hold to be diagnosed, and what is said of one that lacks or repeats values."""

import numpy as np
import pytest

from airtouch.errors import AirTouchError
from airtouch.gap.flights.fitness import cannot_of, cannot_tell, notes_of, stamped_at_arrival, without_bad_columns
from airtouch.logs.flight_log import ACC, GYRO, PWM, FlightLog

SAMPLES, HEIGHT = 1000, 0.4  #: 10 s of a hover, m


def hover(**columns):
    """A hover of SAMPLES at 100 Hz whose every channel is noise, with these columns instead."""
    rng = np.random.default_rng(3)
    channels = {name: rng.normal(0.0, 0.1, SAMPLES) for name in (*ACC, *GYRO)}
    channels |= {name: rng.normal(36000.0, 100.0, SAMPLES) for name in PWM}
    channels |= {"t_s": np.arange(SAMPLES) * 0.01, "zrange_m": np.full(SAMPLES, HEIGHT),
                 "vbat_V": rng.normal(3.8, 0.01, SAMPLES)}
    return FlightLog({**channels, **columns}, {"source": "a/hover.csv", "format": "canonical"})


def test_a_sound_log_stays_as_it_is():
    log, notes = without_bad_columns(hover())
    assert not notes and all(np.array_equal(log[name], hover()[name]) for name in hover().columns)


def test_values_that_cannot_be_become_missing():
    rates = hover()["gyro_x_radps"].copy()
    rates[10:14] = 1e9
    log, notes = without_bad_columns(hover(gyro_x_radps=rates))
    assert not notes and np.flatnonzero(np.isnan(log["gyro_x_radps"])).tolist() == [10, 11, 12, 13]


def test_a_column_most_of_which_is_missing_is_left_out_and_named():
    log, notes = without_bad_columns(hover(vbat_V=np.where(np.arange(SAMPLES) < 400, 3.8, np.nan)))
    assert not log.has("vbat_V") and notes == ("left out, as most of it is missing or out of range: vbat_V",)


def test_a_channel_that_stands_still_is_named_with_the_share_of_the_flight():
    rates = hover()["gyro_y_radps"].copy()
    rates[250:500] = rates[250]
    _, notes = without_bad_columns(hover(gyro_y_radps=rates, gyro_z_radps=np.zeros(SAMPLES)))
    assert notes == ("gyro_y_radps does not change in 25% of the flight",
                     "gyro_z_radps does not change in 100% of the flight")


def test_a_motor_at_its_limit_a_height_that_is_held_and_a_simulated_battery_are_no_fault():
    assert not without_bad_columns(hover(m1_pwm=np.full(SAMPLES, 65535.0), vbat_V=np.full(SAMPLES, 3.7)))[1]


@pytest.mark.parametrize(("columns", "words"), [
    (PWM, r"no motor commands \(m1_pwm\);"), (ACC, r"no accelerations \(acc_x_mps2\);")])
def test_a_log_without_motors_or_accelerations_is_refused(columns, words):
    with pytest.raises(AirTouchError, match=words):
        without_bad_columns(hover(**{columns[0]: np.full(SAMPLES, np.nan)}))


def test_a_log_in_which_nothing_was_logged_is_told_as_that():
    empty = {name: np.full(SAMPLES, np.nan) for name in hover().columns if name != "t_s"}
    with pytest.raises(AirTouchError, match="nothing was logged"):
        without_bad_columns(hover(**empty))


@pytest.mark.parametrize(("meta", "at_arrival"), [
    ({"format": "authors-12"}, True), ({"format": "canonical", "origin_format": "authors-14"}, True),
    ({"format": "canonical"}, False), ({"format": "canonical", "origin_format": "usd-2"}, False), ({}, False)])
def test_rows_of_the_authors_logs_are_stamped_at_arrival_in_converted_logs_too(meta, at_arrival):
    log = FlightLog(hover().columns, meta)
    assert stamped_at_arrival(log) is at_arrival
    assert any("those of arrival" in reason for reason in cannot_tell(log)) is at_arrival


def test_a_note_has_the_name_of_its_flight_once_or_the_number_of_flights():
    flights = [("a/b.csv", ("stuck", "cut off")), ("c.csv", ("stuck",)), ("d.csv", ())]
    assert notes_of(flights, "baseline flights") == ["2 of 3 baseline flights: stuck", "b.csv: cut off"]
    assert notes_of([("a.csv", ("stuck",))]) == ["a.csv: stuck"] and notes_of([]) == []


def test_a_reason_is_told_once_with_the_number_of_flights_where_it_is_not_all():
    assert cannot_of([("no gyro", "no velocity"), ("no gyro",)]) == ("no gyro", "1 of 2 flights: no velocity")
