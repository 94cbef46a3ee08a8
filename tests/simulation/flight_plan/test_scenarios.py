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
def fitted():
    return table(MISSIONS / "sweep.toml")


@pytest.mark.parametrize("name", sorted(set(scenario.names()) - OTHER_AIR))
def test_scenarios_have_the_fitted_air_and_down_range(name, fitted):
    own = table(SCENARIOS / f"{name}.toml")
    assert set(fitted["effects"]) <= set(own["effects"]) <= set(fitted["effects"]) | OWN
    for effect in set(fitted["effects"]) - OWN:
        assert own["effects"][effect] == fitted["effects"][effect]
    for field in ("range_drift_rms", "range_drift_time_s"):
        assert own["vehicle"][field] == fitted["vehicle"][field]
    assert ("flow_noise_mps" in own["vehicle"]) == (own["mission"]["control"] == "position")


@pytest.mark.parametrize("name", mission.names())
def test_missions_have_it_too(name, fitted):
    own = table(MISSIONS / f"{name}.toml")
    assert own["effects"] == fitted["effects"] and own["vehicle"] == fitted["vehicle"]
