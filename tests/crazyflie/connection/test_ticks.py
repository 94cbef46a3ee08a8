"""The drone's clock against counting by hand."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from airtouch.crazyflie.connection.ticks import WRAP_MS, Restarted, Ticks, gaps, in_order


@given(st.integers(0, WRAP_MS - 1), st.lists(st.integers(1, 5_000_000), min_size=1, max_size=30))
def test_ticks_go_on_where_the_counter_wraps(start, steps):
    true = start + np.cumsum([0, *steps])
    ticks = Ticks()
    assert [ticks.unwrap(int(t) % WRAP_MS, t / 1000) for t in true] == list(true)


@given(st.integers(0, WRAP_MS - 1), st.permutations(range(10)))
def test_late_packets_keep_their_own_time(start, order):
    ticks = Ticks()
    ticks.unwrap(start, 0.0)
    times = [ticks.unwrap((start + 10 * i) % WRAP_MS, 0.01 * n) for n, i in enumerate(order)]
    assert times == [start + 10 * i for i in order]


@pytest.mark.parametrize("uptime_h", [1 / 60, 1.0, 3.0, 4.5])
def test_a_clock_that_starts_anew_is_told(uptime_h):
    ticks = Ticks()
    ticks.unwrap(int(3_600_000 * uptime_h), 7.0)
    with pytest.raises(Restarted):
        ticks.unwrap(500, 9.0)


def test_packets_that_were_held_up_in_a_queue_are_no_restart():
    ticks = Ticks()
    ticks.unwrap(1000, 2.5)  # 1.5 s late
    assert ticks.unwrap(2600, 2.6) == 2600


def test_fresh_packets_after_a_silence_and_a_queue_are_no_restart():
    """Four seconds without the link: what the queue held of their begin arrives first, then the present."""
    ticks = Ticks()
    ticks.unwrap(1000, 1.0)
    assert ticks.unwrap(1010, 5.0) == 1010
    assert ticks.unwrap(5020, 5.02) == 5020


@given(st.integers(0, WRAP_MS // 2), st.floats(1.0, 20.0), st.lists(st.floats(0.001, 5.0), min_size=1, max_size=30))
def test_a_drone_whose_clock_runs_faster_has_not_restarted(start, speed, silences_s):
    """As a virtual drone's: after each silence of the host's time it is `speed` times further."""
    host_s = np.concatenate([[0.0], np.cumsum(silences_s)])
    true = (start + np.round(1000 * speed * host_s)).astype(int)
    ticks = Ticks()
    assert [ticks.unwrap(int(t) % WRAP_MS, at) for t, at in zip(true, 7.0 + host_s, strict=True)] == list(true)


def test_a_suspend_that_stops_the_hosts_clock_is_no_restart():
    ticks = Ticks()
    assert [ticks.unwrap(t, at) for t, at in ((60_000, 1.0), (90_000, 1.01))] == [60_000, 90_000]


@given(st.sets(st.integers(0, 300), min_size=2), st.integers(-3, 3))
def test_gaps_are_the_samples_that_are_not_there(numbers, jitter):
    slots = np.array(sorted(numbers))
    times = 10 * slots + np.where(slots % 2, jitter, 0)
    missing = gaps(times)
    assert sum(g.lost for g in missing) == slots[-1] - slots[0] + 1 - len(slots)
    for gap in missing:
        assert slots[gap.sample] - slots[gap.sample - 1] - 1 == gap.lost


def test_doubled_and_late_samples_are_put_in_order():
    assert list(in_order(np.array([30, 10, 20, 10, 40]))) == [1, 2, 0, 4]
