"""Unmodified cflib on a virtual Crazyflie, and the virtual Crazyflie without a network."""

import struct

import pytest

from airtouch.sitl import Server
from airtouch.sitl.services.packet import HIGH_LEVEL, LOG, Packet


@pytest.fixture(scope="session")
def cflib():
    crtp = pytest.importorskip("cflib.crtp")
    crtp.init_drivers()
    import cflib

    return cflib


class Bench:
    """The firmware without a network, flown as fast as it goes."""

    def __init__(self, server):
        self.server, self.firmware, self.drone = server, server.firmware, server.drone

    def take(self, port, channel, data):
        return self.firmware.take(Packet(port, channel, bytes(data)))

    def high_level(self, layout, *values):
        return self.take(HIGH_LEVEL, 0, struct.pack(layout, *values))[0].data[3]

    def take_off(self, height=0.5, seconds=1.5):
        assert self.high_level("<BBff?f", 7, 0, height, 0.0, True, seconds) == 0
        return self.fly(seconds + 1.0)

    def fly(self, seconds):
        """The packets that it sends meanwhile."""
        return [packet for _ in range(round(100 * seconds)) for packet in self.firmware.tick()]

    def log(self, command, *data):
        """The error code of a log command."""
        answer, = self.take(LOG, 1, bytes([command, *data]))
        assert answer.data[0] == command
        return answer.data[2]

    @property
    def height(self):
        return float(self.drone.row[19])


@pytest.fixture
def bench():
    """bench(scenario, ...): a Bench."""
    servers = []

    def make(scenario="hover", **settings):
        servers.append(Server(scenario, port=0, **settings))
        return Bench(servers[-1])

    yield make
    for open_server in servers:
        open_server.close()
