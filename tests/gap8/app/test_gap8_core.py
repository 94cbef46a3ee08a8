"""The GAP8 app's core under sanitizers: packets that say anything, and networks that do not fit."""

import re
import subprocess
from pathlib import Path

import pytest

from patience import HANG_S
from sanitized import build


@pytest.fixture(scope="module")
def driver(tmp_path_factory):
    program = build(Path(__file__).with_name("gap8_driver.c"), tmp_path_factory.mktemp("gap8") / "driver")

    def run(*words):
        process = subprocess.run([program, *words], capture_output=True, text=True, timeout=HANG_S)
        assert process.returncode == 0, process.stderr[-3000:]
        return process.stdout

    return run


def test_whatever_comes_a_new_session_begins_as_on_a_new_core(driver):
    packets, answers = map(int, re.fullmatch(r"(\d+) packets, (\d+) answers\n", driver("hostile", "9")).groups())
    assert packets == 9 * 300 and answers > 2_500


def test_a_network_that_does_not_fit_is_left_out(driver):
    assert driver("models") == "8 refused\n"
