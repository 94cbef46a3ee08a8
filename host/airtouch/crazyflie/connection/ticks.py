"""The drone's clock, 24-bit milliseconds in every log packet, and the gaps that it shows."""

from dataclasses import dataclass

import numpy as np

from airtouch.logs.checks.clock import Gap

WRAP_MS = 1 << 24  #: ms after which the counter wraps, 4 h 39 min
LATEST_MS = 2000  #: ms that a packet may be late; a larger step back, or one ahead of the host's clock, is a restart


class Restarted(Exception):
    """The drone's clock started again from zero: it was switched off, or it reset itself."""


@dataclass
class Ticks:
    """Unwraps the time stamps of packets in order of arrival.

    newest_ms: the newest time. least_delay_ms: host's clock at arrival minus the drone's, of the packet that came with
    the least delay.
    """

    newest_ms: int | None = None
    least_delay_ms: float = 0.0

    def unwrap(self, stamp: int, arrival_s: float) -> int:
        """The time of a 24-bit stamp in ms, without wraps. arrival_s: host's clock.

        Raises Restarted if it is over LATEST_MS in the past, or over LATEST_MS ahead of the host's clock: from half a
        wrap of uptime on, a clock that starts again from zero looks like a step forward. Packets that waited in a queue
        are behind that clock, and the fresh ones after them are not ahead of it.
        """
        if self.newest_ms is None:
            self.newest_ms, self.least_delay_ms = stamp, 1000.0 * arrival_s - stamp
            return stamp
        step = (stamp - self.newest_ms + WRAP_MS // 2) % WRAP_MS - WRAP_MS // 2
        at = self.newest_ms + step
        delay_ms = 1000.0 * arrival_s - at
        if step < -LATEST_MS or self.least_delay_ms - delay_ms > LATEST_MS:
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
