"""The process that lands the drone when the flying one is gone, over real UDP with cflib's own driver."""

import os
import signal
import socket
import struct
import subprocess
import sys
import time

import pytest

from airtouch.crazyflie import guard

LAND_HEADER = 0x8C


@pytest.fixture
def drone():
    """A socket that takes the drone's place."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as served:
        served.bind(("127.0.0.1", 0))
        served.settimeout(15.0)
        yield served


def uri(drone):
    return f"udp://127.0.0.1:{drone.getsockname()[1]}"


def heard(drone, timeout):
    drone.settimeout(timeout)
    try:
        return drone.recvfrom(64)
    except TimeoutError:
        return None, None


FLYER = """
import sys, time
from airtouch.crazyflie.guard import guarding
with guarding(sys.argv[1], 0.25, 4.0) as watch:
    print("flying", flush=True)
    if sys.argv[2] == "lands":
        watch.landed = True
    elif sys.argv[2] == "raises":
        raise RuntimeError("a bug")
    else:
        time.sleep(60)
"""


def flyer(drone, how):
    process = subprocess.Popen([sys.executable, "-c", FLYER, uri(drone), how], stdout=subprocess.PIPE,
                               stderr=subprocess.DEVNULL, text=True)
    assert process.stdout.readline() == "flying\n"
    return process


@pytest.mark.parametrize("how", ["is killed", "raises"])
def test_the_drone_is_landed_when_its_pilot_dies(drone, how):
    process = flyer(drone, how)
    if how == "is killed":
        os.kill(process.pid, signal.SIGKILL)
    process.wait()
    data, sender = heard(drone, 15.0)
    command, _, height, _, keep_heading, seconds = struct.unpack("<BBff?f", data[1:])
    assert (data[0], command, height, keep_heading, seconds) == (LAND_HEADER, 8, 0.25, True, 4.0)
    assert heard(drone, 5.0)[0] == data  # it is not answered, so it comes again
    drone.sendto(bytes([LAND_HEADER, 8, 0, 0, 0]), sender)
    time.sleep(0.3)
    while heard(drone, 0.05)[0]:
        pass
    assert heard(drone, 0.6)[0] is None  # answered: it is silent


def test_a_pilot_that_landed_is_left_alone(drone):
    process = flyer(drone, "lands")
    assert process.wait(timeout=15.0) == 0
    assert heard(drone, 0.5)[0] is None


def test_it_gives_up_in_the_end(drone):
    began = time.monotonic()
    assert not guard.land(uri(drone), 0.0, 2.0, patience_s=0.7)
    assert 0.5 < time.monotonic() - began < 10.0
