"""Scenarios: the built-in ones and the missions fly in one air, that of the fit to recorded flights; a scenario may
change its vehicle.
"""

import tomllib
from importlib import resources

import pytest

from airtouch import vehicle as vehicles
from airtouch.crazyflie import mission
from airtouch.errors import AirTouchError
from airtouch.simulation import scenario

SCENARIOS = resources.files("airtouch") / "simulation/scenarios"
MISSIONS = resources.files("airtouch") / "crazyflie/missions"
OTHER_AIR = {"paper-mixed", "randomised", "diagnosis", "hover"}  #: to train on, and without anything unmodelled
OWN = {"gust", "wind"}  #: effects that a scenario may set for itself


def table(path):
    return tomllib.loads(path.read_text("utf-8"))


@pytest.fixture(scope="module")
def fitted_scenario():
    return table(MISSIONS / "sweep.toml")


@pytest.mark.parametrize("name", sorted(set(scenario.names()) - OTHER_AIR))
def test_scenarios_have_the_fitted_air_and_down_range(name, fitted_scenario):
    own = table(SCENARIOS / f"{name}.toml")
    assert set(fitted_scenario["effects"]) <= set(own["effects"]) <= set(fitted_scenario["effects"]) | OWN
    for effect in set(fitted_scenario["effects"]) - OWN:
        assert own["effects"][effect] == fitted_scenario["effects"][effect]
    for field in ("range_drift_rms", "range_drift_time_s"):
        assert own["vehicle"][field] == fitted_scenario["vehicle"][field]
    assert ("flow_noise_mps" in own["vehicle"]) == (own["mission"]["control"] == "position")


@pytest.mark.parametrize("name", mission.names())
def test_missions_have_it_too(name, fitted_scenario):
    own = table(MISSIONS / f"{name}.toml")
    assert own["effects"] == fitted_scenario["effects"] and own["vehicle"] == fitted_scenario["vehicle"]


LEVEL = """
[mission]
step = [{ do = "take-off", height_m = 0.5 }, { do = "hover", time_s = 1.0 }]
"""


def test_a_scenario_may_change_fields_of_the_vehicle():
    fields = "range_module = 'none'\n[vehicle]\nmass_kg = { low = 0.03, high = 0.05 }\nflow_noise_mps = [0.01, 0.02]\n"
    scene = scenario.parse(fields + LEVEL, "mine.toml")
    vehicles_drawn = [scenario.draw_flight(scene, 0, i).with_changes(vehicles.load()) for i in range(20)]
    assert all(0.03 <= v.mass_kg <= 0.05 for v in vehicles_drawn) and len({v.mass_kg for v in vehicles_drawn}) == 20
    assert {v.flow_noise_mps for v in vehicles_drawn} == {(0.01, 0.02)}
    assert {(v.range_module, v.name) for v in vehicles_drawn} == {("none", "crazyflie-2.1-flow")}


@pytest.mark.parametrize("line, message", [
    ("mas_kg = 1", "unknown key mas_kg"), ("mass_kg = -1", "must be positive"),
    ("flow_noise_mps = 1", "must be 2 numbers"),
    ("firmware = '1999'", "mine.toml"), ("name = 'other'", "every field of a vehicle but its name")])
def test_wrong_fields_are_told_with_their_file(line, message):
    with pytest.raises(AirTouchError, match=message) as error:
        scenario.parse(f"[vehicle]\n{line}\n{LEVEL}", "mine.toml")
    assert str(error.value).startswith("mine") and "\n" not in str(error.value)
