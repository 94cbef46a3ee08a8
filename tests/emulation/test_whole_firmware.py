"""The whole firmware in QEMU: bad input anywhere;
with a checkout (CRAZYFLIE_BASE) the image itself, beside the desktop."""

import os
import shutil
import subprocess
import sys
from dataclasses import replace as changed
from pathlib import Path

import numpy as np
import pytest

from airtouch import vehicle as vehicles
from airtouch.detector import best
from airtouch.errors import AirTouchError
from airtouch.kernels.app_core import AppCore
from airtouch.logs import write
from airtouch.simulation import scenario
from airtouch.simulation.flight import fly
from airtouch.simulation.scenario import draw_flight
from tools.emulate import build, gap8, height
from tools.emulate.__main__ import main
from tools.emulate.board import REPLAY, Board
from tools.emulate.deck import CLEAR, Deck, Faults, frame
from tools.emulate.plant import FLOW, Plant
from tools.emulate.replay import FED, desktop_values, differs, replay, rows, sample

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def log():
    return fly(scenario.load("paper-4cm"), vehicles.load(), seed=3)


@pytest.fixture(scope="module")
def image():
    base = os.environ.get("CRAZYFLIE_BASE")
    if not base or not all(map(shutil.which, ("arm-none-eabi-gcc", "qemu-system-arm"))):
        pytest.skip("set CRAZYFLIE_BASE to a checkout of the firmware, and install arm-none-eabi-gcc and "
                    "qemu-system-arm")
    build.compile_firmware(Path(base))
    return build.link()


def emulate(*arguments, **environment):
    return subprocess.run([sys.executable, "-m", "tools.emulate", *map(str, arguments)], cwd=ROOT, capture_output=True,
                          text=True, env=os.environ | environment)


def one_line(run, words):
    assert run.returncode == 1 and words in run.stderr and run.stderr.count("\n") == 1, run.stderr


@pytest.fixture
def refused(monkeypatch):
    """Whether a checkout is refused with these words, with this PATH; in this process, as imports take a second."""
    def check(base, path, words):
        monkeypatch.setenv("PATH", path)
        with pytest.raises(AirTouchError) as found:
            main([str(base)])
        assert words in str(found.value) and "\n" not in str(found.value)
    return check


@pytest.fixture
def path_with(tmp_path):
    """A PATH with these programs that do nothing; of git and make, those that are here."""
    def make(*names, real=("git", "make")):
        folder = tmp_path / "bin"
        folder.mkdir()
        for name in names:
            (folder / name).write_text("#!/bin/sh\n")
            (folder / name).chmod(0o755)
        for name in real:
            (folder / name).symlink_to(shutil.which(name))
        return str(folder)
    return make


def test_without_a_checkout_it_says_where_to_get_one():
    one_line(emulate(""), "say where the firmware's sources are")
    with pytest.raises(AirTouchError, match="say where the firmware's sources are"):
        main(["--fly"])


@pytest.mark.parametrize("there, missing", [((), "no arm-none-eabi-gcc: apt-get install gcc-arm-none-eabi"),
                                            (("arm-none-eabi-gcc",),
                                             "no qemu-system-arm: apt-get install qemu-system-arm")])
def test_a_missing_tool_is_named(there, missing, path_with, tmp_path, refused):
    refused(tmp_path, path_with(*there), missing)


def test_without_git_or_make_it_says_so(path_with, tmp_path, refused):
    refused(tmp_path, path_with("arm-none-eabi-gcc", "qemu-system-arm", real=()), "no git: apt-get install git")


def test_a_folder_that_is_no_checkout_is_refused(path_with, tmp_path, refused):
    tools = path_with("arm-none-eabi-gcc", "qemu-system-arm")
    refused(tmp_path, f"{tools}:{os.environ['PATH']}", "is no checkout of bitcraze/crazyflie-firmware (no tools/make/"
                                                       "oot.mk): git clone --recursive --branch 2026.08")


def test_a_copy_without_its_history_is_refused(path_with, tmp_path, refused):
    (tmp_path / "tools/make").mkdir(parents=True)
    (tmp_path / "tools/make/oot.mk").touch()
    tools = path_with("arm-none-eabi-gcc", "qemu-system-arm")
    refused(tmp_path, f"{tools}:{os.environ['PATH']}", "does not say which release it is, and the board is written for "
                                                       "2026.08: git clone --recursive --branch 2026.08")


@pytest.mark.parametrize("tag", ["2025.02", "2026.08-rc1"])
def test_another_release_is_refused(tag, path_with, tmp_path, refused):
    base = tmp_path / "base"
    (base / "tools/make").mkdir(parents=True)
    (base / "tools/make/oot.mk").touch()
    for command in (["init", "-q"], ["add", "."], ["-c", "user.name=a", "-c", "user.email=a@b", "commit", "-qm", "a"],
                    ["tag", tag]):
        subprocess.run(["git", "-C", base, *command], check=True)
    tools = path_with("arm-none-eabi-gcc", "qemu-system-arm")
    refused(base, f"{tools}:{os.environ['PATH']}", f"is {tag}, the board is written for 2026.08: git -C")


def test_a_flight_without_motors_is_refused(log):
    less = changed(log, columns={k: v for k, v in log.columns.items() if k != "m3_pwm"})
    with pytest.raises(AirTouchError, match="has no m3_pwm: the app needs acceleration, rates and motors"):
        rows(less)


@pytest.mark.parametrize("arguments, words", [
    (["flight.csv", "--fly"], "--fly flies the simulator's drone: leave out flight.csv"),
    (["--height", "--only", "slope"], "no case begins with 'slope'; --only is the beginning of one of: platform 0.76"),
    (["nowhere.csv"], "nowhere.csv: cannot be read: No such file"),
    (["--nonsense"], "unrecognized arguments: --nonsense; see python -m tools.emulate --help"),
    (["--fly", "--height"], "--height: not allowed with argument --fly"),
    (["--platform", "bolt"], "invalid choice: 'bolt' (choose from 'cf2', 'cf21bl')"),
    (["--steps", "many"], "--steps: many is no whole number from 1 on"),
    (["--begin", "-5"], "--begin: -5 is no whole number from 0 on"),
    (["--begin", "5", "nowhere.csv"], "nowhere.csv: cannot be read: No such file"),
    (["--gap8", "a.csv", "b.csv"], "--gap8 takes one flight: leave out b.csv"),
    (["--gap8", "--platform", "cf21bl"], "--gap8 compares the networks of the cf2: leave out --platform cf21bl"),
    (["--keep", "out"], "--keep is of --height: add it, or leave out --keep"),
    (["--fly", "--steps", "100"], "--steps is of a recorded flight, and --fly flies none: leave it out"),
    (["--seeds", "3"], "--seeds is of --fly and --height, a recorded flight has one noise: leave it out"),
    (["--force"], "--force is of --traces: leave it out"),
    (["--built", "--config", "app-config-tap"], "--built takes what was built last: leave out --config"),
    (["--height", "--config", "app-config-tap"], "--height needs app-config-height: leave out --config app-config-tap"),
    (["--height", "--keep", "/dev/null/x"], "/dev/null/x: cannot be made: Not a directory; choose another"),
])
def test_what_cannot_be_run_is_refused_before_anything_is_built(monkeypatch, tmp_path, arguments, words):
    monkeypatch.setattr(build, "tools", lambda: pytest.fail("it went on"))
    with pytest.raises(AirTouchError) as found:
        main([str(tmp_path), *arguments])
    assert words in str(found.value) and "\n" not in str(found.value)


def test_a_flight_is_looked_at_before_anything_is_built(monkeypatch, tmp_path, log):
    monkeypatch.setattr(build, "tools", lambda: pytest.fail("it went on"))
    write(changed(log, columns={k: v for k, v in log.columns.items() if k != "m3_pwm"}), tmp_path / "flight.csv")
    with pytest.raises(AirTouchError, match="has no m3_pwm"):
        main([str(tmp_path), str(tmp_path / "flight.csv")])
    write(log, tmp_path / "short.csv")
    with pytest.raises(AirTouchError, match=rf"has {len(log)} rows: --begin must be less"):
        main([str(tmp_path), str(tmp_path / "short.csv"), "--begin", str(len(log))])


def test_a_compiler_that_refuses_is_one_line(monkeypatch, tmp_path):
    (tmp_path / "tools/make").mkdir(parents=True)
    (tmp_path / "tools/make/oot.mk").touch()
    (tmp_path / ".git").mkdir()
    said = "In file included:\nsrc/a.c:3:1: fatal error: b.h: No such file\nmake: 1\n"
    failed = subprocess.CompletedProcess([], 2, "", said)
    monkeypatch.setattr(build, "release", lambda base: build.RELEASE)
    monkeypatch.setattr(build.subprocess, "run", lambda *_, **__: failed)
    with pytest.raises(AirTouchError, match="^the firmware does not compile: src/a.c:3:1: fatal error: b.h: No such "
                                            "file; for all of it: make firmware CRAZYFLIE_BASE=.*PLATFORM=cf2$"):
        build.compile_firmware(tmp_path)


def test_a_kept_flight_that_is_damaged_is_named(tmp_path):
    elf = tmp_path / "board.elf"
    elf.touch()
    case = height.cases("flat")[0]
    path = height._kept_at(tmp_path, elf, case, 1, 0)
    path.write_text("{")
    with pytest.raises(AirTouchError, match="is damaged: delete it, and it is flown again"):
        height.report(elf, only="flat", folder=tmp_path)


def test_an_image_that_was_not_built_is_asked_for(monkeypatch, tmp_path):
    monkeypatch.setattr(build, "BUILT", tmp_path)
    with pytest.raises(AirTouchError, match="no image is built yet: leave out --built"):
        build.link()
    (tmp_path / "image").write_text("build/firmware/cf2.bin\n")
    with pytest.raises(AirTouchError, match="without height_port.c: leave out --built"):
        build.link(needs="height_port")


def test_what_is_fed_is_what_the_core_gets(log):
    table = rows(log)
    acc, gyro, pwm, volts, attitude = map(np.array, zip(*map(sample, table), strict=True))
    for column, axis in zip(acc.T, "xyz", strict=True):
        np.testing.assert_allclose(column, log[f"acc_world_{axis}_mps2"], atol=2e-5)
    np.testing.assert_allclose(gyro[:, 1], log["gyro_y_radps"], atol=1e-5)
    np.testing.assert_allclose(pwm[:, 2], log["m3_pwm"], atol=0.5)
    np.testing.assert_allclose(volts, log["vbat_V"], atol=1e-5)
    np.testing.assert_allclose(np.linalg.norm(attitude, axis=1), 1.0, atol=1e-6)
    assert len(FED) == table.shape[1]


def test_a_bit_more_is_a_difference():
    core = AppCore()
    for _ in range(3):
        core.step([0.1, 0.0, 9.8], [0.0, 0.1, 0.0], [30_000.0] * 4)
    values = desktop_values(core)
    assert not any(differs(name, value, value) for name, value in values.items())
    off = np.nextafter(np.float32(values["fwz"]), np.float32(9))
    assert differs("fwz", off, values["fwz"]) and differs("steps", values["steps"] + 1, values["steps"])
    assert differs("health", int(values["health"]) ^ 1, values["health"]) and not differs("late", 7, 0)
    assert not differs("thresh", np.nan, np.nan) and differs("thresh", 1.0, np.nan) and differs("fwz", -0.0, 0.0)


def counts_of_flow(x, distance, top):
    """Forward counts of the optical flow, sum of 0.2 s at 0.3 m/s, so far above what lies below x."""
    plan = draw_flight(height.mission(height.CASES[0]), 1, 0)
    plant = Plant(plan, vehicles.load("crazyflie-2.1-flow"), 1, 0, [])
    drone = plant.stepper.plant[0]
    drone["flow_noise"] = 0.0
    total = 0.0
    for _ in range(300):
        state = plant.state["body"]["state"]
        state[:3] = x, 0.0, top + distance + float(drone["range_below_rotors"])
        state[3:6], state[6:10], state[10:13] = (0.3, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), 0.0
        plant.step(np.full(4, 40_000.0))
        total += plant.readings[FLOW]
    return total


def test_the_emulated_flow_sees_the_distance_to_what_is_below():
    """Not the height over the floor: the real firmware divides by its own height, and corrects nothing."""
    floor, platform = counts_of_flow(0.0, 0.2, 0.0), counts_of_flow(0.95, 0.2, 0.76)
    assert platform == pytest.approx(floor, rel=0.05) and floor > 0.0
    assert counts_of_flow(0.0, 0.4, 0.0) == pytest.approx(0.5 * floor, rel=0.05)
    assert counts_of_flow(0.95, 0.04, 0.76) == pytest.approx(2.5 * floor, rel=0.05), "0.08 m is the nearest in focus"


class Wire:
    """A board that only notes what it is told."""

    def __init__(self):
        self.said, self.handlers = [], {}

    def on(self, kind, handler):
        self.handlers[kind] = handler

    def say(self, kind, content=b""):
        self.said.append(content)

    def go(self):
        pass


def test_the_deck_frames_takes_turns_and_answers():
    """CPX over UART: 0xff, length, route, data and the exclusive or of all; a frame only after the other's ff 00."""
    core = AppCore({"detector": gap8.DETECTOR}, have_gap8=True)
    core.step([0.0, 0.0, 9.8], [0.0, 0.0, 0.0], [40_000.0] * 4)
    reset, = core.packets()
    whole = bytes([0xFF, len(reset) + 2, 4 | 1 << 3 | 1 << 6, 5]) + reset
    xor = 0
    for byte in whole:
        xor ^= byte
    wire = Wire()
    deck = Deck(wire)
    deck.turn(0)
    wire.handlers["U"](whole[:5])
    assert wire.said == []
    wire.handlers["U"](whole[5:] + bytes([xor]))
    assert deck.sent == [reset] and wire.said == [CLEAR], "it may go on; the answer waits for its turn"
    wire.handlers["U"](CLEAR)
    reply, = deck.taken()
    assert wire.said[-1] == frame(reply) and frame(reply)[2:4] == bytes([1 | 4 << 3 | 1 << 6, 5])
    core.receive(reply)
    core.step([0.0, 0.0, 9.8], [0.0, 0.0, 0.0], [40_000.0] * 4)
    assert core.log.link == 1, "filling: the GAP8 has taken the reset"


def test_a_deck_that_is_not_there_and_a_packet_for_the_wifi():
    wire = Wire()
    deck = Deck(wire, Faults(there=False))
    wire.handlers["U"](CLEAR)
    assert wire.said == []
    deck = Deck(wire)
    wire.handlers["U"](frame(b"name")[:2] + bytes([2 | 1 << 3 | 1 << 6, 4]) + b"name" + b"\0")
    assert deck.sent == [] and wire.said == [CLEAR]


@pytest.mark.slow
def test_the_network_on_the_gap8_and_what_may_go_wrong(image, log):
    build.compile_firmware(Path(os.environ["CRAZYFLIE_BASE"]), "app-config-gap8")
    elf = build.link()
    for faults, link in ((Faults(late=3, lost=0.1, damaged=0.1), "up"), (Faults(dead=(0, 1 << 30)), "starting"),
                         (Faults(there=False), "starting")):
        found = gap8.replay(elf, log, 400, faults)
        assert (found.steps, found.different, found.other_packets, found.link) == (400, 0, 0, link), found.first
    with pytest.raises(AirTouchError, match="cpx_uart_transport.c"):
        gap8.replay(elf, log, 200, Faults(wrong_byte=50))


@pytest.mark.slow
def test_the_firmware_computes_what_the_desktop_does(image, log):
    steps = best.run(log).edges[0].sample + 100
    changes = {100: {"pFa": 1e-3}, 200: {"scoreIn": 99.0}, 300: {"detector": 0}, 400: {"detector": 1, "scoreIn": 2.3}}
    found = replay(image, log, steps, changes)
    assert (found.steps, found.different, found.late) == (steps, 0, 0), found.first
    assert found.prob_off < 1e-6 and len(found.edges) == 1 and 0 < found.stack_bytes < 1200 and found.longest_us < 2000
    assert "Self test passed!" in found.console


@pytest.mark.slow
def test_the_comparison_notices_another_input(image, log):
    found = replay(image, log, 50, {10: {"pFa": 1e-3}})
    assert found.different == 0
    core = AppCore(vehicle=vehicles.load("crazyflie-2.1-flow"))
    with Board(image, REPLAY, ["airtouch.fwz", "airtouch.steps"]) as board:
        board.ask("W", FED)
        board.go()
        table = rows(log)
        table[:, 2] += np.float32(1e-6)
        seen = []
        for row, true in zip(table[1000:1010], rows(log)[1000:1010], strict=True):
            board.say("V", row.tobytes())
            board.go()
            acc, gyro, pwm, volts, attitude = sample(true)
            core.step(acc, gyro, pwm, vbat_v=volts, attitude=attitude)
            seen.append(differs("fwz", board.values(board.hear("S"))["airtouch.fwz"], core.log.force[2]))
    assert any(seen)


@pytest.mark.slow
def test_a_log_variable_or_a_parameter_that_is_missing_is_named(image):
    with (pytest.raises(AirTouchError, match="no log variable airtouch.nothing"),
          Board(image, REPLAY, ["airtouch.nothing"])):
        pass
    with (pytest.raises(AirTouchError, match="stopped: no such parameter"),
          Board(image, REPLAY, ["airtouch.steps"]) as board):
        board.ask("W", FED)
        board.parameter("airtouch.nothing", 1.0)
        board.go()
        board.hear("S")
