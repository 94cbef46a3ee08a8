"""Which signals of the flight a gap follows: of height, speed, thrust, tilt, battery voltage and time."""

from collections.abc import Mapping, Sequence

import numpy as np

from airtouch.gap.flights.flight import PERIOD_S, Flight
from airtouch.gap.flights.missing import interpolate_missing
from airtouch.gap.signals.spectra import AIR, LENGTH, starts
from airtouch.gap.study import Study
from airtouch.simulation import signals as at

#: least number of blocks that do not overlap for which a rank correlation is tested; chosen. A larger number names no
#: signal in short flights
FEWEST_BLOCKS = 8
#: probability that any signal correlates so by chance alone (Bonferroni); chosen. A larger number names more
#: signals that the gap does not follow
SIGNIFICANCE_LEVEL = 0.01
#: largest correlation of neighbouring blocks that is taken; chosen. With a larger number fewer signals are named in
#: short flights
LARGEST_CORRELATION = 0.97
LEAST_RATIO = 1e-9  #: least ratio to the floor of which a logarithm is taken; far below any measured


def followed_signals(study: Study, ratios: Sequence[tuple[Flight, np.ndarray]]) -> list[str]:
    """Names of the signals whose block means correlate in rank with a cell's power (Spearman), the closest first.

    ratios: flights, each with the cell's rms over its floor (blocks,), NaN in blocks that do not count. A signal that
    not every flight has is left out. Blocks overlap by half: every other one of a flight counts.
    """
    power = np.concatenate([np.log(np.maximum(ratio, LEAST_RATIO))[::2] for _, ratio in ratios])
    known = np.isfinite(power)
    if known.sum() < FEWEST_BLOCKS:
        return []
    place = np.concatenate([len(ratio[::2]) * [k] for k, (_, ratio) in enumerate(ratios)])[known]
    neighbours = (np.diff(np.flatnonzero(known)) == 1) & (np.diff(place) == 0)
    means = [_block_means(study, flight) for flight, _ in ratios]
    names = list(dict.fromkeys(name for of_flight in means for name in of_flight))
    correlations = []
    for name in names:
        if not all(name in of_flight for of_flight in means):
            continue
        values = np.concatenate([of_flight[name][::2] for of_flight in means])[known]
        if np.ptp(values) == 0.0:
            continue
        correlation, p = rank_correlation(values, power[known], neighbours)
        if p < SIGNIFICANCE_LEVEL / len(names):
            correlations.append((abs(correlation), name))
    return [name for _, name in sorted(correlations, reverse=True)]


def rank_correlation(x: np.ndarray, y: np.ndarray, neighbours: np.ndarray) -> tuple[float, float]:
    """Spearman's correlation of x (n,) with y (n,) and its p value, where neighbouring values are correlated.

    As many values count as independent as n (1 - q) / (1 + q), with q the product of the lag-1 correlations of x and of
    what a line through the ranks leaves of y (Bartlett 1935): of neighbours that vary together the p value of
    independent ones would be too small. neighbours (n - 1,): whether a value and the next follow one another in time.
    """
    from scipy.stats import rankdata, t  # slow to import, and seldom needed

    a, b = (r - r.mean() for r in (rankdata(x), rankdata(y)))
    if not np.any(a) or not np.any(b):
        return 0.0, 1.0
    slope = a @ b / (a @ a)
    r = float(np.clip(a @ b / np.sqrt((a @ a) * (b @ b)), -1.0, 1.0))
    q = _lag_one(a, neighbours, 1) * _lag_one(b - slope * a, neighbours, 2)
    degrees = len(a) * (1.0 - q) / (1.0 + q) - 2.0
    if degrees <= 0.0:
        return r, 1.0
    unexplained = max(1.0 - r * r, 1e-12)  # share of the variance of the ranks
    return r, float(2.0 * t.sf(abs(r) * np.sqrt(degrees / unexplained), degrees))


def _lag_one(values: np.ndarray, neighbours: np.ndarray, fitted: int) -> float:
    """Correlation of neighbouring values (n,) of mean 0, from 0 to LARGEST_CORRELATION.

    fitted: parameters taken from the values; about (fitted + 4 correlations) / n is lost with them, which is put back
    (Kendall 1954).
    """
    power = float(values @ values)
    n, pairs = len(values), int(neighbours.sum())
    if power <= 1e-12 * n ** 3 or not pairs or n <= 4:
        return 0.0
    of_pairs = float((values[1:] * values[:-1])[neighbours].sum()) / power * (n - 1) / pairs
    return float(np.clip((n * of_pairs + fitted) / (n - 4), 0.0, LARGEST_CORRELATION))


def _block_means(study: Study, flight: Flight) -> dict[str, np.ndarray]:
    """Mean in the air (blocks,) of each signal of a flight, by its name."""
    samples = starts(flight, AIR)[:, None] + np.arange(LENGTH[AIR])
    return {name: values[samples].mean(axis=1) for name, values in _signals(study, flight).items()}


def _signals(study: Study, flight: Flight) -> Mapping[str, np.ndarray]:
    """The signals (n,) of a flight that a gap may follow, by their names in the answer."""
    s, log = flight.signals, flight.log
    thrust = study.vehicle.thrust(flight.pwm).sum(axis=1)
    out = {"thrust": thrust, "tilt": np.hypot(flight.body_to_world[:, 2, 0], flight.body_to_world[:, 2, 1]),
           "time": np.arange(len(flight)) * PERIOD_S}
    if log.has("zrange_m") or log.has("z_m"):
        out["height"] = s[:, at.LOWER_HEIGHT:at.LOWER_HEIGHT + 4].mean(axis=1)
    if log.has("vx_mps", "vy_mps"):
        out["speed"] = np.hypot(s[:, at.VELOCITY], s[:, at.VELOCITY + 1])
    if log.has("vbat_V"):
        out["battery voltage"] = interpolate_missing(log["vbat_V"])
    return out
