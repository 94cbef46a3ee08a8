"""How far a gap closes: the share by its closed form, and that of a jitter in the logged times."""

from types import SimpleNamespace

import numpy as np
import pytest

from airtouch.gap.answer.shrink import share_closed, shrink_of_jitter
from airtouch.gap.flights.clock import LEAST_JITTER_S


@pytest.mark.parametrize(("before", "after", "share"), [
    (3.0, 1.0, 1.0), (3.0, 2.0, 0.5), (3.0, 3.0, 0.0), (3.0, 4.0, -0.5), (3.0, 9.0, -1.0), (3.0, 0.5, 1.0),
    (1.01, 1.0, 0.0), (1.0, 1.0, 0.0), (0.9, 1.0, 0.0), (1.03, 1.0, 1.0)])
def test_the_share_is_that_of_the_rms_over_the_floor(before, after, share):
    """Rms values of 3 and 2 floors: half of what is over the floor is gone."""
    assert share_closed(before ** 2, after ** 2) == pytest.approx(share)


def jittered(rms_of_eighths, floor_s=0.0):
    """A stand-in for the data of one flight whose logged times jitter by so much in each eighth of it, s rms."""
    clock = np.concatenate([np.full(100, rms) for rms in rms_of_eighths])
    return SimpleNamespace(flights=[SimpleNamespace(clock_s=clock)],
                           study=SimpleNamespace(floor=SimpleNamespace(clock_s=floor_s)))


def test_a_jitter_that_both_halves_share_closes_wholly():
    shrink = shrink_of_jitter(jittered([0.004] * 8, floor_s=0.001))
    assert (shrink.before, shrink.after, shrink.share.value) == pytest.approx((4.0, 1.0, 1.0))


def test_what_the_halves_differ_by_stays():
    """Every other eighth is a half: 2 and 6 ms rms."""
    shrink = shrink_of_jitter(jittered([0.002, 0.006] * 4, floor_s=0.001))
    assert (shrink.before, shrink.after) == pytest.approx((4.0, 5.0))
    assert shrink.share.value == pytest.approx(-1.0 / 3.0)
    both = shrink_of_jitter(jittered([0.002, 0.002, 0.006, 0.006] * 2, floor_s=0.001))
    assert both.after == pytest.approx(1.0)


def test_the_floor_of_a_jitter_is_never_that_of_perfect_times():
    assert shrink_of_jitter(jittered([0.002] * 8)).before == pytest.approx(0.002 / LEAST_JITTER_S)
