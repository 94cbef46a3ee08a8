"""True edges: closed-form cases, then every flight of the manifest."""

import csv

import numpy as np
import pytest

from airtouch import logs
from airtouch.errors import AirTouchError
from airtouch.logs.alignment import aligned_log
from airtouch.logs.flight_log import PWM, FlightLog


def flight(height, pwm=40000.0):
    n = len(height)
    return FlightLog({"zrange_m": np.asarray(height, float)} | {m: np.full(n, pwm) for m in PWM},
                     {"sample_period_s": 0.01})


def test_step_down_and_up():
    height = np.r_[np.full(100, 0.8), np.full(150, 0.05), np.full(100, 0.8)]
    edges = logs.true_edges(flight(height))
    assert [(e.sample, e.kind) for e in edges] == [(100, "entry"), (250, "exit")]
    assert (edges[0].height_before_m, edges[0].height_after_m) == (0.8, 0.05)


def test_step_spread_over_readings_counts_once_where_it_first_exceeds():
    height = np.r_[np.full(100, 0.76), np.full(5, 0.60), np.full(5, 0.20), np.full(100, 0.0)]
    assert [e.sample for e in logs.true_edges(flight(height))] == [105]  # 0.16 m is none, 0.40 m is


def test_threshold_is_more_than_30_cm():
    step = np.r_[np.full(100, 0.8), np.full(100, 0.5)]  # 0.30000000000000004 in floats
    assert logs.true_edges(flight(step)) == []
    assert len(logs.true_edges(flight(step - np.r_[np.zeros(100), np.full(100, 0.001)]))) == 1
    assert len(logs.true_edges(flight(step), step_m=0.2)) == 1


def test_within_two_samples_but_not_three():
    def ramp(samples):
        return np.r_[np.full(100, 0.8), np.linspace(0.8, 0.4, samples + 1)[1:], np.full(100, 0.4)]
    assert [e.sample for e in logs.true_edges(flight(ramp(2)))] == [101]
    assert logs.true_edges(flight(ramp(3))) == []


def test_glitch_overshoot_and_invalid_readings_are_no_edges():
    glitch = np.full(300, 0.8)
    glitch[100:104] = 0.2
    assert logs.true_edges(flight(glitch)) == []
    overshoot = np.r_[np.full(100, 0.05), np.full(4, 1.15), np.full(100, 0.77)]
    assert [(e.sample, e.kind) for e in logs.true_edges(flight(overshoot))] == [(100, "exit")]
    invalid = np.full(300, 0.8)
    invalid[100:180] = np.nan
    assert logs.true_edges(flight(invalid)) == []


def test_a_descent_that_nobody_measured_is_no_edge():
    """From 0.8 m to 0.4 m in 2 s: with its readings it is none, and without them nobody knows."""
    height = np.r_[np.full(300, 0.8), np.linspace(0.8, 0.4, 200), np.full(300, 0.4)]
    log = flight(height).with_columns({"t_s": 0.01 * np.arange(800)}, sample_period_s=None)
    rows = np.r_[:300, 500:800]
    lost = FlightLog({name: values[rows] for name, values in log.columns.items()}, log.meta)
    invalid = log.with_columns({"zrange_m": np.where((np.arange(800) >= 300) & (np.arange(800) < 500), np.nan, height)})
    assert logs.true_edges(log) == logs.true_edges(lost) == logs.true_edges(invalid) == []


@pytest.mark.parametrize("without", [10, 20])
def test_an_edge_between_readings_that_are_close_is_one(without):
    """The sensor reads every 25 to 50 ms; 0.11 s without a reading are two of them lost, 0.21 s are too many."""
    height = np.r_[np.full(100, 0.8), np.full(without, np.nan), np.full(100, 0.05)]
    assert len(logs.true_edges(flight(height))) == (without == 10)
    slow = FlightLog({"t_s": 0.2 * np.arange(80), "zrange_m": np.repeat([0.8, 0.05], 40)}
                     | {m: np.full(80, 40000.0) for m in PWM}, {})
    assert [e.sample for e in logs.true_edges(slow)] == [40]  # at 5 Hz no reading is closer than 0.2 s


GAPS = [0.04, 0.11, 0.15, 0.156, 0.18, 0.21, 0.25, 0.3, 0.35, 0.41]  #: s; a step over more than 0.15 s is no edge


@pytest.mark.parametrize("gap_s", GAPS)
@pytest.mark.parametrize("rate_hz", [50.0, 100.0, 200.0])
@pytest.mark.parametrize("rows_lost", [False, True])
def test_a_log_has_its_edges_before_and_after_resampling(gap_s, rate_hz, rows_lost):
    time = 0.002 * np.arange(4000)
    unread = (time > 4.0 + 1e-9) & (time < 4.0 + gap_s - 1e-9)
    height = np.where(time > 4.0 + 1e-9, 0.3, 0.8)
    log = flight(np.where(unread, np.nan, height)).with_columns({"t_s": time}, sample_period_s=0.002)
    if rows_lost:
        log = FlightLog({name: values[~unread] for name, values in log.columns.items()}, log.meta)
    edges, after = logs.true_edges(log), logs.true_edges(logs.resample(log, rate_hz))
    assert [e.kind for e in edges] == [e.kind for e in after] == ["entry"] * (gap_s <= 0.15)
    for e, f in zip(edges, after, strict=True):
        assert f.sample / rate_hz == pytest.approx(log["t_s"][e.sample], abs=0.05)


@pytest.mark.parametrize("gap_s", GAPS)
@pytest.mark.parametrize("first_s", [4.0, 4.003, 4.0075])
@pytest.mark.parametrize("invalid", [False, True])
def test_a_log_of_several_clocks_has_no_edge_over_a_long_gap(gap_s, first_s, invalid):
    """As ULog files and bags have them; invalid: the sensor says so every 40 ms, else it is silent."""
    imu = 0.01 * np.arange(800)
    before, after = first_s - 0.04 * np.arange(90)[::-1], first_s + gap_s + 0.04 * np.arange(80)
    between = np.arange(first_s + 0.04, first_s + gap_s - 0.001, 0.04) if invalid else np.empty(0)
    height = np.r_[np.full(90, 0.8), np.full(len(between), np.nan), np.full(80, 0.3)]
    log = aligned_log({"gyro_x_radps": (imu, imu), "zrange_m": (np.r_[before, between, after], height)}
                      | {m: (imu, np.full(800, 40000.0)) for m in PWM}, {"source": "made"})
    assert [e.kind for e in logs.true_edges(log)] == ["entry"] * (gap_s <= 0.15)


def test_a_step_on_the_ground_is_no_edge_and_edges_need_a_range():
    height = np.r_[np.full(100, 0.8), np.full(100, 0.05)]
    assert logs.true_edges(flight(height, pwm=0.0)) == []  # carried by hand
    with pytest.raises(AirTouchError, match="zrange_m"):
        logs.true_edges(FlightLog({PWM[0]: np.zeros(3)}))


def test_every_clean_flight_has_one_entry_and_one_exit(flights):
    clean = [r for r in csv.DictReader((flights / "airtouch" / "manifest.csv").open()) if r["use"] == "clean"]
    for row in clean:
        edges = logs.true_edges(logs.read(flights / "airtouch" / row["file"]))
        assert [e.kind for e in edges] == ["entry", "exit"], row["file"]
        assert edges[0].height_after_m < 0.15 and edges[0].height_before_m > 0.6, row["file"]
    assert len(clean) == 87


@pytest.mark.parametrize("name, kinds", [
    ("imu_data_0126-2009", ["entry", "exit"] * 3),  # manifest: 3 entry/exit pairs
    ("imu_data_1104-1406_00d", ["entry", "exit"] * 2),  # 9 columns
    ("imu_data_0126-1621", []),  # no flight
    ("imu_data_0701-2232", []),  # 0 pairs
])
def test_messy_flights_as_the_manifest_notes(flights, name, kinds):
    log = logs.read(flights / "airtouch" / f"{name}.csv.gz")
    assert [e.kind for e in logs.true_edges(log)] == kinds
