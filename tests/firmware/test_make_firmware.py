"""`make firmware` and `make flash`: what they refuse, and how far they come without a compiler."""

import shutil
import subprocess

import pytest

from firmware.make import ROOT, make


@pytest.fixture
def checkout(tmp_path):
    """What `make firmware` takes for a checkout of the firmware, up to the first source that it compiles."""
    for file in ("tools/make/oot.mk", "vendor/FreeRTOS/include/FreeRTOS.h", "vendor/CMSIS/CMSIS/x",
                 *(f"configs/{name}_defconfig" for name in ("cf2", "cf21bl", "bolt"))):
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / file).touch()
    return tmp_path


@pytest.mark.parametrize("missing, words", [(None, "say where the firmware's sources are"),
                                            ("tools/make/oot.mk", "is no checkout of bitcraze/crazyflie-firmware"),
                                            ("vendor/FreeRTOS/include/FreeRTOS.h", "lacks its submodules")])
def test_make_firmware_says_what_is_missing(missing, words, checkout):
    if missing:
        (checkout / missing).unlink()
    process = make("firmware", *([f"CRAZYFLIE_BASE={checkout}"] if missing else []))
    assert process.returncode != 0 and words in process.stderr


@pytest.mark.parametrize("arguments, words", [
    (["CONFIG=app-config-tab"], "no firmware/app/app-config-tab; CONFIG is one of app-config"),
    (["PLATFORM=cf3"], "the firmware has no configs/cf3_defconfig"),
    (["PLATFORM=cf21bl"], "trained for the thrust curve of crazyflie-2.1-flow, not of crazyflie-2.1-brushless"),
    (["PLATFORM=cf21bl", "VEHICLE=crazyflie-2.1-flow"], "crazyflie-2.1-flow is flown by platform cf2, not by cf21bl"),
    (["VEHICLE=crazyflie-2.1-brushless"], "crazyflie-2.1-brushless is flown by platform cf21bl, not by cf2"),
    (["PLATFORM=bolt"], "no vehicle of AirTouch flies bolt"),
    (["VEHICLE=host/airtouch/vehicles/crazyflie-2.1.toml"], "is no header that `airtouch export --vehicle` wrote"),
    (["VEHICLE=mine"], "no firmware/app/vehicles/mine.h; VEHICLE is one of crazyflie-2.1"),
])
def test_make_firmware_refuses_what_does_not_fit(arguments, words, checkout):
    process = make("firmware", f"CRAZYFLIE_BASE={checkout}", *arguments)
    assert process.returncode != 0 and words in process.stderr


@pytest.mark.parametrize("config, platform, vehicle, networks", [
    ("app-config", "cf2", "", ""), ("app-config-gap8-tap", "cf2", "crazyflie-2.1", ""),
    ("app-config", "cf21bl", "", "no"), ("app-config", "cf2", "firmware/app/vehicles/crazyflie-2.1-flow.h", "")])
def test_what_fits_comes_as_far_as_the_compiler(config, platform, vehicle, networks, checkout):
    for tool in ("sed", "basename", "paste"):
        (checkout / tool).symlink_to(shutil.which(tool))
    command = [shutil.which("sh"), "firmware/app/build.sh", checkout, config, platform, vehicle, networks]
    process = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, env={"PATH": str(checkout)})
    assert process.returncode != 0 and process.stderr.startswith("make firmware: no arm-none-eabi-gcc")


@pytest.mark.parametrize("arguments, flashed", [
    ([], "build/firmware/cf21bl.bin"), (["PLATFORM=cf2"], "build/firmware/cf2.bin"), (["IMAGE=x y.bin"], "x y.bin"),
    (["CHECK=1"], "build/firmware/cf21bl.bin --check"), (["CONFIG=app-config-tap"], "build/firmware/cf2-tap.bin"),
    (["PLATFORM=cf2", "CONFIG=app-config"], "build/firmware/cf2.bin"),
    (["URI=radio://0/80/2M/E7E7E7E7E7"], "build/firmware/cf21bl.bin --uri radio://0/80/2M/E7E7E7E7E7")])
def test_make_flash_takes_the_image_last_built(arguments, flashed, tmp_path):
    (tmp_path / "build/firmware").mkdir(parents=True)
    (tmp_path / ".venv/bin").mkdir(parents=True)
    (tmp_path / ".venv/bin/airtouch").write_text('#!/bin/sh\necho "$@"\n')
    (tmp_path / ".venv/bin/airtouch").chmod(0o755)
    command = ["-C", tmp_path, "-f", ROOT / "Makefile", "-o", ".venv/.kernels", "--no-print-directory", "flash"]
    if not arguments:
        process = make(*command)
        assert process.returncode != 0 and "make flash: no image" in process.stderr
    (tmp_path / "build/firmware/image").write_text("build/firmware/cf21bl.bin\n")
    process = make(*command, *arguments)
    assert process.returncode == 0 and process.stdout.split() == f"flash {flashed}".split(), process.stderr
