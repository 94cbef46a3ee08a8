"""Faults to order, on the bench and through cflib."""

import math
import struct

import numpy as np
import pytest

from airtouch.errors import AirTouchError
from airtouch.sitl.faults import Fault, Line, parse
from airtouch.sitl.services.packet import CONSOLE, LOG, PARAM, Packet
from sitl.clients import connected, log_block

pytest.importorskip("cflib")
from simulated_link import simulated


@pytest.mark.parametrize("text, fault", [
    ("loss=0.3", Fault("loss", amount=0.3)), ("loss=0.3,all", Fault("loss", amount=0.3, all_packets=True)),
    ("late=50ms", Fault("late", amount=0.05)), ("disconnect=3,5s", Fault("disconnect", 3.0, 5.0)),
    ("gap8-reset=2.5s", Fault("gap8-reset", 2.5)), ("low-battery=start", Fault("low-battery"))])
def test_a_fault_is_parsed_from_its_text(text, fault):
    assert parse(text) == fault


@pytest.mark.parametrize("text", ["", "loss", "loss=1", "loss=nan", "loss=0.3,some", "late=-1s", "late=1,2",
                                  "disconnect=3", "gap8-reset=", "low-battery=soon", "late=1e99s"])
def test_badly_written_faults_are_named(text):
    with pytest.raises(AirTouchError):
        parse(text)


def test_a_lossy_line_loses_that_share():
    log, answer = Packet(LOG, 2, b"1234"), Packet(PARAM, 1, b"123")
    for fault, shares in (("loss=0.3", (0.7, 1.0)), ("loss=0.3,all", (0.7, 0.7))):
        for packet, share in zip((log, answer), shares, strict=True):
            line = Line([parse(fault)], np.random.default_rng(0))
            for _ in range(5000):
                line.put(packet, None, 0.0)
            assert len(line.ready(0.0)) / 5000 == pytest.approx(share, abs=4 * math.sqrt(0.21 / 5000))


def test_a_late_line_keeps_the_order():
    line = Line([parse("late=50ms")], np.random.default_rng(0))
    arrived = {}
    for tick in range(500):
        line.put(Packet(CONSOLE, 0, struct.pack("<H", tick)), None, 0.01 * tick)
        for packet, _ in line.ready(0.01 * tick):
            arrived[struct.unpack("<H", packet.data)[0]] = 0.01 * tick
    delays = [at - 0.01 * number for number, at in arrived.items()]
    assert list(arrived) == sorted(arrived) and len(arrived) > 490
    assert max(delays) <= 0.06 and np.mean(delays) > 0.02


def flying(bench, *faults, detector=2, **settings):
    """A drone in the air with faults, and `pass_(seconds)` that lets the server's time pass."""
    craft = bench("hover", faults=faults, **settings)
    craft.drone.app.set("detector", detector)

    def pass_(seconds):
        for _ in range(round(100 * seconds)):
            craft.server.step(lambda _: None)

    assert craft.high_level("<BBff?f", 7, 0, 0.5, 0.0, True, 1.5) == 0
    pass_(2.5)
    return craft, pass_


def test_the_gap8_restarts_and_comes_back(bench):
    craft, pass_ = flying(bench, "gap8-reset=4")
    app = craft.drone.app
    pass_(1.4)
    assert app.read("health") == 0 and app.read("resets") == 0 and math.isfinite(app.read("prob"))
    pass_(1.0)
    assert app.read("health") & 2
    pass_(6.0)
    assert app.read("resets") == 1 and not app.read("health") & 2
    assert craft.height == pytest.approx(0.5, abs=0.15)


def test_the_gap8_is_left_alone_unless_a_detector_asks_for_it(bench):
    craft = bench("hover", faults=["gap8-reset=3"])
    assert craft.firmware.param.values["airtouch.detector"] == 1
    craft.take_off()
    craft.fly(4.0)
    app = craft.drone.app
    assert app.sent == 0 and app.read("health") == 0 and math.isfinite(app.read("prob"))
    app.set("detector", 2)
    craft.fly(0.1)
    assert app.sent > 0


def test_a_gap8_that_never_answers(bench):
    craft, pass_ = flying(bench, "gap8-silent=start")
    pass_(2.0)
    assert craft.drone.app.read("health") & 2  # and the STM32's own detector may have stepped in
    assert craft.height == pytest.approx(0.5, abs=0.15)


def test_faults_can_be_ordered_in_flight(bench):
    craft, pass_ = flying(bench)
    pass_(1.5)
    assert craft.drone.app.read("health") == 0
    craft.server.order("gap8-silent=2")
    craft.server.order("low-battery=start")
    pass_(2.0)
    assert craft.drone.app.read("health") & 2 and craft.drone.row[16] < 3.4
    with pytest.raises(AirTouchError):
        craft.server.order("rain=1")


def test_without_an_ai_deck_the_stm32_does_it(bench):
    craft, _ = flying(bench, ai_deck=False)
    assert craft.drone.app.sent == 0 and craft.drone.app.read("detector") == 1
    assert math.isfinite(craft.drone.app.read("prob"))
    assert craft.firmware.param.values["deck.bcAI"] == 0


def test_a_low_battery_warns_before_the_drone_falls(bench):
    craft, pass_ = flying(bench, "low-battery=3")
    before = craft.drone.row[16]
    pass_(1.0)
    assert craft.drone.row[16] < min(3.4, before - 0.2)
    pass_(9.0)
    assert craft.drone.low_battery and craft.height > 0.3  # it warns before it falls


def test_lost_samples_can_be_counted(monkeypatch):
    with simulated(monkeypatch, faults=["loss=0.3"]) as virtual, connected(virtual.uri) as cf:
        rows = []
        log_block(cf, "one", 10, {"pm.vbat": "float"}, rows)
        virtual.clock.wait_for(lambda: rows and rows[-1][0] - rows[0][0] > 8000)
        stamps = np.array([stamp for stamp, _ in rows])
    gaps = np.diff(stamps)
    assert (gaps % 10 == 0).all() and (gaps > 0).all()
    assert len(stamps) / (np.ptp(stamps) / 10 + 1) == pytest.approx(0.7, abs=0.07)


def test_late_packets_are_seen_by_cflib(monkeypatch):
    with simulated(monkeypatch) as virtual, connected(virtual.uri) as cf:
        samples, latency = [], cf.link_statistics.latency
        latency.latency_updated.add_callback(samples.append)
        latency.ping()
        virtual.clock.sleep(0.02)
        assert samples == [0.0]
        virtual.order("late=20ms")
        for _ in range(20):
            latency.ping()
            virtual.clock.sleep(0.1)
        assert len(samples) == 21 and 8.0 < samples[-1] <= 60.0  # ms, 95th percentile there and back, in ticks of 10 ms


def test_the_drone_flies_on_while_the_link_is_down(monkeypatch):
    with simulated(monkeypatch, faults=["disconnect=3,5s"]) as virtual, connected(virtual.uri) as cf:
        wait_for = virtual.clock.wait_for
        rows, after = [], []
        log_block(cf, "one", 10, {"stateEstimate.z": "float"}, rows)
        wait_for(lambda: rows)
        cf.high_level_commander.takeoff(0.5, 1.5)
        took_off = wait_for(lambda: virtual.drone.took_off_s)
        wait_for(lambda: virtual.drone.now_s > took_off + 8.5)
        assert rows[-1][0] == pytest.approx(1000 * (took_off + 3.0), abs=20)
        assert virtual.drone.motors_on and virtual.drone.height_over_floor == pytest.approx(0.5, abs=0.15)
        # the blocks are gone, as after a radio's break
        log_block(cf, "again", 10, {"stateEstimate.z": "float"}, after)
        wait_for(lambda: len(after) > 20)
        cf.high_level_commander.land(0.0, 1.0)
        wait_for(lambda: not virtual.drone.motors_on and virtual.drone.height_over_floor < 0.03)
