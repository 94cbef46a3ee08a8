"""CRTP packets: one header byte (port and channel) and up to 30 bytes."""

from typing import NamedTuple

CONSOLE, PARAM, COMMANDER, MEMORY, LOG = 0, 2, 3, 4, 5
LOCALIZATION, GENERIC, HIGH_LEVEL, SUPERVISOR, PLATFORM, LINK = 6, 7, 8, 9, 13, 15
MOST_DATA = 30
Peer = tuple[str, int]  #: host and port of who a packet is to or from


class Packet(NamedTuple):
    """A packet. data: what the firmware calls p.data, without the header."""

    port: int
    channel: int
    data: bytes

    def to_bytes(self) -> bytes:
        """As one UDP datagram."""
        return bytes([self.port << 4 | 0x0C | self.channel]) + self.data[:MOST_DATA]


def parse(datagram: bytes) -> Packet | None:
    """The packet of a datagram; None for an empty or over-long one."""
    if not 1 <= len(datagram) <= MOST_DATA + 1:
        return None
    return Packet(datagram[0] >> 4, datagram[0] & 3, bytes(datagram[1:]))


def is_null(packet: Packet) -> bool:
    """Whether it is the empty packet with which clients look for drones."""
    return packet.port == LINK and packet.channel == 3
