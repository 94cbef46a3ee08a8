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
LEAST_RATIO = 1e-9  #: least ratio to the floor of which a logarithm is taken; far below any measured


def followed_signals(study: Study, ratios: Sequence[tuple[Flight, np.ndarray]]) -> list[str]:
    """Names of the signals whose block means correlate in rank with a cell's power (Spearman), the closest first.

    ratios: flights, each with the cell's rms over its floor (blocks,), NaN in blocks that do not count. A signal that
    not every flight has is left out.
    """
    from scipy.stats import spearmanr  # slow to import, and seldom needed

    power = np.concatenate([np.log(np.maximum(ratio, LEAST_RATIO)) for _, ratio in ratios])[::2]  # they overlap by half
    known = np.isfinite(power)
    if known.sum() < FEWEST_BLOCKS:
        return []
    means = [_block_means(study, flight) for flight, _ in ratios]
    names = list(dict.fromkeys(name for of_flight in means for name in of_flight))
    correlations = []
    for name in names:
        if not all(name in of_flight for of_flight in means):
            continue
        values = np.concatenate([of_flight[name] for of_flight in means])[::2][known]
        if np.ptp(values) == 0.0:
            continue
        rank = spearmanr(values, power[known])
        if rank.pvalue < SIGNIFICANCE_LEVEL / len(names):
            correlations.append((abs(rank.statistic), name))
    return [name for _, name in sorted(correlations, reverse=True)]


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
