"""What the simulator's tests share."""

import numpy as np
import pytest

from airtouch import vehicle as vehicles
from airtouch.simulation import flight, scenario
from airtouch.simulation import signals as at
from airtouch.simulation.plant import from_vehicle, hover_speed


def pytest_configure(config):
    config.addinivalue_line("filterwarnings", "ignore:First-class function type feature")


@pytest.fixture(scope="session")
def vehicle():
    return vehicles.load("crazyflie-2.1-flow")


@pytest.fixture(scope="session")
def ideal(vehicle):
    """The same vehicle with sensors that do not err."""
    from dataclasses import replace
    return replace(vehicle, acc_noise_rms_mps2=0.0, gyro_noise_rms_radps=0.0, range_noise_rms_m=0.0,
                   flow_noise_mps=(0.0, 0.0), range_drift_rms=0.0)


HOVER = """
name = "test-hover"
[[mission.step]]
do = "take-off"
height_m = 0.8
[[mission.step]]
do = "hover"
time_s = 12.0
"""


@pytest.fixture(scope="session")
def hover():
    return scenario.parse(HOVER, "test-hover")


@pytest.fixture(scope="session")
def steady(ideal, hover):
    """steady(effects) -> the log of a hover, its last four seconds."""
    def fly(effects=(), vehicle=ideal, scene=hover):
        log = flight.fly(scene, vehicle, 1, 0, effects=effects)
        assert not isinstance(log, flight.Diverged), str(log)
        return log.slice(len(log) - 400, len(log))
    return fly


@pytest.fixture
def signals(vehicle):
    """Signals (100, COUNT) of a level hover far from any surface."""
    plant = from_vehicle(vehicle)
    row = plant[0]
    s = np.zeros((100, at.COUNT))
    s[:, at.STEP], s[:, at.MASS], s[:, at.GRAVITY] = 0.002, row["mass"], row["gravity"]
    s[:, at.ROTOR_X:at.ROTOR_X + 4], s[:, at.ROTOR_Y:at.ROTOR_Y + 4] = row["rotor_x"], row["rotor_y"]
    s[:, at.ROTOR_RADIUS], s[:, at.ROTOR_SPACING] = row["rotor_radius"], row["rotor_spacing"]
    s[:, at.HOVER_SPEED] = hover_speed(plant)
    s[:, [at.ROTATION, at.ROTATION + 4, at.ROTATION + 8]] = 1.0
    s[:, at.ROTOR_SPEED:at.ROTOR_SPEED + 4] = hover_speed(plant)
    s[:, at.THRUST:at.THRUST + 4] = row["mass"] * row["gravity"] / 4
    s[:, at.LOWER_HEIGHT:at.UPPER_HEIGHT + 4] = 10.0
    s[:, at.LOWER_FACTOR:at.ACCELERATION] = 1.0
    s[:, at.HEIGHT] = 10.0
    return s
