"""`replay`: a recorded flight through the detector and the board of a live one."""

import time
from collections.abc import Callable
from threading import Event

import numpy as np

from airtouch.crazyflie.view.board import Board, ReportedEdge
from airtouch.crazyflie.view.host_detector import HostDetector
from airtouch.detector import best
from airtouch.detector.evaluation import evaluate
from airtouch.detector.evaluation.data.dataset import FlightFile
from airtouch.detector.shared import sensors
from airtouch.logs.flight_log import FlightLog
from airtouch.parameters import SAMPLE_PERIOD_S
from airtouch.vehicle import arm_pwm_of

CHUNK = 5  #: rows per turn of the loop, 50 ms


def position(log: FlightLog, speed_mps: float | None) -> dict[str, np.ndarray]:
    """Columns x_m and y_m, (n,), for a log without them: straight ahead at constant speed while in the air.

    Empty if the log has them, or without a speed.
    """
    if log.has("x_m", "y_m") or speed_mps is None:
        return {}
    along = np.cumsum(sensors.airborne_by(log, arm_pwm_of(log.meta))[0]) * SAMPLE_PERIOD_S * speed_mps
    return {"x_m": along, "y_m": np.zeros(len(log))}


def run(log: FlightLog, board: Board, detector: HostDetector, *, speed: float = 0.0,
        speed_mps: float | None = None, stop: Event, show: Callable[[Board], None] = lambda _: None,
        on_edge: Callable[[ReportedEdge], None] = lambda _: None) -> int:
    """Feed a log to the detector and the board in steps of 50 ms. Returns the number of rows.

    speed: multiple of real time, 0 for as fast as possible. speed_mps: flight speed for logs without a position.
    """
    columns = {**log.columns, **position(log, speed_mps)}
    began = time.monotonic()
    for first in range(0, len(log), CHUNK):
        if stop.is_set():
            return first
        rows = {name: values[first:first + CHUNK] for name, values in columns.items()}
        count = len(next(iter(rows.values())))
        probability, edges = detector.next(rows)
        board.add((first + np.arange(count)) * SAMPLE_PERIOD_S, rows, probability)
        for edge in edges:
            on_edge(board.add_edge(edge.kind, edge.sample * SAMPLE_PERIOD_S, edge.probability))
        show(board)
        if speed > 0.0:
            ahead = (first + count) * SAMPLE_PERIOD_S / speed - (time.monotonic() - began)
            if ahead > 0.0:
                stop.wait(ahead)
    return len(log)


def result(file: FlightFile, log: FlightLog, detector: HostDetector) -> evaluate.Result:
    """The flight's result as `evaluate` gives it, from the detector's output so far."""
    return evaluate.result_of(file, log, detector.trace(log), best, detector.model)
