"""Bad input: one line that names file, place and remedy, or an answer that says what is missing."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import short_flights
from airtouch import vehicle as vehicles
from airtouch.errors import AirTouchError
from airtouch.gap.diagnosis import diagnose
from airtouch.gap.measurement import measure
from airtouch.logs.flight_log import ACC, ACC_WORLD, COLUMNS, GYRO, POSITION, PWM, VELOCITY, FlightLog
from airtouch.simulation.effects import EFFECTS

VEHICLE = vehicles.load("crazyflie-2.1-flow")


@pytest.fixture(scope="module")
def sweeps():
    return short_flights.fly(2)


def without(log, *names):
    return FlightLog({k: v for k, v in log.columns.items() if k not in names}, dict(log.meta))


def with_columns(log, **columns):
    return log.with_columns(columns)


@pytest.mark.parametrize(("change", "words"), [
    (lambda log: log.slice(0, 1), "1 samples"),
    (lambda log: log.slice(0, 260), "no flight in it"),
    (lambda log: without(log, *PWM), "no motor commands (m1_pwm"),
    (lambda log: without(log, "m3_pwm"), "no motor commands"),
    (lambda log: without(log, *ACC, *ACC_WORLD), "no accelerations (acc_x_mps2"),
    (lambda log: log.with_columns({c: np.zeros(len(log)) for c in PWM}), "no flight in it (0.0 s in the air)"),
    (lambda log: with_columns(log, t_s=np.where(np.arange(len(log)) < 700, log["t_s"], log["t_s"] - 3.0)),
     "sample 700: the clock runs backwards by 2.99"),
    (lambda log: log.with_columns({c: np.full(len(log), np.nan) for c in PWM}), ""),
    (lambda log: log.with_columns({c: np.full(len(log), np.nan) for c in ACC + ACC_WORLD if log.has(c)}), ""),
])
def test_what_cannot_be_used_is_said_in_one_line(sweeps, change, words):
    with pytest.raises(AirTouchError) as error:
        measure([change(sweeps[0])], VEHICLE)
    text = str(error.value)
    assert words in text and "\n" not in text and sweeps[0].source in text


@pytest.mark.parametrize(("missing", "words", "remaining"), [
    (GYRO, "no gyro", "force_x"), (("zrange_m",), "no down range", "torque_x"),
    (VELOCITY, "no velocity", "force_z"), (("vbat_V", "t_s", *POSITION), None, "torque_z")])
def test_a_missing_channel_leaves_the_others(sweeps, missing, words, remaining):
    gap = measure([without(sweeps[0], *missing)], VEHICLE)
    assert any(c.channel == remaining for c in gap.map.cells)
    assert words is None or any(words in line for line in gap.cannot)


def test_one_bad_flight_does_not_stop_the_others(sweeps):
    gap = measure([sweeps[0].slice(0, 100), sweeps[1]], VEHICLE)
    assert len(gap.flights) == 1 and len(gap.left_out) == 1 and sweeps[0].source in gap.left_out[0]
    with pytest.raises(AirTouchError, match="no flight that can be used of 2; the first: "):
        measure([sweeps[0].slice(0, 100), sweeps[1].slice(0, 100)], VEHICLE)


def test_a_measurement_of_no_flight_is_refused():
    with pytest.raises(AirTouchError, match="no flight that can be used"):
        measure([], VEHICLE)


def test_a_vehicle_file_without_a_parameter_names_it(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('name = "mine"\nmass_kg = 0.03\narm_m = 0.04\n')
    with pytest.raises(AirTouchError, match=r"mine.toml: missing inertia_kg_m2, thrust_of_pwm_n"):
        vehicles.load(path)


def stuck(log, name):
    """The log, under a name of its own, with a roll rate that stands still for 3 s, and a voltage that is none."""
    rate = log["gyro_x_radps"].copy()
    rate[400:700] = rate[400]
    columns = {**log.columns, "gyro_x_radps": rate, "vbat_V": np.full(len(log), np.nan)}
    return FlightLog(columns, {**log.meta, "source": f"flights/{name}.csv"})


def test_notes_on_flights_and_on_the_baseline_have_the_name_once(sweeps):
    one, other = stuck(sweeps[0], "one"), stuck(sweeps[1], "other")
    whose = ["one.csv", "3 of 3 baseline flights"]
    notes = measure([one], VEHICLE, [other, other, other]).notes
    assert [n[:n.index(":")] for n in notes if "gyro_x_radps does not change" in n] == whose
    silent = [without(log, *GYRO) for log in (one, other, other, other)]
    of_silent = diagnose(silent[:1], VEHICLE, silent[1:]).notes
    assert [n[:n.index(":")] for n in of_silent if n.endswith("vbat_V")] == whose


def test_inconsistent_baseline_is_said_and_the_measurement_goes_on(sweeps):
    """One of two nominal flights carries a bias that the other does not."""
    other = sweeps[1].with_columns({a: sweeps[1][a] + 1.5 for a in ("acc_x_mps2",)})
    gap = measure([sweeps[0]], VEHICLE, [sweeps[0], other], calibrated=False)
    note = next(n for n in gap.notes if "not consistent" in n)
    assert "1.5 m/s^2 in forward force" in note and gap.map.cells
    lowest = [c for c in gap.map.cells if c.channel == "force_x" and c.band_hz[0] == 0.0 and c.phase == "cruise"]
    assert all(c.floor > 0.5 for c in lowest)


def test_a_baseline_that_cannot_be_used_is_left_out(sweeps):
    gap = measure([sweeps[0]], VEHICLE, [sweeps[1].slice(0, 50)])
    assert gap.baseline == () and len(gap.left_out) == 1


VALUES = st.one_of(st.floats(-2.0, 2.0), st.sampled_from([np.nan, np.inf, -np.inf, 0.0, 1e300, -1e5, 65535.0, 9.81]))


@st.composite
def tables(draw):
    n = draw(st.integers(0, 900))
    names = draw(st.lists(st.sampled_from(COLUMNS), unique=True))
    if draw(st.booleans()):
        names = list(dict.fromkeys([*names, *ACC, *PWM]))
    rng = np.random.default_rng(draw(st.integers(0, 2 ** 32 - 1)))
    columns = {}
    for name in names:
        centre, spread = draw(VALUES), draw(st.sampled_from([0.0, 1.0, 1e4]))
        with np.errstate(all="ignore"):
            columns[name] = centre + spread * rng.normal(size=n)
        if n and draw(st.booleans()):
            columns[name][rng.integers(0, n, n // 10 + 1)] = draw(VALUES)
    if "t_s" in columns and draw(st.booleans()):
        columns["t_s"] = np.arange(n) * draw(st.sampled_from([0.01, 0.002, 0.1, -0.01, 0.0]))
    return FlightLog(columns, {"source": "random.csv"})


@st.composite
def damages(draw):
    """What becomes of some columns of a real flight: gone, constant, noise, spiked, or cut short."""
    kinds = st.sampled_from(["drop", "constant", "noise", "spikes"])
    columns = draw(st.dictionaries(st.sampled_from(COLUMNS), st.tuples(kinds, VALUES), max_size=8))
    return columns, draw(st.integers(350, 1900)), draw(st.integers(0, 2 ** 32 - 1))


def damaged_log(log, damage):
    columns, stop, seed = damage
    rng, log = np.random.default_rng(seed), log.slice(0, stop)
    out = dict(log.columns)
    for name, (kind, value) in columns.items():
        if kind == "drop":
            out.pop(name, None)
        elif kind == "spikes" and name in out:
            out[name] = out[name].copy()
            out[name][rng.integers(0, len(log), 20)] = value
        elif kind != "spikes":
            with np.errstate(all="ignore"):
                out[name] = value + (kind == "noise") * rng.normal(size=len(log))
    return FlightLog(out, dict(log.meta))


def answers_or_one_line(log, baseline):
    try:
        gap = measure([log], VEHICLE, baseline, calibrated=False)
    except AirTouchError as error:
        assert "\n" not in str(error) and str(error)
        return
    json.dumps(gap.plain(), allow_nan=False)


@settings(max_examples=40, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
@given(tables())
@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_random_tables_give_an_answer_or_one_line(log):
    answers_or_one_line(log, [])


@settings(max_examples=60, suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture])
@given(damages())
@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_damaged_flights_give_an_answer_or_one_line(sweeps, damage):
    answers_or_one_line(damaged_log(sweeps[0], damage), [])


@settings(max_examples=3, suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture])
@given(damages())
@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_a_damaged_baseline_does_no_harm(sweeps, damage):
    answers_or_one_line(sweeps[1], [damaged_log(sweeps[0], damage)])


OTHERS = tuple(name for name in EFFECTS if name not in ("mass", "imu_bias", "imu_noise", "time_jitter"))


@settings(max_examples=10, suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture])
@given(damages())
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_damaged_flight_is_diagnosed_or_refused_in_one_line(sweeps, damage):
    try:
        diagnosis = diagnose([damaged_log(sweeps[0], damage)], VEHICLE, without=OTHERS)
    except AirTouchError as error:
        assert "\n" not in str(error) and str(error)
        return
    table = json.loads(json.dumps(diagnosis.plain(), allow_nan=False))
    first = table["effects"][0]["name"] if table["verdict"] == "effect" else table["verdict"]
    assert first == table["ranking"][0]["name"] in {"mass", "imu_bias", "imu_noise", "time_jitter", "none", "unknown"}
    assert sum(r["probability"] for r in table["ranking"]) == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("samples", [470, 520, 600, 700])
def test_a_short_nominal_flight_has_no_gap(sweeps, samples):
    assert diagnose([sweeps[0].slice(0, samples)], VEHICLE, without=OTHERS).verdict == "none"


def test_a_flight_that_is_too_short_is_refused(sweeps):
    with pytest.raises(AirTouchError, match="too short|no flight in it"):
        diagnose([sweeps[0].slice(0, 420)], VEHICLE, without=OTHERS)


def test_a_diagnosis_of_no_flight_is_refused():
    with pytest.raises(AirTouchError, match="no flight to diagnose"):
        diagnose([], VEHICLE)


def test_without_a_flight_the_error_is_of_the_flights_not_of_the_baseline(sweeps):
    one, other, nominal = (replace(sweeps[0].slice(0, 1), meta={"source": n}) for n in ("one", "other", "nominal"))
    with pytest.raises(AirTouchError, match="no flight to diagnose"):
        diagnose([], VEHICLE, [nominal])
    with pytest.raises(AirTouchError, match="of 2; the first: one") as error:
        diagnose([one, other], VEHICLE, [nominal])
    assert "nominal" not in str(error.value)
