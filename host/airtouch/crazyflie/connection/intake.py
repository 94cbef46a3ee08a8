"""Log packets as rows: with unwrapped time stamps, held values of the slow block, and a count of lost samples."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from airtouch.crazyflie.connection import blocks
from airtouch.crazyflie.connection.blocks import Block
from airtouch.crazyflie.connection.log_blocks import Sample
from airtouch.crazyflie.connection.ticks import Ticks

REMEMBERED_S = 1.0  #: s for which packets of the slow block are stored


@dataclass
class Intake:
    """Converts packets to rows with `take`.

    received: packets of the fast block; first_ms, newest_ms: their first and newest time, drone's clock.
    last_arrival_s: of a packet of the fast block, host's clock: without that block a flight lands and the blocks are
    requested again, whether the link or the block is lost. latest: the newest values by column.
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
        """t_s and the columns that `take` returns."""
        zeros = dict.fromkeys(blocks.MOTION.names, 0)
        names = ["t_s", *blocks.motion_columns([zeros])]
        if self.slow:
            names += blocks.state_columns(self.slow, [dict.fromkeys(self.slow.names, 0)])
        return names

    @property
    def complete(self) -> bool:
        """True if both blocks have arrived, the fast one for a fifth of a second."""
        return self.received > 20 and (self.slow is None or bool(self._past))

    @property
    def lost(self) -> int:
        """Samples that should have arrived by now and did not; delayed ones count as lost."""
        if self.first_ms is None or self.newest_ms is None:
            return 0
        return max(round((self.newest_ms - self.first_ms) / blocks.MOTION.period_ms) + 1 - self.received, 0)

    @property
    def lateness_s(self) -> float:
        """Delay of the last packet over the least of the last 500, in s; NaN before the first."""
        return self._delays[-1] - min(self._delays) if self._delays else float("nan")

    def take(self, samples: Sequence[Sample]) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """The rows of the fast block in these packets: drone's clock, (n,) in ms, and SI columns, (n,) each.

        Raises ticks.Restarted if the drone's clock started again from zero.
        """
        fast: list[tuple[int, dict]] = []
        for sample in samples:
            at = self.ticks.unwrap(sample.stamp, sample.arrival_s)
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
