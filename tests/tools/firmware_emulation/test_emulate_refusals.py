"""`python -m tools.firmware_emulation` with what it cannot run: one line each, before anything is built."""

import os
import shutil
import subprocess
import sys
from dataclasses import replace as changed
from pathlib import Path

import pytest

from airtouch.errors import AirTouchError
from airtouch.logs import write
from tools.firmware_emulation import build, height, missions
from tools.firmware_emulation.__main__ import main
from tools.firmware_emulation.replay import rows

ROOT = Path(__file__).parents[3]


def emulate(*arguments, **environment):
    return subprocess.run([sys.executable, "-m", "tools.firmware_emulation", *map(str, arguments)], cwd=ROOT,
                          capture_output=True, text=True, env=os.environ | environment)


def one_line(process, words):
    assert process.returncode == 2 and words in process.stderr and process.stderr.count("\n") == 1, process.stderr


@pytest.fixture
def refusal(monkeypatch):
    """Whether a checkout is refused with these words, with this PATH; in this process, as imports take a second."""
    def check(base, path, words):
        monkeypatch.setenv("PATH", path)
        with pytest.raises(AirTouchError) as error:
            main([str(base)])
        assert words in str(error.value) and "\n" not in str(error.value)
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


@pytest.mark.parametrize("tools, message", [((), "no arm-none-eabi-gcc: apt-get install gcc-arm-none-eabi"),
                                            (("arm-none-eabi-gcc",),
                                             "no qemu-system-arm: apt-get install qemu-system-arm")])
def test_a_missing_tool_is_named(tools, message, path_with, tmp_path, refusal):
    refusal(tmp_path, path_with(*tools), message)


def test_without_git_or_make_it_says_so(path_with, tmp_path, refusal):
    refusal(tmp_path, path_with("arm-none-eabi-gcc", "qemu-system-arm", real=()), "no git: apt-get install git")


def test_a_folder_that_is_no_checkout_is_refused(path_with, tmp_path, refusal):
    tools = path_with("arm-none-eabi-gcc", "qemu-system-arm")
    refusal(tmp_path, f"{tools}:{os.environ['PATH']}", "is no checkout of bitcraze/crazyflie-firmware (no tools/make/"
                                                       "oot.mk): git clone --recursive --branch 2026.08")


def test_a_copy_without_its_history_is_refused(path_with, tmp_path, refusal):
    (tmp_path / "tools/make").mkdir(parents=True)
    (tmp_path / "tools/make/oot.mk").touch()
    tools = path_with("arm-none-eabi-gcc", "qemu-system-arm")
    refusal(tmp_path, f"{tools}:{os.environ['PATH']}", "does not say which release it is, and the board is written for "
                                                       "2026.08: git clone --recursive --branch 2026.08")


@pytest.mark.parametrize("tag", ["2025.02", "2026.08-rc1"])
def test_another_release_is_refused(tag, path_with, tmp_path, refusal):
    base = tmp_path / "base"
    (base / "tools/make").mkdir(parents=True)
    (base / "tools/make/oot.mk").touch()
    for command in (["init", "-q"], ["add", "."], ["-c", "user.name=a", "-c", "user.email=a@b", "commit", "-qm", "a"],
                    ["tag", tag]):
        subprocess.run(["git", "-C", base, *command], check=True)
    tools = path_with("arm-none-eabi-gcc", "qemu-system-arm")
    refusal(base, f"{tools}:{os.environ['PATH']}", f"is {tag}, the board is written for 2026.08: git -C")


def test_a_flight_without_motors_is_refused(log):
    three_motors = changed(log, columns={k: v for k, v in log.columns.items() if k != "m3_pwm"})
    with pytest.raises(AirTouchError, match="has no m3_pwm: the app needs acceleration, rates and motors"):
        rows(three_motors)


@pytest.mark.parametrize("arguments, words", [
    (["flight.csv", "--fly"], "--fly flies the simulator's drone: leave out flight.csv"),
    (["--height", "--only", "slope"], "no case begins with 'slope'; --only is the beginning of one of: platform 0.76"),
    (["nowhere.csv"], "nowhere.csv: cannot be read: No such file"),
    (["--nonsense"], "unrecognized arguments: --nonsense; see python -m tools.firmware_emulation --help"),
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
    with pytest.raises(AirTouchError) as error:
        main([str(tmp_path), *arguments])
    assert words in str(error.value) and "\n" not in str(error.value)


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
    output = "In file included:\nsrc/a.c:3:1: fatal error: b.h: No such file\nmake: 1\n"
    process = subprocess.CompletedProcess([], 2, "", output)
    monkeypatch.setattr(build, "release", lambda base: build.RELEASE)
    monkeypatch.setattr(build.subprocess, "run", lambda *_, **__: process)
    with pytest.raises(AirTouchError, match="^the firmware does not compile: src/a.c:3:1: fatal error: b.h: No such "
                                            "file; for all of it: make firmware CRAZYFLIE_BASE=.*PLATFORM=cf2$"):
        build.compile_firmware(tmp_path)


def test_a_kept_flight_that_is_damaged_is_named(tmp_path):
    elf = tmp_path / "board.elf"
    elf.touch()
    case = missions.cases("flat")[0]
    path = height.kept_at(tmp_path, elf, case, 1, 0)
    path.write_text("{")
    with pytest.raises(AirTouchError, match="is damaged: delete it, and it is flown again"):
        height.report(elf, only="flat", folder=tmp_path)


def test_an_image_that_was_not_built_is_asked_for(monkeypatch, tmp_path):
    monkeypatch.setattr(build, "FIRMWARE", tmp_path)
    with pytest.raises(AirTouchError, match="no image is built yet: leave out --built"):
        build.link()
    (tmp_path / "image").write_text("build/firmware/cf2.bin\n")
    with pytest.raises(AirTouchError, match="without height_port.c: leave out --built"):
        build.link(needs="height_port")
