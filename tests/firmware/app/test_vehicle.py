"""The vehicle that the app is built for: its header, what it changes, and what it refuses."""

import shutil
import subprocess
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from airtouch import vehicle as vehicles
from airtouch.cli.learning import export as export_command
from airtouch.detector.shared import vehicle_header
from airtouch.errors import AirTouchError
from airtouch.kernels.app_core import DETECTORS, HEALTH, AppCore
from airtouch.parameters import DEFAULT
from airtouch.reference.motion_channels import MotionConfig
from airtouch.simulation import scenario
from airtouch.sitl.drone import Drone

ROOT = Path(__file__).parents[3]
HEADERS = ROOT / vehicle_header.FOLDER
PRINT = """
#include <stdio.h>
#include "{name}.h"
int main(void) {{
  const airtouchVehicle_t *v = &airtouchVehicle;
  printf("%a %a %a %a %a %a %a\\n", (double)v->mass, (double)v->gravity, (double)v->thrust[0], (double)v->thrust[1],
         (double)v->thrust[2], (double)v->nominalVoltage, (double)AIRTOUCH_VEHICLE_ARM_PWM);
}}
"""


def compiled(tmp_path, name, platform):
    """The compiler's result and the program that prints the header's numbers."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler on this machine")
    (tmp_path / "print.c").write_text(PRINT.format(name=name))
    process = subprocess.run([compiler, "-Wall", "-Wextra", "-Werror", f"-DCONFIG_PLATFORM_{platform}", f"-I{HEADERS}",
                              f"-I{ROOT / 'firmware/kernels'}", tmp_path / "print.c", "-o", tmp_path / "print"],
                             capture_output=True, text=True)
    return process, tmp_path / "print"


def test_the_headers_are_those_of_the_vehicle_files():
    for name in vehicle_header.SHIPPED:
        vehicle_header.check(vehicles.load(name), HEADERS)
    buildable = {f.stem for f in (ROOT / "host/airtouch/vehicles").glob("*.toml") if vehicles.load(f.stem).platform}
    assert set(vehicle_header.SHIPPED) == buildable


@pytest.mark.parametrize("name", vehicle_header.SHIPPED)
def test_a_header_has_the_numbers_of_its_file(name, tmp_path):
    text = (ROOT / "host/airtouch/vehicles" / f"{name}.toml").read_text()
    file = tomllib.loads(text)
    process, program = compiled(tmp_path, name, file["platform"].upper())
    assert process.returncode == 0, process.stderr
    numbers = [float.fromhex(word) for word in subprocess.run([program], capture_output=True, text=True).stdout.split()]
    expected = [file["mass_kg"], file["gravity_mps2"], *file["thrust_of_pwm_n"], file.get("nominal_voltage_v", 0.0),
                file.get("arm_pwm", 15000.0)]
    assert numbers == [float(np.float32(value)) for value in expected]


def test_a_header_refuses_another_platform(tmp_path):
    process, _ = compiled(tmp_path, "crazyflie-2.1-brushless", "CF2")
    assert process.returncode != 0 and "is flown by platform cf21bl: make firmware PLATFORM=cf21bl" in process.stderr


def test_armed_at_one_pwm_everywhere():
    vehicle = vehicles.load()
    assert vehicle.arm_pwm == DEFAULT.arm_pwm == MotionConfig().arm_pwm
    brushless = vehicles.load("crazyflie-2.1-brushless")

    def share(v):
        return float(4 * v.thrust(v.arm_pwm) / (v.mass_kg * v.gravity_mps2))

    assert share(brushless) == pytest.approx(share(vehicle), abs=0.01)
    assert brushless.arm_pwm > 7000 + 2000  # what the firmware lets armed brushless motors idle at


def export(*arguments):
    return CliRunner().invoke(export_command.command, [str(a) for a in arguments])


def test_an_own_vehicle_is_exported_and_checked(tmp_path):
    source = (ROOT / "host/airtouch/vehicles/crazyflie-2.1.toml").read_text().replace('"crazyflie-2.1"', '"mine"')
    (tmp_path / "mine.toml").write_text(source)
    arguments = ("--vehicle", tmp_path / "mine.toml", "--out", tmp_path / "headers")
    assert isinstance(export(*arguments, "--check").exception, AirTouchError)
    assert export(*arguments).exit_code == 0
    assert "mine.h: up to date with mine" in export(*arguments, "--check").output
    (tmp_path / "mine.toml").write_text(source.replace("0.0319", "0.0330"))
    assert "--force" in str(export(*arguments).exception)
    assert "stale" in str(export(*arguments, "--check").exception)
    assert export(*arguments, "--force").exit_code == 0 and export(*arguments, "--check").exit_code == 0


@pytest.mark.parametrize("change, words", [
    (("platform", "plattform"), "unknown key plattform"),
    (('platform = "cf2"', ""), "says no platform of crazyflie-firmware"),
    (('platform = "cf2"', "platform = 2"), "platform must be a text"),
    (('"crazyflie-2.1"', '"../mine"'), "the name becomes a file's"),
    (('"crazyflie-2.1"', "'my\\\"drone'"), "the name becomes a file's"),
])
def test_an_own_vehicle_that_cannot_be_built_for_is_refused(tmp_path, change, words):
    source = (ROOT / "host/airtouch/vehicles/crazyflie-2.1.toml").read_text()
    assert change[0] in source
    (tmp_path / "mine.toml").write_text(source.replace(*change))
    result = export("--vehicle", tmp_path / "mine.toml", "--out", tmp_path / "headers")
    assert isinstance(result.exception, AirTouchError) and words in str(result.exception)
    assert not (tmp_path / "headers").exists()


def test_a_model_and_a_vehicle_are_two_exports(tmp_path):
    assert "not both" in export(tmp_path / "m.npz", "--vehicle", "crazyflie-2.1", "--out", tmp_path).output


def hover(vehicle):
    """PWM (4,) that carries the vehicle, by the closed form of its curve."""
    c0, c1, c2 = vehicle.thrust_of_pwm_n
    each = vehicle.mass_kg * vehicle.gravity_mps2 / 4
    return np.full(4, (-c1 + np.sqrt(c1 * c1 + 4 * c2 * (each - c0))) / (2 * c2))


def last_log(app, pwm, steps=300):
    for step in range(steps):
        app.step((1e-3 * (step % 2), 0, 9.81), (0, 0, 0), pwm)
    return app.log


@pytest.mark.parametrize("name", vehicle_header.SHIPPED)
def test_in_hover_no_force_is_left_to_explain(name):
    vehicle = vehicles.load(name)
    log = last_log(AppCore(vehicle=vehicle), hover(vehicle))
    assert abs(log.force[2]) < 1e-3 * vehicle.mass_kg * vehicle.gravity_mps2
    heavier = last_log(AppCore(vehicle=replace(vehicle, mass_kg=1.1 * vehicle.mass_kg)), hover(vehicle))
    assert heavier.force[2] == pytest.approx(0.1 * vehicle.mass_kg * vehicle.gravity_mps2, rel=0.02)


def test_networks_run_on_the_vehicle_that_they_were_trained_for():
    heavy = replace(vehicles.load(), mass_kg=0.040)  # the network does not see the mass
    for vehicle in (None, vehicles.load(), vehicles.load("crazyflie-2.1"), heavy):
        log = last_log(AppCore({"detector": 1}, vehicle=vehicle), hover(vehicle or vehicles.load()))
        assert DETECTORS[log.detector] == "best" and log.health == 0 and log.answers > 0


@pytest.mark.parametrize("detector", range(len(DETECTORS)), ids=DETECTORS)
@pytest.mark.parametrize("change", [{"thrust_of_pwm_n": (8e-3, 5.6e-7, 5.6e-11)}, {"gravity_mps2": 3.7},
                                    {"arm_pwm": 12000.0}], ids=lambda c: next(iter(c)))
def test_on_another_vehicle_fr_cfar_runs_alone_and_health_says_so(detector, change):
    vehicle = replace(vehicles.load(), **change)
    app = AppCore({"detector": detector}, have_gap8=True, vehicle=vehicle)
    log = last_log(app, hover(vehicle))
    assert DETECTORS[log.detector] == "cfar" and log.answers == 0 and list(app.packets()) == []
    assert log.health == (HEALTH["other vehicle"] if detector else 0)
    app.set_params(detector=0)
    assert last_log(app, hover(vehicle), 1).health == 0


def edges(vehicle, pwm):
    """Edges of FR-CFAR while something shoves the drone once a second."""
    app = AppCore({"detector": 0}, vehicle=vehicle)
    for step in range(1500):
        app.step((0, 0, 9.81 + 3.0 * (step % 100 == 0) + 0.01 * (step % 7)), (0, 0, 0), np.full(4, pwm))
    return app.log.edges


def test_the_vehicle_says_when_it_is_airborne():
    brushless = vehicles.load("crazyflie-2.1-brushless")
    assert edges(brushless, 13000) > 5 and edges(vehicles.load(), 13000) == 0
    assert edges(brushless, 11000) == 0 and edges(vehicles.load(), 16000) > 5


@pytest.mark.parametrize("name, runs", [("crazyflie-2.1-flow", True), ("crazyflie-2.1-brushless", False)])
def test_the_virtual_crazyflie_carries_an_app_built_for_its_vehicle(name, runs):
    plan = scenario.draw_flight(scenario.load("paper-9cm"), 0, 0)
    drone = Drone(plan, vehicles.load(name), 0, 0, [], ai_deck=False)
    drone.app.set("detector", 1)
    for _ in range(20):
        drone.step()
    assert (DETECTORS[int(drone.app.read("detector"))] == "best") == runs
    assert bool(int(drone.app.read("health")) & HEALTH["other vehicle"]) != runs
