"""Packets: the CRC is the published one, and no packet is larger than CPX carries."""

import binascii
import re
import struct
from pathlib import Path

import numpy as np
import pytest

from airtouch.kernels.app_core import DETECTORS, HEALTH, LINK, AppCore, Gap8Core

MODEL = Path(__file__).parents[3] / "gap8" / "model" / "airtouch_stream.h"

STEP = {"acc": (0.0, 0.0, 9.81), "gyro": (0.0, 0.0, 0.0), "pwm": (40000.0,) * 4}


def packets_of(detector, steps):
    app = AppCore({"detector": detector}, have_gap8=True)
    gap8, packets, replies = Gap8Core(), [], []
    for _ in range(steps):
        app.step(**STEP)
        for packet in app.packets():
            packets.append(packet)
            replies.append(gap8.take(packet))
            app.receive(replies[-1])
    return packets, replies


@pytest.mark.parametrize("detector", [2, 3])
def test_packets_fit_and_end_with_the_published_crc(detector):
    packets, replies = packets_of(detector, 700)
    assert len(packets) > 400
    for packet in packets + replies:
        assert 10 <= len(packet) <= 98
        assert packet[0] == 0xA1 and packet[2] == len(packet)
        assert int.from_bytes(packet[-2:], "little") == binascii.crc_hqx(packet[:-2], 0xFFFF)


def test_a_sample_is_sent_once_where_nothing_is_lost():
    packets, _ = packets_of(2, 700)
    feature_packets = [packet for packet in packets if packet[1] == 2]
    assert max(packet[10] for packet in feature_packets[60:]) == 1  # count


def test_any_bytes_change_nothing():
    rng = np.random.default_rng(0)
    app, gap8 = AppCore({"detector": 2}, have_gap8=True), Gap8Core()
    app.step(**STEP)
    for _ in range(20_000):
        junk = rng.bytes(int(rng.integers(0, 130)))
        if len(junk) > 3 and rng.random() < 0.5:
            junk = bytes([0xA1, int(rng.integers(0, 6)), len(junk) & 255]) + junk[3:]
        assert gap8.take(junk) == b""
        app.receive(junk)
    for junk in (b"", bytes(65_535), bytes(70_000)):
        assert gap8.take(junk) == b""
        app.receive(junk)
    app.step(**STEP)
    assert app.log.answers == 0


def result(session, sequence, expected, flags):
    """A RESULT without answers, as host/docs/link.md lays it out."""
    body = struct.pack("<BBBBI", 0xA1, 3, 16, session, sequence) + struct.pack("<IBB", expected, flags, 0)
    return body + struct.pack("<H", binascii.crc_hqx(body, 0xFFFF))


def test_another_model_on_the_gap8_is_refused_and_said():
    app = AppCore({"detector": 2}, have_gap8=True)
    requests = 0
    for _ in range(500):
        app.step(**STEP)
        for packet in app.packets():
            assert packet[1] == 1, "nothing but a reset is sent to a GAP8 with another model"
            requests += 1
            app.receive(result(packet[3], int.from_bytes(packet[4:8], "little"), 0, 8))
    assert LINK[app.log.link] == "refused" and app.log.health & HEALTH["model refused"]
    assert requests <= 6, "once a second"
    assert DETECTORS[app.log.detector] == "best" and app.log.answers > 0, "the STM32 does it"


def test_the_layout_is_the_one_that_is_documented():
    app, gap8 = AppCore({"detector": 2}, have_gap8=True), Gap8Core()
    app.step(**STEP)
    (reset,) = app.packets()
    version, kind, length, session, _, nonce, detector = struct.unpack("<BBBBIIB", reset[:13])
    assert (version, kind, length, nonce, detector) == (0xA1, 1, len(reset), 1, 1) and session > 0
    assert reset[13:21].hex() == re.search(r'STREAM_SHA256 "(\w{16})', MODEL.read_text())[1]
    answer = gap8.take(reset)
    assert answer == result(session, 1, 0, 16 | 4)
    app.receive(answer)
    app.step(**STEP)
    (features,) = app.packets()
    assert struct.unpack("<BBBBIHB", features[:11]) == (0xA1, 2, 10 + 3 + 2 * 12, session, 0, 0, 2)
    beat = gap8.heartbeat(1234)
    assert struct.unpack("<BBBBIIIIIIBB", beat[:30])[1:] == (4, 40, session, 0, 1234, 0, 0, 0, 0, 1, 16 | 4)
