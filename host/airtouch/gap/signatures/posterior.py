"""Scatter of a few values: what a class of vehicles says beforehand, updated by the values of the baseline."""

from collections.abc import Sequence

import numpy as np
from scipy.special import logsumexp

LEAST = 1e-3  #: natural steps that the scatter of a parameter is at least; no effect is a thousandth of its step
#: standard deviations above the mean to which values are cut, and up to which a rate is no news; chosen
MOST_STANDARD_DEVIATIONS = 4.0
LEAST_INFORMATION = 1.0  #: exactly known values, of a scatter of a natural step, of which a scatter can be estimated
GRID = np.geomspace(LEAST, 30.0, 200)  #: standard deviations, in natural steps, among which the posterior's median is


def standard_deviation(x: np.ndarray, error: np.ndarray, prior: float, worths: Sequence[float] = ()) -> float:
    """Posterior median of the standard deviation of values (n,) that chance alone scatters by `error` (n,).

    The variance's prior is scaled inverse chi-square about `prior`^2 (Gelman et al., Bayesian Data Analysis, 3rd ed.,
    section 2.6). Each of the degrees of freedom `worths` is as likely as the others, since flights that do not scatter
    as a well-known class does are not of it. Without worths every order of magnitude of GRID is as likely, and LEAST is
    the answer where the values have too little information. The median is taken because the likeliest value is 0
    wherever chance can explain the values.
    """
    information = float(((1.0 + error ** 2) ** -2.0).sum())  # Fisher's, of each value 1 at most
    if not worths and information < LEAST_INFORMATION:
        return LEAST
    variance = GRID[:, None] ** 2 + error ** 2
    level = -0.5 * (np.log(variance) + x ** 2 / variance).sum(axis=1)
    if worths:
        priors = [-0.5 * n * (np.log(GRID ** 2) + prior ** 2 / GRID ** 2) for n in worths]
        level += logsumexp([p - logsumexp(p) for p in priors], axis=0)
    below = np.cumsum(np.exp(level - level.max()))
    return float(GRID[int(np.searchsorted(below, 0.5 * below[-1]))])


def updated(own: tuple[float, float], values: Sequence[float] | np.ndarray, worth: float, least: float = 0.0,
             ) -> tuple[float, float]:
    """Mean and standard deviation about it, from those of a class and from the values (n,) of the baseline.

    The mean is that of the class at least, as a few flights without a gust do not make gusts rarer. own: those of the
    class; worth: number of flights that they count as; least: standard deviation at least.
    """
    class_mean, spread = own
    values = np.minimum(values, class_mean + MOST_STANDARD_DEVIATIONS * spread)
    total = worth + len(values)
    mean = float(max((worth * class_mean + values.sum()) / total, class_mean))
    spread = float(np.sqrt((worth * spread ** 2 + ((values - mean) ** 2).sum()) / total))
    return mean, max(spread, least)


def predicted(own: tuple[float, float], values: Sequence[float] | np.ndarray, level_worth: float, worth: float,
              ) -> tuple[float, float]:
    """Middle and scale of Student's density of a further value, where those (n,) of a baseline have their own level.

    Values are normal about a level with a variance, whose prior is normal-inverse-chi-square (Gelman et al., Bayesian
    Data Analysis, 3rd ed., section 3.3); the density has worth + n degrees of freedom. own: mean and standard deviation
    of the class, from level to level and about it together; level_worth, worth: numbers of flights that the class's
    level and its variance count as.
    """
    class_mean, spread = own
    values = np.minimum(values, class_mean + MOST_STANDARD_DEVIATIONS * spread)
    n, total = len(values), level_worth + len(values)
    mean = (level_worth * class_mean + values.sum()) / total
    about_level = spread ** 2 * level_worth / (level_worth + 1.0)
    off = float(values.mean()) - class_mean if n else 0.0
    squares = float(((values - off - class_mean) ** 2).sum()) + level_worth * n / total * off ** 2
    variance = (worth * about_level + squares) / (worth + n)
    return float(mean), float(np.sqrt(variance * (1.0 + 1.0 / total)))


def mean_and_deviation(values: Sequence[float] | np.ndarray) -> tuple[float, float]:
    """Mean and standard deviation (unbiased) of values."""
    return float(np.mean(values)), float(np.std(values, ddof=1))
