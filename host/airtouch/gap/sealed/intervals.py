"""Shares, medians and areas of a score, each with n and a 95 % interval."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypedDict

import numpy as np

DRAWS = 1000  #: bootstrap samples; chosen, the ends of an interval then vary little
ENDS = (2.5, 97.5)  #: percentiles of the bootstrap between which the 95 % interval lies


class Figure(TypedDict, total=False):
    """A figure of a score, JSON-ready: its value with a 95 % interval, None where nothing is known, of n cases.

    hits: cases that count, of a share; median: over cases, of a pooled share; probability: that was said, of a bin.
    """

    value: float | None
    low: float | None
    high: float | None
    n: int
    hits: int
    median: float | None
    probability: float


def share(values: Iterable[Any]) -> Figure:
    """Share of true values with n and Wilson's 95 % interval."""
    hits = [bool(v) for v in values]
    return wilson(sum(hits), len(hits))


def wilson(hits: float, n: int, z: float = 1.959964) -> Figure:
    """Share hits / n with Wilson's score interval; without trials anything is possible."""
    if not n:
        return {"value": None, "low": 0.0, "high": 1.0, "hits": 0, "n": 0}
    p, middle = hits / n, (hits + 0.5 * z * z) / (n + z * z)
    half = z * np.sqrt(p * (1.0 - p) / n + z * z / (4.0 * n * n)) / (1.0 + z * z / n)
    return {"value": p, "low": float(max(middle - half, 0.0)), "high": float(min(middle + half, 1.0)),
            "hits": int(hits), "n": int(n)}


def share_in_groups(groups: Sequence[Sequence[bool]]) -> Figure:
    """Share of true values of all groups with their n, and Wilson's interval as of so many values as there are groups.

    The values of a group, such as the parameters of one flight, may be right or wrong together.
    """
    hits, n = sum(map(sum, groups)), sum(map(len, groups))
    of_groups = wilson(hits / n * len(groups), len(groups)) if n else wilson(0, 0)
    return {**of_groups, "hits": hits, "n": n}


def share_text(hits: int, n: int, digits: int = 0) -> str:
    """Hits of n with the 95 % interval of their share, as text; digits: decimals of the percentages."""
    share = wilson(hits, n)
    return f"{hits} of {n} [{share['low']:.{digits}%}, {share['high']:.{digits}%}]"


def auroc(positive: Sequence[float], negative: Sequence[float]) -> float | None:
    """Chance that a positive scores higher than a negative, ties counted half; None where either has none."""
    if not len(positive) or not len(negative):
        return None
    a, b = np.asarray(positive)[:, None], np.asarray(negative)[None, :]
    return float((a > b).mean() + 0.5 * (a == b).mean())


def pooled(pairs: Sequence[tuple[float, float]]) -> Figure:
    """(before - after) / (before - 1) of sums and its median over flights; pairs: gap before and after of each."""
    if not pairs:
        return {"value": None, "low": None, "high": None, "median": None, "n": 0}
    x = np.array(pairs)
    removed, excess = x[:, 0] - x[:, 1], x[:, 0] - 1.0
    low, high = _bootstrap(lambda pick: removed[pick].sum(axis=1) / excess[pick].sum(axis=1), len(x))
    return {"value": float(removed.sum() / excess.sum()), "low": low, "high": high,
            "median": float(np.median(removed / excess)), "n": len(x)}


def median(values: np.ndarray) -> Figure:
    """Median of values (n,)."""
    if not len(values):
        return {"value": None, "low": None, "high": None, "n": 0}
    low, high = _bootstrap(lambda pick: np.median(values[pick], axis=1), len(values))
    return {"value": float(np.median(values)), "low": low, "high": high, "n": len(values)}


def _bootstrap(statistic: Callable[[np.ndarray], np.ndarray], n: int) -> tuple[float, float]:
    """Ends of a statistic's interval over n cases, always the same draws.

    statistic: takes the cases of each draw (DRAWS, n) and gives its values (DRAWS,).
    """
    low, high = np.percentile(statistic(np.random.default_rng(0).integers(0, n, (DRAWS, n))), ENDS)
    return float(low), float(high)
