"""The board behind `monitor`: edges from packets, with and without losses, and from the app's counter."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.crazyflie.connection import app_log, blocks
from airtouch.crazyflie.connection.intake import Intake
from airtouch.crazyflie.connection.log_blocks import Sample
from airtouch.crazyflie.connection.ticks import Restarted
from airtouch.crazyflie.monitor import Monitor
from airtouch.crazyflie.view.board import Board
from airtouch.crazyflie.view.host_detector import HostDetector
from airtouch.detector import best
from airtouch.logs.flight_log import ACC_WORLD, ATTITUDE, PWM, FlightLog
from airtouch.logs.quaternion import decompress, euler
from airtouch.simulation import batch

G = 9.81


@pytest.fixture(scope="module")
def flight():
    return batch.simulate("paper-4cm")[0]


def compressed(roll, pitch, yaw):
    """Bitcraze's 32 bits of an attitude near level: w is the largest component."""
    x, y, z = 0.5 * roll, 0.5 * pitch, 0.5 * yaw
    word = 3
    for component in (x, y, z):
        word = word << 10 | (component < 0) << 9 | min(int(511 * abs(component) * np.sqrt(2) + 0.5), 511)
    return word


def packets(log, loss=0.0, seed=0):
    """The flight's packets as the firmware would send them, some of them lost."""
    rng = np.random.default_rng(seed)
    for k in range(len(log)):
        row = {name: log[name][k] for name in log.columns}
        stamp, arrival = (2**24 - 5000 + 10 * k) % 2**24, 0.01 * k
        fast = {f"acc.{a}": float(np.float16(row[f"acc_{a}_mps2"] / G)) for a in "xyz"}
        fast |= {f"gyro.{a}": float(np.float16(np.degrees(row[f"gyro_{a}_radps"]))) for a in "xyz"}
        fast |= {f"motor.m{i}": int(row[f"m{i}_pwm"]) for i in range(1, 5)}
        fast |= {"range.zrange": int(1000 * np.nan_to_num(row["zrange_m"])), "pm.vbat": 3.9}
        slow = dict.fromkeys(blocks.STATE.names, 0) | {f"stateEstimateZ.{a}": int(1000 * row[f"{a}_m"]) for a in "xyz"}
        slow["stateEstimateZ.quat"] = compressed(row["roll_rad"], row["pitch_rad"], row["yaw_rad"])
        if k % 5 == 0 and rng.random() >= loss:
            yield Sample(blocks.STATE.name, stamp, arrival, slow)
        if rng.random() >= loss:
            yield Sample(blocks.MOTION.name, stamp, arrival, fast)


def watch(log, **how):
    monitor = Monitor(Board("test", "best", best.lag_s(None)), Intake(blocks.STATE), HostDetector())
    waiting = []
    for sample in packets(log, **how):
        waiting.append(sample)
        if len(waiting) == 7:
            monitor.take(waiting)
            waiting = []
    monitor.take(waiting)
    return monitor


def as_sent(log):
    """The same flight with what the packets leave of it: half precision, attitude every 50 ms in 32 bits."""
    half = {f"acc_{a}_mps2": np.float16(log[f"acc_{a}_mps2"] / G) * G for a in "xyz"}
    half |= {f"gyro_{a}_radps": np.radians(np.float16(np.degrees(log[f"gyro_{a}_radps"])).astype(float)) for a in "xyz"}
    attitude = [compressed(*row) for row in log.stack(ATTITUDE)]
    packets = np.array(attitude, dtype=float)[np.arange(len(log)) // 5 * 5]
    columns = {n: np.floor(v) if n in PWM else v for n, v in log.columns.items() if n not in ACC_WORLD}
    angles = dict(zip(ATTITUDE, euler(decompress(packets)), strict=True))
    return FlightLog({**columns, **half, **angles}, log.meta)


def test_edges_are_felt_where_the_log_feels_them(flight):
    monitor = watch(flight)
    expected = best.run(as_sent(flight)).edges
    assert [f.kind for f in monitor.board.edges] == [e.kind for e in expected] and len(expected) == 2
    for reported, edge in zip(monitor.board.edges, expected, strict=True):
        assert reported.at_s == pytest.approx(edge.sample / 100, abs=0.1)  # roundings move a slow exit
        at = int(round(100 * (reported.at_s - monitor.board.lag_s)))
        assert reported.x_m == pytest.approx(flight["x_m"][at], abs=0.06)
    assert monitor.intake.lost == 0 and monitor.detector.taken == len(flight)


def test_losses_move_them_little_for_the_clock_stays_true(flight, monkeypatch):
    monkeypatch.setattr("airtouch.crazyflie.monitor.host_clock_s", lambda: 5.0)
    complete, holed = watch(flight), watch(flight, loss=0.3)
    assert holed.detector.taken == pytest.approx(len(flight), abs=8)
    assert [f.kind for f in holed.board.edges] == [f.kind for f in complete.board.edges]
    for reported, expected in zip(holed.board.edges, complete.board.edges, strict=True):
        assert reported.at_s == pytest.approx(expected.at_s, abs=0.5)  # a slow entry moves with what is lost
    holed.intake.last_arrival_s = 5.0
    holed.refresh(0.004)
    assert holed.board.link.lost == pytest.approx(0.3, abs=0.03)
    assert str(holed.board.link) == "waiting for data"  # this clock stands still: there is no rate
    assert "round trip 4 ms" in str(replace(holed.board.link, rate_hz=100.0))


def test_the_apps_own_edges_are_shown_once_each_at_their_time():
    messages = []
    monitor = Monitor(Board("test", "app"), Intake(None), None, messages.append)
    motion = dict.fromkeys(blocks.MOTION.names, 0.0)
    app = dict.fromkeys(app_log.WANTED.names, 0) | {"airtouch.prob": 0.9, "airtouch.detector": 2}
    for k in range(300):
        app |= {"airtouch.steps": k}
        if k == 137:
            app |= {"airtouch.edges": 1, "airtouch.edge": 1, "airtouch.edgeStep": 137}
        monitor.take([Sample(blocks.MOTION.name, 10 * k, 0.01 * k, motion)])
        if k % 5 == 0:
            monitor.take([Sample(app_log.WANTED.name, 10 * k, 0.01 * k, dict(app))])
    assert [(f.kind, pytest.approx(f.at_s, abs=0.011)) for f in messages] == [("entry", 1.37)]
    assert monitor.board.detector == "best on the GAP8" and monitor.board.status == ""


def test_an_edge_after_a_restart_is_on_the_new_track():
    """The drone stood at x = -5 m for 30 s, restarted, and flies at x = 2 m; its app reports an edge there."""
    monitor = Monitor(Board("test", ""), Intake(blocks.STATE), None)
    motion, state, app = (dict.fromkeys(block.names, 0) for block in (blocks.MOTION, blocks.STATE, app_log.WANTED))

    def fly(from_ms, to_ms, since_s, x_mm):
        for ms in range(from_ms, to_ms, 10):
            at = since_s + 0.001 * ms
            monitor.take([Sample(blocks.STATE.name, ms, at, state | {"stateEstimateZ.x": x_mm}),
                          Sample(blocks.MOTION.name, ms, at, motion)])

    fly(1000, 31000, 0.0, -5000)
    with pytest.raises(Restarted):
        fly(1000, 3000, 30.0, 2000)
    assert monitor.board.closing_line().startswith("30.0 s watched: ")
    monitor.restart()
    assert monitor.board.closing_line().startswith("0.0 s watched since the drone's last restart: ")
    fly(1500, 11500, 30.0, 2000)
    for edges in (0, 1):
        monitor.take([Sample(app_log.WANTED.name, 11500, 41.5, app | {"airtouch.edges": edges, "airtouch.edge": 1})])
    assert [edge.x_m for edge in monitor.board.edges] == [2.0]
    assert monitor.board.now_s < 11.0
    closing_line = "10.0 s watched since the drone's last restart: no data; 1 edges ("
    assert monitor.board.closing_line().startswith(closing_line)
