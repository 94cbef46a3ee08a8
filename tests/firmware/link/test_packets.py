"""The parser of both processors: a packet with a right CRC that says anything is read within its bytes, or refused."""

import binascii
import re
import struct
import subprocess
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from patience import HANG_S
from sanitized import build

FEATURES, RESULT = 2, 3


@pytest.fixture(scope="module")
def driver(tmp_path_factory):
    """A function from words for packet_driver.c to (packets read, packets refused)."""
    program = build(Path(__file__).with_name("packet_driver.c"), tmp_path_factory.mktemp("packets") / "driver")

    def run(*words):
        process = subprocess.run([program, *words], capture_output=True, text=True, timeout=HANG_S)
        assert process.returncode == 0, process.stderr[-3000:]
        return tuple(map(int, re.fullmatch(r"(\d+) packets read, (\d+) refused\n", process.stdout).groups()))

    return run


def packet(kind, body, session=1, sequence=0):
    """A packet of host/docs/link.md around any body, with the right length and CRC."""
    data = struct.pack("<BBBBI", 0xA1, kind, (10 + len(body)) & 255, session, sequence) + body
    return data + struct.pack("<H", binascii.crc_hqx(data, 0xFFFF))


def is_packet(data):
    """Whether host/docs/link.md has such a packet."""
    if not 10 <= len(data) <= 98 or data[0] != 0xA1 or data[2] != len(data):
        return False
    if int.from_bytes(data[-2:], "little") != binascii.crc_hqx(data[:-2], 0xFFFF):
        return False
    kind, body = data[1], data[8:-2]
    if kind == FEATURES:
        return len(body) >= 3 and 1 <= body[2] <= 7 and len(body) == 3 + 12 * body[2]
    if kind == RESULT:
        return len(body) >= 6 and body[5] <= 7 and len(body) == 6 + 4 * body[5]
    return len(body) == {1: 13, 4: 30}.get(kind, -1)


def records(packets):
    return b"".join(bytes([is_packet(data), len(data)]) + data for data in packets)


@pytest.mark.parametrize("kind", range(6))
def test_a_packet_without_a_body_is_refused(driver, tmp_path, kind):
    empty = packet(kind, b"")
    assert len(empty) == 10
    (tmp_path / "one").write_bytes(records([empty]))
    assert driver(tmp_path / "one") == (0, 1)


def test_every_type_length_and_count_is_read_within_its_bytes(driver):
    accepted, rejected = driver("counts")
    # RESET and HEARTBEAT have no count, so each is met with all 256; FEATURES has 7 counts, RESULT 8.
    assert (accepted, rejected) == (2 * 256 + 7 + 8, 10 * 140 * 256 - (2 * 256 + 7 + 8))


def bodies(kind):
    """Any body; mostly one whose count byte is near what its length has room for."""
    at, each = (2, 12) if kind == FEATURES else (5, 4)

    def body(count, off, fill):
        return (fill * 20)[:at] + bytes([count]) + (fill * 20)[:max(0, each * count + off)]

    fitting = st.builds(body, st.integers(0, 9), st.sampled_from([0, 0, 0, -1, 1, -4, 4, -12, 12]),
                        st.binary(min_size=9, max_size=9))
    return st.one_of(st.binary(max_size=120), fitting)


PACKETS = st.one_of(
    st.integers(0, 6).flatmap(lambda kind: st.builds(packet, st.just(kind), bodies(kind), st.integers(0, 255),
                                                     st.integers(0, 2**32 - 1))),
    st.binary(max_size=140))


@settings(max_examples=30)
@given(packets=st.lists(PACKETS, min_size=20, max_size=100))
def test_packets_are_read_as_they_are_documented_and_no_byte_further(driver, tmp_path_factory, packets):
    file = tmp_path_factory.mktemp("drawn") / "packets"
    file.write_bytes(records(packets))
    valid = sum(map(is_packet, packets))
    assert driver(file) == (valid, len(packets) - valid)
