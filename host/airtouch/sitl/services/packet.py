"""CRTP packets: one header byte (port and channel) and up to 30 bytes."""

from typing import NamedTuple

CONSOLE, PARAM, COMMANDER, MEMORY, LOG = 0, 2, 3, 4, 5
LOCALIZATION, GENERIC, HIGH_LEVEL, SUPERVISOR, PLATFORM, LINK = 6, 7, 8, 9, 13, 15
MOST_DATA = 30
Peer = tuple[str, int]  #: host and port of a client


class Packet(NamedTuple):
    """A packet. data: its bytes without the header, p.data in the firmware."""

    port: int
    channel: int
    data: bytes

    def to_bytes(self) -> bytes:
        """The packet as a UDP datagram."""
        return bytes([self.port << 4 | 0x0C | self.channel]) + self.data[:MOST_DATA]


def parse(datagram: bytes) -> Packet | None:
    """The packet in a datagram; None if it is empty or too long."""
    if not 1 <= len(datagram) <= MOST_DATA + 1:
        return None
    return Packet(datagram[0] >> 4, datagram[0] & 3, bytes(datagram[1:]))


def is_null(packet: Packet) -> bool:
    """True for the empty packet with which clients search for drones."""
    return packet.port == LINK and packet.channel == 3
