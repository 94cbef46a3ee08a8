"""The scatter of nominal flights: how strong an effect seems to be in flights that have none.

Two nominal flights of one vehicle differ in trim, battery, air and wear. Fitted to such a
flight, an effect gets some apparent strength, and may gain many nats of likelihood. It is
news only as far as its strength exceeds what nominal flights show of the same effect.

The variance of a parameter's apparent strength has a scaled inverse chi-square prior
(Gelman et al., Bayesian Data Analysis, 3rd ed., section 2.6) from the table
`nominal_scatter.toml`, of one class of vehicles, and is updated by the baseline flights;
the class is the one that these fit best (`scatter_estimates`). `tools/calibration/nominal_scatter.py`
makes the table.
"""

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import stdtrit

from airtouch.gap.signatures.posterior import LEAST

EXACT = 1e-9  #: variance, in units of the nominal scatter squared, that is added to that of every strength
QUANTILES = 1000  #: of Student's distribution, of which sums of rarities are made; chosen
STEPS = 12  #: iterations of the compromise between nominal scatter and chance; chosen
LEAST_SPREAD = 0.05  #: natural steps: scatter of a size at least; chosen
#: names in `Scatter.passing` of how unsteady torque and lift are, of which each vehicle has its own level
UNSTEADY = UNSTEADY_TORQUE, UNSTEADY_LIFT = "unsteady_torque", "unsteady_lift"
FALSE_SHARE = 0.01  #: share of nominal flights in which a passing effect may be named, or the rate be news; chosen


@dataclass(frozen=True)
class ApparentStrengths:
    """One nominal flight compared with others.

    strengths: scaled parameters (k,) by effect; errors: the standard deviation (k,) that each estimate has by
    chance; rate: nats a second that the nameless model gains; passing: size (`size_of`) of each effect that comes
    and goes; hidden: effects that the flight could not show, as ground effect high above the ground.
    """

    strengths: Mapping[str, np.ndarray]
    errors: Mapping[str, np.ndarray]
    rate: float
    passing: Mapping[str, float] = field(default_factory=dict)
    hidden: frozenset[str] = frozenset()


def size_of(rate: float, strength: np.ndarray) -> float:
    """Size of a passing effect: the geometric mean of the root of its rate and of its strength.

    rate: nats a second that it gains; strength (k,): in natural steps. What nominal flights seem to have gains much
    in calm ones with hardly any strength, and has strength in hard ones but gains little: only what does both is
    out of the ordinary.
    """
    return math.sqrt(math.sqrt(max(rate, 0.0)) * float(np.linalg.norm(strength)))


def fourth_root(rates: ArrayLike) -> Any:
    """Fourth roots of rates, which in nominal flights are nearly normal.

    A rate is about a sum of squares of disturbances, and the fourth root of chi-square is nearly normal for one degree
    of freedom and for many (Hawkins and Wixley 1986, The American Statistician 40).
    """
    return np.power(np.maximum(rates, 0.0), 0.25)


@dataclass(frozen=True)
class Scatter:
    """Standard deviation of apparent strengths (k,) by effect, beyond chance, with its degrees of freedom.

    rate: mean and standard deviation of its fourth root (`fourth_root`); passing by effect: of its size, of how
    unsteady torque and lift are and of how far pushes point down (`passing.unsteadiness`, `passing.one_sided`).
    vehicle: whose flights a class of the table was measured on. middle: mean (k,) of the strengths of a random effect,
    which are never negative; the others' is 0. exact: whether the flights come from the models that effects are fitted
    with.
    """

    rms: Mapping[str, np.ndarray]
    freedom: float
    rate: tuple[float, float]
    passing: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    vehicle: str = ""
    middle: Mapping[str, np.ndarray] = field(default_factory=dict)
    exact: bool = False

    def evidence(self, name: str, strength: np.ndarray, covariance: np.ndarray | None = None,
                 apart: np.ndarray | float = 0.0) -> float:
        """Nats of evidence that a fitted strength (k,) is more than nominal scatter and chance.

        The strength is nominal scatter, Student's with `freedom`, plus a chance error, normal with `covariance` (k, k);
        the likeliest split of the two counts, after each further parameter has paid for itself. Parameters that make
        up for one another thus count together, and one that the data leave open says nothing. A parameter that the
        table does not know yet scatters as the widest of its effect's others.

        covariance: None for no chance error. apart (k,): half of what two halves of the flights differ by; of all
        strengths between theirs the one of least evidence counts.
        """
        rms = self.rms.get(name)
        if rms is None or not len(strength):
            return math.inf
        rms = np.append(rms, np.full(max(len(strength) - len(rms), 0), rms.max()))[:len(strength)]
        if name in self.middle:  # a random effect weaker than in nominal flights is no news
            strength = np.maximum(strength - self.middle[name], 0.0)
        if covariance is None or not covariance.any():
            return self._rare(strength / rms, max(int(np.count_nonzero(strength)) - 1, 0))
        known = np.flatnonzero(np.isfinite(np.diag(covariance)))
        unit, further = rms[known], max(len(known) - 1, 0)
        chance = covariance[np.ix_(known, known)] / np.outer(unit, unit) + EXACT * np.eye(len(known))
        fitted = _least_within(strength[known] / unit, np.broadcast_to(apart, strength.shape)[known] / unit, chance)
        precision = np.linalg.inv(chance)
        return min(self._compromise(fitted, precision, further, start) for start in (fitted, np.zeros(len(fitted))))

    def _rare(self, far: np.ndarray, further: int) -> float:
        """Log of Student's density at 0 over that at `far` (k,), where `further` parameters pay for themselves."""
        over = max(float(far @ far) - further, 0.0)
        return 0.5 * (self.freedom + 1.0) * math.log1p(over / self.freedom)

    def _compromise(self, fitted: np.ndarray, precision: np.ndarray, further: int, nominal: np.ndarray) -> float:
        """Least sum of how rare a strength is in nominal flights and how far off by chance the fitted one is.

        fitted: the fitted strength; nominal: the strength in nominal flights from which the search begins, by weighted
        least squares (of Student's density, Lange et al. 1989).
        """
        for _ in range(STEPS):
            weight = (self.freedom + 1.0) / (self.freedom + float(nominal @ nominal))
            nominal = np.linalg.solve(precision + weight * np.eye(len(fitted)), precision @ fitted)
        return self._rare(nominal, further) + 0.5 * float((fitted - nominal) @ precision @ (fitted - nominal))

    def allowed(self, seconds: float, least: float) -> float:
        """Log likelihood that the nameless model may gain in a nominal flight of so many seconds.

        least: what would be news in a flight of rate 0, nats. To it comes the rate that a share FALSE_SHARE of nominal
        flights exceeds, if fourth roots of rates scatter as Student's.
        """
        mean, spread = self.rate
        return least + seconds * (mean + float(stdtrit(self.freedom, 1.0 - FALSE_SHARE)) * spread) ** 4

    def unusual(self, sizes: Mapping[str, float]) -> float:
        """Nats by which the rarity of sizes is over its limit, negative below (`rarity`)."""
        nats, limit = self.rarity(sizes)
        return nats - limit

    def rarity(self, sizes: Mapping[str, float]) -> tuple[float, float]:
        """Log likelihood (Student) by which sizes of passing effects, together, exceed those of nominal flights.

        The second number is its limit, which a share FALSE_SHARE of nominal flights exceeds. sizes: by name, as in
        `passing`; their log likelihoods add up, as if nominal flights had them independently of one another.
        """
        nats = 0.0
        for name, size in sizes.items():
            mean, spread = self.passing.get(name, (0.0, 0.0))
            nats += _rarity(max(size - mean, 0.0) / max(spread, LEAST_SPREAD), self.freedom)
        return float(nats), _exceeded(len(sizes), self.freedom)


def _rarity(far: np.ndarray | float, freedom: float) -> Any:
    """Log of Student's density at 0 over that at `far`."""
    return 0.5 * (freedom + 1.0) * np.log1p(np.square(far) / freedom)


@cache
def _exceeded(count: int, freedom: float) -> float:
    """The sum of `count` rarities, of positive draws alone, that a share FALSE_SHARE of Student's draws exceeds."""
    if count == 1:
        return float(_rarity(stdtrit(freedom, 1.0 - FALSE_SHARE), freedom))
    share = (np.arange(QUANTILES) + 0.5) / QUANTILES
    one = sums = _rarity(np.maximum(stdtrit(freedom, share), 0.0), freedom)
    for _ in range(count - 2):
        sums = np.quantile(np.add.outer(sums, one), share)  # as many again, of the same distribution
    return float(np.quantile(np.add.outer(sums, one), 1.0 - FALSE_SHARE))


def _least_within(strength: np.ndarray, apart: np.ndarray, chance: np.ndarray) -> np.ndarray:
    """Of the strengths (k,) on the line between strength - apart and strength + apart that of least evidence.

    All in units of the nominal scatter; chance (k, k): covariance of the strength.
    """
    toward = np.linalg.solve(chance + np.eye(len(strength)), apart)
    if toward @ apart > 0.0:
        return strength - np.clip(toward @ strength / (toward @ apart), -1.0, 1.0) * apart
    return strength


@cache
def table() -> dict[str, Scatter]:
    """The shipped classes of vehicles by name."""
    text = (resources.files("airtouch") / "gap" / "signatures" / "nominal_scatter.toml").read_text(encoding="utf-8")
    return {name: Scatter({k: np.maximum(v, LEAST) for k, v in entry["rms"].items()}, float(entry["freedom"]),
                          tuple(entry["fourth_root_rate"]), {k: tuple(v) for k, v in entry["passing"].items()},
                          entry.get("vehicle", ""), {k: np.array(v) for k, v in entry.get("middle", {}).items()})
            for name, entry in tomllib.loads(text).items()}
