"""Log blocks over a link whose answers come in the order that the test chooses."""

import errno
import threading

import pytest

from airtouch.crazyflie import blocks
from airtouch.crazyflie.drone import Drone, drain
from airtouch.crazyflie.link import disconnect
from airtouch.errors import AirTouchError
from airtouch.sitl.packet import LOG, Packet

scripted_link = pytest.importorskip("scripted_link", reason="flying needs cflib")
APPEND, CREATE, SETTINGS, URI, Timer = (getattr(scripted_link, name) for name in (
    "APPEND", "CREATE", "SETTINGS", "URI", "Timer"))
PATIENCE_S = 60.0  #: for what happens at once, on however busy a machine
SLOW = 200  #: turns; the first log packet then comes long after every answer


@pytest.fixture
def link(monkeypatch):
    made = scripted_link.ScriptedLink()
    monkeypatch.setattr("cflib.crtp.CLASSES", [lambda: made])
    monkeypatch.setattr("cflib.crazyflie.Timer", Timer)
    monkeypatch.setattr("airtouch.crazyflie.link.FIRST_S", PATIENCE_S)
    monkeypatch.setattr("airtouch.crazyflie.link.NEXT_S", PATIENCE_S)
    return made


@pytest.fixture
def drone(link):
    made = Drone(URI, patience_s=PATIENCE_S)
    yield made
    made.close()


def full(name, count=26):
    """A block of so many bytes, in packets of nine variables."""
    return blocks.Block(name, 10, (("sys.canfly", "uint8_t"),) * count)


def is_setting(packet, command):
    return (packet.port, packet.channel) == (LOG, SETTINGS) and packet.data[0] == command


def test_an_answer_about_another_block_refuses_nothing(link, drone):
    drone.start(blocks.MOTION)
    number = link.settings(CREATE)[0][1]

    def stale_first(packet, answers):
        late = [Packet(LOG, SETTINGS, bytes([APPEND, number, errno.E2BIG]))] if is_setting(packet, CREATE) else []
        return late + answers, []

    link.script, link.turns = stale_first, SLOW
    drone.start(blocks.STATE)
    assert len(link.settings(CREATE)) == 2  # one for each block: the second was not given up


def test_an_answer_to_a_repeated_packet_refuses_nothing(link, drone):
    link.script = lambda packet, answers: ([], answers) if is_setting(packet, APPEND) else (answers, [])
    link.turns = SLOW
    drone.start(blocks.MOTION)
    (asked,) = link.settings(CREATE)
    assert link.settings(APPEND)[0] == link.settings(APPEND)[1]  # the answer was late, so it was repeated
    assert asked[1] in link.firmware.log.blocks


def test_what_was_answered_in_time_is_not_repeated(link, drone):
    drone.start(full("three packets"))
    assert len(link.settings(APPEND)) == 2
    for timer in list(Timer.started):
        timer.expire()
    assert len(link.settings(APPEND)) == 2


def test_a_refusal_says_why(link, drone, monkeypatch):
    monkeypatch.setattr("cflib.crazyflie.log.Log.MAX_VARIABLES", 1000)  # so that it is the drone that refuses
    for number in range(4):
        drone.start(full(f"full{number}"))
    with pytest.raises(AirTouchError, match="log block one more rejected: .*memory for log blocks is full"):
        drone.start(full("one more"))


def test_a_block_whose_number_is_taken_gets_another(link, drone):
    drone.start(blocks.MOTION)
    number = link.settings(CREATE)[0][1]
    link.firmware.log.blocks[number + 1] = link.firmware.log.blocks[number]
    drone.start(blocks.STATE)
    assert [data[1] for data in link.settings(CREATE)] == [number, number + 1, number + 2]


def test_blocks_are_asked_for_again_however_often_the_drone_forgets_them(link, drone):
    for block in (blocks.MOTION, blocks.STATE):
        drone.start(block)
    for _ in range(20):  # cflib counts 16 blocks and 128 variables at most
        link.firmware.log.reset()
        drone.revive()
        drone._reviving.join(PATIENCE_S)
        assert len(link.firmware.log.blocks) == 2
    drain(drone.samples)
    assert {drone.samples.get(timeout=PATIENCE_S).block for _ in range(12)} == {"motion", "state"}


def test_the_link_may_go_while_a_command_is_sent(link, drone):
    closed = threading.Event()

    def close():
        disconnect(drone._cf)
        closed.set()

    def break_off():
        link.about_to_send = lambda: None
        threading.Thread(target=close, daemon=True).start()
        assert closed.wait(PATIENCE_S)

    link.about_to_send = break_off
    drone._cf.log.reset()
    assert closed.is_set()
    drone.ping()  # nobody holds the sender's lock
    assert drone._cf.link.receive_packet(0) is None  # as a receiver that saw the link before it went


def test_answers_come_while_their_packet_is_repeated():
    from airtouch.crazyflie.cflib_crazyflie import Unanswered

    table, old, new = Unanswered(), Timer(0.2, lambda: pytest.fail("repeated")), Timer(0.2, lambda: None)
    assert not table["answered"]
    del table["answered"]
    table["same"] = old
    table["same"] = new
    old.expire()  # its packet counts as answered with the newer one's answer
    assert table["same"] is new and list(table) == ["same"]


def test_a_block_on_a_dead_link_is_told_in_plain_words(link, drone):
    disconnect(drone._cf)
    with pytest.raises(AirTouchError, match="log block motion: the link is closed"):
        drone.start(blocks.MOTION)
