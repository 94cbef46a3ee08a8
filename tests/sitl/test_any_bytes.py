"""Any bytes on its socket: it answers the next client as if nothing had been."""

import contextlib
import socket

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from airtouch.sitl import Server, serve
from airtouch.sitl.services.packet import MOST_DATA, Packet, parse
from patience import HANG_S

ECHO = bytes([15 << 4 | 0x0C]) + b"are you there"
PACKETS = st.lists(st.tuples(st.integers(0, 15), st.integers(0, 3), st.integers(0, 15),
                             st.binary(max_size=MOST_DATA)), min_size=1, max_size=20)
ASK_S = 0.2  #: then it is asked again
server = None


@settings(max_examples=150, deadline=None, suppress_health_check=list(HealthCheck))
@given(PACKETS)
def test_no_packet_breaks_the_firmware(packets):
    global server
    server = server or Server("hover", port=0)
    firmware = server.firmware
    for port, channel, first, data in packets:
        # a plausible first byte, so that commands are reached
        for bytes_ in (data, bytes([first]) + data[1:]):
            for answer in firmware.take(Packet(port, channel, bytes_)):
                assert len(answer.data) <= MOST_DATA
                assert parse(answer.to_bytes()) is not None
    for packet in [p for _ in range(3) for p in firmware.tick()]:
        assert len(packet.data) <= MOST_DATA
    assert firmware.take(Packet(15, 0, b"here")) == [Packet(15, 0, b"here")]


def answered(client, datagram):
    """What comes back, asked until it does: the noise may have filled the socket's buffer."""
    for _ in range(int(HANG_S / ASK_S)):
        client.send(datagram)
        with contextlib.suppress(TimeoutError):
            return client.recv(2048)
    return None


def test_no_datagram_breaks_the_server():
    import random

    draw = random.Random(0)
    with serve("hover", port=0, speed=5.0) as virtual:
        def client():
            sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            sender.connect(("127.0.0.1", virtual.port))
            sender.settimeout(ASK_S)
            return sender

        for _ in range(5):
            with client() as noisy:  # gone before it gets its answers
                for _ in range(200):
                    noisy.send(draw.randbytes(draw.choice([0, 1, 2, 5, 14, 31, 32, 100, 1500])))
        with client() as polite:
            assert answered(polite, ECHO) == ECHO
            assert answered(polite, b"\xff")
