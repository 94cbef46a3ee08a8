"""Flights in which nothing is an edge, of any vehicle: what a detector must stay silent in."""

from collections.abc import Callable, Iterable
from pathlib import Path

from airtouch import logs
from airtouch.detector.evaluation import evaluate
from airtouch.detector.shared import sensors
from airtouch.errors import AirTouchError
from airtouch.logs.checks.clock import sample_period
from airtouch.logs.files import in_folder
from airtouch.logs.flight_log import FlightLog
from airtouch.parameters import SAMPLE_PERIOD_S


def read(folders: Iterable[Path], tell: Callable[[str], None] = lambda _: None) -> list[FlightLog]:
    """Every flight under the folders that lacks at most one sensor, at 100 Hz.

    tell: called with the reason for each flight that is left out.

    Raises AirTouchError where a log's own down range shows an edge, and where no flight is usable.
    """
    flights = []
    for folder in folders:
        if not folder.is_dir():
            raise AirTouchError(f"{folder}: no such folder of free-air flights")
        for path in in_folder(folder, below=True):
            try:
                log = _at_100_hz(logs.read(path))
                sensors.signals(log)
            except AirTouchError as error:
                tell(str(error))
                continue
            if evaluate.truth(log):
                raise AirTouchError(f"{path}: its down range shows an edge, so this is not free air; leave it out")
            flights.append(log)
    if not flights:
        raise AirTouchError("no flight in free air that can be used; give folders of logs with motors and "
                            "accelerations")
    return flights


def _at_100_hz(log: FlightLog) -> FlightLog:
    """The log itself within 2 % of 100 Hz, else resampled."""
    rate_hz = 1.0 / SAMPLE_PERIOD_S
    return log if abs(sample_period(log) * rate_hz - 1.0) < 0.02 else logs.resample(log, rate_hz)
