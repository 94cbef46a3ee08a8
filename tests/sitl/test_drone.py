"""What the drone does with set-points: commander, watchdog, supervisor, crash; and the log of it."""

import math
import struct
from pathlib import Path

import numpy as np
import pytest

from airtouch import logs
from airtouch.detector import best
from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import COLUMNS, FlightLog
from airtouch.sitl import Server
from airtouch.sitl.drone import CRASHED, LOCKED, PRE_FLIGHT
from airtouch.sitl.services.packet import COMMANDER, CONSOLE, GENERIC, LOCALIZATION, PARAM, PLATFORM, SUPERVISOR

HOVER, POSITION, VELOCITY, Z_DISTANCE, MANUAL, STOP = 10, 7, 8, 9, 11, 0
QUIET = {"without": ["gust"]}


def keep(craft, seconds, kind, *values, period_s=0.1):
    """Repeat a set-point as a client does."""
    for _ in range(round(seconds / period_s)):
        craft.take(GENERIC, 0, bytes([kind]) + struct.pack("<ffff", *values))
        craft.fly(period_s)


def place(craft):
    return np.array(craft.drone.row[17:20])


def test_hover_set_points_follow_the_nose(bench):
    craft = bench(**QUIET)
    keep(craft, 3.0, HOVER, 0.0, 0.0, 0.0, 0.5)
    keep(craft, 2.0, HOVER, 0.0, 0.0, 45.0, 0.5)  # 90 degrees to the left
    assert math.degrees(craft.drone.row[25]) == pytest.approx(90.0, abs=8.0)
    before = place(craft)
    keep(craft, 3.0, HOVER, 0.3, 0.0, 0.0, 0.5)
    displacement = place(craft) - before
    assert displacement[1] == pytest.approx(0.9, abs=0.3) and abs(displacement[0]) < 0.35
    assert craft.height == pytest.approx(0.5, abs=0.12)


def test_position_and_velocity_set_points(bench):
    craft = bench(**QUIET)
    keep(craft, 3.0, POSITION, 0.0, 0.0, 0.5, 0.0)
    keep(craft, 4.0, POSITION, 0.5, -0.5, 0.6, 0.0)
    np.testing.assert_allclose(craft.drone.estimate[6:9], [0.5, -0.5, 0.6], atol=0.12)
    before = place(craft)
    keep(craft, 2.0, VELOCITY, -0.2, 0.0, 0.2, 0.0)
    displacement = place(craft) - before
    assert displacement[0] < -0.2 and displacement[2] == pytest.approx(0.4, abs=0.15)


def test_tilts_push_the_right_way(bench):
    craft = bench(**QUIET)
    keep(craft, 3.0, HOVER, 0.0, 0.0, 0.0, 0.6)
    before = place(craft)
    keep(craft, 0.8, Z_DISTANCE, 0.0, -6.0, 0.0, 0.6)  # nose down in the firmware's legacy axes
    assert (place(craft) - before)[0] > 0.15
    keep(craft, 1.5, HOVER, 0.0, 0.0, 0.0, 0.6)
    before = place(craft)
    keep(craft, 0.8, Z_DISTANCE, 6.0, 0.0, 0.0, 0.6)
    assert (place(craft) - before)[1] < -0.15


def test_thrust_is_locked_until_it_was_zero(bench):
    craft = bench(**QUIET)
    for _ in range(10):
        craft.take(COMMANDER, 0, struct.pack("<fffH", 0.0, 0.0, 0.0, 50000))
        craft.fly(0.05)
    assert not craft.drone.motors_on
    craft.take(COMMANDER, 0, struct.pack("<fffH", 0.0, 0.0, 0.0, 0))
    for _ in range(10):
        craft.take(COMMANDER, 0, struct.pack("<fffH", 0.0, 0.0, 0.0, 55000))
        craft.fly(0.05)
    assert craft.drone.motors_on and craft.height > 0.03


def test_watchdog_levels_out_and_then_stops(bench):
    craft = bench(**QUIET)
    keep(craft, 3.0, HOVER, 0.0, 0.0, 0.0, 0.6)
    craft.take(GENERIC, 0, bytes([HOVER]) + struct.pack("<ffff", 0.4, 0.0, 0.0, 0.6))
    craft.fly(0.6)
    assert craft.drone.commander.levelled and craft.drone.motors_on
    packets = craft.fly(3.0)
    assert craft.drone.state == LOCKED and not craft.drone.motors_on
    assert b"".join(p.data for p in packets if p.port == CONSOLE).count(b"Locked, reboot required") == 1
    keep(craft, 0.5, HOVER, 0.0, 0.0, 0.0, 0.6)
    assert not craft.drone.motors_on


def test_a_drone_without_thrust_does_not_fly_and_is_not_locked(bench):
    """As isFlyingCheck: flying needs a motor ratio above idle, and only a flying drone is locked."""
    craft = bench(**QUIET)
    craft.take(COMMANDER, 0, struct.pack("<fffH", 0.0, 0.0, 0.0, 0))  # unlocks the thrust; then silence
    for _ in range(30):
        craft.fly(0.1)
        assert not craft.drone.row[7:11].any(), "no motor turns"
        assert not craft.drone.motors_on and not craft.drone.is_flying and craft.drone.took_off_s is None
    assert craft.drone.state == PRE_FLIGHT and craft.drone.commander.timed_out
    keep(craft, 3.0, HOVER, 0.0, 0.0, 0.0, 0.5)
    assert craft.height == pytest.approx(0.5, abs=0.12)


def test_the_high_level_commander_needs_no_radio_and_gives_way(bench):
    craft = bench(**QUIET)
    craft.take_off(0.5)
    craft.fly(5.0)  # nobody speaks to it
    assert craft.height == pytest.approx(0.5, abs=0.12)
    keep(craft, 1.0, HOVER, 0.0, 0.0, 0.0, 0.7)
    assert craft.drone.commander.low_level
    craft.take(GENERIC, 1, [0, 0, 0, 0, 0])  # set-points end
    assert craft.high_level("<BBff?f", 8, 0, 0.0, 0.0, True, 2.0) == 0
    craft.fly(2.5)
    assert craft.height < 0.03 and not craft.drone.motors_on and craft.drone.state == PRE_FLIGHT
    craft.fly(2.1)
    assert not craft.drone.is_flying


def bits(craft):
    answer, = craft.take(SUPERVISOR, 0, [0x0C])
    assert answer.data[0] == 0x8C
    return int.from_bytes(answer.data[1:], "little")


def test_a_reset_puts_the_estimate_where_the_parameters_say(bench):
    """As estimatorKalmanTask: `if (resetEstimation) {estimatorKalmanInit(); resetEstimation = false;}`."""
    craft = bench(**QUIET)

    def write(name, layout, value):
        number = struct.pack("<H", craft.firmware.param.toc.ids[name])
        craft.take(PARAM, 2, number + struct.pack(layout, value))
        return craft.take(PARAM, 1, number)[0].data[3:]

    keep(craft, 3.0, POSITION, 0.0, 0.0, 0.5, 0.0)
    keep(craft, 4.0, POSITION, 0.4, 0.0, 0.5, 30.0)
    keep(craft, 3.0, POSITION, 0.4, 0.0, 0.0, 30.0)
    craft.take(GENERIC, 0, bytes([STOP]))
    craft.fly(3.0)
    assert craft.drone.estimate[6] > 0.2 and craft.drone.estimate[2] > 0.3
    before = place(craft)
    assert write("kalman.resetEstimation", "<B", 1) == b"\0", "the firmware clears it"
    craft.fly(1.0)
    np.testing.assert_allclose(craft.drone.estimate[[0, 1, 2, 6, 7]], 0.0, atol=0.03)
    write("kalman.initialY", "<f", -1.5)
    write("kalman.initialYaw", "<f", 1.2)
    write("kalman.resetEstimation", "<B", 1)
    craft.fly(1.0)
    np.testing.assert_allclose(craft.drone.estimate[[2, 6, 7]], [1.2, 0.0, -1.5], atol=0.03)
    np.testing.assert_allclose(place(craft), before, atol=0.01)
    keep(craft, 3.0, POSITION, 0.0, -1.5, 0.5, math.degrees(1.2))
    assert craft.height == pytest.approx(0.5, abs=0.1)
    np.testing.assert_allclose(place(craft)[:2], before[:2], atol=0.15)  # it takes off where it stands


def test_a_fall_from_high_up_is_a_crash_that_can_be_recovered_from(bench):
    craft = bench(**QUIET)
    craft.take_off(0.8)
    craft.take(GENERIC, 0, [MANUAL, 0, 0])  # too short: ignored
    craft.fly(0.1)
    assert craft.height > 0.6
    for _ in range(60):
        craft.take(GENERIC, 0, bytes([MANUAL]) + struct.pack("<fffHB", 0.0, 0.0, 0.0, 12000, 0))
        craft.fly(0.02)
    assert craft.drone.state == CRASHED and bits(craft) >> 7 & 1 and not bits(craft) & 1
    craft.take(SUPERVISOR, 1, [2])
    assert bits(craft) & 0b1011 == 0b1011 and craft.height < 0.05
    craft.take_off(0.5)
    assert craft.height > 0.35


@pytest.mark.parametrize("port, channel, data", [(SUPERVISOR, 1, [3]), (LOCALIZATION, 1, [3])])
def test_an_emergency_stop_drops_the_drone(bench, port, channel, data):
    craft = bench(**QUIET)
    craft.take_off(0.3)
    craft.take(port, channel, data)
    craft.fly(1.0)
    assert not craft.drone.motors_on and craft.height < 0.05 and not bits(craft) & 1


def test_protocol_and_platform_are_those_of_a_crazyflie(bench):
    craft = bench()
    assert craft.take(PLATFORM, 1, [0])[0].data == bytes([0, 12, 0, 0, 0])
    assert craft.take(PLATFORM, 1, [2])[0].data == b"\2CF21"
    assert craft.take(PLATFORM, 1, [9]) == []


def test_the_flight_is_recorded(tmp_path):
    path = tmp_path / "flight.csv"
    server = Server("hover", port=0, record=path)
    for _ in range(150):
        server.step(lambda _: None)
    server.close()
    server.recorder.write()
    log = logs.read(path)
    assert len(log) == 150 and log.meta["scenario"] == "hover"
    np.testing.assert_allclose(np.diff(log["t_s"]), 0.01, atol=1e-6)
    with pytest.raises(AirTouchError, match="exists already"):
        Server("hover", port=0, record=path)


def test_the_app_is_best_over_what_it_was_given(bench):
    """From the app's own first sample on, with the heading taken off: `best`'s logits to the bit, and its edges.

    A log that begins one sample later is another matter: `best` computes at every second sample, and the log's even
    ones are the app's odd ones. These 8 flights give the same edges within 0.1 s all the same.
    """
    equal_flights = 0
    for flight in range(8):
        edges, logits, log = flown_with_the_app(bench("paper-4cm", flight=flight, ai_deck=False))
        trace = best.run(log)
        np.testing.assert_array_equal(trace.signals["logits"], logits)
        assert [(edge.sample, edge.kind) for edge in trace.edges] == edges and len(edges) >= 2
        later = best.run(FlightLog({name: values[1:] for name, values in log.columns.items()}, log.meta)).edges
        equal_flights += ([edge.kind for edge in later] == [kind for _, kind in edges] and
                          all(abs(edge.sample + 1 - at) <= 10 for edge, (at, _) in zip(later, edges, strict=True)))
    assert equal_flights == 8


def flown_with_the_app(craft):
    """On the way over the platform: edges (row, kind) and logits (n, 3) of the app, and the log of what it was given.

    The log's first row is what the drone gave the app as it was switched on.
    """
    plan, app = craft.server.plan, craft.drone.app
    rows, axes, edges, logits = [], [], [], []
    height, end = plan.values["cruise"], plan.world.box[0][2] + 1.0

    def keep_row():
        rows.append(craft.drone.row.copy())
        axes.append(without_heading(craft.drone.row[30:33], craft.drone.quaternion()))
        logits.append([app.read(name) for name in ("lOver", "lEntry", "lExit")])

    def fly(seconds):
        for _ in range(round(100 * seconds)):
            before = app.read("edges")
            craft.firmware.tick()
            keep_row()
            if app.read("edges") > before:
                edges.append((len(rows) - 1, ("entry", "exit")[int(app.read("edge")) - 1]))

    assert app.read("steps") == 1
    keep_row()
    fly(0.5)
    craft.high_level("<BBff?f", 7, 0, height, 0.0, False, 2.0)
    fly(6.0)
    craft.high_level("<BBBBfffff", 12, 0, 0, 1, end, 0.0, height, 0.0, end / 0.3)
    fly(end / 0.3 + 2.0)
    table = np.array(rows)
    table[:, 30:33] = axes
    columns = {c: table[:, i] for i, c in enumerate(COLUMNS)}
    return edges, logits, FlightLog(columns, {"source": "virtual", "acc_frame": "body"})


def without_heading(acc_world, quaternion):
    """(3,) world acceleration with the heading of the quaternion x, y, z, w taken off, in float32 as the app does."""
    one, two = np.float32(1.0), np.float32(2.0)
    (x, y, z, w), (ax, ay, az) = np.float32(quaternion), np.float32(acc_world)
    scale = two / (x * x + y * y + z * z + w * w)
    ahead, left = one - scale * (y * y + z * z), scale * (x * y + w * z)
    nose = np.sqrt(ahead * ahead + left * left)
    cosine, sine = ahead / nose, left / nose
    return cosine * ax + sine * ay, cosine * ay - sine * ax, az


@pytest.mark.parametrize("setting", [{"speed": 0.0}, {"port": 99999}, {"faults": ["loss=2"]},
                                     {"faults": ["rain=1"]}, {"faults": ["disconnect=3"]},
                                     {"record": "/dev/null/at/all.csv"}])
def test_wrong_settings_are_named(setting):
    settings = {"port": 0, **setting}
    if "record" in settings:
        settings["record"] = Path(settings["record"])
    with pytest.raises(AirTouchError) as error:
        Server("hover", **settings)
    assert "\n" not in str(error.value)


def test_a_taken_port_is_named():
    first = Server("hover", port=0)
    try:
        with pytest.raises(AirTouchError, match="--port"):
            Server("hover", port=first.port)
    finally:
        first.close()
