"""The whole firmware in QEMU, with a checkout (CRAZYFLIE_BASE): the image itself, beside the desktop."""

import os
from pathlib import Path

import numpy as np
import pytest

from airtouch import vehicle as vehicles
from airtouch.detector import best
from airtouch.errors import AirTouchError
from airtouch.kernels.app_core import AppCore
from tools.firmware_emulation import build, gap8
from tools.firmware_emulation.board import REPLAY, Board
from tools.firmware_emulation.deck import Faults
from tools.firmware_emulation.replay import FED, desktop_values, differs, replay, rows, sample


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


@pytest.mark.slow
def test_the_network_on_the_gap8_and_what_may_go_wrong(image, log):
    build.compile_firmware(Path(os.environ["CRAZYFLIE_BASE"]), "app-config-gap8")
    elf = build.link()
    for faults, link in ((Faults(late=3, lost=0.1, damaged=0.1), "up"), (Faults(dead=(0, 1 << 30)), "starting"),
                         (Faults(there=False), "starting")):
        comparison = gap8.replay(elf, log, 400, faults)
        assert (comparison.steps, comparison.different) == (400, 0), comparison.first
        assert (comparison.other_packets, comparison.link) == (0, link)
    with pytest.raises(AirTouchError, match="cpx_uart_transport.c"):
        gap8.replay(elf, log, 200, Faults(wrong_byte=50))


@pytest.mark.slow
def test_the_firmware_computes_what_the_desktop_does(image, log):
    steps = best.run(log).edges[0].sample + 100
    changes = {100: {"pFa": 1e-3}, 200: {"scoreIn": 99.0}, 300: {"detector": 0}, 400: {"detector": 1, "scoreIn": 2.3}}
    comparison = replay(image, log, steps, changes)
    assert (comparison.steps, comparison.different, comparison.late) == (steps, 0, 0), comparison.first
    assert comparison.prob_off < 1e-6 and len(comparison.edges) == 1
    assert 0 < comparison.stack_bytes < 1200 and comparison.longest_us < 2000
    assert "Self test passed!" in comparison.console


@pytest.mark.slow
def test_the_comparison_notices_another_input(image, log):
    comparison = replay(image, log, 50, {10: {"pFa": 1e-3}})
    assert comparison.different == 0
    core = AppCore(vehicle=vehicles.load("crazyflie-2.1-flow"))
    with Board(image, REPLAY, ["airtouch.fwz", "airtouch.steps"]) as board:
        board.ask("W", FED)
        board.go()
        table = rows(log)
        table[:, 2] += np.float32(1e-6)
        differences = []
        for row, true in zip(table[1000:1010], rows(log)[1000:1010], strict=True):
            board.say("V", row.tobytes())
            board.go()
            acc, gyro, pwm, volts, attitude = sample(true)
            core.step(acc, gyro, pwm, vbat_v=volts, attitude=attitude)
            differences.append(differs("fwz", board.values(board.hear("S"))["airtouch.fwz"], core.log.force[2]))
    assert any(differences)


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
