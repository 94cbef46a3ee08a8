"""Measuring the gap of whole flights: what is injected is found, with few channels too."""

import json
from dataclasses import replace

import numpy as np
import pytest

import short_flights
from airtouch import logs, vehicle
from airtouch.errors import AirTouchError
from airtouch.gap.flights.flight import ready
from airtouch.gap.measurement import Measurement, curves_of_measurement, measure
from airtouch.gap.where.cell import BASELINE, GapMap
from airtouch.gap.where.rotor_speeds import RotorSpeed
from airtouch.gap.where.summary import significant
from airtouch.logs.flight_log import ACC, ACC_WORLD, GYRO, PWM, RPM, FlightLog
from airtouch.logs.segments import KINDS
from made_diagnosis import cell

VEHICLE = vehicle.load("crazyflie-2.1-flow")


@pytest.fixture(scope="module")
def sweeps():
    return short_flights.fly(3)


def no_constant(name):
    raise ValueError(name)


def pushed(log, size, kind):
    """The log with a forward force of `size` m/s^2 more in one phase."""
    phase = ready(log, VEHICLE).phase
    pad = np.zeros(len(log))
    pad[:len(phase)] = size * (phase[:len(log)] == KINDS.index(kind))
    return log.with_columns({"acc_x_mps2": log["acc_x_mps2"] + pad})


def test_json_holds_the_largest_cells_and_the_whole_map(sweeps):
    gap = measure(sweeps, VEHICLE)
    table = json.loads(json.dumps(gap.plain(), allow_nan=False), parse_constant=no_constant)
    assert {"where", "map", "gap", "floor_from", "cannot", "notes"} <= set(table)
    assert {"flights", "vehicle", "spectra", "left_out"} <= set(table)
    assert len(table["where"]) >= 10 and len(table["flights"]) == 3
    for row in table["where"]:
        assert {"channel", "band_hz", "phase", "gap", "floor", "unit", "low", "high", "words"} <= set(row)
        assert row["low"] <= row["gap"] <= row["high"] and row["floor"] > 0.0
    assert table["gap"]["before"] > 1.0


def louder(log, seed):
    """The log with white noise of 1 m/s^2 more along x: at 100 Hz that is 1/50 (m/s^2)^2/Hz."""
    return log.with_columns({"acc_x_mps2": log["acc_x_mps2"] + np.random.default_rng(seed).standard_normal(len(log))})


def test_spectra_show_the_floor_of_the_baseline(sweeps):
    """A force is pushed over the platform; nominal flights have the noise alone."""
    nominal = [louder(log, k) for k, log in enumerate(sweeps)]
    real = [pushed(louder(log, 10 + k), 3.0, "over platform") for k, log in enumerate(sweeps)]
    gap = measure(real, VEHICLE, nominal, calibrated=False)
    curves = curves_of_measurement(gap, real, VEHICLE)
    (force,) = [s for s in curves.spectra if s.channel == "force_x"]
    high = curves.frequency_hz > 10.0
    assert np.median(force.floor[high]) == pytest.approx(1.0 / 50.0, rel=0.3)


def test_of_many_flights_the_curves_are_of_those_with_the_phase_of_the_answer(sweeps):
    """Of 43 flights the last three alone go beyond hover, and there the gap is."""
    real = [pushed(log, 3.0, "over platform") for log in sweeps]
    before = [FlightLog({name: real[0][name][:450] for name in real[0].columns}, {"source": f"short {i}"})
              for i in range(40)]
    gap = measure(real, VEHICLE, calibrated=False)
    phase = KINDS.index(gap.headline.phase)
    assert phase not in ready(before[0], VEHICLE).phase
    read = []
    curves = curves_of_measurement(gap, (read.append(i) or log for i, log in enumerate(before + real)), VEHICLE)
    assert phase in curves.signal.phase and len(read) == 43
    read.clear()
    curves_of_measurement(gap, (read.append(i) or log for i, log in enumerate(real * 16)), VEHICLE)
    assert len(read) == 40


def test_error_without_a_flight_is_that_of_the_flight_not_of_the_baseline(sweeps):
    bad, bad_nominal = (FlightLog({"t_s": sweeps[0]["t_s"][:20]}, {"source": name}) for name in ("real", "nominal"))
    with pytest.raises(AirTouchError, match="real") as error:
        measure([bad], VEHICLE, [bad_nominal])
    assert "nominal" not in str(error.value)


@pytest.mark.parametrize(("real", "nominal", "noted"), [
    ("ns-34g", "ns-67g", True), ("ns-34g", "ns-34g", False), ("", "ns-67g", False), ("ns-34g", "", False)])
def test_a_baseline_of_another_vehicle_is_noted(sweeps, real, nominal, noted):
    """--vehicle names one for all of them, so that the logs' two names are no error."""
    of = [replace(log, meta={**log.meta, "vehicle": name}) for log, name in zip(sweeps, (real, nominal), strict=False)]
    notes = measure(of[:1], VEHICLE, of[1:], calibrated=False).notes
    assert [n for n in notes if "names vehicle ns-67g, the flights ns-34g" in n] == [n for n in notes if "ns-67g" in n]
    assert any("ns-67g" in n for n in notes) == noted


def test_a_flight_without_a_gyro_is_left_out_among_others_that_have_one(sweeps):
    """Its map is that of the others alone."""
    bare = FlightLog({k: v for k, v in sweeps[2].columns.items() if k not in GYRO}, {"source": "bare"})
    mixed, alike = measure([bare, *sweeps[:2]], VEHICLE), measure(sweeps[:2], VEHICLE)
    assert mixed.map.cells == alike.map.cells and mixed.flights == alike.flights
    assert [r for r in mixed.left_out if "bare: no gyro" in r]
    assert measure([bare], VEHICLE).flights == ("bare",)


def test_a_push_over_the_platform_is_found_there(sweeps):
    before = measure(sweeps, VEHICLE)
    after = measure([pushed(log, 3.0, "over platform") for log in sweeps], VEHICLE)
    key = ("force_x", (0.0, 0.5), "over platform", "all")
    cell_before, cell_after = (next(c for c in m.map.cells if (c.channel, c.band_hz, c.phase, c.regime) == key)
                               for m in (before, after))
    assert not significant(cell_before) or cell_before.gap < 0.5
    assert significant(cell_after) and cell_after.gap == pytest.approx(3.0, rel=0.2)
    assert any((c.channel, c.phase, c.band_hz[0]) == ("force_x", "over platform", 0.0) for c in after.where)


def test_imu_and_motors_are_enough(sweeps):
    full, imu_only = measure(sweeps, VEHICLE), measure(
        [FlightLog({k: log[k] for k in (*ACC, *GYRO, *PWM)}, {"source": log.source}) for log in sweeps], VEHICLE)
    channels = {c.channel for c in imu_only.map.cells}
    assert {"force_z", "torque_x", "torque_z"} <= channels == {c.channel for c in full.map.cells}
    assert {"no down range", "no velocity"} <= {line.split(":")[0] for line in imu_only.cannot}
    assert full.cannot == ()


def test_without_a_gyro_torque_is_known_at_low_frequency_alone(sweeps):
    gap = measure([FlightLog({k: v for k, v in log.columns.items() if k not in GYRO}, dict(log.meta))
                   for log in sweeps], VEHICLE)
    assert {c.band_hz for c in gap.map.cells if c.channel.startswith("torque")} == {(0.0, 0.5)}
    assert any("no gyro" in line for line in gap.cannot)


def test_logged_rotor_speeds_are_held_against_the_model(sweeps):
    """The simulator logs what its rotors did; 5 % slower ones are seen as such."""
    assert all(log.has(*RPM) for log in sweeps)
    slow = [log.with_columns({"rpm_3": 0.95 * log["rpm_3"]}) for log in sweeps]
    as_flown, with_slow_rotors = measure(sweeps, VEHICLE), measure(slow, VEHICLE)
    for r, s in zip(as_flown.rotors, with_slow_rotors.rotors, strict=True):
        assert r.ratio == pytest.approx(1.0, abs=0.05) and r.low <= r.ratio <= r.high
        assert s.ratio / r.ratio == pytest.approx(0.95 if r.rotor == 3 else 1.0, abs=1e-6)


def test_any_map_may_spread_the_work_and_progress_is_told(sweeps):
    messages, counts = [], []

    def backwards(function, items):
        items = list(items)
        counts.append(len(items))
        return reversed([function(i) for i in reversed(items)])

    gap = measure(sweeps, VEHICLE, progress=messages.append)
    assert measure(sweeps, VEHICLE, mapper=backwards).plain() == gap.plain()
    assert counts == [3] and messages == list(gap.flights)


def test_nominal_flights_have_little_gap_to_one_another(sweeps):
    measured = measure(sweeps[:1], VEHICLE, sweeps[1:], calibrated=False)
    assert measured.gap["before"] < 2.5
    assert np.mean([significant(c) for c in measured.map.cells if c.regime == "all"]) < 0.1
    assert set(measured.spectra.plain()["roll"]) == {"flown", "nominal"}


@pytest.mark.parametrize("name", ["crazypad/pad_cut_propeller_M3_3mm_3mm_41mm_E8_log00.csv.gz",
                                  "airtouch/imu_data_0103-1435.csv.gz", "peers/case_05.csv.gz"])
def test_recorded_flights_of_every_kind(flights, name):
    path = flights / name
    if not path.is_file():
        pytest.skip(f"{name} is not there")
    log = logs.read(path)
    measured = measure([log], vehicle.load("crazyflie-2.1"))
    assert measured.where and measured.map.cells
    assert (any("no gyro" in line for line in measured.cannot)) == (not log.has(*GYRO))
    assert log.has(*ACC) or log.has(*ACC_WORLD)


@pytest.mark.slow
def test_a_cluster_gives_the_same(sweeps):
    distributed = pytest.importorskip("dask.distributed")
    from airtouch.gap.sealed.on_cluster import mapper

    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        on_cluster = measure(sweeps, VEHICLE, mapper=mapper(cluster.scheduler_address))
    assert on_cluster.plain() == measure(sweeps, VEHICLE).plain()


def test_a_baseline_flight_unlike_the_others_is_no_part_of_the_floor(sweeps):
    real, nominal = sweeps[0], [renamed(log, f"nominal_{i}") for i, log in enumerate(short_flights.fly(4, seed=9))]
    odd = renamed(nominal[0].with_columns({"acc_z_mps2": nominal[0]["acc_z_mps2"] + 5.0}), "odd")
    with_odd, without = measure([real], VEHICLE, [*nominal, odd]), measure([real], VEHICLE, nominal)
    assert with_odd.baseline == without.baseline and "odd" not in with_odd.baseline
    assert any("odd" in n and n.endswith("left out") for n in with_odd.notes)
    assert with_odd.map.cells == without.map.cells


def renamed(log, name):
    return FlightLog(log.columns, {**log.meta, "source": name})


def test_a_measurement_in_two_sentences():
    """Where most of the gap lies, and how large all of it is; the calibrated vehicle is told where there is one."""
    largest = cell("force_z", "hover", 1.0)
    gap = Measurement("x", GapMap((largest,), BASELINE, ()), (largest,), {"before": 2.34, "floor": 1.0}, ("a.csv",))
    assert gap.sentences == ("Most of the gap lies in hover, 0-0.5 Hz, lift: 1 m/s^2, 10 times the floor.",
                             "Overall it is 2.3 times the floor.")
    large = replace(gap, gap={"before": 123.4, "floor": 1.0, "calibrated": 1234.0})
    assert large.sentences[1].startswith("Overall it is 123 times the floor, 1234 times with the vehicle calibrated")
    on_ground = replace(gap, where=(), gap={"before": float("nan"), "floor": 1.0})
    assert on_ground.sentences[1] == "How large it is over all is not known: no cell of the map is in the air."
    calibrated = replace(gap, where=(), gap={**gap.gap, "calibrated": 1.2})
    assert calibrated.sentences == (
        "No gap stands out from the floor.",
        "Overall it is 2.3 times the floor, 1.2 times with the vehicle calibrated on the baseline flights.")


def test_speeds_of_a_rotor_are_told_with_their_range():
    speed = RotorSpeed(2, 19600.4, 20000.0, 0.96, 0.95, 0.972, 6)
    assert speed.in_words() == "rotor 2: 19600 rpm logged, 0.960 of the model's (0.950 to 0.972 over 6 flights)"
