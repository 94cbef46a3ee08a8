"""The memory port. There are no memories; requests for one get the firmware's error (crtp_mem.c)."""

import errno

from airtouch.sitl.services.packet import MEMORY, Packet

INFO_CHANNEL, READ_CHANNEL, WRITE_CHANNEL = 0, 1, 2
GET_COUNT, GET_INFO = 1, 2


def take(packet: Packet) -> list[Packet]:
    """The answers to a packet on the memory port."""
    data = packet.data
    if packet.channel == INFO_CHANNEL:
        if data[:1] == bytes([GET_COUNT]):
            return [Packet(MEMORY, INFO_CHANNEL, bytes([GET_COUNT, 0]))]
        if data[:1] == bytes([GET_INFO]) and len(data) > 1:
            return [Packet(MEMORY, INFO_CHANNEL, data[:2] + bytes(13))]
    elif packet.channel in (READ_CHANNEL, WRITE_CHANNEL) and len(data) >= 5:
        return [Packet(MEMORY, packet.channel, data[:5] + bytes([errno.EIO]))]
    return []
