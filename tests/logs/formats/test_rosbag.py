"""ROS 2 bags with several topics of a kind, and motors in other units, written by rosbags."""

import numpy as np
import pytest

from airtouch import logs

RANGE, IMU, ODOMETRY = "sensor_msgs/msg/Range", "sensor_msgs/msg/Imu", "nav_msgs/msg/Odometry"
POSE, FLOATS, SHORTS = ("geometry_msgs/msg/PoseStamped", "std_msgs/msg/Float32MultiArray",
                        "std_msgs/msg/UInt16MultiArray")
PERIOD_NS = 10_000_000


@pytest.fixture
def bag_of(tmp_path):
    """A function that writes a bag of {topic: (type, frame id, values (n,) or (n, 4))} beside an IMU at rest.

    begin_ns: of the recording; the headers count from 0, as a simulator's do.
    """
    pytest.importorskip("rosbags", reason="ROS 2 bags need the extra 'ros'")
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kind = store.types.__getitem__
    vector, point, quaternion = (kind(f"geometry_msgs/msg/{n}") for n in ("Vector3", "Point", "Quaternion"))
    still, zeros = quaternion(0.0, 0.0, 0.0, 1.0), np.zeros(9)

    def message(name, frame, stamp_ns, value):
        time = kind("builtin_interfaces/msg/Time")(stamp_ns // 10**9, stamp_ns % 10**9)
        header = kind("std_msgs/msg/Header")(time, frame)
        pose = kind("geometry_msgs/msg/Pose")(point(float(np.max(value)), 0.0, 0.0), still)
        if name == RANGE:
            return kind(name)(header, 0, 0.5, 0.1, 4.0, float(value))
        if name == IMU:
            return kind(name)(header, still, np.r_[-1.0, np.zeros(8)], vector(0.0, 0.0, 0.0), zeros,
                              vector(float(value), 0.0, 9.81), zeros)
        if name == POSE:
            return kind(name)(header, pose)
        if name == ODOMETRY:
            twist = kind("geometry_msgs/msg/Twist")(vector(0.0, 0.0, 0.0), vector(0.0, 0.0, 0.0))
            return kind(name)(header, "base", kind("geometry_msgs/msg/PoseWithCovariance")(pose, np.zeros(36)),
                              kind("geometry_msgs/msg/TwistWithCovariance")(twist, np.zeros(36)))
        layout = kind("std_msgs/msg/MultiArrayLayout")([], 0)
        return kind(name)(layout, np.asarray(value, np.float32 if name == FLOATS else np.uint16))

    def write(topics, begin_ns=0):
        place = tmp_path / "bag"
        topics = {"/imu": (IMU, "body", np.zeros(20)), **topics}
        with Writer(place, version=9) as writer:
            at = {t: writer.add_connection(t, name, typestore=store) for t, (name, _, _) in topics.items()}
            for i in range(20):
                for topic, (name, frame, values) in topics.items():
                    data = store.serialize_cdr(message(name, frame, i * PERIOD_NS, values[i]), name)
                    writer.write(at[topic], begin_ns + i * PERIOD_NS, data)
        return logs.read(place)

    return write


@pytest.mark.parametrize(("topics", "frames"), [(("/front", "/left", "/range/down"), ("", "", "")),
                                                (("/r0", "/r1", "/r2"), ("front", "left", "Zrange_link"))])
def test_of_several_ranges_the_one_that_looks_down_is_read(bag_of, topics, frames):
    """All of them once came into one column, sample by sample."""
    log = bag_of({t: (RANGE, frame, np.full(20, height))
                  for t, frame, height in zip(topics, frames, (3.0, 2.0, 0.5), strict=True)})
    assert (log["zrange_m"] == 0.5).all()
    warned = [w for w in log.meta["warnings"] if "zrange_m" in w]
    assert len(warned) == 2 and all(topics[2] in w for w in warned)
    assert topics[0] in warned[0] and topics[1] in warned[1]


def test_without_a_name_that_says_down_the_first_range_is_read(bag_of):
    log = bag_of({"/tof_b": (RANGE, "", np.full(20, 0.5)), "/tof_a": (RANGE, "", np.full(20, 3.0))})
    assert (log["zrange_m"] == 0.5).all()
    assert any("/tof_a" in w and "/tof_b" in w for w in log.meta["warnings"])


def test_two_sensors_of_a_kind_are_never_mixed(bag_of):
    log = bag_of({"/imu/raw": (IMU, "body", np.full(20, 5.0)), "/goal": (POSE, "map", np.full(20, 7.0)),
                  "/odom": (ODOMETRY, "map", np.full(20, 1.0)), "/odom/other": (ODOMETRY, "map", np.full(20, 2.0))})
    assert (log["acc_x_mps2"] == 0.0).all() and (log["x_m"] == 1.0).all()
    for other in ("/imu/raw", "/goal", "/odom/other"):
        assert sum(w.startswith(f"{other} is left out of") for w in log.meta["warnings"]) == 1


def test_one_topic_of_each_kind_gives_no_warning(bag_of):
    log = bag_of({"/tof": (RANGE, "", np.full(20, 0.5)), "/odom": (ODOMETRY, "map", np.full(20, 1.0))})
    assert log.meta["warnings"] == []


@pytest.mark.parametrize(("kind", "commands", "share", "unit"), [
    (FLOATS, [0.5, 0.5, 0.5, 1.001], [0.5, 0.5, 0.5, 1.0], "0 to 1"),  # one overshoot made it all PWM 0.5
    (FLOATS, [1250.0, 1500.0, 2000.0, 1000.0], [0.25, 0.5, 1.0, 0.0], "2000 us"),
    (SHORTS, [1250, 1500, 2000, 1000], [0.25, 0.5, 1.0, 0.0], "2000 us"),
    (SHORTS, [16384, 32768, 65535, 1], [16384 / 65535, 32768 / 65535, 1.0, 1 / 65535], "PWM"),
    (FLOATS, [16384.0, 32768.0, 65535.0, 0.5], [16384 / 65535, 32768 / 65535, 1.0, 0.5 / 65535], "PWM")])
def test_the_unit_of_the_motors_is_that_of_the_whole_topic(bag_of, kind, commands, share, unit):
    still = [0.0] * 4  # on the ground
    log = bag_of({"/motor_cmd": (kind, "", [still] * 5 + [commands] * 15)})
    for i in range(4):
        np.testing.assert_allclose(log[f"m{i + 1}_pwm"], np.r_[np.zeros(5), np.full(15, 65535 * share[i])], atol=1e-2)
    (note,) = log.meta["warnings"]
    assert "/motor_cmd" in note and unit in note


def test_motors_without_a_header_keep_their_place_where_the_headers_count_from_zero(bag_of):
    """With use_sim_time: the headers have simulated time, the recording that of 2026."""
    commands = np.tile(np.linspace(10_000, 48_000, 20)[:, None], 4)
    log = bag_of({"/motor_pwm": (SHORTS, "", commands), "/tof": (RANGE, "", np.full(20, 0.5))},
                 begin_ns=1_796_000_000 * 10**9)
    assert log["m1_pwm"] == pytest.approx(commands[:, 0], abs=2000.0)  # one sample: 1e9 s is exact to 1e-7 s
    assert (log["zrange_m"] == 0.5).all()
    assert not any("empty" in w or "left out" in w for w in log.meta["warnings"])


def test_a_column_that_is_empty_in_the_flight_is_named(bag_of):
    log = bag_of({"/motor_pwm": (SHORTS, "", np.full((20, 4), 30_000)), "/tof": (RANGE, "", np.full(20, np.nan))})
    assert [w for w in log.meta["warnings"] if "empty" in w] == ["zrange_m is empty: no value while the IMU was logged"]


@pytest.mark.parametrize(("metres", "valid"), [(0.11, True), (3.9, True), (0.09, False), (4.1, False), (32.767, False)])
def test_a_range_outside_of_its_messages_limits_is_missing(bag_of, metres, valid):
    """By Range.msg: values outside of min_range and max_range, here 0.1 to 4 m, should be discarded."""
    log = bag_of({"/down": (RANGE, "body", np.full(20, metres))})
    assert np.isfinite(log["zrange_m"]).all() == np.isfinite(log["zrange_m"]).any() == valid
