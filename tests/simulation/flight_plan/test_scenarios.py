"""Built-in scenarios and ready missions fly in one air: that of the fit to recorded flights."""

import tomllib
from importlib import resources

import pytest

from airtouch.crazyflie import mission
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
