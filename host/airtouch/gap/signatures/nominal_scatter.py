"""The scatter of nominal flights: how strong an effect seems to be in flights that have none.

Two nominal flights of one vehicle differ in trim, battery, air and wear. Fitted to such a
flight, an effect gets some apparent strength, and may gain many nats of likelihood. It is
news only as far as its strength exceeds what nominal flights show of the same effect.

The variance of a parameter's apparent strength has a scaled inverse chi-square prior
(Gelman et al., Bayesian Data Analysis, 3rd ed., section 2.6) from the table
`nominal_scatter.toml`, of one class of vehicles, and is updated by the baseline flights;
the class is the one that these fit best. `tools/nominal_scatter.py` makes the table.
"""

import math
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import resources

import numpy as np
from scipy.special import poch, stdtrit

from airtouch.gap.signatures.alike import ALIKE
from airtouch.gap.signatures.candidates import is_random
from airtouch.gap.signatures.posterior import LEAST, MOST_DEVIATIONS, moments, standard_deviation, updated

LEAST_RECORDED = 0.02  #: scatter at least, in natural steps, in recorded flights, which chance at times explains wholly
RECORDED_WORTH = 4.0  #: flights that a class of recorded ones counts as at most, beside the baseline's own
EXACT = 1e-9  #: variance, in units of the nominal scatter squared, that is added to that of every strength
STEPS = 12  #: iterations of the compromise between nominal scatter and chance
POOLED = 1.0  #: flights that the scatter of all an effect's parameters together counts as, for each of them
LEAST_SPREAD = 0.05  #: natural steps: scatter of strengths and sizes at least, where classes are compared
LEAST_RATE_SPREAD = 0.3  #: the same for the square root of a rate, nats a second
WINSOR = 0.9  #: quantile of the square roots of rates to which those above it are cut (winsorised)
FALSE_SHARE = 0.01  #: share of nominal flights in which one of the effects that come and go may be named
RATE_FREEDOM = 4.0  #: degrees of freedom of Student's density of that square root: a flight or two may be odd
SIMULATED = "simulated"  #: the class of flights of this project's simulator


@dataclass(frozen=True)
class Apparent:
    """One nominal flight held against others.

    strengths: scaled parameters (k,) by effect; errors: the standard deviation (k,) that each estimate has by
    chance; rate: nats a second that a model without names gains; passing: size (`size_of`) of each effect that comes
    and goes.
    """

    strengths: Mapping[str, np.ndarray]
    errors: Mapping[str, np.ndarray]
    rate: float
    passing: Mapping[str, float] = field(default_factory=dict)


def size_of(rate: float, strength: np.ndarray) -> float:
    """Size of an effect that comes and goes: the geometric mean of the root of its rate and of its strength.

    rate: nats a second that it gains; strength (k,): in natural steps. What nominal flights seem to have gains much
    in calm ones with hardly any strength, and has strength in hard ones but gains little: only what does both is
    out of the ordinary.
    """
    return math.sqrt(math.sqrt(max(rate, 0.0)) * float(np.linalg.norm(strength)))


@dataclass(frozen=True)
class Scatter:
    """Standard deviation of apparent strengths (k,) by effect, beyond chance, with its degrees of freedom.

    rate: mean and standard deviation of its square root; passing by effect: of its size. vehicle: whose flights a class
    of the table was measured on. middle: mean (k,) of the strengths of a random effect, which are never
    negative; the others' is 0. exact: whether the flights come from the models that effects are fitted with.
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
        """Log likelihood that a strength (k,) has over the likeliest one that nominal flights scatter to.

        That one is a compromise: Student's density with `freedom` says how rare it is in nominal flights, after each
        further parameter has paid for itself, the normal density of `covariance` (k, k) how far by chance the strength
        was found from it; parameters that make up for one another thus count together, and one that the data leave
        open says nothing. None: the strength is exact. apart (k,): half of what two halves of the flights differ by; of
        all strengths between theirs the one of least evidence counts. A parameter that the table does not know yet
        scatters as the widest of its effect's others.
        """
        rms = self.rms.get(name)
        if rms is None or not len(strength):
            return math.inf
        rms = np.append(rms, np.full(max(len(strength) - len(rms), 0), rms.max()))[:len(strength)]
        if name in self.middle:  # a random effect weaker than in nominal flights is no news
            strength = np.maximum(strength - self.middle[name], 0.0)
        if covariance is None or not covariance.any():
            return self._rare(strength / rms, max(int(np.count_nonzero(strength)) - 1, 0))
        finite = np.flatnonzero(np.isfinite(np.diag(covariance)))
        own, further = strength[finite] / rms[finite], max(len(finite) - 1, 0)
        chance = covariance[np.ix_(finite, finite)] / np.outer(rms[finite], rms[finite]) + EXACT * np.eye(len(finite))
        apart = np.broadcast_to(apart, strength.shape)[finite] / rms[finite]
        toward = np.linalg.solve(chance + np.eye(len(finite)), apart)
        if toward @ apart > 0.0:
            own = own - np.clip(toward @ own / (toward @ apart), -1.0, 1.0) * apart
        precision = np.linalg.inv(chance)
        return min(self._compromise(own, precision, further, start) for start in (own, np.zeros(len(own))))

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
        """Log likelihood that a model without names may gain in a nominal flight of so many seconds.

        least: what would be news in a flight of rate 0, nats; square roots of rates scatter as Student's.
        """
        middle, spread = self.rate
        deviations = math.sqrt(self.freedom * math.expm1(2.0 * least / (self.freedom + 1.0)))
        return least + seconds * (middle + min(deviations, MOST_DEVIATIONS) * spread) ** 2

    def unusual(self, name: str, size: float) -> float:
        """Log likelihood (Student) by which the size of an effect that comes and goes exceeds that of nominal flights.

        It is 0 at the size that a share FALSE_SHARE of nominal flights exceeds, and negative below.
        """
        middle, spread = self.passing.get(name, (0.0, 0.0))
        far = max(size - middle, 0.0) / max(spread, LEAST_SPREAD)
        limit = float(stdtrit(self.freedom, 1.0 - FALSE_SHARE))
        rarity, limit_rarity = (math.log1p(x ** 2 / self.freedom) for x in (far, limit))
        return 0.5 * (self.freedom + 1.0) * (rarity - limit_rarity)


def scatter_of(baseline: Sequence[Apparent], recorded: bool = False, vehicle: str = "") -> Scatter:
    """The scatter of the vehicle's class, or else of the one that the baseline flights fit best, updated by them.

    baseline: flights held against a vehicle that was calibrated on all of them. Their scatter is widened
    by (n + 1) / (n - 1): each was among those that it is held against, another flight will not be.
    recorded: the logs' format says that a drone has flown them, so no class of simulated flights is theirs. A class
    that was measured on the vehicle of this name leaves no room for other vehicles'.
    """
    classes = {name: c for name, c in table().items() if not (recorded and name == SIMULATED)}
    if vehicle and any(c.vehicle == vehicle for c in classes.values()):
        classes = {name: c for name, c in classes.items() if c.vehicle == vehicle}
    n = len(baseline)
    wide = (n + 1.0) / (n - 1.0) if n > 1 else 1.0
    known = baseline if n > 1 else ()
    weight = np.array([_fit(c, known, wide) for c in classes.values()])
    name_of = list(classes)[int(np.argmax(weight))]
    own = classes[name_of] if n > 1 else _widest(list(classes.values()))
    simulated = name_of == SIMULATED and n > 1  # whose flights are all drawn alike
    least = LEAST if simulated else LEAST_RECORDED
    worth = own.freedom if simulated else min(own.freedom, RECORDED_WORTH)
    rms, middle = {}, {}
    for name, prior in own.rms.items():
        rows = [f for f in known if name in f.strengths]
        scale = math.sqrt(wide)
        centre = np.zeros(len(prior))
        if name in own.middle:
            sums = sum((f.strengths[name] for f in rows), worth * own.middle[name])
            middle[name] = centre = sums / (worth + len(rows))
        own_rms = [standard_deviation(scale * (_column(rows, name, "strengths", k) - centre[k]),
                           scale * _column(rows, name, "errors", k), p, (worth, min(worth, RECORDED_WORTH)))
                   for k, p in enumerate(prior)] if rows else prior
        exact = rows and not any(f.errors[name].any() for f in rows)  # of the log's times, which differ from day to day
        rms[name] = np.maximum(own_rms, np.maximum(prior, least) if exact else least)
    for group, _ in ALIKE:  # one thing in the logs, as mass and thrust, scatters as the wider of its names
        same = [rms[n] for n in group if n in rms]
        if len({len(x) for x in same}) == 1:
            rms |= {n: np.max(same, axis=0) for n in group if n in rms}
    passing = {n: updated(r, [f.passing.get(n, 0.0) for f in known], worth, r[1]) for n, r in own.passing.items()}
    rate = updated(own.rate, np.sqrt([f.rate for f in known]), worth)
    return Scatter(rms, worth + len(known), rate, passing, middle=middle, exact=simulated)


def _column(flights: Sequence[Apparent], name: str, what: str, k: int) -> np.ndarray:
    """Parameter k of an effect, strength or error, in every flight (n,)."""
    return np.array([getattr(f, what)[name][k] for f in flights if k < len(f.strengths[name])])


def _fit(own: Scatter, baseline: Sequence[Apparent], wide: float) -> float:
    """Log likelihood of the baseline's strengths and rates in a class."""
    total, nu = 0.0, own.freedom
    for flight in baseline:
        for name, rms in own.rms.items():
            if name in flight.strengths:
                n = min(len(rms), len(flight.strengths[name]))
                variance = np.maximum(rms[:n], LEAST_SPREAD) ** 2 + wide * flight.errors[name][:n] ** 2
                strength = flight.strengths[name][:n] - own.middle.get(name, np.zeros(n))[:n]
                far = wide * strength ** 2 / variance
                total -= float(np.sum(0.5 * np.log(variance) + 0.5 * (nu + 1.0) * np.log1p(far / nu)))
        middle, spread = own.rate
        total += float(student_log_density(np.sqrt(flight.rate), RATE_FREEDOM, middle, max(spread, LEAST_RATE_SPREAD)))
        for name, (middle, spread) in own.passing.items():
            size = flight.passing.get(name, 0.0)
            total += float(student_log_density(size, RATE_FREEDOM, middle, max(spread, LEAST_SPREAD)))
    return total


def student_log_density(x: float, freedom: float, middle: float, spread: float) -> float:
    """Logarithm of Student's density about a middle, of a spread; scipy.stats takes a second to import."""
    far = (x - middle) / spread
    top = np.log(poch(0.5 * freedom, 0.5)) - 0.5 * (np.log(freedom) + np.log(np.pi))
    return top - 0.5 * (freedom + 1.0) * np.log1p(far * far / freedom) - np.log(spread)


def _widest(classes: Sequence[Scatter]) -> Scatter:
    """Of every effect the widest scatter of any class: for vehicles of which no nominal flight is known."""
    classes = list(classes)
    names = {n for c in classes for n in c.rms}
    rms = {n: np.max([c.rms[n] for c in classes if n in c.rms], axis=0) for n in sorted(names)}

    def highest(rates: Iterable[tuple[float, float]]) -> tuple[float, float]:
        return max(rates, key=lambda r: r[0] + r[1])

    passing = {n: highest(c.passing[n] for c in classes if n in c.passing)
               for n in sorted({n for c in classes for n in c.passing})}
    return Scatter(rms, min(c.freedom for c in classes), highest(c.rate for c in classes), passing)


@cache
def table() -> dict[str, Scatter]:
    """The shipped classes of vehicles by name."""
    text = (resources.files("airtouch") / "gap" / "signatures" / "nominal_scatter.toml").read_text(encoding="utf-8")
    return {name: Scatter({k: np.maximum(v, LEAST) for k, v in entry["rms"].items()}, float(entry["freedom"]),
                          tuple(entry["root_rate"]), {k: tuple(v) for k, v in entry["passing"].items()},
                          entry.get("vehicle", ""), {k: np.array(v) for k, v in entry.get("middle", {}).items()})
            for name, entry in tomllib.loads(text).items()}


def measured(flights: Sequence[Apparent], alike: Sequence[Apparent] | None = None) -> Scatter:
    """The scatter of flights each of which was held against others than itself.

    alike: those of them that give the rates and the degrees of freedom, which were held against flights of their own
    day and condition; all by default.
    """
    alike = flights if alike is None else alike
    names = sorted({n for f in flights for n in f.strengths})
    rms, middle = {}, {}
    for name in names:
        rows = [f for f in flights if name in f.strengths]
        size = max(len(f.strengths[name]) for f in rows)
        columns = [(_column(rows, name, "strengths", k), _column(rows, name, "errors", k)) for k in range(size)]
        if is_random(name):
            middle[name] = np.array([strengths.mean() for strengths, _ in columns])
            columns = [(strengths - m, errors) for (strengths, errors), m in zip(columns, middle[name], strict=True)]
        each, errors = (np.concatenate(part) for part in zip(*columns, strict=True))
        pooled = standard_deviation(each, errors, 0.0)
        rms[name] = np.array([standard_deviation(x, e, pooled, (POOLED,)) for x, e in columns] if size > 1
                             else [pooled])
    # of what comes and goes the largest count in full: a nominal flight may have met a gust, and the next may too
    names = sorted({n for f in alike for n in f.passing})
    passing = {n: moments([f.passing.get(n, 0.0) for f in alike]) for n in names}
    roots = np.sqrt([f.rate for f in alike])
    rate = moments(np.minimum(roots, np.quantile(roots, WINSOR)))
    return Scatter(rms, float(len(alike)), rate, passing, middle=middle)
