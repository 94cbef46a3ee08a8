"""The app's shell, what surrounds the core in the firmware:
tasks, parameters, log tables, and what of CPX it touches."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

import objects
import sanitized
from airtouch import vehicle as vehicles
from airtouch.detector.shared import vehicle_header
from airtouch.kernels.app_core import PARAM_TYPES
from airtouch.kernels.library import ffi
from airtouch.simulation import scenario
from airtouch.sitl import app as sitl
from airtouch.sitl.drone import Drone
from patience import HANG_S

ROOT, HERE = Path(__file__).parents[3], Path(__file__).parent
APP, HOST = ROOT / "firmware" / "app" / "src", ROOT / "host" / "airtouch" / "kernels" / "batch"
INCLUDES = [APP, APP.parent / "core", HERE / "crazyflie", *(ROOT / folder for folder in (
    "firmware/link", "firmware/kernels", "gap8/kernels", "gap8/model", "gap8/app/src"))]
CORE = sorted((APP.parent / "core").glob("app_*.c"))
#: sources that know nothing of the configuration
PORTABLE = [path for folder in ("firmware/kernels", "firmware/link", "gap8/kernels", "gap8/model")
            for path in sorted((ROOT / folder).glob("*.c"))]
#: configuration -> what the compiler is told, sources beside the core's
BUILDS = {
    "app-config": ([], []),
    "app-config-tap": (["-DCONFIG_CONTROLLER_OOT"], [APP / "imu_tap.c"]),
    "app-config-gap8": (["-DCONFIG_DECK_AI", "-DCONFIG_ENABLE_CPX", f"-I{HERE / 'crazyflie/cpx'}", f"-I{HOST}"],
                        [APP / "gap8_port.c", ROOT / "gap8/app/src/gap8_core.c", HOST / "app_core_batch.c"]),
}
ALL = ("silent", "missing-variable", "parameters", "write-between", "stalled", "late")
LONGEST_NAME = 26  # group, name and two bytes: the firmware asserts on a longer one when it starts


@pytest.fixture(scope="module")
def headers():
    """A folder with the vehicle's header under the name that the build gives it."""
    folder = objects.FOLDER / "vehicle"
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(ROOT / vehicle_header.FOLDER / "crazyflie-2.1-flow.h", folder / "airtouch_vehicle.h")
    return folder


@pytest.fixture(scope="module")
def shells(headers, tmp_path_factory):
    """The shell as each configuration builds it: configuration -> program."""
    compiler = shutil.which(os.environ.get("CC", "cc"))
    if compiler is None:
        pytest.skip("no C compiler on this machine")
    folder = tmp_path_factory.mktemp("shell")
    command = [compiler, "-std=gnu11", "-O1", "-g1", "-Wall", "-Wextra", "-Werror", "-Wdouble-promotion",
               *sanitized.SANITIZERS, "-DCONFIG_PLATFORM_CF2", f"-I{headers}", *(f"-I{i}" for i in INCLUDES)]
    core = []
    for flags, sources in ((command[1:], CORE), (sanitized.FLAGS, PORTABLE)):
        compiled, error = objects.compiled(compiler, flags, sources)
        assert not error, error[:3000]
        core += compiled
    for name, (flags, sources) in BUILDS.items():
        process = subprocess.run([*command, *flags, HERE / "shell_driver.c", APP / "app_sensors.c", *sources, *core,
                                  "-lm", "-o", folder / name], capture_output=True, text=True)
        assert process.returncode == 0, process.stderr[:3000]
    return {name: folder / name for name in BUILDS}


def run(program, *arguments):
    process = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True, timeout=HANG_S)
    assert process.returncode == 0, process.stderr[-3000:]
    return process.stdout


@pytest.mark.parametrize("name", BUILDS)
@pytest.mark.parametrize("story", ALL)
def test_the_shell_keeps_its_promises(shells, name, story):
    run(shells[name], story)


@pytest.mark.parametrize("story", ["gap8-on-request", "foreign"])
def test_the_gap8_is_asked_only_where_the_parameter_says_so(shells, story):
    run(shells["app-config-gap8"], story)


@pytest.mark.parametrize("deck", [0, 0xFFFF], ids=["absent", "unknown to the firmware"])
def test_without_an_ai_deck_nothing_is_sent(shells, deck):
    assert "no GAP8, detector 1" in run(shells["app-config-gap8"], "no-deck", deck)


@pytest.mark.parametrize("story", ["tap", "tap-mean"])
def test_the_tap_gives_means(shells, story):
    run(shells["app-config-tap"], story)


def test_the_virtual_crazyflie_has_the_same_defaults(shells):
    lines = [line.split() for line in run(shells["app-config"], "tables").splitlines()]
    params = {words[1].split(".")[1]: float.fromhex(words[4]) for words in lines if words[0] == "param"}
    virtual = Drone(scenario.draw_flight(scenario.load("paper-9cm"), 0, 0), vehicles.load(), 0, 0, [], ai_deck=True)
    assert params and {p.name.split(".")[1]: p.default for p in virtual.app.parameters()} == params


def test_the_virtual_crazyflie_has_the_same_tables(shells):
    """Names, types, and which field each one is."""
    lines = [line.split() for line in run(shells["app-config"], "tables").splitlines()]
    compiled = {(group, name.split(".")[1]): (int(kind), int(field)) for group, name, kind, field, *_ in lines}
    kinds = {"log": {"uint8_t": 1, "uint16_t": 2, "uint32_t": 3, "float": 7},  # log.h, param.h
             "param": {"float": 6, "uint8_t": 8, "uint16_t": 9}}
    virtual = {("log", name): (kinds["log"][kind], ffi.offsetof("appLog_t", field, *([at] if at >= 0 else [])))
               for name, (kind, field, at) in sitl.LOGS.items()}
    virtual |= {("param", name): (kinds["param"][PARAM_TYPES[field]], ffi.offsetof("appParams_t", field))
                for name, field in sitl.PARAMS.items()}
    assert compiled == virtual


def test_the_page_lists_every_variable_and_parameter():
    page = (ROOT / "host/docs/flash.md").read_text("utf-8")
    params, logs = (re.search(rf"\n\| {head} `airtouch\.`.*?\n\n", page, re.DOTALL)[0] for head in ("parameter", "log"))
    for table, names in ((params, sitl.PARAMS), (logs, sitl.LOGS)):
        rows = [row.split("|")[1] for row in table.strip().splitlines()[2:]]
        assert sorted(re.findall(r"\w+", " ".join(rows))) == sorted(names)


def test_names_are_no_longer_than_the_firmware_takes(shells):
    names = [line.split()[1] for line in run(shells["app-config"], "tables").splitlines()]
    assert max(len(name.replace(".", "")) for name in names) + 2 <= LONGEST_NAME
    assert not [name for name in names if not name.replace(".", "").isalnum()]


@pytest.mark.parametrize("name", ["app-config", "app-config-tap"])
def test_shipped_configurations_leave_cpx_out(name):
    lines = (APP.parent / name).read_text().splitlines()
    assert {"# CONFIG_DECK_AI is not set", "# CONFIG_ENABLE_CPX is not set"} <= set(lines)
