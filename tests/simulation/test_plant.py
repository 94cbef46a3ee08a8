"""What the simulator makes of a vehicle: built-in ones and other people's hover; the larger one senses further."""

import math
import re
from dataclasses import replace
from importlib import resources

import numpy as np
import pytest
from scipy.optimize import brentq

from airtouch import vehicle as vehicles
from airtouch.errors import AirTouchError
from airtouch.simulation import flight
from airtouch.simulation.effects.air.ground_effect import thrust_ratio
from airtouch.simulation.plant import from_vehicle, hover_pwm

BUILT_IN = ("crazyflie-2.1", "crazyflie-2.1-flow", "crazyflie-2.1-brushless", "quadrotor-450")


@pytest.mark.parametrize("name", BUILT_IN)
def test_built_in_vehicles_hover(name, hover):
    log = flight.fly(hover, vehicles.load(name), 0, 0, effects={"rotor_drag": {}})
    assert not isinstance(log, flight.Diverged), str(log)
    still = log.slice(len(log) - 300, len(log))
    assert abs(still["z_m"].mean() - 0.8) < 0.05
    assert still["z_m"].std() < 0.03
    assert np.abs(still["roll_rad"]).max() < 0.1


@pytest.mark.parametrize("letter", ["a", "b"])
def test_other_peoples_vehicles_load_as_they_are_and_hover(flights, letter, hover):
    craft = vehicles.load(flights / "peers" / f"vehicle_{letter}.toml")
    log = flight.fly(hover, craft, 0, 0)
    assert not isinstance(log, flight.Diverged), str(log)
    assert log["z_m"][-300:].std() < 0.03


def test_gains_are_scaled_to_the_vehicles_authority():
    small, large = (from_vehicle(vehicles.load(n))[0] for n in ("crazyflie-2.1", "quadrotor-450"))
    assert small["rate_scale"] == pytest.approx(1.0)
    assert large["rate_scale"] > 1.5


def test_the_larger_quadrotor_senses_at_around_three_metres():
    """Range: where the ground effect's force is what a Crazyflie feels at its limit of 12 cm."""
    def force(name, height):
        v = vehicles.load(name)
        ratio = thrust_ratio(height, v.rotor_radius_m, math.sqrt(2) * v.arm_m, 2.0)
        return ratio * v.mass_kg * v.gravity_mps2
    limit = force("crazyflie-2.1-flow", 0.12 + 0.025)
    reach = brentq(lambda z: force("quadrotor-450", z) - limit, 0.3, 30.0)
    assert 2.0 < reach < 4.0


def test_a_vehicle_declares_triples_and_old_files_still_load():
    text = """
name = "t"
mass_kg = 0.03
arm_m = 0.04
inertia_kg_m2 = [1e-5, 1e-5, 2e-5]
thrust_of_pwm_n = [0.0, 0.0, 4e-11]
yaw_torque_over_thrust_m = 0.006
motor_time_constant_s = 0.05
rotor_radius_m = 0.02
acc_noise_ratio = [1.0, 2.0, 3.0]
"""
    v = vehicles.parse(text, "t.toml")
    np.testing.assert_allclose(from_vehicle(v)[0]["acc_noise"], 0.06 * np.array([1, 2, 3]))
    assert hover_pwm(v) == pytest.approx(math.sqrt(0.03 * 9.81 / 4 / 4e-11))
    assert hover_pwm(replace(v, thrust_of_pwm_n=(0.0, 1e-6, 0.0))) == pytest.approx(0.03 * 9.81 / 4 / 1e-6)


@pytest.mark.parametrize("line", [
    "thrust_of_pwm_n = [0, 0, 0]", "thrust_of_pwm_n = [0.1, 0, 0]", "thrust_of_pwm_n = [0, -1e-6, 0]",
    "thrust_of_pwm_n = [0, 1e-6, -1e-11]", "battery_resistance_ohm = -0.1", "power_per_thrust15 = -1",
    "rotor_drag_kg_per_rad = -1e-6", "voltage_exponent = -1", "motor_time_constant_s = 0",
    "motor_fall_time_constant_s = -0.1", "rotor_inertia_kg_m2 = -1e-8", "thrust_per_speed2 = -1e-8"])
def test_an_impossible_vehicle_is_refused_with_the_name_of_its_field(line):
    text = (resources.files("airtouch") / "vehicles" / "crazyflie-2.1-flow.toml").read_text()
    name = line.split(" = ")[0]
    text = re.sub(rf"(?m)^{name}\s*=.*\n", "", text) + line + "\n"
    with pytest.raises(AirTouchError, match=f"mine.toml: {name}"):
        vehicles.parse(text, "mine.toml")


def test_a_firmware_file_that_was_edited_flies_as_it_is_now(tmp_path):
    path = tmp_path / "mine.toml"
    craft = replace(vehicles.load("crazyflie-2.1"), firmware=str(path))
    for command in (36000.0, 46000.0, 36000.0):
        path.write_text(f'base = "2026.08"\n[controller]\nthrust_base = {command}\n')
        plant = from_vehicle(craft)[0]
        assert plant["thrust_base"] == plant["firmware"]["controller"]["thrust_base"] == command
