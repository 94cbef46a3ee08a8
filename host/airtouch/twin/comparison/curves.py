"""The curves of a twin's report: recorded and simulated signals, medians around edges, spectra in free air."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from airtouch.parameters import SAMPLE_RATE_HZ
from airtouch.twin.comparison.compare import SimulatedFlight
from airtouch.twin.recorded import channels as ch
from airtouch.twin.recorded.course import Course
from airtouch.twin.recorded.features import BANDS_HZ, CLASSES, edge_locked, height_class, names
from airtouch.twin.recorded.flights import RecordedFlights

BEFORE, AFTER = 50, 100  #: samples before and after an edge, as `features.edge_locked`
MARGIN = 200  #: samples before the entry and after the exit in the overlaid flight; no source: round number
QUARTILES = (25, 50, 75)  #: percentiles of the bands in the figures


@dataclass(frozen=True)
class Signals:
    """A flight: time after its entry, (n,) s, and channels (n, 12) less their level in free air."""

    time_s: np.ndarray
    channels: np.ndarray


@dataclass(frozen=True)
class AroundEdges:
    """Quartiles (3, BEFORE + AFTER, 12) of the channels around the edges of one kind, and the number of flights."""

    quartiles: np.ndarray
    flights: int


@dataclass(frozen=True)
class Curves:
    """The curves of a report. A pair is (recorded, simulated).

    edges: height class -> "entry" or "exit" -> pair, for classes that both have. spectra: quartiles (3, 11, bands) of
    band powers, dB.
    """

    overlaid: tuple[Signals, Signals]
    edges: dict[str, dict[str, tuple[AroundEdges, AroundEdges]]]
    spectra: tuple[np.ndarray, np.ndarray]


def curves(recorded: RecordedFlights, simulated: Sequence[SimulatedFlight]) -> Curves:
    """The curves of the report. The overlaid flight is that with the median duration over the platform."""
    durations = [f.course.exit - f.course.entry for f in simulated]
    median_flight = simulated[int(np.argsort(durations)[len(durations) // 2])]
    edges = {}
    for name in CLASSES:
        real = [(x, c) for x, c in zip(recorded.channels, recorded.courses, strict=True)
                if height_class(c.clearance_m) == name]
        model = [(f.channels, f.course) for f in simulated if height_class(f.course.clearance_m) == name]
        if real and model:
            edges[name] = {kind: (_around(real, kind), _around(model, kind)) for kind in ("entry", "exit")}
    spectrum = [k for k, f in enumerate(names()) if f.group == "spectrum"]
    powers = recorded.features[:, spectrum], np.array([f.features[spectrum] for f in simulated])
    return Curves((_signals(recorded.channels[median_flight.number], recorded.courses[median_flight.number]),
                   _signals(median_flight.channels, median_flight.course)), edges,
                  (_spectra(powers[0]), _spectra(powers[1])))


def _signals(data: np.ndarray, course: Course) -> Signals:
    """The channels of a flight from MARGIN before its entry to MARGIN after its exit."""
    span = slice(max(course.entry - MARGIN, 0), min(course.exit + MARGIN, len(data)))
    level = np.median(data[course.free], axis=0)
    level[ch.DOWN] = 0.0
    return Signals((np.arange(span.start, span.stop) - course.entry) / SAMPLE_RATE_HZ, data[span] - level)


def _around(flights: Sequence[tuple[np.ndarray, Course]], kind: str) -> AroundEdges:
    """Quartiles of the channels around the edges of one kind."""
    locked = np.array([edge_locked(x, c, getattr(c, kind), BEFORE, AFTER) for x, c in flights])
    rows = np.isfinite(locked[:, :, 0]).any(axis=0)
    out = np.full((3, *locked.shape[1:]), np.nan)
    out[:, rows] = np.nanpercentile(locked[:, rows], QUARTILES, axis=0)
    return AroundEdges(out, len(flights))


def _spectra(powers: np.ndarray) -> np.ndarray:
    """Quartiles (3, channels, bands) of band powers of flights, dB."""
    return np.nanpercentile(powers.reshape(-1, ch.DOWN, len(BANDS_HZ)), QUARTILES, axis=0)
