"""uSD-card logs, written here byte by byte from the format."""

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

VARIABLES = ("acc.x(f)", "acc.y(f)", "acc.z(f)", "gyro.x(f)", "gyro.y(f)", "gyro.z(f)", "motor.m1(H)",
             "motor.m2(H)", "motor.m3(H)", "motor.m4(H)", "range.zrange(H)", "pm.vbat(f)",
             "stateEstimateZ.quat(I)")


def usd_log(version=2, rows=50, event=b"fixedFrequency", other=True):
    """A log of `rows` main records 1 ms apart, an event of another kind between them."""
    out = b"\xbc" + struct.pack("<HH", version, 2)
    out += struct.pack("<H", 7) + event + b"\0" + struct.pack("<H", len(VARIABLES))
    out += b"".join(v.encode() + b"\0" for v in VARIABLES)
    out += struct.pack("<H", 9) + b"estTDOA\0" + struct.pack("<H", 1) + b"distance(f)\0"
    for i in range(rows):
        out += struct.pack("<H", 7) + _time(version, i)
        out += struct.pack("<6f4HHfI", 0.5, 0, 1, 90, 0, 0, i, 2, 3, 65535, 800 + i, 3.9, 3 << 30)
        if other and i % 3 == 0:
            out += struct.pack("<H", 9) + _time(version, i) + struct.pack("<f", 1.0)
    return out + struct.pack("<I", zlib.crc32(out))


def _time(version, i):
    return struct.pack("<I", 100 + i) if version == 1 else struct.pack("<Q", 100_000 + 1000 * i)


@pytest.mark.parametrize("version", [1, 2])
def test_files_of_both_versions_give_columns_in_si_units(version):
    log = parse(usd_log(version), "log00")
    assert len(log) == 50 and log.meta["format"] == f"usd-{version}" and not log.meta["warnings"]
    assert "crazyflie-2.1 is assumed" in vehicles.of_log(log.meta)[1]  # no name of a drone in it
    np.testing.assert_allclose(log["t_s"], 0.1 + 0.001 * np.arange(50))
    np.testing.assert_allclose(log.stack(ACC)[0], [0.5 * 9.81, 0, 9.81], rtol=1e-6)
    np.testing.assert_allclose(log.stack(GYRO)[0], [np.pi / 2, 0, 0], rtol=1e-6)
    np.testing.assert_array_equal(log["m1_pwm"], np.arange(50))
    assert log["m4_pwm"][0] == 65535 and log["zrange_m"][5] == pytest.approx(0.805)
    assert log["roll_rad"][0] == 0


def test_a_wrong_checksum_is_told():
    data = bytearray(usd_log())
    data[-20] ^= 1
    log = parse(bytes(data), "log00")
    assert len(log) == 50 and "checksum" in log.meta["warnings"][0]


def test_cut_log_keeps_whole_records():
    data = usd_log()
    for length in range(len(data) - 400, len(data) - 5):
        log = parse(data[:length], "log00")
        assert 30 < len(log) <= 50 and any("checksum" in w for w in log.meta["warnings"])
        np.testing.assert_array_equal(log["m1_pwm"], np.arange(len(log)))


def test_logs_without_the_usual_event_and_unusable_ones():
    assert len(parse(usd_log(event=b"controller"), "log00")) == 50
    with pytest.raises(AirTouchError, match="version 3"):
        parse(usd_log(version=3), "log00")
    with pytest.raises(AirTouchError, match="no complete record"):
        parse(usd_log(rows=0), "log00")
    with pytest.raises(AirTouchError, match="within its header"):
        parse(usd_log()[:60], "log00")
    with pytest.raises(AirTouchError, match="no known type"):
        parse(usd_log().replace(b"acc.x(f)", b"acc.x(Z)"), "log00")


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_a_damaged_log_is_read_or_refused_in_one_line(data):
    damaged.is_read_or_refused(usd_log(rows=5), data)
