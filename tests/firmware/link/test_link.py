"""The two ends of the link over a pipe of bytes: any fault, no wrong answer, back within ten packets."""

import re
import subprocess
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from patience import HANG_S
from sanitized import build

PASS, DROP, FLIP, RESET = 0, 6, 10, 62


@pytest.fixture(scope="module")
def driver(tmp_path_factory):
    """The C driver, built with sanitizers: a function from scripts to the slowest recovery, in packets."""
    folder = tmp_path_factory.mktemp("link")
    program = build(Path(__file__).with_name("link_driver.c"), folder / "driver")

    def run(scripts, *words):
        files = list(words)
        for number, script in enumerate(scripts):
            files.append(folder / f"{number}.script")
            files[-1].write_bytes(script)
        process = subprocess.run([program, *files], capture_output=True, text=True, timeout=HANG_S)
        assert process.returncode == 0, process.stderr[-3000:]
        return int(re.fullmatch(r"\d+ scripts, answers after at most (\d+) packets\n", process.stdout)[1])

    return run


def script(faults, reset):
    """Bytes for the driver: faults, most packets unharmed; reset: whether the GAP8 may be reset."""
    body = bytes(b if reset or b % 64 != RESET else PASS for b in faults)
    return body


SCRIPTS = st.lists(
    st.builds(lambda algorithm, faults, reset: bytes([algorithm]) + script(faults, reset),
              st.integers(0, 5),
              st.lists(st.one_of(st.just(PASS), st.sampled_from([DROP, 8, 9, FLIP, 11, 12, 13]), st.integers(0, 255)),
                       max_size=900),
              st.booleans()),
    min_size=8, max_size=8)


@settings(max_examples=4)
@given(scripts=SCRIPTS)
def test_any_faults_give_no_wrong_answer_and_answers_come_back(driver, scripts):
    assert driver(scripts) <= 10


@pytest.mark.parametrize("algorithm", range(6), ids=["best", "paper", "paper-stream", "best-swift", "paper-swift",
                                                     "paper-stream-swift"])
def test_a_burst_of_lost_packets_costs_nothing_but_time(driver, algorithm):
    # Two packets of each step may be on their way up, each answered: some 2 s in which nothing passes.
    assert driver([bytes([algorithm]) + bytes([DROP]) * n for n in (1, 7, 30, 100, 400)]) <= 10


def test_corrupted_lengths_and_lost_power_in_the_midst_of_flight(driver):
    longer = bytes([13, 7, 1]) * 200
    truncated = bytes([9, 40]) * 200
    lost_power = bytes([PASS] * 40 + [RESET] + [PASS] * 80 + [RESET, DROP, DROP] + [PASS] * 5)
    driver([bytes([a]) + s for a in range(6) for s in (longer, truncated, lost_power)])


def test_packets_that_look_right_and_say_anything_break_nothing(driver):
    driver([], "forge")
