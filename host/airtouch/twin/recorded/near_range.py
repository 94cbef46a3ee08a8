"""Height of the platform, and error of the down range near it, from dead-reckoned height around the edges.

A reading near a surface is too small, so the step of the down range at an edge gives neither of the two. Before an
entry and after an exit the floor is below and the reading is right. From there the vertical acceleration, integrated
twice, gives the height over the floor for some tenths of a second.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from airtouch.twin.recorded import channels as ch
from airtouch.twin.recorded.channels import RATE_HZ
from airtouch.twin.recorded.course import Course

ANCHOR_S, CARRIED_S = 1.0, 0.8  #: s of readings over the floor that anchor the height, and s of dead reckoning after it
#: m, standard deviations: of a reading, and of the dead-reckoned height after 1 s (from a bias of 0.04 m/s^2, it grows
#: with the square of time)
READING_STD_M, DRIFT_M = 0.002, 0.02
#: mean and standard deviation of the prior of near (m), fade (m), delay (s); weak if the flights differ in height
PRIOR = np.array([[-0.04, 0.04], [0.055, 0.01], [0.035, 0.01]])
FIRM = 10.0  #: weight of the prior relative to the flights
LEAST, MOST = (-0.2, 0.01, 0.0), (0.0, 0.2, 0.1)  #: bounds of near (m), fade (m), delay (s)
ALIKE_M = 0.06  #: m, largest difference of the steps at one platform, whose readings differ by height
FEWEST = 4  #: least number of flights


@dataclass(frozen=True)
class NearRange:
    """The height of the platform over the floor (top_m) and the error of the down range near it.

    A reading at the distance d, m, is d + near exp(-d / fade), delay seconds late; near and fade in m.
    """

    top_m: float
    near: float
    fade: float
    delay: float


def measure(courses: Sequence[Course], channels: Sequence[np.ndarray]) -> NearRange | None:
    """The platform of these flights; None if they cross more than one platform or are too few.

    channels: (n, 12) of each flight, as `channels.channels`. Nonlinear least squares over all flights with one
    platform, one bias curve and one delay. On simulated flights the fitted height is up to 8 mm too large, and the
    error too small.
    """
    steps = np.array([c.before_m - c.entered_m for c in courses])
    if len(courses) < FEWEST or np.ptp(np.percentile(steps, (10, 90))) > ALIKE_M:
        return None
    parts = [part for c, x in zip(courses, channels, strict=True) for part in around(c, x)]
    if not parts:
        return None
    height, climb, reading, std = map(np.concatenate, zip(*parts, strict=True))

    def residual(p: np.ndarray) -> np.ndarray:
        true = np.maximum(height - p[3] * climb - p[0], 0.0)
        modelled = np.maximum(true + p[1] * np.exp(-true / p[2]), 0.0)
        return np.r_[(modelled - reading) / std, FIRM * (p[1:] - PRIOR[:, 0]) / PRIOR[:, 1]]

    top = float(np.median(steps))
    solved = least_squares(residual, [top, *PRIOR[:, 0]], loss="soft_l1", x_scale=[0.01, 0.01, 0.01, 0.01],
                           bounds=([top - 0.1, *LEAST], [top + 0.1, *MOST]))
    return NearRange(*(float(v) for v in solved.x))


def around(course: Course, x: np.ndarray) -> list[tuple[np.ndarray, np.ndarray, np.ndarray, float]]:
    """Height over the floor (m,), m, its slope (m,), m/s, and the down range (m,), m, of each edge.

    The fourth value is the standard deviation of height less down range, m, with each edge as one measurement.
    """
    down, dt = 0.01 * x[:, ch.DOWN], 1.0 / RATE_HZ
    change = np.cumsum(np.cumsum(x[:, ch.AZ] - np.median(x[course.free, ch.AZ]))) * dt * dt
    t = np.arange(len(x)) * dt
    anchor, carried, apart = (int(s * RATE_HZ) for s in (ANCHOR_S, CARRIED_S, 0.08))
    spans = ((slice(course.entry - anchor, course.entry - apart // 2), course.entry,
              slice(course.entry + 2, min(course.entry + carried, course.exit - 3))),
             (slice(course.exit + apart, min(course.exit + anchor, course.landing)), course.exit + apart,
              slice(max(course.exit - carried + apart, course.entry + 2), course.exit - 3)))
    out = []
    for floor, tied, over in spans:
        valid = down[floor] > 0.5 * course.before_m
        if valid.sum() < anchor // 3 or over.stop - over.start < apart:
            continue
        drift = np.polyfit(t[floor][valid] - t[tied], (down - change)[floor][valid], 1)
        height = change + np.polyval(drift, t - t[tied])
        std = (READING_STD_M + DRIFT_M * (t[over] - t[tied]) ** 2) * np.sqrt(over.stop - over.start)
        out.append((height[over], np.gradient(height, dt)[over], down[over], std))
    return out
