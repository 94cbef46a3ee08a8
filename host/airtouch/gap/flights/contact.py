"""Moments at which something touches the vehicle: legs on the ground, a hand, a wall. They are no evidence."""

import numpy as np

from airtouch.gap.flights.clock import PERIOD_S
from airtouch.gap.flights.missing import interpolate_missing
from airtouch.logs.segments import LEAST_HEIGHT_M, runs
from airtouch.robust import deviation

CONTACT_S = 0.3  #: seconds excluded before and after take-off, touch-down and a collision; chosen
SETTLED_S = 1.0  #: seconds after the motors have stopped in which the vehicle may still bounce; chosen
#: height over what is read standing, m, below which legs may touch, and seconds before and after it; chosen
TOUCH_M, TOUCH_S = 0.006, 0.05
#: seconds up to which a vehicle that stands with its motors on is taking off or landing, as in every flight; chosen:
#: longer than the 0.7 to 1 s of the authors' take-offs, and shorter than a wait
SHORT_STAND_S = 1.2
KNOCK = 7.0  #: robust standard deviations at rest from which a sample is a knock; chosen
LEAST_AT_REST_MPS2 = 1e-3  #: standard deviation at rest that an accelerometer has at least; chosen
#: robust standard deviations in flight above which the vehicle hit something: over the 35 that steps of a set-point
#: reach; chosen
JOLT = 40.0
LEAST_IN_FLIGHT = 1e-6  #: standard deviation in flight, in the channel's unit, that a channel has at least; chosen
LONG_AGO = 10 ** 6  #: samples, longer than SETTLED_S: before the first command
#: share of a flight that collisions may take with the seconds around them, or by themselves, which a few in a short
#: flight do not reach; more is no collision; chosen
MOST_JOLTED, MOST_HIT = 0.1, 0.02


def within(samples: np.ndarray, seconds: float) -> np.ndarray:
    """Samples (n,), bool, no further than some seconds from one of `samples` (n,), bool."""
    return np.convolve(samples, np.ones(2 * int(seconds / PERIOD_S) + 1), "same") > 0.5


def knocks(force: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """Samples (n,), bool, at rest at which somebody or something pushed: far off all the others there.

    force (n, 3): specific force, m/s^2; rest (n,): on the ground with the motors off.
    """
    out = np.zeros(len(rest), bool)
    if rest.any():
        away = np.abs(force[rest] - np.median(force[rest], axis=0))
        out[rest] = (away > KNOCK * np.maximum(deviation(force[rest]), LEAST_AT_REST_MPS2)).any(axis=1)
    return out


def jolts(force: np.ndarray, rates: np.ndarray | None, air: np.ndarray) -> np.ndarray:
    """Samples (n,), bool, around those at which the vehicle hit something in flight.

    force (n, 3): specific force, m/s^2; rates (n, 3): rad/s, whose steps are looked at; air (n,): in flight.
    """
    hit = np.zeros(len(air), bool)
    turning = np.zeros((len(air), 0)) if rates is None else np.diff(rates, axis=0, prepend=rates[:1])
    for values in (*force.T, *turning.T):
        away = np.abs(values - np.median(values[air]))
        hit |= air & (away > JOLT * max(float(deviation(values[air])), LEAST_IN_FLIGHT))
    around = within(hit, CONTACT_S)
    collided = around[air].mean() < MOST_JOLTED or hit[air].mean() < MOST_HIT
    return around if collided else np.zeros_like(around)


def standing(range_m: np.ndarray, ground: np.ndarray, running: np.ndarray, leg_m: float) -> np.ndarray:
    """Samples (n,), bool, at which the vehicle waits on the ground with its motors on, before or after it flew.

    A wait is longer than SHORT_STAND_S, before the first lift-off or after the last touch-down of a stretch with the
    motors on: a stop between is not told from a low pass. range_m (n,): down range; ground (n,): not in the air by its
    commands; running (n,): a motor is commanded; leg_m: what the range reads standing, where no rest in the log reads
    less than LEAST_HEIGHT_M.
    """
    height = interpolate_missing(range_m)
    rest = ground & ~running & (height < LEAST_HEIGHT_M)  # in a hand it reads more
    low = within(height < (float(np.median(height[rest])) if rest.any() else leg_m) + TOUCH_M, TOUCH_S)
    out = np.zeros(len(low), bool)
    for start, stop in runs(~ground):
        high = np.flatnonzero(~low[start:stop])
        if len(high):
            for a, b in ((start, start + high[0]), (start + high[-1] + 1, stop)):
                out[a:b] = (b - a) * PERIOD_S > SHORT_STAND_S
    return out


def near_ground(ground: np.ndarray, running: np.ndarray) -> np.ndarray:
    """Samples (n,), bool, at which legs may touch: motors run on the ground, and around take-off and touch-down.

    ground (n,): not in the air; running (n,): a motor is commanded. Rest before the first command is not touched.
    """
    rest = ground & ~running
    touching = ground & running
    change = np.diff((ground | ~running).astype(np.int8))
    wide = int(CONTACT_S / PERIOD_S)
    for k in np.flatnonzero(change):
        touching[max(k - wide, 0):k + wide] = True
    sample = np.arange(len(running))
    since = sample - np.maximum.accumulate(np.where(running, sample, -LONG_AGO))  # samples since the last command
    touching |= rest & (since < SETTLED_S / PERIOD_S)
    before = rest & (np.cumsum(running) == 0)
    before[np.argmax(running) - 1 if running.any() else 0:] = False
    return touching & ~before
