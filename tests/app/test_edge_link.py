"""Packets: the CRC is the published one, and no packet is larger than CPX carries."""

import binascii

import numpy as np
import pytest

from airtouch.kernels.app_core import AppCore, Gap8Core

STEP = {"acc": (0.0, 0.0, 9.81), "gyro": (0.0, 0.0, 0.0), "pwm": (40000.0,) * 4}


def packets_of(detector, steps):
    app = AppCore({"detector": detector}, have_gap8=True)
    gap8, sent, replies = Gap8Core(), [], []
    for _ in range(steps):
        app.step(**STEP)
        for packet in app.packets():
            sent.append(packet)
            replies.append(gap8.take(packet))
            app.receive(replies[-1])
    return sent, replies


@pytest.mark.parametrize("detector", [2, 3])
def test_packets_fit_and_end_with_the_published_crc(detector):
    sent, replies = packets_of(detector, 700)
    assert len(sent) > 400
    for packet in sent + replies:
        assert 10 <= len(packet) <= 98
        assert packet[0] == 0xA1 and packet[2] == len(packet)
        assert int.from_bytes(packet[-2:], "little") == binascii.crc_hqx(packet[:-2], 0xFFFF)


def test_a_sample_is_sent_once_where_nothing_is_lost():
    sent, _ = packets_of(2, 700)
    features = [packet for packet in sent if packet[1] == 2]
    assert max(packet[10] for packet in features[60:]) == 1  # count


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
    app.step(**STEP)
    assert app.log.answers == 0
