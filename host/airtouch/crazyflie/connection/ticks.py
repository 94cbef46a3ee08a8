"""The drone's clock, 24-bit milliseconds in every log packet, and the gaps that it shows."""

import time
from dataclasses import dataclass

import numpy as np

from airtouch.logs.checks.clock import Gap

WRAP_MS = 1 << 24  #: ms after which the counter wraps, 4 h 39 min
LATEST_MS = 2000  #: ms that a packet may be late; assumed
#: the host's clock that goes on while the host is suspended: CLOCK_MONOTONIC stops then on Linux, and not on macOS
SUSPENDED_TOO = getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)


def host_clock_s() -> float:
    """The host's clock, s, which goes on while the host is suspended, as the drone's does."""
    return time.clock_gettime(SUSPENDED_TOO)


class Restarted(Exception):
    """The drone's clock started again from zero: it was switched off, or it reset itself."""


@dataclass
class Ticks:
    """Unwraps the time stamps of packets in order of arrival.

    newest_ms: the newest time. least_delay_ms: host's clock at arrival minus the drone's, of the packet that came with
    the least delay. heard_s: arrival of the last packet, host's clock.
    """

    newest_ms: int | None = None
    least_delay_ms: float = 0.0
    heard_s: float = 0.0

    def unwrap(self, stamp: int, arrival_s: float) -> int:
        """The time of a 24-bit stamp in ms, without wraps. arrival_s: host's clock.

        Raises Restarted if it is over LATEST_MS in the past. From half a wrap of uptime on, a clock that starts again
        from zero looks like a step forward: it is over LATEST_MS ahead of the host's clock and shows no more than the
        time since the last packet. A clock that runs faster than the host's, as a virtual drone's may, or through a
        suspend of the host shows more. Packets that waited in a queue are behind, and the fresh ones after them are not
        ahead.
        """
        silent_ms, self.heard_s = 1000.0 * (arrival_s - self.heard_s), arrival_s
        if self.newest_ms is None:
            self.newest_ms, self.least_delay_ms = stamp, 1000.0 * arrival_s - stamp
            return stamp
        step = (stamp - self.newest_ms + WRAP_MS // 2) % WRAP_MS - WRAP_MS // 2
        at = self.newest_ms + step
        delay_ms = 1000.0 * arrival_s - at
        ahead = self.least_delay_ms - delay_ms > LATEST_MS
        if step < -LATEST_MS or (ahead and step > LATEST_MS and stamp <= silent_ms + LATEST_MS):
            raise Restarted
        self.newest_ms, self.least_delay_ms = max(self.newest_ms, at), min(self.least_delay_ms, delay_ms)
        return at


def gaps(times_ms: np.ndarray, period_ms: int = 10) -> list[Gap]:
    """Gaps in a sorted clock, (n,) ms, of samples at this period."""
    steps = np.diff(np.asarray(times_ms, dtype=np.int64))
    missing = (steps + period_ms // 2) // period_ms - 1
    return [Gap(int(i) + 1, int(missing[i]), float(steps[i]) / 1000.0) for i in np.flatnonzero(missing > 0)]


def in_order(times_ms: np.ndarray) -> np.ndarray:
    """Indices that sort a clock, (n,) ms, without duplicates."""
    return np.unique(np.asarray(times_ms), return_index=True)[1]
