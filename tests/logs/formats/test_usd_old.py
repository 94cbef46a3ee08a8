"""uSD-card logs of firmware before March 2021, written here byte by byte from the format."""

import struct
import zlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import damaged
from airtouch import vehicle as vehicles
from airtouch.errors import AirTouchError
from airtouch.logs.files import parse
from airtouch.logs.flight_log import ACC, GYRO

NAMES = ("tick(I)", "acc.x(f)", "acc.y(f)", "acc.z(f)", "gyro.x(f)", "gyro.y(f)", "gyro.z(f)", "pwm.m1_pwm(I)",
         "pwm.m2_pwm(I)", "pwm.m3_pwm(I)", "pwm.m4_pwm(I)", "pm.vbatMV(H)")
RATES = ("tick(I)", "stateEstimate.qx(f)", "stateEstimate.qy(f)", "stateEstimate.qz(f)", "stateEstimate.qw(f)",
         "stateEstimateZ.rateRoll(h)", "stateEstimateZ.ratePitch(h)", "stateEstimateZ.rateYaw(h)")


def checksum(data):
    """Bit by bit, as the firmware's crc32.c of the time: reflected 0xEDB88320, begins at all ones, not inverted."""
    register = 0xFFFFFFFF
    for byte in data:
        register ^= byte
        for _ in range(8):
            register = register >> 1 ^ (0xEDB88320 if register & 1 else 0)
    return struct.pack("<I", register)


def old_log(rows, names=NAMES, a_block=7):
    """The log of packed rows, `a_block` rows a block."""
    head = bytes([len(names)]) + b"".join(name.encode() + b"," for name in names)
    out = head + checksum(head)
    for k in range(0, len(rows), a_block):
        block = bytes([len(rows[k:k + a_block])]) + b"".join(rows[k:k + a_block])
        out += block + checksum(block)
    return out


def flight(n=50):
    return [struct.pack("<I6f4IH", 9000 + 10 * i, 0.5, 0, 1, 90, 0, 0, i, 2, 3, 65535, 3900) for i in range(n)]


def test_an_old_file_gives_columns_in_si_units():
    log = parse(old_log(flight()), "log00")
    assert len(log) == 50 and log.meta["format"] == "usd-0" and not log.meta["warnings"]
    assert "crazyflie-2.1 is assumed" in vehicles.of_log(log.meta)[1]  # no name of a drone in it
    np.testing.assert_allclose(log["t_s"], 9 + 0.01 * np.arange(50))
    np.testing.assert_allclose(log.stack(ACC)[0], [0.5 * 9.81, 0, 9.81], rtol=1e-6)
    np.testing.assert_allclose(log.stack(GYRO)[0], [np.pi / 2, 0, 0], rtol=1e-6)
    np.testing.assert_array_equal(log["m1_pwm"], np.arange(50))
    assert log["vbat_V"][0] == pytest.approx(3.9)


@pytest.mark.parametrize(("step", "in_doubt"), [(10, False), (500, False), (1000, True), (1004, True), (2000, False)])
def test_a_step_that_may_be_either_unit_is_warned_of(step, in_doubt):
    """1000 ticks are 1 kHz in microseconds and 1 Hz in milliseconds: the deck does both."""
    rows = [struct.pack("<IH", 9000 + step * i, 3900) for i in range(20)]
    warnings = parse(old_log(rows, ("tick(I)", "pm.vbatMV(H)")), "log00").meta["warnings"]
    assert any("milliseconds" in w for w in warnings) == in_doubt


def test_ticks_in_microseconds_give_seconds():
    rows = [struct.pack("<IH", 9_000_000 + 9890 * i, 3900) for i in range(20)]
    log = parse(old_log(rows, ("tick(I)", "pm.vbatMV(H)")), "log00")
    np.testing.assert_allclose(log["t_s"], 9 + 0.00989 * np.arange(20))


def test_a_damaged_block_is_left_out_and_a_cut_one_gives_its_whole_rows():
    data = bytearray(old_log(flight(21)))
    size = len(flight(1)[0])
    data[-size - 30] ^= 1  # in the last of three blocks
    log = parse(bytes(data), "log00")
    assert len(log) == 14 and "1 blocks with a wrong checksum" in log.meta["warnings"][0]
    contents = old_log(flight(21))
    for missing_bytes in (1, 4, 5, size, 3 * size + 4):
        log = parse(contents[:-missing_bytes], "log00")
        missing_rows = -(-max(missing_bytes - 4, 0) // size)
        np.testing.assert_array_equal(log["m1_pwm"], np.arange(21 - missing_rows))
        assert "cut off" in log.meta["warnings"][0]


@pytest.mark.parametrize("sign", [1, -1])
def test_the_sign_of_the_pitch_rate_is_that_of_the_attitude(sign):
    """A swing about y: quaternion (0, sin(a/2), 0, cos(a/2)), whose body rate is da/dt."""
    t = 0.01 * np.arange(300)
    angle, rate = 0.3 * np.sin(4 * t), 1.2 * np.cos(4 * t)
    rows = [struct.pack("<I4f3h", round(1000 * a), 0, np.sin(b / 2), 0, np.cos(b / 2), 0, round(sign * 1000 * c), 0)
            for a, b, c in zip(t, angle, rate, strict=True)]
    log = parse(old_log(rows, RATES), "log00")
    np.testing.assert_allclose(log["gyro_y_radps"], rate, atol=1e-3)


def test_rates_without_attitude_are_left_out_and_said():
    names = (RATES[0], *RATES[5:], "pm.vbatMV(H)")
    log = parse(old_log([struct.pack("<I3hH", 10 * i, 1, 2, 3, 3900) for i in range(20)], names), "log00")
    assert "gyro_y_radps" not in log.columns and "ratePitch" in log.meta["warnings"][0]


def test_files_without_rows_time_or_known_variables_are_refused():
    with pytest.raises(AirTouchError, match="no complete row"):
        parse(old_log([]), "log00")
    with pytest.raises(AirTouchError, match="'tick' has no time"):
        parse(old_log([struct.pack("<H", 3900)] * 3, ("pm.vbatMV(H)",)), "log00")
    with pytest.raises(AirTouchError, match="none of its variables is known"):
        parse(old_log([struct.pack("<If", i, 1) for i in range(3)], ("tick(I)", "ctrlFa.Faz(f)")), "log00")


def test_text_is_not_taken_for_one():
    log = parse(b"# vehicle: \"x\"\nt_s,acc_x_mps2\n0,1\n0.01,1\n", "a.csv")
    assert log.meta["format"] == "canonical"


def test_checksum_is_zlibs_without_its_inversion():
    assert checksum(b"123456789") == struct.pack("<I", 0xCBF43926 ^ 0xFFFFFFFF) == struct.pack(
        "<I", zlib.crc32(b"123456789") ^ 0xFFFFFFFF)


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_a_damaged_log_is_read_or_refused_in_one_line(data):
    damaged.is_read_or_refused(old_log(flight(9)), data)
