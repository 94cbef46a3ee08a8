"""Connecting where nobody answers."""

import socket
import subprocess
import sys
import threading
import time

import pytest

pytest.importorskip("cflib", reason="flying needs cflib")

from airtouch.cli.drone.collect import waiting
from airtouch.crazyflie.connection.drone import Drone
from airtouch.errors import AirTouchError


@pytest.fixture
def silent():
    """URI of a port that takes packets and never answers."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as port:
        port.bind(("127.0.0.1", 0))
        yield f"udp://127.0.0.1:{port.getsockname()[1]}"


def test_within_three_seconds_it_is_said_that_nobody_answers(silent, capsys):
    stop, times, began_s = threading.Event(), [], time.monotonic()
    report = waiting(silent, stop)

    def unanswered(reason):
        times.append(time.monotonic() - began_s)
        report(reason)

    with pytest.raises(AirTouchError, match="no connection"):
        Drone(silent, patience_s=3.0, unanswered=unanswered)
    message = capsys.readouterr().err
    assert times[0] < 3.0 and len(times) > 1
    assert message.count("\n") == 1
    assert f"{silent}: no answer yet" in message and "is `airtouch sitl` running" in message


def test_a_stop_ends_the_attempts(silent):
    stop = threading.Event()
    stop.set()
    with pytest.raises(AirTouchError, match="stopped before anybody answered"):
        Drone(silent, patience_s=30.0, unanswered=waiting(silent, stop))


def test_a_monitor_without_a_drone_waits_for_no_import_of_the_simulator(silent):
    """The simulator takes seconds to import, and the remedy is due within three."""
    script = f"""import sys
from airtouch.cli import airtouch
from airtouch.crazyflie.connection import link
def say_imports(uri):
    print(*sys.modules.keys() & {{"numba", "airtouch.simulation"}})
    sys.exit()
link.remedy = say_imports
airtouch(["monitor", "--uri", "{silent}"])"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.strip() == "" and "connecting" in done.stderr
