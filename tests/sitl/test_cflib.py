"""Unmodified cflib against the virtual Crazyflie: in the drone's own time, and over UDP in real time."""

import numpy as np
import pytest

from airtouch.crazyflie import mission
from airtouch.sitl import serve
from patience import HANG_S
from sitl.clients import connected, log_block, wait_for

pytest.importorskip("cflib")
from simulated_link import simulated

MOTION = {**{f"acc.{a}": "FP16" for a in "xyz"}, **{f"gyro.{a}": "FP16" for a in "xyz"},
          **{f"motor.m{i}": "uint16_t" for i in (1, 2, 3, 4)}, "range.zrange": "uint16_t", "pm.vbat": "FP16"}
#: names of FACTS and of the app, with the firmware's types
TYPES = {"acc.x": "float", "gyro.z": "float", "gyro.xRaw": "int16_t", "stateEstimate.qw": "float",
         "stateEstimateZ.az": "int16_t", "stateEstimateZ.quat": "uint32_t", "motor.m4": "uint16_t",
         "motor.m1req": "int32_t", "range.zrange": "uint16_t", "range.up": "uint16_t", "pm.vbat": "float",
         "pm.state": "int8_t", "supervisor.info": "uint16_t", "stabilizer.yaw": "float",
         "kalman.varPX": "float",
         "airtouch.prob": "float", "airtouch.edges": "uint16_t", "airtouch.health": "uint16_t"}


@pytest.fixture
def craft(monkeypatch, tmp_path):
    """(virtual drone, cflib's Crazyflie connected to it), in still air."""
    with simulated(monkeypatch, without=["gust"]) as virtual, connected(virtual.uri, str(tmp_path)) as cf:
        yield virtual, cf


def test_tables_have_the_firmwares_names_and_types(craft):
    virtual, cf = craft
    assert cf.platform.get_protocol_version() == 12
    for name, kind in TYPES.items():
        assert cf.log.toc.get_element_by_complete_name(name).ctype == kind, name
    assert len(cf.log.toc.toc) == len({v.group for v in virtual.firmware.log.toc.items})
    for name, value in {"deck.bcFlow2": 1, "deck.bcMultiranger": 1, "deck.bcAI": 1, "commander.enHighLevel": 0,
                        "airtouch.detector": 1, "stabilizer.estimator": 2}.items():
        assert int(cf.param.get_value(name)) == value, name


def test_a_parameter_is_set_and_one_out_of_range_is_put_right_by_the_app(craft):
    virtual, cf = craft
    wait_for = virtual.clock.wait_for
    cf.param.set_value("airtouch.pFa", 1e-3)
    wait_for(lambda: abs(virtual.drone.app.values()["airtouch.pFa"] - 1e-3) < 1e-9)
    cf.param.set_value("airtouch.detector", 200)
    wait_for(lambda: cf.param.get_value("airtouch.detector") == "200")
    cf.param.request_param_update("airtouch.detector")
    wait_for(lambda: int(cf.param.get_value("airtouch.detector")) <= 4)
    with pytest.raises(AttributeError):
        cf.param.set_value("deck.bcAI", 0)


def test_a_persistent_parameter_is_stored(craft):
    virtual, cf = craft
    assert cf.param.toc.get_element_by_complete_name("pm.lowVoltage").is_persistent()
    states = []
    cf.param.persistent_store("pm.lowVoltage", lambda name, ok: states.append(ok))
    cf.param.persistent_get_state("pm.lowVoltage", lambda name, state: states.append(state))
    virtual.clock.wait_for(lambda: len(states) == 2)
    assert states[0] is True and states[1].is_stored


def test_a_block_that_is_too_large_is_refused(craft):
    from cflib.crazyflie.log import LogConfig

    virtual, cf = craft
    too_large = LogConfig("refused", 10)
    for name in ("acc.x", "acc.y", "acc.z", "gyro.x", "gyro.y", "gyro.z"):
        too_large.add_variable(name, "float")
    cf.log.add_config(too_large)
    too_large.variables += too_large.variables[:1]
    errors = []
    too_large.error_cb.add_callback(lambda block, text: errors.append(text))
    too_large.start()
    assert virtual.clock.wait_for(lambda: errors) == ["Block too large"]


def test_ten_seconds_of_flight_at_100_hz_lose_no_sample(craft):
    virtual, cf = craft
    wait_for, rows, slow = virtual.clock.wait_for, [], []
    log_block(cf, "motion", 10, MOTION, rows)
    log_block(cf, "state", 50, {"stateEstimate.z": "float", "sys.isFlying": "uint8_t"}, slow)
    wait_for(lambda: rows)
    cf.high_level_commander.takeoff(0.5, 1.5)
    first = rows[0][0]
    wait_for(lambda: rows[-1][0] - first >= 10000, 30.0)
    cf.high_level_commander.land(0.0, 1.0)
    stamps = np.array([stamp for stamp, _ in rows[:1001]])
    assert (np.diff(stamps) == 10).all()
    values = {name: np.array([row[name] for _, row in rows]) for name in MOTION}
    assert np.mean(values["acc.z"][600:1000]) == pytest.approx(1.0, abs=0.03)
    assert np.mean(values["motor.m1"][600:1000]) > 30000 and values["range.zrange"][900] > 350
    assert any(row["sys.isFlying"] for _, row in slow)
    wait_for(lambda: virtual.drone.height_over_floor < 0.03)


def test_clients_come_and_go(cflib, tmp_path):
    with serve("hover", port=0) as virtual:
        for _ in range(2):  # the second time the tables come from the cache
            with connected(virtual.uri, str(tmp_path)) as cf:
                rows = []
                log_block(cf, "one", 10, {"pm.vbat": "float"}, rows)
                wait_for(lambda rows=rows: len(rows) > 5)
                console = []
                cf.console.receivedChar.add_callback(console.append)
                line = "hello, a long line on the console of the drone"
                virtual.firmware.say(line)
                wait_for(lambda console=console, line=line: line + "\n" in "".join(console))
        with connected(virtual.uri) as cf:
            wait_for(lambda: cf.link_statistics.latency.latency > 0.0)
            assert "Can fly" in cf.supervisor.read_state_list()


def test_cflibs_scan_finds_the_virtual_drone(cflib, monkeypatch):
    from cflib.crtp import udpdriver

    with serve("hover", port=0) as virtual:
        monkeypatch.setattr(udpdriver, "_BASE_PORT", virtual.port)
        monkeypatch.setattr(udpdriver, "_NR_OF_PORTS_TO_SCAN", 1)
        monkeypatch.setattr(udpdriver, "_SCAN_TIMEOUT", HANG_S)
        assert udpdriver.UdpDriver().scan_interface() == [[virtual.uri, ""]]


def test_sweep_over_a_platform_is_felt(monkeypatch):
    with simulated(monkeypatch, mission.scene_of("sweep"), flight=1) as virtual, connected(virtual.uri) as cf:
        wait_for, let_fly = virtual.clock.wait_for, virtual.clock.sleep
        plan, rows = virtual.plan, []
        start, _, end, _ = plan.world.box[0]
        height = plan.values["top"] + plan.values["clearance"]
        log_block(cf, "edges", 10, {"stateEstimate.x": "float", "range.zrange": "uint16_t",
                                    "airtouch.edges": "uint16_t", "airtouch.edge": "uint8_t",
                                    "airtouch.health": "uint16_t"}, rows)
        fly = cf.high_level_commander

        fly.takeoff(height, 2.0)
        let_fly(5.0)
        away = (end + 1.0) / 0.3
        fly.go_to(end + 1.0, 0.0, height, 0.0, away, linear=True)
        let_fly(away + 1.0)
        fly.land(0.0, 2.5)
        wait_for(lambda: virtual.drone.took_off_s and not virtual.drone.motors_on, 20.0)
        x = np.array([row["stateEstimate.x"] for _, row in rows])
        down = np.array([row["range.zrange"] for _, row in rows])
        edges = np.array([row["airtouch.edges"] for _, row in rows], dtype=int)
        stamps = np.array([stamp for stamp, _ in rows])
        assert (np.diff(stamps) == 10).all()
        over = (x > start + 0.1) & (x < end - 0.1)
        assert np.median(down[over]) < 90 and np.median(down[(x > 0.5) & (x < start - 0.1)]) > 600
        samples = np.flatnonzero(np.diff(edges) == 1)
        assert len(samples) >= 2  # in and out again
        assert any(start <= x[i] <= end + 0.7 for i in samples)
        assert rows[-1][1]["airtouch.edge"] in (1, 2) and rows[-1][1]["airtouch.health"] == 0
        # its down range reads short near the floor: let go a little above
        assert virtual.drone.height_over_floor < 0.05


def test_motion_commander_flies_a_step(monkeypatch):
    from cflib.positioning.motion_commander import MotionCommander

    with simulated(monkeypatch, without=["gust"]) as virtual, connected(virtual.uri) as cf:
        with MotionCommander(cf, default_height=0.3) as commander:
            commander.forward(0.25, velocity=0.4)
            x = float(virtual.drone.row[17])
            assert virtual.drone.height_over_floor == pytest.approx(0.3, abs=0.12)
        assert x == pytest.approx(0.25, abs=0.15)
        virtual.clock.wait_for(lambda: not virtual.drone.motors_on and virtual.drone.height_over_floor < 0.03)
