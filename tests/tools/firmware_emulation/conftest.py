"""A flight, and the firmware's image where CRAZYFLIE_BASE has a checkout."""

import os
import shutil
from pathlib import Path

import pytest

from airtouch import vehicle as vehicles
from airtouch.simulation import scenario
from airtouch.simulation.flight import fly
from tools.firmware_emulation import build


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
