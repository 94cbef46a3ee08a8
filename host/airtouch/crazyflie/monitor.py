"""`monitor`: the live view of a drone, with edges from its app or from the detector on the host."""

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from threading import Event

import numpy as np

from airtouch.crazyflie.connection import app_log, blocks
from airtouch.crazyflie.connection.drone import Drone, drain
from airtouch.crazyflie.connection.intake import Intake
from airtouch.crazyflie.connection.log_blocks import Sample
from airtouch.crazyflie.connection.ticks import Restarted, host_clock_s
from airtouch.crazyflie.flight import FORGOTTEN_S
from airtouch.crazyflie.view.board import Board, Link, ReportedEdge
from airtouch.crazyflie.view.host_detector import HostDetector, with_gaps
from airtouch.errors import AirTouchError

TURN_S = 0.05  #: s, period of the loop
PING_S = 0.5  #: s between echo requests
RATE_S = 2.0  #: s over which the packet rate is averaged
REOPEN_S = 5.0  #: s, longest attempt to connect again


def start(drone: Drone, host_detector: bool) -> tuple[blocks.Block | None, HostDetector | None]:
    """Start the log blocks. Returns the slow block and the host's detector; None for the detector of the drone's app.

    Raises AirTouchError with the log variables that the drone lacks.
    """
    known = drone.variables
    blocks.check(blocks.MOTION, known)
    state = blocks.available(blocks.STATE, known)
    slow = state if state.variables else None
    app = app_log.block(known)
    for block in filter(None, (blocks.MOTION, slow, app)):
        drone.start(block)
    return slow, HostDetector(traced=False) if host_detector or app is None else None


@dataclass
class Monitor:
    """Updates a board from packets. on_edge: called with every edge."""

    board: Board
    intake: Intake
    detector: HostDetector | None
    on_edge: Callable[[ReportedEdge], None] = lambda _: None
    app: app_log.AppState | None = None
    _before_ms: int | None = None
    _edges: int | None = None
    _arrivals: deque = field(default_factory=deque)

    def take(self, samples: list[Sample]) -> None:
        """Handle new packets. Raises Restarted if the drone's clock started again from zero."""
        for sample in samples:
            if sample.block == app_log.WANTED.name:
                self._take_app(sample)
        times, columns = self.intake.take([s for s in samples if s.block != app_log.WANTED.name])
        if not len(times):
            return
        order = np.argsort(times, kind="stable")
        clock, filled = with_gaps(times[order], {n: v[order] for n, v in columns.items()}, self._before_ms)
        if not len(clock):
            return
        self._before_ms = int(clock[-1])
        self._arrivals += [(host_clock_s(), len(times))]
        seconds = (clock - self.intake.first_ms) / 1000.0
        edges = []
        if self.detector:
            probability, edges = self.detector.next(filled)
            begin = self.detector.taken - len(clock)
        else:
            probability = np.full(len(clock), self.app.probability if self.app else np.nan)
        self.board.add(seconds, filled, probability)
        for edge in edges:
            self.on_edge(self.board.add_edge(edge.kind, float(seconds[edge.sample - begin]), edge.probability))

    def _take_app(self, sample: Sample) -> None:
        self.app = app_log.state(sample.values)
        if self.detector is None:
            self.board.detector = self.app.detector
            if self._edges is not None and self.app.edges != self._edges and self.intake.first_ms is not None:
                now_ms = self.intake.ticks.unwrap(sample.stamp, sample.arrival_s)
                at = (now_ms - self.intake.first_ms) / 1000.0 - self.app.age_s
                self.on_edge(self.board.add_edge(self.app.kind, at, self.app.probability))
            self._edges = self.app.edges
        load = [f"app {self.app.load_us:.0f} us"] if self.app.load_us else []
        self.board.status = "; ".join([*load, *self.app.faults])

    def restart(self) -> None:
        """Start again with the drone's new clock and an empty board; the detector keeps its state."""
        self.board.clear()
        self.intake, self._before_ms, self._edges = Intake(self.intake.slow), None, None

    def refresh(self, round_trip_s: float) -> None:
        """Update the state of the link on the board."""
        now = host_clock_s()
        while self._arrivals and now - self._arrivals[0][0] > RATE_S:
            self._arrivals.popleft()
        span = now - self._arrivals[0][0] if self._arrivals else 0.0
        i = self.intake
        total = i.received + i.lost
        silent = now - i.last_arrival_s if i.last_arrival_s is not None else 0.0
        self.board.link = Link(sum(n for _, n in self._arrivals) / span if span > 0.2 else float("nan"),
                               i.lost / total if total else 0.0, i.lateness_s, round_trip_s, silent)


def watch(drone: Drone, monitor: Monitor, duration_s: float | None, stop: Event,
          show: Callable[[Board], None], say: Callable[[str], None]) -> None:
    """Update and show the board for `duration_s`, or until `stop` is set. A lost link is opened again."""
    until = host_clock_s() + duration_s if duration_s else float("inf")
    pinged = 0.0
    while host_clock_s() < until and not stop.is_set():
        if drone.lost.is_set():
            say("the link broke; connecting anew")
            try:
                drone.reopen(min(REOPEN_S, max(until - host_clock_s(), 0.1)))
            except AirTouchError:
                continue
        try:
            monitor.take(drain(drone.samples))
        except Restarted:
            say("the drone restarted")
            monitor.restart()
            continue
        heard = monitor.intake.last_arrival_s
        if heard is not None and host_clock_s() - heard > FORGOTTEN_S:
            drone.revive()
        if host_clock_s() - pinged > PING_S:
            drone.ping()
            pinged = host_clock_s()
        for line in drone.console_lines():
            say(f"the drone says: {line}")
        monitor.refresh(drone.round_trip_s)
        show(monitor.board)
        time.sleep(TURN_S)
