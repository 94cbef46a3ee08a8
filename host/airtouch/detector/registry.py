"""The detectors, by name."""

import importlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from airtouch.detector.trace import Trace
from airtouch.errors import unknown
from airtouch.logs.flight_log import FlightLog

#: name -> module that is a `Detector`; imported only when asked for
DETECTORS = {
    "best": "airtouch.detector.best",
    "paper": "airtouch.detector.paper",
    "paper-stream": "airtouch.detector.paper.rolling",
    "baseline": "airtouch.detector.baseline",
}


class Detector(Protocol):
    """What a detector's module offers. `model` is whatever its `fit` and `load` return.

    One that says SPARE_SENSORS = k takes logs that lack k of acceleration, rates and motors; others need all.
    """

    def run(self, log: FlightLog, model: Any = None) -> Trace:
        """Edges of one flight at 100 Hz; None is the shipped model. AirTouchError for what it cannot use."""

    # a property that is callable, for each detector's `fit` has options of its own, which no one signature covers
    @property
    def fit(self) -> Callable[..., Any]:
        """fit(flights, seed=0, **options): a model from training flights, deterministic per seed."""

    def load(self, path: Path | None) -> Any:
        """A model from its file, the shipped one for None; AirTouchError that names what is wrong with it."""

    def lag_s(self, model: Any) -> float:
        """Seconds by which detections are late, learnt in training; the score takes it off and states it."""

    def parameters(self, model: Any) -> dict[str, Any]:
        """What a report prints: plain numbers and text."""


@runtime_checkable
class Filtered(Detector, Protocol):
    """A detector whose edges FR-CFAR may drop."""

    def retune(self, model: Any, flights: Sequence[FlightLog], physical_filter: bool) -> Any:
        """The model with decoding and lag chosen anew, with the filter or without."""


@runtime_checkable
class InFloat(Detector, Protocol):
    """A detector whose network also runs in float, as trained."""

    def run_float(self, log: FlightLog, model: Any = None) -> Trace:
        """As `run`, by the float network, before quantisation."""


@runtime_checkable
class Choosing(Detector, Protocol):
    """A detector with several models, which picks one by the sensors that a log holds."""

    def model_for(self, model: Any, log: FlightLog) -> Any:
        """The model that serves this log."""


@dataclass(frozen=True)
class InFloatOnly:
    """A detector whose `run` is another one's `run_float`; all else is the other's."""

    detector: InFloat

    def run(self, log: FlightLog, model: Any = None) -> Trace:
        """`run_float` of the detector."""
        return self.detector.run_float(log, model)

    @property
    def fit(self) -> Callable[..., Any]:
        """`fit` of the detector."""
        return self.detector.fit

    def load(self, path: Path | None) -> Any:
        """`load` of the detector."""
        return self.detector.load(path)

    def lag_s(self, model: Any) -> float:
        """`lag_s` of the detector."""
        return self.detector.lag_s(model)

    def parameters(self, model: Any) -> dict[str, Any]:
        """`parameters` of the detector."""
        return self.detector.parameters(model)


def model_for(detector: Detector, model: Any, log: FlightLog) -> Any:
    """The model that serves this log: by the detector's own choice, or `model` where it has but one."""
    return detector.model_for(model, log) if isinstance(detector, Choosing) else model


def get(name: str | Detector) -> Detector:
    """The module of a detector, or the detector itself; AirTouchError that lists the known ones."""
    if not isinstance(name, str):
        return name
    if name not in DETECTORS:
        raise unknown("detector", name, DETECTORS)
    return importlib.import_module(DETECTORS[name])
