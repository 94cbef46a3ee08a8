"""collect against the virtual Crazyflie in a thread of its own, over UDP, in real time.

Only what needs sockets and processes is here; the rest flies in the drone's own time (test_collect_and_monitor).
Nothing here depends on how long a step takes: the limits are those after which a test counts as hung.
"""

import os
import signal
import subprocess
import sys
import time

import pytest
from click.testing import CliRunner

from airtouch import logs
from airtouch.cli import airtouch
from airtouch.crazyflie.connection import blocks
from airtouch.crazyflie.connection.drone import Drone
from airtouch.errors import AirTouchError
from airtouch.simulation.sensors import log_row
from airtouch.sitl import serve

pytest.importorskip("cflib", reason="flying needs cflib")
from missions import HOP

from patience import HANG_S

SPEED = 2.0  #: drone seconds a second


@pytest.fixture(scope="module")
def hop(tmp_path_factory):
    path = tmp_path_factory.mktemp("missions") / "hop.toml"
    path.write_text(HOP)
    return path


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    return tmp_path_factory.mktemp("tables")


def height(virtual):
    return virtual.drone.row[log_row.POSITION + 2]


def on_the_ground(virtual):
    """Whether it stands with its motors off."""
    row = virtual.drone.row
    return height(virtual) < 0.1 and not row[log_row.PWM:log_row.PWM + 4].any() and not virtual.drone.info() >> 7 & 1


def start(virtual, hop, cache, out):
    """`airtouch collect` as a process, in the air and with 100 rows on the disk."""
    code = "from airtouch.cli import main; main()"
    process = subprocess.Popen([sys.executable, "-c", code, "collect", "--uri", virtual.uri, "--mission", str(hop),
                                "--out", str(out), "--cache", str(cache), "--link-timeout", str(HANG_S)],
                               stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    part = out / "hop_0001.csv.gz.part"
    until(lambda: process.poll() is not None or height(virtual) > 0.3 and part.exists()
          and part.read_bytes().count(b"\n") > 150)
    assert process.poll() is None, process.communicate()[0]
    return process


def until(condition):
    end = time.monotonic() + HANG_S
    while not condition():
        assert time.monotonic() < end, "it did not happen"
        time.sleep(0.02)


def test_a_connection_is_made_through_losses(hop, cache, monkeypatch):
    monkeypatch.setattr("airtouch.crazyflie.connection.log_blocks.BLOCK_S", HANG_S)
    with serve(hop, port=0, speed=SPEED, faults=("loss=0.05,all",)) as virtual:
        drone = Drone(virtual.uri, cache, HANG_S)
        try:
            drone.start(blocks.MOTION)
            assert set(blocks.MOTION.names) <= drone.variables, "the whole table of contents has come"
        finally:
            drone.close()


def test_ctrl_c_lands_and_keeps_the_log(hop, cache, tmp_path):
    with serve(hop, port=0, speed=SPEED) as virtual:
        process = start(virtual, hop, cache, tmp_path)
        process.send_signal(signal.SIGINT)
        text = process.communicate(timeout=HANG_S)[0]
        assert process.returncode == 1 and "stopped by the user" in text, text
        until(lambda: on_the_ground(virtual))
    assert "stopped by the user" in logs.read(tmp_path / "hop_0001.csv.gz").meta["ended"]


def test_a_killed_process_leaves_its_rows_and_a_drone_that_lands(hop, cache, tmp_path):
    with serve(hop, port=0, speed=SPEED) as virtual:
        process = start(virtual, hop, cache, tmp_path)
        os.kill(process.pid, signal.SIGKILL)
        process.communicate()
        until(lambda: on_the_ground(virtual))
    result = CliRunner().invoke(airtouch, ["collect", "--recover", "--out", str(tmp_path)])
    assert result.exit_code == 0 and "recovered: " in result.output
    assert len(logs.read(tmp_path / "hop_0001.csv.gz")) > 100
    assert (tmp_path / "manifest.csv").read_text().splitlines()[1].startswith("hop_0001.csv.gz,messy,1,40mm,")


def test_nobody_at_the_address_is_one_line():
    with pytest.raises(AirTouchError, match="no connection: .*is `airtouch sitl` running"):
        Drone("udp://127.0.0.1:1", patience_s=0.5)
    with pytest.raises(AirTouchError, match="no connection"):
        Drone("nonsense", patience_s=0.5)
