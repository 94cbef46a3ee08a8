"""Log and parameter service packet by packet, with the firmware's errors."""

import errno
import re
import struct
import zlib
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from airtouch.kernels.app_core import PARAM_TYPES
from airtouch.logs.quaternion import decompress
from airtouch.sitl import app
from airtouch.sitl.services.log_service import LENGTHS, encode
from airtouch.sitl.services.packet import LOG, MEMORY, PARAM
from airtouch.sitl.services.toc import Item, Toc
from airtouch.sitl.services.variables import compress

CREATE, APPEND, DELETE, START, STOP, RESET = 6, 7, 2, 3, 4, 5
APP = Path(__file__).parents[2] / "firmware/app/src/airtouch_app.c"


def variable(bench, name, kind):
    return struct.pack("<BH", kind, bench.firmware.log.toc.ids[name])


def test_the_app_has_the_names_and_types_of_the_firmware():
    text = APP.read_text()
    field = r"core\.log\.(\w+)(?:\[(\d)\])?"
    logs = re.findall(rf"LOG_ADD(?:_BY_FUNCTION)?\(LOG_(\w+), (\w+), &(?:{field}|\w+)\)", text)
    assert {name: kind for kind, name, _, _ in logs} == {
        name: kind.removesuffix("_t").upper() for name, (kind, _, _) in app.LOGS.items()}
    assert {name: (field, int(element or -1)) for _, name, field, element in logs if field} == {
        name: (field, element) for name, (_, field, element) in app.LOGS.items() if name != "health"}
    params = re.findall(r"PARAM_ADD\(PARAM_(\w+), (\w+), &wantedParams\.(\w+)\)", text)
    assert {name: field for _, name, field in params} == app.PARAMS
    assert {field: kind for kind, _, field in params} == {
        field: kind.removesuffix("_t").upper() for field, kind in PARAM_TYPES.items()}


def test_checksum_chains_the_entries():
    items = [Item("a", "x", 7), Item("a", "y", 1), Item("bb", "z", 2)]
    crc = 0
    for entry in (b"\x81a", b"\x07x", b"\x01y", b"\x80stop_a", b"\x81bb", b"\x02z", b"\x80stop_bb"):
        crc = zlib.crc32(crc.to_bytes(4, "little") + entry)
    toc = Toc(items, 0x0F)
    assert toc.crc == crc
    assert toc.answer(bytes([3])) == struct.pack("<BHI", 3, 3, crc)
    assert toc.answer(bytes([2, 2, 0])) == b"\x02\x02\x00\x02bb\x00z\x00"
    assert toc.answer(bytes([2, 3, 0])) == b"\x02"  # no such item
    assert toc.answer(b"") is None and toc.answer(b"\x02\x00") is None


def test_log_blocks_and_their_errors(bench):
    craft = bench()
    x = variable(craft, "acc.x", 7)
    assert craft.log(CREATE, 1, *x * 6) == 0  # 24 bytes
    assert craft.log(CREATE, 1, *x) == errno.EEXIST
    assert craft.log(APPEND, 1, *x) == errno.E2BIG
    assert craft.log(APPEND, 1, *variable(craft, "acc.y", 8)) == 0  # 26 bytes
    assert craft.log(APPEND, 2, *x) == errno.ENOENT
    assert craft.log(CREATE, 3, 7, 0xF0, 0x00) == errno.ENOENT  # no such variable
    assert craft.log(START, 9, 1) == errno.ENOENT
    assert craft.log(STOP, 9) == errno.ENOENT
    assert craft.log(DELETE, 9) == errno.ENOENT
    assert craft.log(0, 1) == errno.ENOEXEC  # version 1
    assert craft.log(RESET) == 0
    for number in range(16):
        assert craft.log(CREATE, number, *variable(craft, "sys.canfly", 1) * 8) == 0
    assert craft.log(CREATE, 17, *x) == errno.ENOMEM  # 16 blocks
    assert craft.log(APPEND, 0, *variable(craft, "sys.canfly", 1)) == errno.ENOMEM  # 128 variables
    assert craft.log(RESET) == 0 and not craft.firmware.log.blocks


def test_blocks_run_at_their_period(bench):
    craft = bench()
    craft.log(CREATE, 1, *variable(craft, "acc.z", 7))
    craft.log(CREATE, 2, *variable(craft, "pm.vbat", 8))
    craft.log(CREATE, 3, *variable(craft, "pm.state", 4))
    craft.log(START, 1, 1)
    craft.log(START, 2, 5)
    assert craft.take(LOG, 1, struct.pack("<BBH", 8, 3, 20))[0].data[2] == 0  # version 2: milliseconds
    packets = [p for p in craft.fly(1.0) if p.port == LOG]
    stamps = {n: [int.from_bytes(p.data[1:4], "little") for p in packets if p.data[0] == n] for n in (1, 2, 3)}
    assert [len(stamps[n]) for n in (1, 2, 3)] == [100, 20, 50]
    assert [set(np.diff(stamps[n])) for n in (1, 2, 3)] == [{10}, {50}, {20}]
    assert struct.unpack("<f", packets[0].data[4:])[0] == pytest.approx(1.0, abs=0.2)
    craft.log(STOP, 1)
    craft.log(DELETE, 2)
    assert {p.data[0] for p in craft.fly(0.2) if p.port == LOG} == {3}


def test_time_stamps_have_24_bits(bench):
    craft = bench()
    craft.drone.ticks = (1 << 24) // 10 - 1
    craft.log(CREATE, 1, *variable(craft, "acc.z", 7))
    craft.log(START, 1, 1)
    stamps = [int.from_bytes(p.data[1:4], "little") for p in craft.fly(0.05) if p.port == LOG]
    assert [(b - a) % (1 << 24) for a, b in pairwise(stamps)] == [10] * (len(stamps) - 1)
    assert stamps[-1] < stamps[0] or stamps[0] < 100


@pytest.mark.parametrize("kind", LENGTHS)
def test_values_of_any_size_can_be_sent(kind):
    for value in (0.0, -1.0, 1e30, -1e30, np.nan, np.inf, 65536.0):
        assert len(encode(value, kind)) == LENGTHS[kind]


def test_quaternions_survive_compression():
    rng = np.random.default_rng(0)
    q = rng.normal(size=(200, 4))
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    back = decompress(np.array([compress(tuple(quaternion)) for quaternion in q]))
    assert np.abs(np.sum(q * back, axis=1)).min() > 0.9999


def test_parameters_and_their_errors(bench):
    craft = bench()
    ids = craft.firmware.param.toc.ids

    def number(name):
        return struct.pack("<H", ids[name])

    reply = craft.take(PARAM, 1, number("pm.lowVoltage"))[0]
    assert reply.data == number("pm.lowVoltage") + b"\0" + struct.pack("<f", 3.2)
    missing = struct.pack("<H", 999)
    assert craft.take(PARAM, 1, missing)[0].data == missing + bytes([errno.ENOENT])
    assert craft.take(PARAM, 2, missing + b"\1")[0].data == missing + bytes([errno.ENOENT])
    assert craft.take(PARAM, 2, number("deck.bcFlow2") + b"\0") == []  # read-only: the firmware says nothing
    assert craft.firmware.param.values["deck.bcFlow2"] == 1
    for command in (7, 2):  # extended type
        assert craft.take(PARAM, 3, bytes([command]) + missing)[0].data[3] == errno.ENOENT
    assert craft.take(PARAM, 3, bytes([7]) + number("pm.lowVoltage"))[0].data[3:] == b"\0\1"
    request = number("pm.lowVoltage") + struct.pack("<f", 3.4)
    assert craft.take(PARAM, 2, request)[0].data == request
    default = craft.take(PARAM, 3, bytes([8]) + number("pm.lowVoltage"))[0].data[3:]
    assert default == b"\0" + struct.pack("<f", 3.2)
    assert craft.take(PARAM, 3, bytes([3]) + number("pm.lowVoltage"))[0].data[3:] == b"\0"  # stored
    state = craft.take(PARAM, 3, bytes([4]) + number("pm.lowVoltage"))[0].data[3:]
    assert state == b"\1" + struct.pack("<ff", 3.2, 3.4)
    assert craft.take(PARAM, 3, bytes([5]) + number("pm.lowVoltage"))[0].data[3:] == b"\0"  # cleared
    by_name = b"pm\0lowVoltage\0"
    for kind, value, code in ((6, struct.pack("<f", 3.3), 0), (8, b"\1", errno.EINVAL)):
        answer, = craft.take(PARAM, 3, b"\0" + by_name + bytes([kind]) + value)
        assert answer.data == b"\0" + by_name + bytes([code])
    assert craft.firmware.param.values["pm.lowVoltage"] == pytest.approx(3.3)
    assert craft.take(PARAM, 3, b"\0pm\0nothing\0\6" + bytes(4))[0].data[-1] == errno.ENOENT
    assert craft.take(PARAM, 3, b"\0deck\0bcAI\0\x08\1")[0].data[-1] == errno.EACCES


def test_the_app_puts_parameters_right(bench):
    craft = bench()
    number = struct.pack("<H", craft.firmware.param.toc.ids["airtouch.pFa"])
    craft.take(PARAM, 2, number + struct.pack("<f", 7.0))
    value, = struct.unpack("<f", craft.take(PARAM, 1, number)[0].data[3:])
    assert value == pytest.approx(0.5)
    craft.fly(0.02)
    assert craft.drone.app.read("badParam") == 1
    assert craft.drone.app.read("health") & 16
    craft.take(PARAM, 2, number + struct.pack("<f", 1e-4))
    assert struct.unpack("<f", craft.take(PARAM, 1, number)[0].data[3:])[0] == pytest.approx(1e-4)


def test_there_is_no_memory(bench):
    craft = bench()
    assert craft.take(MEMORY, 0, [1])[0].data == b"\1\0"
    assert craft.take(MEMORY, 1, struct.pack("<BIB", 3, 0, 8))[0].data[5] == errno.EIO
