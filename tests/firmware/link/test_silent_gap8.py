"""A GAP8 that falls silent: the STM32 does its work, asks after it ever less often, and finds it again."""

import binascii
import struct

import numpy as np
import pytest

from airtouch.kernels.app_core import DETECTORS, LINK, AppCore, Gap8Core
from firmware.drone import Drone

HOVER = (0.0, 0.0, 9.81), (0.0, 0.0, 0.0), (40_000.0,) * 4
HISTORY = 288  # steps of which the samples are kept
LONGEST = 320  # steps from one packet to the next, however long the GAP8 is silent
BEATS = 1000  # steps for which a GAP8 that is not spoken to goes on with heartbeats
WINDOW = 40  # steps in which a whole window is sent again


def test_a_gap8_that_never_answers_leaves_the_stm32_to_do_it(flight, best_edges):
    drone = Drone("best-gap8", answers=False)
    assert drone.fly(flight, stop=24) == [] and np.isnan(drone.app.log.probability)
    assert drone.health == {"link down"}
    drone = Drone("best-gap8", answers=False)
    assert drone.fly(flight) == best_edges
    assert drone.health == {"link down", "no GAP8"} and DETECTORS[drone.app.log.detector] == "best"
    assert drone.sent <= len(tries(drone.steps)) + 1


def test_paper_without_answers_knows_no_probability(flight):
    drone = Drone("paper-gap8", answers=False)
    assert drone.fly(flight) == [] and np.isnan(drone.app.log.probability) and drone.health == {"link down"}


def test_the_gap8_loses_power_and_the_link_for_five_seconds(flight):
    _, acc, gyro, pwm = flight
    drone, reference = Drone("best-gap8", beats=True), Drone("best")
    logits, link, shown_logits, lag = [], [], [], []
    for i in range(1700):
        drone.answers = drone.beats = not 800 <= i < 1300
        if i == 500:
            drone.gap8.reset()
        drone.step(acc[i], gyro[i], pwm[i])
        link.append(LINK[drone.app.log.link])
        shown_logits.append(list(drone.app.log.logit))
        lag.append(drone.app.log.lag)
        reference.step(acc[i], gyro[i], pwm[i])
        logits.append(list(reference.app.log.logit))
    assert drone.app.log.gap8Resets == 1
    back = [link.index("up", at) - at for at in (502, 1300)]
    assert back[0] <= WINDOW, "a whole window of the past is sent again within 40 steps"
    assert back[1] <= 50 + WINDOW, "after its next heartbeat"
    assert link[852:1300] == ["down"] * 448, "the log says that the link is down"
    for first, last in ((300, 500), (600, 800), (1400, 1700)):
        assert shown_logits[first:last] == logits[first - 1:last - 1] and set(lag[first:last]) == {0}
    assert shown_logits[870:1300] == logits[870:1300], "the STM32 runs the network meanwhile"
    assert drone.health == set()


def test_a_full_queue_is_logged_and_loses_nothing(flight):
    _, acc, gyro, pwm = flight
    drone = Drone("best-gap8")
    drone.fly(flight, stop=400)
    for i in range(400, 420):
        drone.app.step(acc[i], gyro[i], pwm[i])
        assert list(drone.app.packets(accepted=False)) == []
    assert drone.app.log.dropped >= 1 and "packet dropped" in drone.health
    for i in range(420, 460):
        drone.step(acc[i], gyro[i], pwm[i])
    assert drone.app.log.lost == 0 and drone.app.log.lag == 0


def hover(drone, steps):
    """The steps at which packets were sent, counted from here."""
    at = []
    for i in range(steps):
        before = drone.sent
        drone.step(*HOVER)
        at += [i] * (drone.sent - before)
    return at


def tries(steps):
    """Steps at which a GAP8 that is silent from step 0 on is asked, as host/docs/link.md says: ten times a second
    while its silence costs nothing, then ever less often."""
    at = list(range(0, HISTORY + 10, 10))
    for wait in (20, 40, 80, 160, *[LONGEST] * (steps // LONGEST)):
        at.append(at[-1] + wait)
    return [i for i in at if i < steps]


def test_a_gap8_that_is_not_there_is_asked_ever_less_often():
    steps = hover(Drone("best-gap8", answers=False), 6000)
    expected = tries(6000)
    assert len(steps) == len(expected) == 50  # in a minute
    np.testing.assert_allclose(steps, expected, atol=2)


@pytest.mark.parametrize("detector", ["best-gap8", "paper-gap8", "paper-stream-gap8"])
def test_a_gap8_that_dies_in_flight_is_asked_ever_less_often(detector):
    drone = Drone(detector, beats=True)
    hover(drone, 700)
    assert LINK[drone.app.log.link] == "up"
    drone.answers = drone.beats = False
    steps = np.array(hover(drone, 6000))
    assert (steps < 15).sum() <= 10 and (steps >= HISTORY + 20).sum() <= 22
    assert np.diff(steps).max() <= LONGEST


@pytest.mark.parametrize("beats", [True, False], ids=["heartbeats", "no-heartbeat"])
@pytest.mark.parametrize("reset", [True, False], ids=["reset", "same-gap8"])
@pytest.mark.parametrize("detector", ["best-gap8", "paper-gap8", "paper-stream-gap8"])
def test_a_gap8_that_returns_is_found_in_a_bounded_time(detector, reset, beats):
    rng = np.random.default_rng(0)
    drone = Drone(detector, beats=beats)
    hover(drone, 700)
    slowest = {True: 0, False: 0}  # by whether heartbeats bring the STM32 back
    for silence in (30, 150, 287, *rng.integers(300, 3000, 12)):
        assert LINK[drone.app.log.link] == "up"
        drone.answers = drone.beats = False
        hover(drone, int(silence))
        if reset:
            drone.gap8.reset()
        drone.answers, drone.beats = True, beats
        for waited in range(1000):
            drone.step(*HOVER)
            if LINK[drone.app.log.link] == "up" and drone.app.log.lag == 0 and waited > 0:
                break
        beating = beats and not reset and silence < BEATS
        slowest[beating] = max(slowest[beating], waited)
        hover(drone, 60)
    print(f"{detector}, {'reset' if reset else 'kept its state'}: back after at most {slowest} steps")
    assert slowest[True] <= 50 + WINDOW and slowest[False] <= LONGEST + WINDOW


def test_heartbeats_alone_bring_two_packets_a_second():
    drone, other = Drone("best-gap8", answers=False), Drone("best-gap8")
    counts = []
    for i in range(2000):
        counts.append(len(hover(drone, 1)))
        hover(other, 1)
        if i % 50 == 0:  # those of a GAP8 that another one speaks to
            drone.app.receive(other.gap8.heartbeat(10 * i))
    assert drone.app.log.gap8Uptime == 19_500 and sum(counts[1000:]) <= 24


def test_a_gap8_says_nothing_before_it_is_spoken_to_and_falls_silent_after_ten_seconds():
    gap8, stm32 = Gap8Core(), AppCore({"detector": DETECTORS.index("best-gap8")}, have_gap8=True)
    assert gap8.heartbeat(500) == gap8.take(b"noise") == gap8.heartbeat(1000) == b""
    stm32.step(*HOVER)
    for packet in stm32.packets():
        assert gap8.take(packet)
    assert [bool(gap8.heartbeat(i)) for i in range(22)] == [True] * 20 + [False] * 2


def test_a_gap8_that_knows_no_session_is_not_flooded():
    drone = Drone("best-gap8", answers=False)
    packets = 0
    for _ in range(500):
        drone.app.step(*HOVER)
        for packet in drone.app.packets():
            packets += 1
            for flags, expected in ((1, 0), (0, 1 << 20)):  # unknown; and it confirms what was never sent
                body = struct.pack("<BBBBI", 0xA1, 3, 16, packet[3], 0) + struct.pack("<IBB", expected, flags, 0)
                drone.app.receive(body + struct.pack("<H", binascii.crc_hqx(body, 0xFFFF)))
    assert packets <= 51


@pytest.mark.parametrize("first", [800, 801])
def test_no_sample_is_left_without_an_answer_when_the_gap8_falls_silent(flight, first):
    """The decoder counts answers: one for every second sample, whoever gives it."""
    _, acc, gyro, pwm = flight
    drone = Drone("best-gap8")
    counted = []
    for i in range(1200):
        drone.answers = i < first
        drone.step(acc[i], gyro[i], pwm[i])
        counted.append(drone.app.log.answers)
    assert counted[first + 20] == counted[first], "the GAP8 is silent and the STM32 waits"
    assert counted[1199] - counted[599] == 300
