"""Height of the platform, and error of the down range near it, from dead-reckoned height around the edges.

A reading near a surface is too small, so the step of the down range at an edge gives neither of the two. Before an
entry and after an exit the floor is below and the reading is right. From there the vertical acceleration, integrated
twice, gives the height over the floor for some tenths of a second.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from airtouch.parameters import SAMPLE_RATE_HZ
from airtouch.twin.recorded import channels as ch
from airtouch.twin.recorded.course import Course

#: s of readings over the floor that anchor the height, and s of dead reckoning after it; no source: round numbers
ANCHOR_S, CARRIED_S = 1.0, 0.8
GUARD_S = 0.08  #: s around an edge whose readings are of neither surface; the range sees one every 25 ms
MIN_ANCHOR = 1.0 / 3.0  #: fraction of the anchor's readings that must be of the floor; no source: round number
#: m, standard deviations: of a reading, and of the dead-reckoned height after 1 s (from a bias of 0.04 m/s^2, it grows
#: with the square of time)
READING_STD_M, DRIFT_M = 0.002, 0.02
#: mean and standard deviation of the prior of near (m), fade (m), delay (s); found on folds 0 to 2, where a fade of
#: 2.5 cm fits better (host/docs/twin-findings.md), and weak if the flights differ in height
PRIOR = np.array([[-0.04, 0.04], [0.055, 0.01], [0.035, 0.01]])
PRIOR_WEIGHT = 10.0  #: of the prior relative to an edge; no source: round number
LOW, HIGH = (-0.2, 0.01, 0.0), (0.0, 0.2, 0.1)  #: bounds of near (m), fade (m), delay (s); no source: round numbers
TOP_RANGE_M = 0.1  #: m around the median step in which the platform's height is looked for; no source: round number
#: m, largest difference of the steps at one platform, whose readings differ by height: 0.735 to 0.766 m on folds 0 to 2
#: (host/docs/twin-findings.md), twice that
SAME_PLATFORM_M = 0.06
#: typical change of top, near and fade (m) and delay (s): the unit of the solver's steps; no source: round number
PARAMETER_SCALE = (0.01, 0.01, 0.01, 0.01)
MIN_FLIGHTS = 4  #: least number of flights, as `flights.MIN_FLIGHTS`


@dataclass(frozen=True)
class NearRange:
    """The height of the platform over the floor (top_m) and the error of the down range near it.

    A reading at the distance d, m, is d + near exp(-d / fade), delay seconds late; near and fade in m.
    """

    top_m: float
    near: float
    fade: float
    delay: float


class EdgeHeights(NamedTuple):
    """What the samples (m,) over the surface at an edge say of its height.

    height: over the floor, m. climb: its slope, m/s. reading: the down range, m. std: standard deviation of height less
    reading, m, with the edge as one measurement.
    """

    height: np.ndarray
    climb: np.ndarray
    reading: np.ndarray
    std: np.ndarray


def measure(courses: Sequence[Course], channels: Sequence[np.ndarray]) -> NearRange | None:
    """The platform of these flights; None if they cross more than one platform or are too few.

    channels: (n, 12) of each flight, as `channels.channels`. Nonlinear least squares over all flights with one
    platform, one bias curve and one delay. On simulated flights the fitted height is up to 8 mm too large, and the
    error too small.
    """
    steps = np.array([c.before_m - c.entered_m for c in courses])
    if len(courses) < MIN_FLIGHTS or np.ptp(np.percentile(steps, (10, 90))) > SAME_PLATFORM_M:
        return None
    edges = [edge for c, x in zip(courses, channels, strict=True) for edge in around(c, x)]
    if not edges:
        return None
    height, climb, reading, std = map(np.concatenate, zip(*edges, strict=True))

    def residual(p: np.ndarray) -> np.ndarray:
        """Standardised residuals of readings and prior. p: top, near, fade, delay."""
        true = np.maximum(height - p[3] * climb - p[0], 0.0)
        modelled = np.maximum(true + p[1] * np.exp(-true / p[2]), 0.0)
        return np.r_[(modelled - reading) / std, PRIOR_WEIGHT * (p[1:] - PRIOR[:, 0]) / PRIOR[:, 1]]

    top = float(np.median(steps))
    solution = least_squares(residual, [top, *PRIOR[:, 0]], loss="soft_l1", x_scale=PARAMETER_SCALE,
                             bounds=([top - TOP_RANGE_M, *LOW], [top + TOP_RANGE_M, *HIGH])).x
    return NearRange(*(float(v) for v in solution))


def around(course: Course, x: np.ndarray) -> list[EdgeHeights]:
    """Dead-reckoned heights and readings of each edge; an edge without readings over both surfaces is left out.

    x: (n, 12) channels.
    """
    down, dt = 0.01 * x[:, ch.DOWN], 1.0 / SAMPLE_RATE_HZ
    change = np.cumsum(np.cumsum(x[:, ch.AZ] - np.median(x[course.free, ch.AZ]))) * dt * dt
    t = np.arange(len(x)) * dt
    anchor, carried, guard = (int(s * SAMPLE_RATE_HZ) for s in (ANCHOR_S, CARRIED_S, GUARD_S))
    spans = ((slice(course.entry - anchor, course.entry - guard // 2), course.entry,
              slice(course.entry + 2, min(course.entry + carried, course.exit - 3))),
             (slice(course.exit + guard, min(course.exit + anchor, course.landing)), course.exit + guard,
              slice(max(course.exit - carried + guard, course.entry + 2), course.exit - 3)))
    out: list[EdgeHeights] = []
    for floor, tie, over in spans:
        valid = down[floor] > 0.5 * course.before_m
        if valid.sum() < int(MIN_ANCHOR * anchor) or over.stop - over.start < guard:
            continue
        drift = np.polyfit(t[floor][valid] - t[tie], (down - change)[floor][valid], 1)
        height = change + np.polyval(drift, t - t[tie])
        std = (READING_STD_M + DRIFT_M * (t[over] - t[tie]) ** 2) * np.sqrt(over.stop - over.start)
        out.append(EdgeHeights(height[over], np.gradient(height, dt)[over], down[over], std))
    return out
