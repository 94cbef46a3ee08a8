"""Every layout read into SI units, against values worked out by hand."""

import csv
import gzip
import math
import time

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from airtouch import logs
from airtouch import vehicle as vehicles
from airtouch.errors import AirTouchError
from airtouch.logs.files import parse
from airtouch.logs.flight_log import ACC, ACC_WORLD, ATTITUDE, GYRO, PWM
from airtouch.logs.formats.thrust_stand import read_thrust_stand
from airtouch.logs.quaternion import rotation

LEVEL = 3 << 30  # compressed quaternion 0, 0, 0, 1
LSB = math.radians(4000 / 65536)


def lines(*rows):
    return "".join(",".join(f"{v:.18e}" for v in row) + "\n" for row in rows).encode()


def first(log, names):
    return [float(log[name][0]) for name in names]


def test_authors_12_columns_are_world_frame_and_say_so():
    log = parse(lines([100, -200, 9810, 10, -20, 30, 1, 2, 3, 4, 0.5, 800]), "flight.csv")
    assert first(log, ACC_WORLD) == pytest.approx([0.1, -0.2, 9.81])
    assert first(log, ACC) == first(log, ACC_WORLD)
    assert log.meta["acc_frame"] == "world" and "world frame" in log.meta["warnings"][0]
    assert first(log, GYRO) == pytest.approx([10 * LSB, -20 * LSB, 30 * LSB])
    assert first(log, PWM) == [1, 2, 3, 4]
    assert first(log, ("t_s", "zrange_m")) == [0.5, 0.8]
    assert log.meta["sample_period_s"] == 0.01


def test_authors_13_columns_give_attitude_and_body_acceleration():
    half = math.sin(math.radians(30) / 2)  # 30 degrees of roll: x component of the quaternion
    word = LEVEL | round(half * math.sqrt(2) * 511) << 20
    log = parse(lines([0, 0, 9810, 0, 0, 0, 1, 2, 3, 4, word, 0.5, 32767]), "flight.csv")
    assert math.degrees(log["roll_rad"][0]) == pytest.approx(30, abs=0.1)
    assert first(log, ATTITUDE[1:]) == pytest.approx([0, 0], abs=1e-9)
    # rolled right by 30 degrees, the upward force has a part along body y (left)
    assert first(log, ACC) == pytest.approx([0, 9.81 * 0.5, 9.81 * math.cos(math.radians(30))], abs=0.02)
    assert log.meta["acc_frame"] == "body" and not log.meta["warnings"]
    assert np.isnan(log["zrange_m"][0])


def test_the_authors_files_of_other_widths_have_their_columns():
    log = parse(lines([0, 0, 9810, 0, 0, 0, 1, 2, 3, 4, 0, 1500, 0.5, 0]), "f")  # 14
    assert np.isnan(log["range_left_m"][0]) and log["range_right_m"][0] == 1.5
    assert log["zrange_m"][0] == 0.0  # too near to measure is a reading
    log = parse(lines([10, 0, 0, 1, 2, 3, 4, 0.5, 70]), "f")  # 9
    assert log["gyro_x_radps"][0] == pytest.approx(10 * LSB) and not log.has(ACC[0])
    log = parse(lines([0, 0, 1, 180, 0, 0, 0.5, 70]), "f")  # 8
    assert first(log, ACC) == pytest.approx([0, 0, 9.81])
    assert log["gyro_x_radps"][0] == pytest.approx(math.pi) and log.meta["acc_frame"] == "body"
    assert not log.has(PWM[0])
    log = parse(lines([0, 0, math.sqrt(0.5), math.sqrt(0.5), LEVEL, 0.5]), "f")  # 6
    assert first(log, ATTITUDE) == pytest.approx([0, 0, math.pi / 2])


@pytest.mark.parametrize(("name", "header", "assumed"), [
    ("pad_healthy_E1_log00.csv", "timestamp_ms,stateEstimate.ax,stateEstimate.ay,stateEstimate.az", False),
    ("mine.csv", "timestamp_ms,stateEstimate.ax,stateEstimate.ay,stateEstimate.az", True),
    ("brushed_jana23.csv", "timestamp_ms,gyro.x,gyro.y,gyro.z", False),
    ("log00.csv", "timestamp_ms,gyro.x,gyro.y,gyro.z", True)])
def test_a_vehicle_that_no_file_declares_is_assumed_with_a_warning(name, header, assumed):
    """Crazyflie variables come from any Crazyflie: a uSD log of a heavier one was taken for the bare 2.1 unsaid."""
    log = parse(f"{header}\n0,1,2,3\n10,1,2,3\n".encode(), name)
    craft, warning = vehicles.of_log(log.meta)
    assert craft.name == log.meta["vehicle"] == "crazyflie-2.1"
    assert ("names no vehicle; crazyflie-2.1 is assumed" in (warning or "")) == assumed
    assert vehicles.of_log(log.meta | {"vehicle": "crazyflie-2.1-flow"}) == (vehicles.load("crazyflie-2.1-flow"), None)


def test_unknown_width_names_the_known_ones():
    with pytest.raises(AirTouchError, match=r"f:1: 7 columns.*6, 8, 9, 12, 13, 14"):
        parse(lines([1] * 7), "f")


def test_bad_cell_names_file_and_line():
    body = lines(*[[1] * 12] * 3)
    rows = body.split(b"\n")
    rows[1] = b"1.x" + rows[1][3:]
    with pytest.raises(AirTouchError, match=r"f\.csv:2: cell 1 holds '1\.x.*correct or delete"):
        parse(b"\n".join(rows), "f.csv")
    rows = body.split(b"\n")
    rows[1] = rows[1] + b",7"
    with pytest.raises(AirTouchError, match=r"f\.csv:2: 13 cells where 12"):
        parse(b"\n".join(rows), "f.csv")


@pytest.mark.parametrize("tail", [b"1.0,2.0", b"1.0,2.", b"1,2,3,4,5,6,7,8,9,10,11,",
                                  b"1,2,3,4,5,6,7,8,9,10,11,e"])
def test_truncated_last_line_is_dropped_and_said_so(tail):
    log = parse(lines(*[[1] * 12] * 3) + tail, "f.csv")
    assert len(log) == 3
    assert any("line 4 is cut off" in w for w in log.meta["warnings"])


@pytest.mark.parametrize("data", [b"", b"\n\n", b" ", b"# only: a comment\n", gzip.compress(b"", mtime=0)])
def test_empty_files_say_so(data):
    with pytest.raises(AirTouchError, match="f.csv: .*(empty|no data)"):
        parse(data, "f.csv")


def test_gyro_that_repeats_the_accelerations_is_noticed():
    log = parse(lines([1, 2, 9810] * 2 + [1, 2, 3, 4, 0, 7], [3, 4, 9810] * 2 + [1, 2, 3, 4, 1, 7]), "f")
    assert any("repeat the accelerations" in w for w in log.meta["warnings"])


def test_cut_gzip_keeps_what_is_readable():
    data = gzip.compress(lines(*np.random.default_rng(0).normal(size=(500, 12))))
    log = parse(data[: len(data) // 2], "f.csv.gz")
    assert 100 < len(log) < 400
    assert any("gzip file is cut off" in w for w in log.meta["warnings"])
    assert any(f"line {len(log) + 1} is cut off" in w for w in log.meta["warnings"])
    with pytest.raises(AirTouchError, match="damaged"):
        parse(data[:100] + bytes(50) + data[150:], "f.csv.gz")


def test_byte_order_mark_and_windows_line_ends_are_read():
    text = b"\xef\xbb\xbft_s,zrange_m\r\n0,1\r\n0.01,\r\n"
    log = parse(text, "f")
    assert log["zrange_m"][0] == 1 and np.isnan(log["zrange_m"][1])


def test_crazyflie_csv_units_and_signs():
    names = ("timestamp_ms", "gyro.x", "gyro.y", "gyro.z", "acc.x", "acc.y", "acc.z", "motor.m1", "motor.m2",
             "motor.m3", "motor.m4", "pm.vbatMV", "stateEstimate.roll", "stateEstimate.pitch",
             "stateEstimate.yaw")
    row = (1500, 180, 0, 0, 0, 0, 1, 1, 2, 3, 4, 3700, 90, 90, 180)
    log = parse((",".join(names) + "\n" + ",".join(map(str, row)) + "\n").encode(), "f")
    assert first(log, ("t_s", "gyro_x_radps", "acc_z_mps2", "m3_pwm", "vbat_V")) == pytest.approx(
        [1.5, math.pi, 9.81, 3, 3.7])
    assert first(log, ATTITUDE) == pytest.approx([math.pi / 2, -math.pi / 2, math.pi])  # pitch: legacy sign


def test_real_attitude_agrees_with_gyro_and_accelerometer(flights):
    """Derivative of the decoded angles against the rates, thrust axis against the world acceleration."""
    smooth = butter(4, 5, fs=100, output="sos")
    for name in ("imu_data_0201-2248_h82", "imu_data_0127-2027_+20d", "imu_data_0126-2025"):
        log = logs.read(flights / "airtouch" / f"{name}.csv.gz")
        in_air = np.flatnonzero(logs.airborne(log))[200:-200]
        angles = [np.unwrap(log[a]) for a in ATTITUDE]
        for angle, rate in zip(angles, GYRO, strict=True):
            slope = sosfiltfilt(smooth, np.gradient(angle, 0.01))[in_air]
            measured = sosfiltfilt(smooth, log[rate])[in_air]
            assert np.corrcoef(slope, measured)[0, 1] > 0.92
            assert np.polyfit(measured, slope, 1)[0] == pytest.approx(1, abs=0.12)
        thrust_axis = rotation(*angles)[:, :, 2]
        for axis in (0, 1):
            tilt = sosfiltfilt(smooth, thrust_axis[:, axis])[in_air]
            push = sosfiltfilt(smooth, log[ACC_WORLD[axis]])[in_air]
            assert np.polyfit(tilt, push, 1)[0] == pytest.approx(9.81, rel=0.12)


def test_real_flights_are_read_in_time_and_completely(flights):
    folder = flights / "airtouch"
    for row in csv.DictReader((folder / "manifest.csv").open()):
        if row["rows"]:
            log = logs.read(folder / row["file"])
            assert len(log) == int(row["rows"]) and log.meta["format"] == f"authors-{row['columns']}"
    path = folder / "imu_data_0201-2212_h79.csv.gz"  # 3976 x 13
    best = min(_seconds(path) for _ in range(5))
    assert best < 0.05, f"{best * 1e3:.0f} ms"


def _seconds(path):
    start = time.process_time()
    logs.read(path)
    return time.process_time() - start


def test_real_crazypad_and_imrclab(flights):
    log = logs.read(flights / "crazypad" / "pad_normal_flight_E8_log00.csv.gz")
    assert log.meta["condition"] == "normal_flight" and log.meta["drone"] == "E8"
    flying = logs.airborne(log)
    assert np.mean(log["acc_world_z_mps2"][flying]) == pytest.approx(9.81, abs=0.3)
    assert not log.has(GYRO[0])
    log = logs.read(flights / "imrclab" / "brushed_jana28.csv.gz")
    world = np.einsum("nij,nj->ni", rotation(*(log[a] for a in ATTITUDE)), log.stack(ACC))
    assert world.mean(axis=0) == pytest.approx([0, 0, 9.81], abs=0.1)  # it starts and ends in hover
    # velocity is the derivative of position
    speed = np.gradient(log["x_m"], log["t_s"])
    assert np.corrcoef(speed[50:-50], log["vx_mps"][50:-50])[0, 1] > 0.9


def test_thrust_stands_are_no_flights_but_can_be_read(flights):
    path = flights / "imrclab" / "thrust_cf21_bitcraze2021_cf21_stock2.csv.gz"
    with pytest.raises(AirTouchError, match="thrust-stand"):
        logs.read(path)
    stand = read_thrust_stand(path)
    assert np.corrcoef(stand["pwm"], stand["weight_g"])[0, 1] > 0.95
    assert {"vbat_V", "rpm_1", "power_W"} <= set(stand)
