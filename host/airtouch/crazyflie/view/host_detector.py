"""The `best` detector on the host, sample by sample: for a drone without the app, or for a file."""

from collections.abc import Mapping

import numpy as np

from airtouch.detector import best
from airtouch.detector.best.model import BestModel
from airtouch.detector.best.recipe import ROW_STRIDE
from airtouch.detector.shared import sensors
from airtouch.detector.trace import Detection, Trace
from airtouch.kernels.stream_session import StreamSession
from airtouch.logs.flight_log import FlightLog

MOST_FILLED = 100  #: samples of a gap that are fed to the detector as NaN; the rest of a longer gap is skipped


class HostDetector:
    """`best` in the C code of the drone, sample by sample.

    `next` takes rows and returns their results. `trace` returns the trace of all rows, equal to that of `best.run`.
    """

    def __init__(self, model: BestModel | None = None, missing: tuple[str, ...] = (), traced: bool = True) -> None:
        """missing: the sensors, one at most, that the rows lack (`detector.shared.sensors.missing_sensors`).

        traced: keep what `trace` needs of every row. Without it the memory is bounded.
        """
        self._traced = traced
        self.model = (model or best.load(None)).serving(missing)
        self.lag_s = best.lag_s(self.model)
        self._missing = missing
        self._decoder = self.model.decoder_without(missing)
        self._session = StreamSession(self.model.int8, sensors.silence(self.model.recipe.motion, missing),
                                      self._decoder)
        self._rates = np.empty((0, 3))
        self._logits: list[np.ndarray] = []
        self._edge: list[np.ndarray] = []
        self._airborne: list[np.ndarray] = []
        self.taken = 0  #: rows so far

    def next(self, columns: Mapping[str, np.ndarray]) -> tuple[np.ndarray, list[Detection]]:
        """P(over a platform), (n,), and the edges reported at these rows.

        Raises AirTouchError for missing columns.
        """
        log = FlightLog(dict(columns), {"source": "live"})
        for sensor in set(sensors.SENSORS) - set(self._missing):
            log.require(*sensors.required_columns(log, sensor))
        logged = sensors.signals(log, self._rates)
        self._rates = np.vstack([self._rates, logged.gyro])[-sensors.FLYING_WINDOW - 1:]
        events = self._session.next(logged.acc, logged.gyro, logged.pwm)
        self._logits.append(events.logits)
        recent = (self._decoder.hold_steps + self._decoder.look_back) * ROW_STRIDE
        if self._traced:
            self._edge.append(events.edge)
            self._airborne.append(events.airborne)
        else:
            del self._logits[:-recent]
        edges = []
        for i in np.flatnonzero(events.edge):
            past = np.concatenate(self._logits[-recent:])[-(recent + len(log)):]
            upto = len(past) - len(log) + int(i)
            crossing = past[max(upto - recent, 0):upto + 1, int(events.edge[i])].max()
            kind = best.KINDS[int(events.edge[i])]
            edges.append(Detection(self.taken + int(i), kind, _sigmoid(float(crossing))))
        self.taken += len(log)
        over = _sigmoid(events.logits[:, 0].astype(np.float64))
        return np.where(events.airborne, over, 0.0), edges

    def trace(self, log: FlightLog) -> Trace:
        """The trace of all rows so far. `log` holds the same rows. Raises ValueError without `traced`."""
        if not self._traced:
            raise ValueError("a detector without traced=True keeps no trace")
        return best.trace_of(log, self.model, np.concatenate(self._logits), np.concatenate(self._edge),
                             np.concatenate(self._airborne))


def with_gaps(times_ms: np.ndarray, columns: Mapping[str, np.ndarray], before_ms: int | None,
              period_ms: int = 10) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Times (m,) in ms and columns (m,) with a NaN row for each lost one, so that rows stay evenly spaced.

    before_ms: time of the row before, None at the start. A gap is filled with MOST_FILLED rows at most. Rows that
    are not later than the row before them are left out.
    """
    before = times_ms[0] - period_ms if before_ms is None else before_ms
    newest = np.maximum.accumulate(np.r_[before, times_ms])[:-1]
    later = times_ms > newest
    times = times_ms[later]
    steps = np.diff(np.r_[before, times])
    missing = np.clip((steps + period_ms // 2) // period_ms - 1, 0, MOST_FILLED).astype(int)
    at = np.cumsum(missing + 1) - 1
    total = int(at[-1]) + 1 if len(at) else 0
    filled = {name: np.full(total, np.nan) for name in columns}
    for name, values in columns.items():
        filled[name][at] = np.asarray(values, dtype=np.float64)[later]
    clock = np.full(total, -1, dtype=np.int64)
    clock[at] = times
    for i in np.flatnonzero(clock < 0)[::-1]:
        clock[i] = clock[i + 1] - period_ms
    return clock, filled


def _sigmoid(x):
    return 1.0 / (1.0 + np.exp(-x))
