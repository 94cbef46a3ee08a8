"""From a probability to edges, causally: hysteresis, dwell, arming and the physical filter."""

from dataclasses import dataclass

import numpy as np

from airtouch.detector.trace import Detection


@dataclass(frozen=True)
class Decoding:
    """Settings of `decode`, chosen on training flights.

    enter, leave: P(over) from which the drone counts as over a platform, and down to
    which as not over one; enter > leave. dwell: samples in a row that it takes.
    arm: samples in the air before edges are believed. alert_memory: samples for
    which an FR-CFAR alert lets edges through; None switches the physical filter off.
    """

    enter: float = 0.7
    leave: float = 0.3
    dwell: int = 10
    arm: int = 200
    alert_memory: int | None = 100


def armed(airborne: np.ndarray, arm: int) -> np.ndarray:
    """(n,) bool: in the air now and for the `arm` samples before."""
    return run_lengths(airborne) > arm


def decode(
    probability: np.ndarray, airborne: np.ndarray, settings: Decoding, alert: np.ndarray | None = None
) -> list[Detection]:
    """Edges of one flight: entries and exits in turn, each at the sample at which it is declared.

    probability: (n,) P(over), NaN is neither high nor low. airborne: (n,) bool. alert:
    (n,) bool of FR-CFAR, needed by the physical filter. The state follows the
    probability whether or not the filter lets the edge out; on the ground it is "not over".
    """
    on = armed(airborne, settings.arm)
    with np.errstate(invalid="ignore"):
        high = np.flatnonzero(run_lengths((probability >= settings.enter) & on) >= settings.dwell)
        low = np.flatnonzero(run_lengths((probability <= settings.leave) & on) >= settings.dwell)
    edges: list[Detection] = []
    for start, stop in _stretches(on):
        sample, over = start, False
        while True:
            places = low if over else high
            index = np.searchsorted(places, sample)
            if index == len(places) or places[index] >= stop:
                break
            sample = int(places[index])
            over = not over
            sure = float(probability[sample]) if over else 1.0 - float(probability[sample])
            edges.append(Detection(sample, "entry" if over else "exit", sure))
    if settings.alert_memory is None:
        return edges
    return physical_filter(edges, np.zeros(len(on), bool) if alert is None else alert, settings.alert_memory)


def physical_filter(edges: list[Detection], alert: np.ndarray, memory: int) -> list[Detection]:
    """The edges that had an FR-CFAR alert at their sample or up to `memory` before (paper, section 5.1)."""
    alerts = np.concatenate([[0], np.cumsum(alert)])
    return [e for e in edges if alerts[e.sample + 1] > alerts[max(e.sample - memory, 0)]]


def run_lengths(true: np.ndarray) -> np.ndarray:
    """(n,) int: how many samples in a row, up to and with this one, are true."""
    count = np.cumsum(true)
    return count - np.maximum.accumulate(np.where(true, 0, count)) if len(count) else count


def _stretches(true: np.ndarray) -> list[tuple[int, int]]:
    """(first, one past the last) of every stretch that is true."""
    change = np.flatnonzero(np.diff(np.concatenate([[False], true, [False]]).astype(np.int8)))
    return [(int(a), int(b)) for a, b in zip(change[::2], change[1::2], strict=True)]
