"""A flight's clock: what is lost, what comes late, and what nobody can tell."""

from dataclasses import replace

import numpy as np
import pytest

import gap_flights
from airtouch import vehicle as vehicles
from airtouch.gap.flights.flight import ready_flights, with_gyro_if_any
from airtouch.logs.flight_log import PWM, FlightLog
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


def test_motors_below_the_threshold_fly_by_the_height_and_a_note_says_so(log):
    """Commands of less than 15000, as of a strong vehicle: the diagnosis found no flight in it."""
    weak = as_flight(log.with_columns({name: log[name] * 14000.0 / log[name].max() for name in PWM}))
    assert np.flatnonzero(weak.phase != KINDS.index("ground")).size > 0.9 * np.sum(log["zrange_m"] > 0.1)
    assert any("never passes 15000" in note for note in weak.notes)
    assert not any("never passes" in note for note in as_flight(log).notes)


def test_the_threshold_of_the_vehicle_file_tells_what_is_flight(log):
    """The same commands, by a vehicle that flies at them and by one that idles."""
    low = log.with_columns({name: log[name] * 14000.0 / log[name].max() for name in PWM})
    (armed,) = ready_flights([low], replace(VEHICLE, arm_pwm=3000.0), [])
    mean = np.mean([low[name] for name in PWM], axis=0)
    in_air = armed.phase != KINDS.index("ground")
    assert in_air[mean > 3000.0].mean() > 0.95 and not any("never passes" in note for note in armed.notes)


def test_seconds_on_the_ground_with_the_motors_on_are_no_evidence(log):
    """3 s of them, of rows at rest in which the motors turn at 30000, before the take-off: the flight is as without."""
    whole, resting = as_flight(log), np.flatnonzero(np.max([log[name] for name in PWM], axis=0) <= 0.0)[:50]
    first, idle = resting[-1] + 1, np.resize(resting, 300)
    columns = {k: np.insert(v, first, np.full(300, 30000.0) if k in PWM else v[idle]) for k, v in log.columns.items()}
    delayed = as_flight(FlightLog({**columns, "t_s": 0.01 * np.arange(len(log) + 300)}, log.meta))
    in_air = delayed.phase != KINDS.index("ground")
    assert in_air[first:first + 300].sum() > 250, "by its commands it flies"
    assert not delayed.usable[first:first + 300].any()
    np.testing.assert_array_equal(delayed.usable[first + 450:], whole.usable[first + 150:])


def test_a_row_lost_in_mid_flight_is_lost_and_no_jitter(log):
    flight = as_flight(without(log, 700, 701))
    assert np.flatnonzero(flight.lost).tolist() == [700, 701]
    assert np.abs(flight.clock_s).max() < 1e-6


def test_a_log_of_few_of_its_rows_says_how_many_are_missing(log):
    """1000 rows 10 ms apart, 4000 s without one, 1000 more: 402,000 with the missing ones."""
    time = 0.01 * np.arange(2000) + 4000.0 * (np.arange(2000) >= 1000)
    reasons = []
    assert not list(ready_flights([FlightLog({**log.slice(0, 2000).columns, "t_s": time}, {})], VEHICLE, reasons))
    assert "400000 of 402000 samples are missing" in reasons[0]


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


def test_a_hole_of_seconds_in_what_is_measured_is_no_evidence_and_no_lost_row(log):
    """A log of 200 Hz without 2 s of its rows, and one of 100 Hz without the gyro's values then."""
    fast = at_rate(log, 200)
    hole = FlightLog({k: np.delete(v, np.arange(1400, 1800)) for k, v in fast.columns.items()}, fast.meta)
    silent = log.with_columns({"gyro_y_radps": np.where(np.abs(np.arange(len(log)) - 800) < 100, np.nan,
                                                        log["gyro_y_radps"])})
    for one in (hole, silent):
        flight = as_flight(one)
        assert not flight.usable[703:897].any() and flight.bridged[703:897].all() and not flight.lost.any()
        assert flight.usable[500:690].all() and flight.usable[910:1000].all()
        (note,) = flight.notes
        assert "2.0 s in the air are no evidence" in note


def test_a_channel_that_is_logged_ten_times_slower_stays_evidence(log):
    i = np.arange(len(log))
    slow = np.where((i > 400) & (i < 1200) & (i % 10 > 0), np.nan, log["gyro_y_radps"])
    flight = as_flight(log.with_columns({"gyro_y_radps": slow}))
    assert np.array_equal(flight.usable, as_flight(log).usable) and not flight.bridged.any() and not flight.notes


def test_without_a_down_range_the_height_comes_from_the_position(log):
    """In a hover over the flat floor, 2 s before the platform: the simulated range is the truth, within its noise."""
    ranged = as_flight(log)
    unranged = as_flight(FlightLog({k: v for k, v in log.columns.items() if k != "zrange_m"}, log.meta))
    hover = ranged.phase == KINDS.index("hover")
    assert hover.sum() > 100 and log["z_m"][hover].max() < 2.0
    difference = unranged.signals[hover, at.HEIGHT] - ranged.signals[hover, at.HEIGHT]
    assert np.abs(np.median(difference)) < 0.03


def at_rate(log, hz):
    """The log sampled at another rate, by straight lines."""
    old = log["t_s"]
    new = np.arange(old[0], old[-1], 1.0 / hz)
    columns = {k: np.interp(new, old, v) for k, v in log.columns.items()}
    return FlightLog({**columns, "t_s": new}, {k: v for k, v in log.meta.items() if k != "sample_period_s"})


@pytest.mark.parametrize("hz", [101.0, 125.0, 150.0, 250.0])
def test_a_faster_log_is_as_long_as_it_was(log, hz):
    assert len(as_flight(at_rate(log, hz))) == pytest.approx(len(log), rel=0.011)


@pytest.mark.parametrize("jitter_s", [0.0, 1e-3])
def test_a_log_that_lost_many_rows_is_no_slower_log(log, jitter_s):
    rng = np.random.default_rng(1)
    poor = without(log, 50 + np.flatnonzero(rng.random(len(log) - 100) < 0.08))
    late = FlightLog({**poor.columns, "t_s": poor["t_s"] + rng.normal(0.0, jitter_s, len(poor))}, poor.meta)
    flight = as_flight(late)
    assert jitter_s or len(flight) == pytest.approx(len(log), rel=0.01)


@pytest.mark.parametrize("share", [0.4, 0.45])
def test_the_rows_that_a_log_lost_are_found_where_nearly_half_are_lost(log, share):
    gone = 50 + np.flatnonzero(np.random.default_rng(1).random(len(log) - 100) < share)
    np.testing.assert_array_equal(np.flatnonzero(as_flight(without(log, *gone)).lost), gone)


@pytest.mark.parametrize("with_clock", [True, False])
def test_a_slower_log_is_refused(log, with_clock):
    slow, reasons = at_rate(log, 50.0), []
    if not with_clock:
        slow = FlightLog({k: v for k, v in slow.columns.items() if k != "t_s"}, {"sample_period_s": 0.02})
    assert not list(ready_flights([slow], VEHICLE, reasons))
    assert "logged at 50 Hz; the diagnosis needs 100 Hz or more" in reasons[0]


@pytest.mark.parametrize("unknown", [0, 1, 3])
def test_a_clock_that_runs_backwards_is_refused_though_times_are_missing_there(log, unknown):
    time = np.where(np.arange(len(log)) < 900, log["t_s"], log["t_s"] - 3.0)
    time[900:900 + unknown] = np.nan
    reasons = []
    assert not list(ready_flights([log.with_columns({"t_s": time})], VEHICLE, reasons))
    assert f"sample {900 + unknown}: the clock runs backwards by 2.9" in reasons[0]


def test_a_clock_that_counts_from_1970_is_a_clock(log):
    plain = without(log, 700, 701)
    unix = as_flight(FlightLog({**plain.columns, "t_s": plain["t_s"] + 1.8e9}, log.meta))
    assert np.array_equal(unix.lost, as_flight(plain).lost) and not unix.notes


def test_a_flight_of_take_off_and_landing_alone_is_refused(log):
    """Of 3.3 s in the air the 0.3 s after take-off and before touch-down may be touched by the legs."""
    air, end = np.flatnonzero(as_flight(log).phase != KINDS.index("ground"))[[0, -1]]
    cut = np.r_[0:air + 165, end - 164:len(log)]
    hop = FlightLog({k: v[cut] for k, v in log.columns.items()} | {"t_s": np.arange(len(cut)) * 0.01}, log.meta)
    reasons = []
    assert not list(ready_flights([hop], VEHICLE, reasons))
    assert "s in the air without a lost row or contact); at least 3 s are needed" in reasons[0]


def test_flights_without_a_gyro_are_left_out_among_others_that_have_one(log):
    with_gyro = as_flight(log)
    bare = as_flight(FlightLog({k: v for k, v in log.columns.items() if not k.startswith("gyro")}, log.meta))
    reasons = []
    assert with_gyro_if_any([with_gyro, bare], reasons) == [with_gyro] and "no gyro" in reasons[0]
    assert with_gyro_if_any([bare, bare], reasons) == [bare, bare] and len(reasons) == 1
