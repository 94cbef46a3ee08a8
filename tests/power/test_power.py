"""Power from INA219 logs against closed forms; bad files; the estimate."""

import math
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from airtouch.errors import AirTouchError
from airtouch.power import ina219, stages

ROOT = Path(__file__).parents[2]

KNOWN = tuple(stages.PAPER_MW)


def text(times_ms, volts, milliamperes, stage=None, header="time_ms,bus_V,current_mA,stage"):
    rows = [f"{t:.3f},{v:.4f},{i:.4f},{'' if stage is None else stage[k]}"
            for k, (t, v, i) in enumerate(zip(times_ms, volts, milliamperes, strict=True))]
    return "\n".join([header, *rows]) + "\n"


def constant(seconds=5.0, volts=3.8, milliamperes=20.0, rate=200):
    times = np.arange(0.0, 1000.0 * seconds, 1000.0 / rate)
    return times, np.full(len(times), volts), np.full(len(times), milliamperes)


@given(st.floats(0.1, 20.0), st.floats(-300.0, 300.0))
def test_constant_power_is_measured_to_a_thousandth(volts, milliamperes):
    power = ina219.power(ina219.parse(text(*constant(3.0, volts, milliamperes)), "f"))
    assert power.mw == pytest.approx(volts * milliamperes, abs=0.01 + 1e-3 * abs(volts * milliamperes))
    assert power.mj == pytest.approx(power.mw * power.seconds) and power.seconds == pytest.approx(2.995)
    assert power.half_mw == pytest.approx(0.0, abs=1e-6)


def test_energy_of_a_ramp_is_its_integral():
    times = np.sort(np.random.default_rng(0).uniform(0, 10_000, 3000))
    trace = ina219.parse(text(times, np.full(3000, 4.0), times / 100.0), "f")
    exact = 4.0 * (times[-1] ** 2 - times[0] ** 2) / 2 / 100.0 / 1000.0  # mJ
    assert ina219.power(trace).mj == pytest.approx(exact, rel=1e-4)


@pytest.mark.parametrize("seconds", [2.0, 4.0, 20.0])
def test_the_interval_covers_the_truth_as_often_as_it_says(seconds):
    rng, hits = np.random.default_rng(1), 0
    for _ in range(500):
        times, volts, current = constant(seconds)
        noisy = (current + rng.normal(0, 5, len(times))) / 1000.0
        power = ina219.power(ina219.Trace(times / 1000.0, volts, noisy, ("",) * len(times), ()))
        hits += abs(power.mw - 76.0) <= power.half_mw
    assert 455 <= hits <= 495  # 475 expected, standard deviation 4.9


def test_a_log_too_short_for_an_interval_shows_none():
    trace = ina219.parse(text(*constant(1.0), ["baseline"] * 200), "f")
    table = stages.table(ina219.by_stage(trace, KNOWN))
    assert "nan" not in table and re.search(r"Total\s+76\.0\s+121", table)


def test_gaps_and_a_reset_of_the_arduino_are_no_energy():
    times, volts, current = constant(2.0)
    all_times = np.r_[times, times + 60_000, times]  # a minute is missing, then the clock starts anew
    trace = ina219.parse(text(all_times, np.tile(volts, 3), np.tile(current, 3)), "f")
    power = ina219.power(trace)
    assert power.seconds == pytest.approx(3 * 1.995) and power.mw == pytest.approx(76.0)


@pytest.mark.parametrize("header, row, expected", [
    ("time_s;Bus Voltage (V);Current (A)", "{t};3,8;0,02", 76.0),
    ("t_us\tvoltage_mV\tcurrent_uA", "{us}\t3800\t20000", 76.0),
    ("current_mA,time_ms,bus_V", "20,{ms},3.8", 76.0),
    ("millis,V,I", "{ms},3.8,0.02", 76.0),
    (None, "{ms},3.8,20", 76.0),
])
def test_any_order_unit_and_separator(header, row, expected):
    lines = [row.format(t=str(k * 0.005).replace(".", ","), us=5000 * k, ms=5 * k) for k in range(500)]
    power = ina219.power(ina219.parse("\ufeff# made by hand\r\n" + "\r\n".join([*([header] if header else []), *lines]),
                                      "f"))
    assert power.mw == pytest.approx(expected) and power.seconds == pytest.approx(2.495)


@pytest.mark.parametrize("header", ["time_ms,bus_power_mW,bus_V,current_mA", "time_ms,current_V,bus_V,current_mA",
                                    "time_ms,Bus Power (W),Bus Voltage (V),Current (mA)"])
def test_a_column_with_the_unit_of_another_quantity_is_not_taken(header):
    trace = ina219.parse(header + "\n" + "".join(f"{k},{1.5},3.8,20\n" for k in range(50)), "x.csv")
    assert (trace.volts == 3.8).all() and trace.amperes == pytest.approx(0.02)


@pytest.mark.parametrize("name", ["time", "timestamp", "t", "Time"])
def test_a_time_without_a_unit_is_read_where_it_can_only_be_seconds(name):
    def log(column, step):
        return f"{column},bus_V,current_mA\n" + "".join(f"{step * k:g},3.8,20\n" for k in range(400))

    assert ina219.power(ina219.parse(log(name, 0.005), "x.csv")).seconds == pytest.approx(1.995)
    for milliseconds in (1.0, 5.0):
        with pytest.raises(AirTouchError, match=rf"x\.csv:1: the column '{name}' names no unit.*name it time_ms"):
            ina219.parse(log(name, milliseconds), "x.csv")
    assert ina219.power(ina219.parse(log("time_s", 1.0), "x.csv")).seconds == pytest.approx(399.0)


def test_a_log_of_power_alone_is_refused():
    with pytest.raises(AirTouchError, match="no column for volts"):
        ina219.parse("time_ms,bus_power_mW,current_mA\n1,2,3\n2,2,3\n", "x.csv")


def test_damaged_lines_are_passed_over_and_told():
    lines = text(*constant(2.0)).splitlines()
    lines[50], lines[60], lines[70] = "250,3.8", "300,3x8,20,", "350,99,20,"
    lines[100:100] = ["time_ms,bus_V,current_mA,stage", "", "# stage"]
    lines[-1] = lines[-1][:3]
    trace = ina219.parse("\n".join(lines), "f")
    assert len(trace.time_s) == 396 and "4 damaged lines" in trace.notes[0] and "the first is 51" in trace.notes[0]
    assert ina219.power(trace).mw == pytest.approx(76.0)


@pytest.mark.parametrize("content, message", [
    ("", "no data"), ("# only a comment\n", "no data"), ("time_ms,bus_V\n1,2\n", "no column for amperes"),
    ("1,2,3\n", "1 usable lines"), ("time_ms,bus_V,current_mA\n" + "a,b,c\n" * 50, ":2: 50 of 50 lines"),
    ("time_ms,bus_V,current_A\n" + "".join(f"{k},3.8,20\n" for k in range(50)), "check the columns and their units"),
])
def test_what_is_no_log_is_said_in_one_line(content, message):
    with pytest.raises(AirTouchError, match=re.escape(message)) as error:
        ina219.parse(content, "run.csv")
    assert str(error.value).startswith("run.csv") and "\n" not in str(error.value)


@given(st.text(max_size=300)
       | st.lists(st.lists(st.sampled_from(["1", "2.5", "nan", "-1e999", "time_ms", "x", ""]), max_size=5),
                                        max_size=30).map(lambda rows: "\n".join(",".join(r) for r in rows)))
def test_any_text_gives_a_trace_or_one_line(content):
    try:
        trace = ina219.parse(content, "f")
    except AirTouchError as error:
        assert "\n" not in str(error).replace(repr(content), "")
        return
    assert np.isfinite(trace.time_s).all() and np.isfinite(trace.volts * trace.amperes).all()
    ina219.power(trace)


def measured(levels):
    """A log of all stages, 4 s each, with these total powers, mW."""
    times, volts, current, stage = [], [], [], []
    rng = np.random.default_rng(2)
    for k, (name, mw) in enumerate(levels.items()):
        t, v, i = constant(4.0, 3.8, mw / 3.8)
        times += list(t + 4000.0 * k)
        volts += list(v)
        current += list(i + rng.normal(0, 0.2, len(i)))
        stage += [name] * len(t)
    return text(times, volts, current, stage)


LEVELS = {"baseline": 78.0, "fc-fe": 84.0, "CCS_FF": 86.0, "Filter": 88.0, "network": 121.0}


def test_each_stage_is_what_it_adds(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text(measured(LEVELS))
    powers = ina219.by_stage(ina219.parse(path.read_text(), "run.csv"), KNOWN)
    assert list(powers) == list(KNOWN)
    for name, (mw, half) in ina219.added_power(powers).items():
        assert mw == pytest.approx(stages.PAPER_MW[name], abs=2 * half + 0.1) and 0.0 < half < 1.0
    table = stages.table(powers)
    assert re.search(r"Physical Knowledge-aided Network\s+3[23]\.\d \[.*\]\s+3[23]\d\s+33\s", table)
    assert re.search(r"Total\s+12[01]\.\d \[.*\]\s+121", table)


def run(*arguments):
    command = [sys.executable, str(ROOT / "tools/power/power.py"), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True)


def test_the_script_reads_one_file_a_stage_and_refuses_what_it_cannot(tmp_path):
    for name, mw in (("baseline", 78.0), ("network", 111.0)):
        (tmp_path / f"{name}.csv").write_text(text(*constant(3.0, 3.8, mw / 3.8)))
    process = run("measure", f"baseline={tmp_path}/baseline.csv", f"network={tmp_path}/network.csv")
    assert process.returncode == 0 and re.search(r"Network\s+33.0 ", process.stdout), process
    for arguments, message in ((["measure", tmp_path / "baseline.csv"], "no column of stages"),
                               (["measure", tmp_path / "none.csv"], "cannot be read")):
        refusal = run(*arguments)
        assert refusal.returncode == 2 and message in refusal.stderr and refusal.stderr.count("\n") == 1


def test_the_estimate_follows_from_its_counts_and_says_that_it_is_one():
    folder = ROOT / "tools" / "instruction_counts"
    budget, gap8 = (stages.counts(folder / f"{name}.toml") for name in ("budget", "gap8_budget"))
    estimates = stages.estimate(budget, gap8)
    load = budget["cortex-m4"]["band_power"]["instructions_mean"] * 100 / 168e6  # share of the core at a cycle each
    assert estimates["FC-FE"].low_mw == pytest.approx(load * 20 * 3.7)
    assert estimates["FC-FE"].high_mw == pytest.approx(load * 2 * 40 * 3.7)
    window = estimates["network, paper on the GAP8"]
    assert window.high_mw == pytest.approx(gap8["paper"]["window_instructions"] * 100 * 64 / 800e6)
    assert window.low_mw == pytest.approx(8 * gap8["paper"]["cycles_8"] * 100 * 64 / 800e6)
    assert estimates["network, best on the GAP8"].low_mw == estimates["network, best on the GAP8"].high_mw
    assert stages.estimate_table(estimates).count("ESTIMATE") == 2
    assert all(math.isfinite(e.high_mw) and e.low_mw <= e.high_mw for e in estimates.values())


def test_budgets_that_lack_something_are_refused():
    with pytest.raises(AirTouchError, match="no instructions_mean for cortex-m4.band_power"):
        stages.estimate({}, {})
    with pytest.raises(AirTouchError, match="GAP8's budget"):
        stages.gap8_mw({"window_instructions": 5})
    with pytest.raises(AirTouchError, match="cannot be read as a budget"):
        stages.counts(ROOT / "none.toml")


def test_the_sketch_writes_what_is_read():
    sketch = (ROOT / "tools" / "power" / "ina219_logger.ino").read_text()
    header = re.search(r'println\("(time.*?)"\)', sketch)[1]
    trace = ina219.parse(f"{header}\n5,3.801,20.51,\n10,3.800,20.49,FC-FE\n15,3.8,20.4,FC-FE\n", "sketch")
    assert trace.stage == ("", "FC-FE", "FC-FE") and trace.amperes[0] == pytest.approx(0.02051)
