"""Log blocks over a link whose answers come in the order that the test chooses."""

import errno
import threading
from unittest.mock import Mock

import pytest

from airtouch.crazyflie.connection import blocks
from airtouch.crazyflie.connection.drone import Drone, drain
from airtouch.crazyflie.connection.link import disconnect
from airtouch.errors import AirTouchError
from airtouch.sitl.services.packet import LOG, Packet

pytest.importorskip("cflib", reason="flying needs cflib")
from patience import HANG_S
from simulated_link import APPEND, CREATE, SETTINGS, URI, simulated


@pytest.fixture
def remote(monkeypatch):
    """A drone with its clock."""
    with simulated(monkeypatch) as virtual:
        yield virtual


@pytest.fixture
def drone(remote):
    client = Drone(URI)
    yield client
    client.close()


def full(name, count=26):
    """A block of so many bytes, in packets of nine variables."""
    return blocks.Block(name, 10, (("sys.canfly", "uint8_t"),) * count)


def is_setting(packet, command):
    return (packet.port, packet.channel) == (LOG, SETTINGS) and packet.data[0] == command


def test_an_answer_about_another_block_refuses_nothing(remote, drone):
    drone.start(blocks.MOTION)
    number = remote.settings(CREATE)[0][1]
    remote.delay(0.05)  # the block's first packet comes long after the answer

    def stale_first(packet, answers):
        late = [Packet(LOG, SETTINGS, bytes([APPEND, number, errno.E2BIG]))] if is_setting(packet, CREATE) else []
        return late + answers

    remote.script = stale_first
    drone.start(blocks.STATE)
    assert len(remote.settings(CREATE)) == 2  # one for each block: the second was not given up


def test_an_answer_to_a_repeated_packet_refuses_nothing(remote, drone):
    remote.delay(0.15)  # there and back 0.3 s, and cflib repeats after 0.2 s
    drone.start(blocks.MOTION)
    (number,) = {data[1] for data in remote.settings(CREATE)}
    assert len(remote.settings(CREATE)) == len(remote.settings(APPEND)) == 2
    assert number in remote.firmware.log.blocks


def test_what_was_answered_in_time_is_not_repeated(remote, drone):
    drone.start(full("three packets"))
    remote.clock.sleep(1.0)
    assert len(remote.settings(APPEND)) == 2


def test_a_refusal_says_why(remote, drone, monkeypatch):
    monkeypatch.setattr("cflib.crazyflie.log.Log.MAX_VARIABLES", 1000)  # so that it is the drone that refuses
    for number in range(4):
        drone.start(full(f"full{number}"))
    with pytest.raises(AirTouchError, match="log block one more rejected: .*memory for log blocks is full"):
        drone.start(full("one more"))


def test_a_block_whose_number_is_taken_gets_another(remote, drone):
    drone.start(blocks.MOTION)
    number = remote.settings(CREATE)[0][1]
    remote.firmware.log.blocks[number + 1] = remote.firmware.log.blocks[number]
    drone.start(blocks.STATE)
    assert [data[1] for data in remote.settings(CREATE)] == [number, number + 1, number + 2]


def test_blocks_are_asked_for_again_however_often_the_drone_forgets_them(remote, drone):
    for block in (blocks.MOTION, blocks.STATE):
        drone.start(block)
    for _ in range(20):  # cflib counts 16 blocks and 128 variables at most
        remote.firmware.log.reset()
        drone.revive()
        remote.clock.wait_for(lambda: not drone.reviving)
        assert len(remote.firmware.log.blocks) == 2
    drain(drone.samples)
    remote.clock.sleep(0.2)
    assert {sample.block for sample in drain(drone.samples)} == {"motion", "state"}


def test_the_link_may_go_while_a_command_is_sent(remote, drone):
    link_closed = threading.Event()

    def close():
        disconnect(drone.crazyflie)
        link_closed.set()

    def break_off():
        link.about_to_send = lambda: None
        threading.Thread(target=close, daemon=True).start()
        assert link_closed.wait(HANG_S)

    (link,) = remote.links
    link.about_to_send = break_off
    drone.crazyflie.log.reset()
    assert link_closed.is_set()
    drone.ping()  # nobody holds the sender's lock
    assert drone.crazyflie.link.receive_packet(0) is None  # as a receiver that saw the link before it went


def test_answers_come_while_their_packet_is_repeated():
    from airtouch.crazyflie.connection.cflib_crazyflie import Unanswered

    table, old, new = Unanswered(), Mock(), Mock()
    assert not table["answered"]
    del table["answered"]
    table["same"] = old
    table["same"] = new
    old.cancel.assert_called_once()  # its packet counts as answered with the newer one's answer
    assert table["same"] is new and list(table) == ["same"]


def test_a_block_on_a_dead_link_is_told_in_plain_words(remote, drone):
    disconnect(drone.crazyflie)
    with pytest.raises(AirTouchError, match="log block motion: the link is closed"):
        drone.start(blocks.MOTION)
