"""Missions: the legs retrace the simulator's set-points."""

import math

import numpy as np
import pytest

import airtouch as at
from airtouch.crazyflie import mission
from airtouch.errors import AirTouchError
from airtouch.simulation import batch, scenario
from airtouch.simulation.firmware import setpoint as c
from airtouch.sitl import Server


def retraced(legs):
    """Positions at 100 Hz of legs flown straight at constant speed, the landing's height left out."""
    at, rows = np.zeros(3), []
    for leg in legs:
        n = max(int(round(100 * leg.seconds)), 1)
        to = np.array([leg.x_m, leg.y_m, leg.z_m])
        rows.append(at + np.arange(1, n + 1)[:, None] / n * (to - at))
        at = to
    return np.concatenate(rows)


@pytest.mark.parametrize("name", [*mission.names(), "zigzag", "l-shape", "paper-mixed", "circle"])
def test_legs_are_the_path_that_the_simulator_flies(name):
    path = scenario.MISSIONS / f"{name}.toml"
    scene = scenario.load(path) if path.is_file() else scenario.load(name)
    rows = scenario.draw_flight(scene, 3, 2).setpoints
    legs = mission.load(name, 3, 2).legs
    path_rows = retraced(legs)
    assert abs(len(path_rows) - len(rows)) <= 2
    upto = int(100 * sum(leg.seconds for leg in legs if leg.kind not in ("land", "wait") or leg is legs[0])) - 2
    difference = path_rows[:upto] - rows[:upto, c.X:c.Z + 1] + rows[0, c.X:c.Z + 1]
    assert np.abs(difference).max() < 0.02


@pytest.mark.parametrize("name", mission.names())
def test_a_mission_is_a_scenario_wherever_one_is_named(name):
    """Batches, the virtual drone and `at.simulate` fly what stands in its file."""
    plan = scenario.draw_flight(scenario.load(scenario.MISSIONS / f"{name}.toml"), 2, 0)
    server = Server(name, port=0, seed=2)
    server.close()
    np.testing.assert_array_equal(server.plan.setpoints, plan.setpoints)
    for (log,) in (batch.simulate(name, seed=2), at.simulate(name, seed=2)):
        assert log.meta["scenario"] == name and log.meta["condition"] == plan.values
        assert len(log) == len(plan.setpoints)


def test_the_mission_is_seen_from_the_start():
    text = """
[mission]
start_m = [2.0, 1.0]
yaw_deg = 90.0
step = [{ do = "wait", time_s = 1.0 }, { do = "take-off", height_m = 0.5 }, { do = "hover", time_s = 1.0 },
        { do = "go", to_m = [2.0, 3.0], speed_mps = 0.5 }]
"""
    scene = scenario.parse(text, "turned")
    legs = mission.legs_of(scenario.draw_flight(scene, 0, 0).setpoints)
    assert [leg.kind for leg in legs] == ["wait", "take-off", "hover", "go", "land"]  # a landing is added
    assert (legs[3].x_m, legs[3].y_m, legs[3].seconds) == (pytest.approx(2.0), pytest.approx(0.0), pytest.approx(4.0))
    assert legs[4].z_m == 0.0 and legs[4].seconds >= 0.5 / 0.3


def test_the_speed_is_that_of_the_longest_level_leg(tmp_path):
    path = tmp_path / "climb.toml"
    path.write_text("""
[mission]
step = [{ do = "wait", time_s = 1.0 }, { do = "take-off", height_m = 0.5 }, { do = "hover", time_s = 1.0 },
        { do = "go", to_m = [2.0, 0.0], speed_mps = 0.5 }, { do = "hover", time_s = 1.0 },
        { do = "go", to_m = [2.0, 0.0], height_m = 1.3, speed_mps = 0.1 }, { do = "hover", time_s = 1.0 }]
""")
    legs = mission.load(path).legs
    assert max(leg.seconds for leg in legs if leg.kind == "go") == pytest.approx(8.0), "the climb is the longest"
    assert mission.load(path).speed_mps == pytest.approx(0.5)


def test_ready_missions_cross_edges_low_enough_to_be_felt():
    for name in mission.names():
        ready = mission.load(name)
        assert ready.speed_mps and 0.1 <= ready.speed_mps <= 0.4
        assert ready.values["clearance"] <= 0.05 and ready.values["top"] > 0.3
        assert ready.legs[-1].kind == "wait" and ready.legs[-2].kind == "land"
        assert math.isclose(ready.room_m[4], ready.values["top"] + ready.values["clearance"])


def test_what_cannot_be_flown_is_said_in_one_line(tmp_path):
    with pytest.raises(AirTouchError, match="ready ones: sweep, there-and-back, zig-zag"):
        mission.load("nowhere")
    with pytest.raises(AirTouchError, match="no such scenario file"):
        mission.load(tmp_path / "none.toml")
    (tmp_path / "m.toml").write_text('[mission]\nstep = [{ do = "wait", time_s = 1.0 }]\n')
    with pytest.raises(AirTouchError, match="never takes off"):
        mission.load(tmp_path / "m.toml")


@pytest.mark.parametrize("name", ["sweep", "there-and-back"])
def test_the_shipped_detector_feels_the_edges_of_a_first_flight(name):
    """Six virtual flights, drawn anew: at most every fifth edge is missed (of 20 flights: results.md)."""
    path = scenario.MISSIONS / f"{name}.toml"
    logs = [log.with_columns({}, speed_mps=0.3) for log in at.simulate(path, 6, seed=7)]
    score = at.evaluate(logs)
    assert score["edges"] == 6 * {"sweep": 2, "there-and-back": 4}[name]
    assert score["missed"] <= 0.2
