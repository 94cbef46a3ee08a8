"""A flight of noise with a platform in it, and a network small enough to train in a moment.

A training with other steps is compiled anew, which takes longer than all of SMALL's.
"""

import numpy as np

from airtouch.detector.best.recipe import Recipe
from airtouch.logs.flight_log import FlightLog

SMALL = Recipe(width=8, dilations=(1, 2, 4), steps=60, batch=4, crop=512, warm_up=64, sparsity=0.5)
SMALL_SEED = 3  #: of its training; every layer takes many values


def made_flight(seed: int = 0, n: int = 2500) -> FlightLog:
    """Hover noise with a platform under samples 1200 to 1700."""
    rng = np.random.default_rng(seed)
    over_platform = (np.arange(n) >= 1200) & (np.arange(n) < 1700)
    pwm = 47000 + 1500 * rng.standard_normal((n, 4)) - 1500 * over_platform[:, None]
    pwm[:150] = 0
    columns = {"t_s": np.arange(n) * 0.01, "zrange_m": np.where(over_platform, 0.05, 0.8)}
    columns["zrange_m"][:150] = 0.02
    for i, axis in enumerate("xyz"):
        columns[f"acc_{axis}_mps2"] = rng.normal(9.81 if i == 2 else 0, 0.2 + 0.4 * over_platform)
        columns[f"gyro_{axis}_radps"] = rng.normal(0, 0.1 + 0.3 * over_platform)
    columns |= {f"m{i + 1}_pwm": pwm[:, i] for i in range(4)}
    return FlightLog(columns, {"source": f"made{seed}.csv", "sample_period_s": 0.01})
