"""The quality report finds the faults that were put in, and no others."""

import json

import numpy as np
import pytest

from airtouch import logs
from airtouch.detector.evaluation.evaluate import remarks
from airtouch.logs.checks.clock import lost_samples, true_period
from airtouch.logs.checks.quality import summary
from airtouch.logs.flight_log import ACC, GYRO, PWM, FlightLog


def sound_flight(seed=0, n=2000):
    rng = np.random.default_rng(seed)
    names = ACC + GYRO
    columns = {"t_s": np.arange(n) * 0.01} | {name: rng.normal(0, 0.5, n) for name in names}
    columns |= {m: 40000 + rng.normal(0, 500, n).round() for m in PWM}
    columns["zrange_m"] = np.r_[np.linspace(0, 0.8, 300), np.full(n - 600, 0.8), np.linspace(0.8, 0, 300)]
    columns["zrange_m"][900:1100] = 0.05
    for m in PWM:
        columns[m][:100] = columns[m][-100:] = 0
    return FlightLog(columns, {"source": "made", "warnings": []})


def test_sound_flight_has_no_fault():
    report = logs.check(sound_flight())
    assert report.warnings == [] and report.lost == 0
    assert report.rate_hz == pytest.approx(100) and report.duration_s == pytest.approx(19.99)
    assert [e.sample for e in report.edges] == [900, 1100]
    json.dumps(report.as_dict())


def test_faults_put_in_are_found():
    log = sound_flight()
    log.columns["gyro_y_radps"] = 3.0 * log["acc_x_mps2"] + 1
    log.columns["gyro_z_radps"][500:600] = 0.25
    log.columns["acc_y_mps2"][700] += 40
    log.columns["m2_pwm"][800:803] = 65535
    log.columns["acc_z_mps2"][10:15] = np.nan
    log.columns["vbat_V"] = np.full(2000, 3.7)
    log.columns["t_s"][50] = log["t_s"][49]
    log.columns["t_s"][60:62] = log["t_s"][61:59:-1]
    report = logs.check(log)
    assert report.duplicated == [("acc_x_mps2", "gyro_y_radps")]
    assert ("gyro_z_radps", 500, 600) in report.stuck and ("vbat_V", 0, 2000) in report.stuck
    assert report.spikes == {"acc_y_mps2": [700]}
    assert report.saturated == {"m2_pwm": 3}
    assert report.missing == {"acc_z_mps2": 5}
    assert (report.clock_repeats, report.clock_backwards) == (1, 1)


def test_lost_samples_are_told_from_bursts():
    rng = np.random.default_rng(1)
    numbers = np.delete(np.arange(4000), [*range(1000, 1017), 2500])
    arrival = 3.0 + numbers * 0.009993 + rng.exponential(0.002, len(numbers))
    for start in (500, 3000):  # bursts: 30 samples wait for the last of them, and none is lost
        arrival[start:start + 30] = arrival[start + 29] + np.arange(30) * 1e-4
    period = true_period(arrival)
    assert period == pytest.approx(0.009993, rel=1e-3)
    assert [(g.sample, g.lost) for g in lost_samples(arrival, period)] == [(1000, 17), (2483, 1)]


@pytest.mark.parametrize("share", [0.02, 0.1, 0.31, 0.45])
def test_every_lost_sample_of_an_even_clock_is_counted(share):
    """With 31 % lost, a twentieth of them was counted, and the rate was 69 Hz: the losses stretched the period."""
    whole = sound_flight()
    there = np.random.default_rng(5).random(len(whole)) >= share
    there[-40:] = True  # too near the end to be sure
    log = FlightLog({name: values[there] for name, values in whole.columns.items()}, whole.meta)
    report = logs.check(log)
    assert report.lost == np.count_nonzero(~there[np.argmax(there):])
    assert report.rate_hz == pytest.approx(100, rel=1e-6)
    resampled = logs.resample(log).meta["resampled"]
    assert resampled["lost_samples"] == report.lost and resampled["from_hz"] == pytest.approx(100, rel=1e-6)
    lines = [line for line in remarks(log) if "were lost" in line]
    assert lines == [f"{report.lost} samples were lost beside {len(log)} logged ones; rows are taken as if none were"]
    assert not remarks(whole)


def held_back(rng, time_s):
    """A packet in 20 waits for the next one."""
    late = rng.choice(len(time_s) - 2, len(time_s) // 20, replace=False)
    time_s[late] = time_s[late + 1] - 1e-4
    return np.maximum.accumulate(time_s)


def stamped_twice(rng, time_s):
    """A row in ten bears the time of the row before it."""
    late = 1 + rng.choice(len(time_s) - 2, len(time_s) // 10, replace=False)
    time_s[late] = time_s[late - 1]
    return time_s


def ticks(rng, time_s):
    """A clock of 10 ms whose reading jitters by 4 ms."""
    return np.maximum.accumulate(np.floor((time_s + 0.005 + rng.normal(0.0, 0.004, len(time_s))) / 0.01) * 0.01)


@pytest.mark.parametrize("late", [held_back, stamped_twice, ticks])
def test_a_late_sample_that_catches_up_is_no_lost_one(late):
    time_s = late(np.random.default_rng(0), np.arange(3000) * 0.01)
    assert true_period(time_s) == pytest.approx(0.01, rel=1e-3)
    assert not lost_samples(time_s, true_period(time_s))


def test_lost_samples_are_counted_among_late_ones():
    rng = np.random.default_rng(1)
    there = rng.random(3000) >= 0.3
    there[-40:] = True
    time_s = held_back(rng, np.arange(3000) * 0.01)[there]
    assert true_period(time_s) == pytest.approx(0.01, rel=1e-3)
    lost = sum(g.lost for g in lost_samples(time_s, true_period(time_s)))
    assert lost == pytest.approx(np.count_nonzero(~there), rel=0.03)


def test_rows_lost_in_the_air_are_no_ground():
    log = sound_flight()
    segments = logs.segments(log)
    hover = next(s for s in segments if s.kind not in ("ground", "take-off", "landing") and s.stop - s.start > 120)
    hole = slice(hover.start + 10, hover.start + 90)
    holed = log.with_columns({k: np.where(np.isin(np.arange(len(log)), np.r_[hole]), np.nan, v)
                              for k, v in log.columns.items() if k != "t_s"})
    assert [s.kind for s in logs.segments(holed)] == [s.kind for s in segments]


def test_segments_of_a_made_flight():
    kinds = [(s.kind, s.start, s.stop) for s in logs.segments(sound_flight())]
    assert [k for k, _, _ in kinds] == ["ground", "take-off", "cruise", "over platform", "cruise", "landing",
                                       "ground"]
    assert ("over platform", 900, 1100) in kinds and kinds[0] == ("ground", 0, 100)
    assert kinds[-1] == ("ground", 1900, 2000)
    speed = np.where((np.arange(2000) > 700) & (np.arange(2000) < 1300), 0.3, 0.0)
    moving = sound_flight().with_columns({"vx_mps": speed, "vy_mps": np.zeros(2000)})
    names = [s.kind for s in logs.segments(moving)]
    assert names == ["ground", "take-off", "hover", "cruise", "over platform", "cruise", "hover", "landing",
                     "ground"]


def test_a_flight_that_lands_on_the_platform_has_a_landing():
    """It comes to a platform of 0.4 m at 8 s and descends onto it from 15 to 18 s."""
    time = 0.01 * np.arange(2000)
    height = np.interp(time, [1, 3, 15, 18], [0.0, 0.8, 0.8, 0.4])
    columns = {"t_s": time, "zrange_m": np.where(time < 8, height, height - 0.4)}
    columns |= dict.fromkeys(PWM, np.where((time > 1) & (time < 18), 40000.0 + np.arange(2000) % 9, 0.0))
    segments = logs.segments(FlightLog(columns, {"source": "made", "warnings": []}))
    assert [s.kind for s in segments] == ["ground", "take-off", "cruise", "over platform", "landing", "ground"]
    platform, landing = segments[3:5]
    assert platform.start == 800 and 1500 < landing.start < 1600 and landing.stop == 1800


@pytest.mark.parametrize(("begins_m", "ends_m", "kinds"), [
    (0.56, 0.6, ["hover"]), (0.1, 0.6, ["take-off", "hover"]), (0.56, 0.1, ["hover", "landing"])])
def test_a_flight_cut_high_in_the_air_has_no_take_off_and_no_landing(begins_m, ends_m, kinds):
    """Of a climb and a descent around 0.9 m, the motors on throughout."""
    height = np.r_[np.linspace(begins_m, 0.9, 200), np.full(600, 0.9), np.linspace(0.9, ends_m, 200)]
    log = FlightLog({"t_s": np.arange(1000) * 0.01, "z_m": height} | dict.fromkeys(PWM, np.full(1000, 40000.0)),
                    {"source": "cut", "warnings": []})
    assert [s.kind for s in logs.segments(log)] == kinds
    standing = {"z_m": np.r_[np.zeros(100), height[100:-100], np.zeros(100)]} | dict.fromkeys(
        PWM, np.r_[np.zeros(100), np.full(800, 40000.0), np.zeros(100)])
    whole = logs.segments(log.with_columns(standing))
    assert [s.kind for s in whole] == ["ground", "take-off", "hover", "landing", "ground"]


def test_a_platform_crossed_on_a_lower_leg_is_no_landing():
    """Most of the flight is at 1.0 m; the platform of 0.5 m is crossed at 0.6 m, from 21 to 24 s."""
    time = 0.01 * np.arange(3000)
    height = np.interp(time, [1, 3, 18, 19, 27, 29], [0.0, 1.0, 1.0, 0.6, 0.6, 0.0])
    columns = {"t_s": time, "zrange_m": np.where((time > 21) & (time < 24), height - 0.5, height)}
    columns |= dict.fromkeys(PWM, np.where((time > 0.9) & (time < 29.2), 40000.0 + np.arange(3000) % 9, 0.0))
    segments = logs.segments(FlightLog(columns, {"source": "made", "warnings": []}))
    assert [(s.start, s.stop) for s in segments if s.kind == "over platform"] == [(2101, 2400)]


def test_a_group_of_channels_is_there_with_any_axis():
    part = FlightLog({name: values for name, values in sound_flight().columns.items() if "_x_" not in name}, {})
    assert summary(part)["channels"] == ["acc", "gyro", "pwm", "range"]


def test_a_down_range_without_a_value_is_not_the_ground():
    """With `zrange_m` all NaN the whole flight was on the ground, whatever `z_m` said."""
    motors = np.r_[np.zeros(200), np.full(1600, 40000.0), np.zeros(200)]
    height = np.r_[np.zeros(200), np.linspace(0, 0.8, 100), np.full(1400, 0.8), np.linspace(0.8, 0, 100), np.zeros(200)]
    log = FlightLog({"t_s": np.arange(2000) * 0.01, "zrange_m": np.full(2000, np.nan)} | dict.fromkeys(PWM, motors),
                    {"source": "made", "warnings": []})
    alone = logs.segments(log)
    assert [(s.kind, s.start, s.stop) for s in alone] == [("ground", 0, 200), ("hover", 200, 1800),
                                                          ("ground", 1800, 2000)]
    with_height = logs.segments(log.with_columns({"z_m": height}))
    assert [s.kind for s in with_height] == ["ground", "take-off", "hover", "landing", "ground"]
    assert not any("no flight" in w for w in logs.check(log).warnings)


def test_known_faults_of_recorded_flights_are_reported(flights):
    folder = flights / "airtouch"
    report = logs.check(logs.read(folder / "imu_data_0102-2131.csv.gz"))  # gyro duplicates acc
    assert len(report.duplicated) == 3
    assert logs.check(logs.read(folder / "imu_data_0103-1417.csv.gz")).lost >= 10  # lost packets
    assert logs.check(logs.read(folder / "imu_data_0201-2204_h79.csv.gz")).warnings == []
    hop = logs.check(logs.read(folder / "imu_data_0126-1621.csv.gz"))
    assert hop.warnings == ["in the air for only 1.5 s"]
    stuck = logs.check(logs.read(flights / "imrclab" / "brushed_jana23.csv.gz")).stuck
    assert {"vbat_V", "rpm_1"} == {name for name, _, _ in stuck}  # as its SOURCE.md says
