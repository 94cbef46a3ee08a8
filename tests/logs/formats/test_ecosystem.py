"""Files of PX4 and ROS 2, written by pyulog and rosbags, and CSVs of others by a map."""

import csv
import re
import struct

import numpy as np
import pytest
from click.testing import CliRunner

from airtouch import logs
from airtouch.cli import airtouch
from airtouch.cli.logs import command
from airtouch.detector.evaluation.data import dataset
from airtouch.errors import AirTouchError
from airtouch.logs.formats import mapped, ulog

N, HZ = 1000, 250.0  #: samples of the IMU
T = np.arange(N) / HZ


def run(*arguments):
    return CliRunner().invoke(command, [str(a) for a in arguments])


def topic(number, name, fields, rows):
    """Definition, subscription and data messages of one ULog topic; fields {name: count}."""
    kinds = ";".join(f"float{f'[{n}]' if n > 1 else ''} {f}" for f, n in fields.items())
    out = message("F", f"{name}:uint64_t timestamp;{kinds};".encode())
    subscription = message("A", struct.pack("<BH", 0, number) + name.encode())
    data = [message("D", struct.pack("<HQ", number, int(t * 1e6)) + np.asarray(v, "<f4").tobytes()) for t, *v in rows]
    return out, subscription + b"".join(data)


def message(kind, body):
    return struct.pack("<HB", len(body), ord(kind)) + body


@pytest.fixture
def px4(tmp_path):
    """A log that pyulog has written: rolling right at 1 rad/s, 9.81 up, climbing, motors 10, 20, 30, 40 %."""
    pyulog = pytest.importorskip("pyulog", reason="PX4 logs need the extra 'ulog'")
    topics = [
        topic(0, "sensor_combined", {"gyro_rad": 3, "accelerometer_m_s2": 3},
              [(t, 1.0, 0.2, 0.3, 0.1, 0.5, -9.81) for t in T]),
        topic(1, "vehicle_local_position", {"x": 1, "y": 1, "z": 1, "vx": 1, "vy": 1, "vz": 1},
              [(t, 1.0, 2.0, -t, 0.1, 0.2, -1.0) for t in T[::5]]),
        topic(2, "vehicle_attitude", {"q": 4}, [(t, np.cos(0.1), np.sin(0.1), 0.0, 0.0) for t in T[::5]]),
        topic(3, "actuator_motors", {"control": 12}, [(t, 0.1, 0.2, 0.3, 0.4, *[np.nan] * 8) for t in T]),
        topic(4, "distance_sensor", {"current_distance": 1}, [(t, t) for t in T[::20]]),
        topic(5, "battery_status", {"voltage_v": 1}, [(t, 15.5) for t in T[::25]])]
    seed = tmp_path / "seed.ulg"
    seed.write_bytes(b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0) + b"".join(d for d, _ in topics)
                     + b"".join(s for _, s in topics))
    path = tmp_path / "px4.ulg"
    pyulog.ULog(str(seed)).write_ulog(str(path))
    seed.unlink()
    return path


def test_a_px4_log_comes_in_our_axes_and_motor_order(px4):
    log = logs.read(px4)
    assert log.meta["format"] == "ulog" and np.allclose(np.diff(log["t_s"]), 0.01)
    row = len(log) // 2
    for name, value in {"gyro_x_radps": 1.0, "gyro_y_radps": -0.2, "gyro_z_radps": -0.3, "acc_x_mps2": 0.1,
                        "acc_y_mps2": -0.5, "acc_z_mps2": 9.81, "y_m": -2.0, "vy_mps": -0.2, "vz_mps": 1.0,
                        "roll_rad": 0.2, "vbat_V": 15.5}.items():
        assert log[name][row] == pytest.approx(value, abs=1e-5), name
    assert log["z_m"][row] == pytest.approx(log["t_s"][row], abs=0.03)
    # PX4: 1 front right, 2 rear left, 3 front left, 4 rear right
    assert [log[f"m{i}_pwm"][row] / 65535 for i in (1, 2, 3, 4)] == pytest.approx([0.1, 0.4, 0.2, 0.3])


def test_a_px4_log_is_read_by_the_commands(px4, tmp_path):
    result = run("info", px4)
    assert result.exit_code == 0 and "ulog" in result.output
    px4.write_bytes(px4.read_bytes()[:60])
    with pytest.raises(AirTouchError, match="px4.ulg: (not a whole ULog|neither accelerations)"):
        logs.read(px4)


@pytest.mark.parametrize(("orientations", "height"), [((0, 25), 0.5), ((25, 0), 3.0), ((0, 12), None)])
def test_of_distance_sensors_the_one_that_looks_down_is_read(orientations, height):
    """The first is 3 m from something, the second 0.5 m. 25 is MAV_SENSOR_ROTATION_PITCH_270."""
    pytest.importorskip("pyulog", reason="PX4 logs need the extra 'ulog'")
    imu = topic(0, "sensor_combined", {"gyro_rad": 3, "accelerometer_m_s2": 3}, [(t, *[0.0] * 5, -9.81) for t in T])
    definition = message("F", b"distance_sensor:uint64_t timestamp;float current_distance;uint8_t orientation;")
    content = [imu[0], definition, imu[1]]
    for k, (way, metres) in enumerate(zip(orientations, (3.0, 0.5), strict=True)):
        content.append(message("A", struct.pack("<BH", k, 1 + k) + b"distance_sensor"))
        content += [message("D", struct.pack("<HQfB", 1 + k, int(t * 1e6), metres, way)) for t in T[::20]]
    log = ulog.read(b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0) + b"".join(content), "x.ulg")
    if height is None:
        assert not log.has("zrange_m") and any("looks down" in w for w in log.meta["warnings"])
    else:
        assert np.nanmin(log["zrange_m"]) == np.nanmax(log["zrange_m"]) == height and not log.meta["warnings"]


@pytest.mark.parametrize(("metres", "quality", "limits", "valid"), [
    (0.8, 100, (0.1, 4.0), True), (0.8, -1, (0.1, 4.0), True), (0.8, 0, (0.1, 4.0), False),
    (0.05, 100, (0.1, 4.0), False), (4.5, -1, (0.1, 4.0), False), (4.5, 100, (0.0, 0.0), True)])
def test_a_range_that_px4_marks_as_invalid_is_missing(metres, quality, limits, valid):
    """By the comments in DistanceSensor.msg: quality 0 is invalid, -1 unknown; limits of 0 were never set."""
    pytest.importorskip("pyulog", reason="PX4 logs need the extra 'ulog'")
    imu = topic(0, "sensor_combined", {"gyro_rad": 3, "accelerometer_m_s2": 3}, [(t, *[0.0] * 5, -9.81) for t in T])
    definition = message("F", b"distance_sensor:uint64_t timestamp;float min_distance;float max_distance;"
                              b"float current_distance;int8_t signal_quality;uint8_t orientation;")
    content = [imu[0], definition, imu[1], message("A", struct.pack("<BH", 0, 1) + b"distance_sensor")]
    for t in T[::20]:
        reading = (metres, quality) if 1.5 < t < 2.5 else (1.0, 100)
        content.append(message("D", struct.pack("<HQfffbB", 1, int(t * 1e6), *limits, *reading, 25)))
    log = ulog.read(b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0) + b"".join(content), "x.ulg")
    middle, before = (log["zrange_m"][np.abs(log["t_s"] - t) < 0.3] for t in (2.0, 1.0))
    assert np.isfinite(middle).all() == np.isfinite(middle).any() == valid and (before == 1.0).all()


def test_without_pyulog_its_extra_is_named(monkeypatch):
    monkeypatch.setitem(__import__("airtouch.extras", fromlist=["EXTRAS"]).EXTRAS, "ulog",
                        ("no_such_module_of_this_name",))
    with pytest.raises(AirTouchError, match=r"reading PX4 logs needs .*airtouch\[ulog\]"):
        ulog.read(ulog.MAGIC, "x.ulg")


@pytest.fixture
def bag(tmp_path):
    """A ROS 2 bag that rosbags has written."""
    pytest.importorskip("rosbags", reason="ROS 2 bags need the extra 'ros'")
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kind = store.types.__getitem__
    stamp, header = kind("builtin_interfaces/msg/Time"), kind("std_msgs/msg/Header")
    vector, point, quaternion = (kind(f"geometry_msgs/msg/{n}") for n in ("Vector3", "Point", "Quaternion"))
    turn = quaternion(0.0, 0.0, np.sin(np.pi / 4), np.cos(np.pi / 4))  # nose to the left
    place = tmp_path / "bag"
    with Writer(place, version=9) as writer:
        names = {"/imu": "sensor_msgs/msg/Imu", "/odom": "nav_msgs/msg/Odometry", "/down": "sensor_msgs/msg/Range",
                 "/motors_pwm": "std_msgs/msg/UInt16MultiArray"}
        connections = {t: writer.add_connection(t, name, typestore=store) for t, name in names.items()}
        for i in range(200):
            time = header(stamp(i // 100, (i % 100) * 10_000_000), "body")
            zeros = np.zeros(9)
            imu = kind(names["/imu"])(time, turn, zeros, vector(0.1, 0.2, 0.3), zeros, vector(0.0, 0.5, 9.81), zeros)
            standing = kind("geometry_msgs/msg/Pose")(point(1.0, 2.0, 3.0), turn)
            pose = kind("geometry_msgs/msg/PoseWithCovariance")(standing, np.zeros(36))
            twist = kind("geometry_msgs/msg/TwistWithCovariance")(kind("geometry_msgs/msg/Twist")(
                vector(1.0, 0.0, 0.0), vector(0.0, 0.0, 0.0)), np.zeros(36))
            odometry = kind(names["/odom"])(time, "base", pose, twist)
            down = kind(names["/down"])(time, 0, 0.1, 0.0, 4.0, 0.75)
            layout = kind("std_msgs/msg/MultiArrayLayout")([], 0)
            motors = kind(names["/motors_pwm"])(layout, np.array([1, 2, 3, 4], np.uint16))
            for topic_name, message in zip(names, (imu, odometry, down, motors), strict=True):
                writer.write(connections[topic_name], i * 10_000_000, store.serialize_cdr(message, names[topic_name]))
    return place


def test_a_ros_bag_is_read_by_message_type(bag):
    log = logs.read(bag)
    row = 100
    assert log.meta["format"] == "rosbag2" and len(log) == 200
    for name, value in {"gyro_y_radps": 0.2, "acc_y_mps2": 0.5, "acc_z_mps2": 9.81, "x_m": 1.0, "zrange_m": 0.75,
                        "m3_pwm": 3.0, "vx_mps": 0.0, "vy_mps": 1.0, "yaw_rad": np.pi / 2}.items():
        assert log[name][row] == pytest.approx(value, abs=1e-9), name
    result = run("info", bag)
    assert result.exit_code == 0 and "rosbag2" in result.output


@pytest.mark.parametrize("name", ["evaluate", "replay", "map"])
def test_a_command_that_takes_a_flight_takes_a_bag(bag, tmp_path, name):
    """It says of the bag what it says of a CSV of the same samples, which is not that a folder is no flight."""
    csv_file, written = tmp_path / "same.csv", str(tmp_path / "map.geojson")
    options = ["--truth", "--out", written, "--force"] if name == "map" else []
    logs.write(logs.read(bag), csv_file)
    messages = []
    for path in (bag, csv_file):
        result = CliRunner().invoke(airtouch, [name, str(path), *options])
        messages.append(re.sub(r"\S*/(bag|same.csv)", "FLIGHT", result.output + str(result.exception)))
    assert messages[0] == messages[1] and "folder" not in messages[0]


def test_a_bag_has_the_condition_of_the_manifest_beside_it(bag):
    (bag.parent / "manifest.csv").write_text("file,use,speed_mps\nbag,clean,0.3\n")
    for named in (bag, bag.parent):
        (file,) = dataset.collect([named])
        assert file.path == bag and file.condition.speed_mps == 0.3


@pytest.fixture
def theirs(tmp_path):
    path = tmp_path / "nano.csv"
    with path.open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["time_us", "imu.gyro.x", "imu acc z", "motor 1"])
        rows.writerows([[i * 10_000, 90.0, 1.0, 0.5] for i in range(50)])
    return path


MAP = '''vehicle = "crazyflie-2.1"
[columns.t_s]
from = "time_us"
scale = 1e-6
[columns.gyro_x_radps]
from = "imu.gyro.x"
scale = 0.017453292519943295
[columns.acc_z_mps2]
from = "imu acc z"
scale = 9.81
[columns.m1_pwm]
from = "motor 1"
offset = 0.5
scale = 65535
'''


def test_someone_elses_csv_by_a_map(theirs, tmp_path):
    (tmp_path / "map.toml").write_text(MAP)
    result = run("convert", theirs, "--columns", tmp_path / "map.toml", "--out", tmp_path / "out", "--format", "csv")
    assert result.exit_code == 0, result.output
    log = logs.read(tmp_path / "out/nano.csv")
    assert log["t_s"][49] == pytest.approx(0.49) and log["gyro_x_radps"][0] == pytest.approx(np.pi / 2)
    assert log["acc_z_mps2"][3] == pytest.approx(9.81) and log["m1_pwm"][7] == pytest.approx(65535)
    assert log.meta["vehicle"] == "crazyflie-2.1"


@pytest.mark.parametrize(("name", "typo", "message"), [
    ("columns.gyro_x_radps", "columns.gyro_x_rads", "is no column of the flight log; did you mean gyro_x_radps"),
    ('"imu.gyro.x"', '"imu.gyr.x"', "no column 'imu.gyr.x'; did you mean imu.gyro.x"),
    ("offset", "ofset", "has no key 'ofset'; did you mean offset"), ('from = "motor 1"', "", "needs from")])
def test_a_wrong_name_in_a_map_gets_the_nearest(theirs, tmp_path, name, typo, message):
    (tmp_path / "map.toml").write_text(MAP.replace(name, typo))
    with pytest.raises(AirTouchError) as error:
        mapped.read(theirs, tmp_path / "map.toml")
    assert message in str(error.value)


@pytest.mark.parametrize(("right", "wrong", "message"), [
    ('from = "motor 1"', "from = 5", r"\[columns.m1_pwm\]: from is 5, a name"),
    ("scale = 1e-6", 'scale = "1e-6"', r"\[columns.t_s\]: scale is '1e-6', a number"),
    ("offset = 0.5", "offset = true", "offset is True, a number"), ("offset = 0.5", "offset = inf", "offset is inf"),
    ("vehicle =", "warnings = 3\nvehicle =", "warnings is not for a map"),
    ('"crazyflie-2.1"', "21", "vehicle is 21, a text"),
    ('[columns.t_s]\nfrom = "time_us"\nscale = 1e-6', '[columns]\nt_s = "time"',
     r"\[columns.t_s\] is 'time'; give a table with from")])
def test_a_wrong_type_in_a_map_is_named(theirs, tmp_path, right, wrong, message):
    assert right in MAP
    (tmp_path / "map.toml").write_text(MAP.replace(right, wrong))
    with pytest.raises(AirTouchError, match=message):
        mapped.read(theirs, tmp_path / "map.toml")


def test_cells_that_are_no_numbers_are_counted(theirs, tmp_path):
    (tmp_path / "map.toml").write_text(MAP)
    rows = theirs.read_text().splitlines()
    rows[3], rows[5], rows[7], rows[8] = ("20000,fast,1.0,0.5", "40000,1,off,0.5", "60000,,NaN,0.5", "70000,slow,1,1")
    theirs.write_text("\n".join(rows) + "\n")
    log = mapped.read(theirs, tmp_path / "map.toml")
    assert log.meta["warnings"] == ["gyro_x_radps: 2 of 50 cells are no numbers, the first 'fast'; taken as missing",
                                    "acc_z_mps2: 1 of 50 cells are no numbers, the first 'off'; taken as missing"]
    assert np.flatnonzero(np.isnan(log["gyro_x_radps"])).tolist() == [2, 6, 7]


def test_a_plain_csv_is_a_header_and_numbers(theirs, tmp_path):
    (tmp_path / "map.toml").write_text(MAP)
    result = run("convert", theirs, "--columns", tmp_path / "map.toml", "--out", tmp_path / "out", "--format", "csv",
                 "--plain")
    assert result.exit_code == 0, result.output
    pandas = pytest.importorskip("pandas")
    table = pandas.read_csv(tmp_path / "out/nano.csv")
    assert list(table.columns) == ["t_s", "acc_z_mps2", "gyro_x_radps", "m1_pwm"] and len(table) == 50
    assert "object" not in map(str, table.dtypes)
