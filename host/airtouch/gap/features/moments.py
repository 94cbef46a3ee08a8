"""Means, variances and regressions of one flight's signals, in the air, by phase and at rest; the log's times."""

from functools import cache

import numpy as np

from airtouch.gap.features.feature import LEAST_CLOCK, LEAST_LOG, LEAST_LOST, Feature
from airtouch.gap.features.flight_signals import (
    COLUMNS,
    COMMAND,
    FORCE_RESIDUAL,
    RANGE_RESIDUAL,
    SPEED_RESIDUAL,
    TORQUE_RESIDUAL,
    FlightSignals,
)
from airtouch.gap.flights.clock import LEAST_JITTER_S
from airtouch.gap.nameless.basis import BASIS, basis
from airtouch.logs.segments import KINDS
from airtouch.vehicle import Vehicle

AXES = "xyz"
REGRESSED = {"force": FORCE_RESIDUAL, "torque": TORQUE_RESIDUAL, "speed": SPEED_RESIDUAL}
OF_MEANS = slice(FORCE_RESIDUAL.start, SPEED_RESIDUAL.stop)  #: columns of the table whose means are looked at
FEWEST_IN_PHASE = 20  #: samples of a phase, 0.2 s; else the whole flight stands in for it; chosen
FEWEST_AT_REST = 4  #: samples at rest of which a variance is taken; chosen
FAST_SAMPLES = 50  #: samples, 0.5 s, over which a mean is slow; chosen
LEAST_VARIANCE = 1e-14  #: variance that is added, in squared units of a signal, so that none is 0
LEAST_SCORE = 1e-9  #: sum of squares of a column that is added to it, so that none is 0


@cache
def declared_features() -> tuple[Feature, ...]:
    """What `moment_features` gives, in its order: scores, each phase, the second half, at rest, the clock."""
    means = [*COLUMNS[OF_MEANS], *COLUMNS[COMMAND]]
    slow = [*(f"{what} {axis}" for what in ("angle", "velocity", "rate") for axis in AXES), *COLUMNS[RANGE_RESIDUAL]]
    of_phase = [*(Feature(f"mean {what}") for what in (*means, *slow)),
                *(Feature(f"variance {what}", LEAST_LOG) for what in COLUMNS)]
    imu = [f"{what} {axis}" for what in ("acceleration", "rate") for axis in AXES]
    return (
        *(Feature(f"{what} {axis} follows {b}") for what in REGRESSED for axis in AXES for b in BASIS),
        *(Feature(f"{phase} {f.name}", f.least) for phase in KINDS[1:] for f in of_phase),
        *(Feature(f"later mean {what}") for what in means),
        *(Feature(f"rest mean {what}") for what in imu),
        *(Feature(f"rest {part} {what}", LEAST_LOG) for part in ("fast variance", "variance") for what in imu),
        Feature("clock rms", LEAST_CLOCK), Feature("clock steps", LEAST_CLOCK),
        Feature("clock lost", LEAST_LOST), Feature("clock runs", LEAST_LOST))


def moment_features(signals: FlightSignals, vehicle: Vehicle) -> np.ndarray:
    """Scores, means and variances (len(declared_features()),) of a flight; NaN where there is nothing to tell by.

    What force, torque and estimated speed have of the flight's own signals (`nameless.basis`); means and logarithms of
    variances in each phase; what the second half has over the first; means and noise at rest; and what the log did to
    its times.
    """
    return np.concatenate([_scores(signals, vehicle), *(_of_phase(signals, k) for k in range(1, len(KINDS))),
                           _later(signals), _at_rest(signals), _clock(signals)])


def _scores(signals: FlightSignals, vehicle: Vehicle) -> np.ndarray:
    """Scores of each force, torque and speed on each column of the basis: products, over the column's length."""
    columns, out = basis(signals.flight, vehicle)[signals.air], []  # (samples, columns, axes)
    root = np.sqrt(signals.air.sum() + 1.0)
    for place in REGRESSED.values():
        residual = signals.table[signals.air, place]
        for axis in range(len(AXES)):
            of_axis = columns[:, :, axis]
            length = np.sqrt((of_axis ** 2).sum(axis=0) + LEAST_SCORE)
            out.append(of_axis.T @ residual[:, axis] / length / root)
    return np.concatenate(out)


def _means(signals: FlightSignals, samples: np.ndarray) -> np.ndarray:
    """Means of what model and estimator leave open, and of the commands, over samples, bool (n,) or places."""
    table = signals.table
    return np.concatenate([table[samples, OF_MEANS].mean(axis=0), table[samples, COMMAND].mean(axis=0)])


def _of_phase(signals: FlightSignals, phase: int) -> np.ndarray:
    """`_means`, those of angles, velocity, rates and range, and log variances of the part faster than 0.5 s."""
    in_phase = signals.air & (signals.flight.phase == phase)
    samples = in_phase if in_phase.sum() > FEWEST_IN_PHASE else signals.air
    assert signals.flight.rates is not None
    slow = [x[samples].mean(axis=0) for x in (signals.angles, signals.velocity, signals.flight.rates,
                                              signals.table[:, RANGE_RESIDUAL])]
    fast = (signals.table - _smoothed(signals.table))[samples].var(axis=0)
    return np.concatenate([_means(signals, samples), *slow, np.log(fast + LEAST_VARIANCE)])


def _smoothed(table: np.ndarray) -> np.ndarray:
    """Means (n, c) over FAST_SAMPLES around each sample, fewer at the ends."""
    sums = np.cumsum(np.vstack([np.zeros(table.shape[1]), table]), axis=0)
    place = np.arange(len(table))
    low, high = np.maximum(place - FAST_SAMPLES // 2, 0), np.minimum(place + FAST_SAMPLES // 2, len(table))
    return (sums[high] - sums[low]) / (high - low)[:, None]


def _later(signals: FlightSignals) -> np.ndarray:
    """Means of the second half of the flight less those of the first."""
    place = np.flatnonzero(signals.air)
    first, second = np.array_split(place, 2)
    return _means(signals, second) - _means(signals, first)


def _at_rest(signals: FlightSignals) -> np.ndarray:
    """Means (6), logarithms of variances of differences (6) and of values (6) of accelerations and rates."""
    assert signals.flight.rates is not None
    imu = np.column_stack([signals.flight.acceleration, signals.flight.rates])[signals.rest]
    if len(imu) < FEWEST_AT_REST:
        return np.full(3 * imu.shape[1], np.nan)
    return np.concatenate([imu.mean(axis=0), np.log(np.diff(imu, axis=0).var(axis=0) + LEAST_VARIANCE),
                           np.log(imu.var(axis=0) + LEAST_VARIANCE)])


def _clock(signals: FlightSignals) -> np.ndarray:
    """Logarithms of the rms of the logged times and of their steps, and of the numbers of lost rows and of gaps."""
    clock, lost = signals.flight.clock_s, signals.flight.lost
    gaps = (np.diff(lost.astype(int), prepend=0) == 1).sum()
    rms = [np.sqrt(np.mean(x ** 2)) if len(x) else 0.0 for x in (clock, np.diff(clock))]
    return np.concatenate([np.log(np.array(rms) + LEAST_JITTER_S), np.log1p([lost.sum(), gaps])])
