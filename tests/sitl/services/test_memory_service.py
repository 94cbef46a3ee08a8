"""Answers on the memory port as cflib reads them: a drone without memories."""

import errno
import struct

import pytest

from airtouch.sitl.services import memory_service
from airtouch.sitl.services.packet import MEMORY, Packet


def answer(channel, data):
    replies = memory_service.take(Packet(MEMORY, channel, bytes(data)))
    assert all((r.port, r.channel) == (MEMORY, channel) for r in replies)
    return [bytes(r.data) for r in replies]


def test_the_count_is_zero():
    assert answer(0, [1]) == [bytes([1, 0])]


def test_the_description_of_a_memory_is_empty():
    """cflib unpacks number, type, size and address: 15 bytes in all with the command."""
    reply, = answer(0, [2, 5])
    assert struct.unpack("<BBBI8s", reply) == (2, 5, 0, 0, bytes(8))


@pytest.mark.parametrize("channel", [1, 2])
def test_reads_and_writes_fail_with_their_address(channel):
    request = struct.pack("<BI", 3, 0x01020304)
    assert answer(channel, request + b"rest") == [request + bytes([errno.EIO])]


@pytest.mark.parametrize("channel, data", [(0, []), (0, [2]), (0, [9]), (1, [1, 2, 3, 4]), (2, []),
                                           (3, [1, 2, 3, 4, 5])])
def test_packets_cut_short_and_unknown_ones_get_no_answer(channel, data):
    assert answer(channel, data) == []
