"""Bootstrap intervals: of ratios of sums, resampled by flight, and of any statistic of resampled cases."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

Sums = Mapping[str, np.ndarray]


def bootstrap(
    table: Sums,
    statistics: Callable[[Sums], Mapping[str, np.ndarray]],
    *,
    replicates: int = 2000,
    level: float = 0.95,
    seed: int = 0,
) -> dict[str, tuple[float, float] | None]:
    """Percentile intervals of statistics that depend on sums over flights only.

    table: name -> (flights,) one value a flight. statistics: name -> (...,) sums
    in, name -> (...,) statistics out; non-finite values of a replicate are left
    out. A flight is drawn whole, so that what happens within it stays together.
    Returns name -> (low, high), or None with fewer than two flights or where no
    replicate is finite. Source: Efron, Tibshirani, An Introduction to the
    Bootstrap, ch. 13.
    """
    flights = len(next(iter(table.values()), ()))
    if flights < 2:
        whole = statistics({name: np.zeros(1) for name in table})
        return dict.fromkeys(whole)
    draws = np.random.default_rng(seed).multinomial(flights, np.full(flights, 1 / flights), size=replicates)
    resampled = statistics({name: draws @ np.asarray(values, float) for name, values in table.items()})
    tail = 50.0 * (1.0 - level)
    intervals: dict[str, tuple[float, float] | None] = {}
    for name, values in resampled.items():
        finite = values[np.isfinite(values)]
        bounds = np.percentile(finite, [tail, 100.0 - tail]) if len(finite) else None
        intervals[name] = None if bounds is None else (float(bounds[0]), float(bounds[1]))
    return intervals


def resampled(statistic: Callable[..., Any], *sizes: int, replicates: int, level: float, seed: int = 0) -> np.ndarray:
    """Percentile interval (2, ...) of a statistic that depends on each case, not on sums alone.

    sizes: of the groups of cases, each of which is resampled on its own. statistic: takes the indices (size,) of each
    group's cases in a replicate and gives one or more numbers; NaN are left out.
    """
    generator = np.random.default_rng(seed)
    values = [statistic(*(generator.integers(0, size, size) for size in sizes)) for _ in range(replicates)]
    return np.nanpercentile(np.array(values, float), (50.0 - 50.0 * level, 50.0 + 50.0 * level), axis=0)
