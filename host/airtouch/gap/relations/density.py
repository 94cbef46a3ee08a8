"""How likely features are under a class of flights: normal densities with few directions of more scatter."""

from dataclasses import dataclass

import numpy as np
from scipy.special import gammaln

from airtouch.gap.relations.effect_class import EffectClass

LOG_2PI = float(np.log(2.0 * np.pi))
REFINED, AMONG = 3, 9  #: rounds in which the best strength of a grid is refined, and strengths in each
STARTS, STEPS = 5, 10  #: sizes of the strength from which a fit of several parameters begins, and its steps at most
SHORTER = (1.0, 0.5, 0.25, 0.1)  #: of a step that gains nothing
ENOUGH = 0.01  #: nats of a step
SLOPE = 1e-3  #: of the strength, over which slopes are taken


@dataclass(frozen=True)
class Coordinates:
    """A change of coordinates that makes a covariance 1 + F F' to 1: along axes (Q, r) by stretch (r,), less 1.

    level: logarithm of the density that it costs.
    """

    axes: np.ndarray
    stretch: np.ndarray
    level: float

    def __call__(self, values: np.ndarray) -> np.ndarray:
        """Values (..., Q) in these coordinates."""
        return values + ((values @ self.axes) * self.stretch) @ self.axes.T


def coordinates_of(factors: np.ndarray) -> Coordinates:
    """Coordinates for the covariance 1 + F F' of factors F (Q, r)."""
    axes, size, _ = np.linalg.svd(factors, full_matrices=False)
    grown = np.sqrt(1.0 + size ** 2)
    return Coordinates(axes, 1.0 / grown - 1.0, -float(np.log(grown).sum()))


def unchanged(dimensions: int) -> Coordinates:
    """Coordinates that change nothing."""
    return Coordinates(np.zeros((dimensions, 0)), np.zeros(0), 0.0)


def log_density(values: np.ndarray) -> float:
    """Log density of values (Q,) whose covariance is 1, without the constant."""
    return -0.5 * float(values @ values)


@dataclass(frozen=True)
class Fit:
    """A class at its likeliest strength (parameters,): log density there, over no class in plain coordinates without

    the constant, and the same averaged over the strengths that it may have.
    """

    of: EffectClass
    strength: np.ndarray
    level: float
    evidence: float

    @property
    def shift(self) -> np.ndarray:
        """Expected shift (Q,) in plain coordinates."""
        return self.of.mean(self.strength[None])[0]

    def factors(self) -> np.ndarray:
        """F (Q, r): F F' is the covariance of a flight about the curve, beyond that of nominal flights."""
        return self.of.axes * (np.linalg.norm(self.shift) * np.sqrt(self.of.variances))


class _Seen:
    """A class in some coordinates: its log density at strengths."""

    def __init__(self, of: EffectClass, values: np.ndarray, coordinates: Coordinates) -> None:
        self.of, self.values, self.coordinates = of, values, coordinates
        if coordinates.stretch.size and of.variances.size:
            self.axes, size, _ = np.linalg.svd(coordinates((of.axes * np.sqrt(of.variances)).T).T, full_matrices=False)
            self.variances = size ** 2
        else:
            self.axes, self.variances = of.axes, of.variances

    def level(self, shift: np.ndarray) -> np.ndarray:
        """Log density (n,) at expected shifts (n, Q) in plain coordinates."""
        size = (shift ** 2).sum(axis=1)
        off = self.values - self.coordinates(shift)
        along, grown = off @ self.axes, 1.0 + size[:, None] * self.variances
        distance = (off ** 2).sum(axis=1) - (along ** 2 * (1.0 - 1.0 / grown)).sum(axis=1)
        return self.coordinates.level - 0.5 * (distance + np.log(grown).sum(axis=1))

    def at(self, strength: np.ndarray) -> np.ndarray:
        """Log density (n,) at strengths (n, parameters)."""
        return self.level(self.of.mean(strength))

    def solved(self, shift: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Values (n, Q) over the covariance that the class has at an expected shift (Q,)."""
        grown = 1.0 + (shift @ shift) * self.variances
        return values - ((values @ self.axes) * (1.0 - 1.0 / grown)) @ self.axes.T

    def clipped(self, strength: np.ndarray) -> np.ndarray:
        """A strength (parameters,) within what was flown."""
        size = float(np.linalg.norm(strength))
        return strength / max(size, 1e-300) * np.clip(size, self.of.least, self.of.most)

    def slopes(self, strength: np.ndarray) -> np.ndarray:
        """Change (parameters, Q) of the expected shift per parameter, in these coordinates."""
        step = SLOPE * float(np.linalg.norm(strength)) * np.eye(len(strength))
        ahead, back = (self.of.mean(strength + s) for s in (step, -step))
        return self.coordinates((ahead - back) / (2.0 * step[0, 0]))


def fit(of: EffectClass, values: np.ndarray, coordinates: Coordinates) -> Fit:
    """The likeliest strength of a class for features (Q,) in some coordinates."""
    seen = _Seen(of, values, coordinates)
    strength, level = _one(seen) if of.parameters == 1 else _several(seen)
    return Fit(of, strength, level, level + min(_occam(seen, strength), 0.0))


def _one(seen: _Seen) -> tuple[np.ndarray, float]:
    """The likeliest strength of one parameter: on a grid, then closer and closer."""
    strength, shift = seen.of.grid
    level = seen.level(shift)
    best, wide = int(np.argmax(level)), float(np.log(strength[1, 0] / strength[0, 0]))
    found, top = strength[best], float(level[best])
    for _ in range(REFINED):
        tried = np.clip(np.abs(found) * np.exp(np.linspace(-wide, wide, AMONG)), seen.of.least, seen.of.most)
        tried *= np.sign(found)
        level = seen.at(tried[:, None])
        best = int(np.argmax(level))
        if level[best] > top:
            found, top = tried[best:best + 1], float(level[best])
        wide *= 2.0 / (AMONG - 1)
    return found, top


def _several(seen: _Seen) -> tuple[np.ndarray, float]:
    """The likeliest strengths of several parameters, by Gauss-Newton from several sizes."""
    of, found, top = seen.of, np.zeros(0), -np.inf
    for size in np.geomspace(of.least, of.most, STARTS):
        slopes = seen.slopes(np.full(of.parameters, size / np.sqrt(of.parameters)))
        tried = seen.clipped(np.linalg.lstsq(slopes.T, seen.values, rcond=None)[0])
        level = float(seen.at(tried[None])[0])
        if level > top:
            found, top = tried, level
    for _ in range(STEPS):
        shift, slopes = of.mean(found[None])[0], seen.slopes(found)
        over = seen.solved(shift, slopes)
        left = seen.values - seen.coordinates(shift)
        step = np.linalg.lstsq(over @ slopes.T, over @ left, rcond=1e-9)[0]
        before = top
        for share in SHORTER:
            tried = seen.clipped(found + share * step)
            level = float(seen.at(tried[None])[0])
            if level > top:
                found, top = tried, level
                break
        if top < before + ENOUGH:
            break
    return found, top


def _occam(seen: _Seen, strength: np.ndarray) -> float:
    """Logarithm of the share of what a strength may be that the features leave (Laplace's method).

    A strength may be anything between the least and the most that was flown, on a logarithmic scale, in any direction.
    """
    of, many = seen.of, len(strength)
    slopes = seen.slopes(strength)
    curvature = np.linalg.slogdet(seen.solved(of.mean(strength[None])[0], slopes) @ slopes.T)[1]
    size = float(np.linalg.norm(strength))
    directions = np.log(2.0) + 0.5 * many * np.log(np.pi) - gammaln(0.5 * many)  # of the unit sphere; 2 for one
    if many == 1 and not of.signed:
        directions = 0.0
    prior = -np.log(np.log(of.most / of.least)) - directions - many * np.log(size)
    return 0.5 * many * LOG_2PI - 0.5 * float(curvature) + prior
