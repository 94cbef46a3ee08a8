"""From log packets to rows: time stamps unwrapped, slow values held beside fast ones, losses counted."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from airtouch.crazyflie import blocks
from airtouch.crazyflie.blocks import Block
from airtouch.crazyflie.log_blocks import Sample
from airtouch.crazyflie.ticks import Ticks

REMEMBERED_S = 1.0  #: of slow packets


@dataclass
class Intake:
    """Takes packets as they come and gives the columns of the new rows.

    received, first_ms, newest_ms: of the fast block. last_arrival_s: host's clock.
    Raises ticks.Restarted when the drone's clock starts anew.
    """

    slow: Block | None
    ticks: Ticks = field(default_factory=Ticks)
    received: int = 0
    first_ms: int | None = None
    newest_ms: int | None = None
    last_arrival_s: float | None = None
    latest: dict[str, float] = field(default_factory=dict)
    supervisor: int | None = None
    _past: deque = field(default_factory=deque)
    _delays: deque = field(default_factory=lambda: deque(maxlen=500))

    @property
    def names(self) -> list[str]:
        """The columns that `take` gives, and t_s."""
        zeros = dict.fromkeys(blocks.MOTION.names, 0)
        found = ["t_s", *blocks.motion_columns([zeros])]
        if self.slow:
            found += blocks.state_columns(self.slow, [dict.fromkeys(self.slow.names, 0)])
        return found

    @property
    def complete(self) -> bool:
        """Whether both blocks have been heard, the fast one for a fifth of a second."""
        return self.received > 20 and (self.slow is None or bool(self._past))

    @property
    def lost(self) -> int:
        """Samples that should have come by now and did not (those under way count as lost)."""
        if self.first_ms is None or self.newest_ms is None:
            return 0
        return max(round((self.newest_ms - self.first_ms) / blocks.MOTION.period_ms) + 1 - self.received, 0)

    @property
    def lateness_s(self) -> float:
        """How much later than the quickest of the last 500 the last packet came, seconds."""
        return self._delays[-1] - min(self._delays) if self._delays else float("nan")

    def take(self, samples: Sequence[Sample]) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """(clock (n,) in ms, SI columns (n,)) of the rows of the fast block among these packets."""
        fast: list[tuple[int, dict]] = []
        for sample in samples:
            at = self.ticks.unwrap(sample.stamp)
            if sample.block == blocks.MOTION.name:
                fast.append((at, sample.values))
                self._count(at, sample.arrival_s)
            else:
                self._past.append((at, sample.values))
                if "supervisor.info" in sample.values:
                    self.supervisor = int(sample.values["supervisor.info"])
        times = np.array([at for at, _ in fast], dtype=np.int64)
        if not fast:
            return times, {}
        columns = blocks.motion_columns([values for _, values in fast])
        if self.slow:
            while len(self._past) > 1 and self._past[0][0] < times.min() - 1000 * REMEMBERED_S:
                self._past.popleft()
            rows = [values for _, values in self._past] or [dict.fromkeys(self.slow.names, 0)]
            slow_times = np.array([at for at, _ in self._past], dtype=np.float64) / 1000.0
            slow = blocks.state_columns(self.slow, rows)
            slow = {name: values[:len(slow_times)] for name, values in slow.items()}
            columns |= blocks.hold(times / 1000.0, slow_times, slow)
        self.latest = {name: float(values[-1]) for name, values in columns.items()}
        return times, columns

    def _count(self, at: int, arrival_s: float) -> None:
        self.received += 1
        self.first_ms = at if self.first_ms is None else min(self.first_ms, at)
        self.newest_ms = at if self.newest_ms is None else max(self.newest_ms, at)
        self.last_arrival_s = arrival_s
        self._delays.append(arrival_s - at / 1000.0)
