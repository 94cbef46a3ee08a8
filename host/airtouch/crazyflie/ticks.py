"""The drone's clock: 24-bit milliseconds in every log packet, and the packets that never came."""

from dataclasses import dataclass

import numpy as np

from airtouch.logs.clock import Gap

WRAP_MS = 1 << 24  #: the counter starts again after 4 h 39 min
LATEST_MS = 2000  #: a packet may come so late; a clock further back is another one


class Restarted(Exception):
    """The drone's clock started anew: it was switched off or reset itself."""


@dataclass
class Ticks:
    """Time stamps without their wraps, in the order of arrival."""

    newest_ms: int | None = None

    def unwrap(self, stamp: int) -> int:
        """Milliseconds on a scale that never wraps. Raises Restarted where the clock ran back."""
        if self.newest_ms is None:
            self.newest_ms = stamp
            return stamp
        step = (stamp - self.newest_ms + WRAP_MS // 2) % WRAP_MS - WRAP_MS // 2
        if step < -LATEST_MS:
            raise Restarted
        at = self.newest_ms + step
        self.newest_ms = max(self.newest_ms, at)
        return at


def gaps(times_ms: np.ndarray, period_ms: int = 10) -> list[Gap]:
    """Samples that are missing between those of a sorted clock, (n,) milliseconds."""
    steps = np.diff(np.asarray(times_ms, dtype=np.int64))
    missing = (steps + period_ms // 2) // period_ms - 1
    return [Gap(int(i) + 1, int(missing[i]), float(steps[i]) / 1000.0) for i in np.flatnonzero(missing > 0)]


def in_order(times_ms: np.ndarray) -> np.ndarray:
    """Indices that sort the clock and leave out samples that came twice."""
    return np.unique(np.asarray(times_ms), return_index=True)[1]
