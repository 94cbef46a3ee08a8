"""The process that lands the drone when the flying one is gone, over real UDP with cflib's own driver."""

import os
import signal
import socket
import struct
import subprocess
import sys
from unittest.mock import Mock

import pytest

from airtouch.crazyflie import guard
from patience import HANG_S

LAND_HEADER = 0x8C


@pytest.fixture
def drone():
    """A socket that takes the drone's place."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as served:
        served.bind(("127.0.0.1", 0))
        served.settimeout(HANG_S)
        yield served


def uri(drone):
    return f"udp://127.0.0.1:{drone.getsockname()[1]}"


FLYER = f"""
import sys, time
from airtouch.crazyflie.guard import guarding
with guarding(sys.argv[1], 0.25, 4.0) as watch:
    if sys.argv[2] != "never flies":
        watch.tell(True)
    if sys.argv[2] == "has landed":
        watch.tell(False)
    print("flying", flush=True)
    if sys.argv[2] == "lands":
        watch.tell(False)
    elif sys.argv[2] == "raises":
        raise RuntimeError("a bug")
    else:
        time.sleep({HANG_S})
"""


def flyer(drone, ending):
    process = subprocess.Popen([sys.executable, "-c", FLYER, uri(drone), ending], stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "flying\n"
    return process


@pytest.mark.parametrize("ending", ["is killed", "raises"])
def test_the_drone_is_landed_when_its_pilot_dies(drone, ending):
    process = flyer(drone, ending)
    if ending == "is killed":
        os.kill(process.pid, signal.SIGKILL)
    process.wait()
    data, sender = drone.recvfrom(64)
    command, _, height, _, keep_heading, seconds = struct.unpack("<BBff?f", data[1:])
    assert (data[0], command, height, keep_heading, seconds) == (LAND_HEADER, 8, 0.25, True, 4.0)
    assert drone.recv(64) == data  # it is not answered, so it comes again
    drone.sendto(bytes([LAND_HEADER, 8, 0, 0, 0]), sender)
    assert "the flying process is gone; landing" in process.stderr.read()  # answered: the guard has ended


def test_a_pilot_that_landed_is_left_alone(drone):
    process = flyer(drone, "lands")
    assert process.wait(HANG_S) == 0 and process.stderr.read() == ""  # the guard has ended too
    drone.setblocking(False)
    with pytest.raises(BlockingIOError):
        drone.recv(64)


@pytest.mark.parametrize("ending", ["never flies", "has landed"])
def test_a_drone_that_stands_is_left_alone_when_its_pilot_dies(drone, ending):
    process = flyer(drone, ending)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    assert process.stderr.read() == ""  # the guard has ended
    drone.setblocking(False)
    with pytest.raises(BlockingIOError):
        drone.recv(64)


def test_it_gives_up_in_the_end(monkeypatch):
    clock = Mock(now=0.0)
    clock.monotonic, clock.sleep = (lambda: clock.now), (lambda seconds: setattr(clock, "now", clock.now + seconds))
    link = Mock(receive_packet=clock.sleep)
    monkeypatch.setattr(guard, "time", clock)
    monkeypatch.setattr("cflib.crtp.get_link_driver", lambda *_: link)
    assert not guard.land("udp://127.0.0.1:1", 0.0, 2.0, patience_s=3.0)
    assert 3.0 <= clock.now < 3.5 and link.send_packet.call_count == 8  # one in 0.4 s


def test_help_says_what_it_is_for_and_how_to_use_it():
    said = subprocess.run([sys.executable, "-m", "airtouch.crazyflie.guard", "--help"], stdin=subprocess.DEVNULL,
                          capture_output=True, text=True, check=True).stdout
    for words in ("lands the drone if the flying process dies", "`airtouch collect` starts it", "uri", "height",
                  "m: where it took off", "guard radio://0/80/2M/E7E7E7E7E7 0 3"):
        assert words in said
    wrong = subprocess.run([sys.executable, "-m", "airtouch.crazyflie.guard", "udp://127.0.0.1:1", "low", "3"],
                           stdin=subprocess.DEVNULL, capture_output=True, text=True)
    assert wrong.returncode == 2 and "height: invalid float value: 'low'" in wrong.stderr


def test_a_height_below_the_start_is_a_height_and_no_option(drone):
    with guard.guarding(uri(drone), -1e-05, 3.0) as watch:
        watch.tell(True)  # it ends without a landing, as a killed one does
    data, sender = drone.recvfrom(64)
    drone.sendto(bytes([LAND_HEADER, 8, 0, 0, 0]), sender)
    assert struct.unpack("<BBff?f", data[1:])[2] == pytest.approx(-1e-05)
