"""How likely a flight is under a class: normal densities with few directions of more scatter.

A flight's coordinates are Q values, of which nominal flights have the covariance 1. Log densities are in nats and leave
out the constant -Q/2 log(2 pi). A covariance is written 1 + L L' with loadings L (Q, r), as in factor analysis.

The search for the likeliest strength has a few numbers of its own. All were chosen; what other values were tried is not
recorded.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import gammaln

from airtouch.gap.relations.effect_class import SMALLEST, EffectClass

LOG_2PI = float(np.log(2.0 * np.pi))
MACHINE_EPSILON = float(np.finfo(float).eps)
# one parameter: a grid, then finer and finer grids around the best strength
REFINEMENTS = 3  #: finer grids, one after another; chosen. Each more makes the strength four times as exact
REFINED_STRENGTHS = 9  #: strengths of a finer grid, odd, the best one so far in the middle; chosen. More are more exact
# several parameters: Gauss-Newton
START_MAGNITUDES = 5  #: magnitudes of the strength at which a fit may begin; chosen. With fewer it may miss the peak
MOST_STEPS = 10  #: steps of a fit at most; chosen. A smaller number ends more fits before the peak
#: fractions of a step that are tried in turn, until one gains; chosen. With a smaller last one fewer fits end early
STEP_FRACTIONS = (1.0, 0.5, 0.25, 0.1)
#: nats; a fit ends with a step that gains less; chosen. A larger number ends fits farther from the peak
LEAST_STEP_GAIN = 0.01
#: change of a strength over its magnitude by which slopes are taken; chosen. A larger number sees more of the curve's
#: bends, a smaller one more of the rounding
SLOPE_STEP = 1e-3
#: singular values of a step's equations over the largest one, below which they count as 0; chosen. A larger number
#: takes no step along combinations of parameters that the flight shows only faintly
STEP_RCOND = 1e-9


@dataclass(frozen=True)
class Rescaling:
    """A change of coordinates that makes a covariance 1 + L L' to 1.

    Along axes (Q, r) values are multiplied by 1 + stretch (r,). log_determinant: that of the change, which the log
    density gains by it.
    """

    axes: np.ndarray
    stretch: np.ndarray
    log_determinant: float

    def __call__(self, values: np.ndarray) -> np.ndarray:
        """Values (..., Q) rescaled."""
        return values + ((values @ self.axes) * self.stretch) @ self.axes.T


def rescaling_of(loadings: np.ndarray) -> Rescaling:
    """The rescaling for the covariance 1 + L L' of loadings L (Q, r)."""
    axes, variance = principal(loadings)
    deviation = np.sqrt(1.0 + variance)
    return Rescaling(axes, 1.0 / deviation - 1.0, -float(np.log(deviation).sum()))


class PrincipalAxes(NamedTuple):
    """Principal axes (Q, r) of a covariance, and the variances (r,) along them."""

    axes: np.ndarray
    variances: np.ndarray


def principal(loadings: np.ndarray) -> PrincipalAxes:
    """Principal axes of L L' for loadings L (Q, r) with r < Q.

    From the eigenvectors of L'L, several times faster than a singular value decomposition. Axes along which there is
    next to no variance, 1e-16 of the largest, are not of unit length; they count for nothing.
    """
    variance, vectors = np.linalg.eigh(loadings.T @ loadings)
    least = max(float(variance[-1]), SMALLEST) * MACHINE_EPSILON if len(variance) else 0.0
    return PrincipalAxes((loadings @ vectors) / np.sqrt(np.maximum(variance, least)), np.maximum(variance, 0.0))


def unchanged(dimensions: int) -> Rescaling:
    """A rescaling that changes nothing."""
    return Rescaling(np.zeros((dimensions, 0)), np.zeros(0), 0.0)


def log_density(values: np.ndarray) -> float:
    """Log density of values (Q,) whose covariance is 1, without the constant."""
    return -0.5 * float(values @ values)


@dataclass(frozen=True)
class Fit:
    """A class at its likeliest strength (parameters,), with two log densities of the flight, nats.

    log_peak: at that strength; log_marginal: of the density averaged over the strengths that the class may have
    (marginal likelihood), by Laplace's approximation, and `log_peak` where that would exceed it.
    """

    effect_class: EffectClass
    strength: np.ndarray
    log_peak: float
    log_marginal: float

    @property
    def log_occam_factor(self) -> float:
        """Nats, 0 or less, by which the average over strengths lies below the peak."""
        return self.log_marginal - self.log_peak

    @property
    def shift(self) -> np.ndarray:
        """Expected shift (Q,), not rescaled."""
        return self.effect_class.mean(self.strength[None])[0]

    def loadings(self) -> np.ndarray:
        """Loadings L (Q, r): L L' is the covariance of a flight about the curve, beyond that of nominal flights."""
        return self.effect_class.axes * (np.linalg.norm(self.shift) * np.sqrt(self.effect_class.variances))


class _Likelihood:
    """The log density of a flight's values (Q,) under a class, rescaled, as a function of its strength."""

    def __init__(self, effect_class: EffectClass, values: np.ndarray, rescaling: Rescaling) -> None:
        """values: rescaled."""
        self.effect_class, self.values, self.rescaling = effect_class, values, rescaling
        if rescaling.stretch.size and effect_class.variances.size:
            self.axes, self.variances = principal(rescaling((effect_class.axes * np.sqrt(effect_class.variances)).T).T)
        else:
            self.axes, self.variances = effect_class.axes, effect_class.variances

    def log_density(self, shift: np.ndarray) -> np.ndarray:
        """Log density (n,) at expected shifts (n, Q), not rescaled."""
        squared_length = (shift ** 2).sum(axis=1)
        residual = self.values - self.rescaling(shift)
        along, variance = residual @ self.axes, 1.0 + squared_length[:, None] * self.variances
        squared_distance = (residual ** 2).sum(axis=1) - (along ** 2 * (1.0 - 1.0 / variance)).sum(axis=1)
        return self.rescaling.log_determinant - 0.5 * (squared_distance + np.log(variance).sum(axis=1))

    def at_strength(self, strength: np.ndarray) -> np.ndarray:
        """Log density (n,) at strengths (n, parameters)."""
        return self.log_density(self.effect_class.mean(strength))

    def over_covariance(self, shift: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Values (n, Q) times the inverse of the covariance that the class has at an expected shift (Q,)."""
        variance = 1.0 + (shift @ shift) * self.variances
        return values - ((values @ self.axes) * (1.0 - 1.0 / variance)) @ self.axes.T

    def clipped(self, strength: np.ndarray) -> np.ndarray:
        """A strength (parameters,) with its magnitude cut to what was flown; 0 becomes the least, in equal parts."""
        if not strength.any():
            strength = np.ones_like(strength)
            return strength * (self.effect_class.least / np.linalg.norm(strength))
        magnitude = float(np.linalg.norm(strength))
        return strength / max(magnitude, SMALLEST) * np.clip(magnitude, self.effect_class.least, self.effect_class.most)

    def slopes(self, strength: np.ndarray) -> np.ndarray:
        """Change (parameters, Q) of the expected shift per parameter, rescaled."""
        step = SLOPE_STEP * float(np.linalg.norm(strength)) * np.eye(len(strength))
        ahead, back = (self.effect_class.mean(strength + s) for s in (step, -step))
        return self.rescaling((ahead - back) / (2.0 * step[0, 0]))


class _Peak(NamedTuple):
    """A likeliest strength (parameters,) and the log density of the flight there, nats."""

    strength: np.ndarray
    log_density: float


def fit(effect_class: EffectClass, values: np.ndarray, rescaling: Rescaling) -> Fit:
    """The likeliest strength of a class for a flight's coordinates (Q,), values: rescaled."""
    likelihood = _Likelihood(effect_class, values, rescaling)
    peak = _on_a_grid(likelihood) if effect_class.parameters == 1 else _by_gauss_newton(likelihood)
    log_marginal = peak.log_density + min(_log_occam_factor(likelihood, peak.strength), 0.0)
    return Fit(effect_class, peak.strength, peak.log_density, log_marginal)


def _on_a_grid(likelihood: _Likelihood) -> _Peak:
    """The likeliest strength of one parameter: on the class's grid, then on finer ones around the best."""
    effect_class = likelihood.effect_class
    strengths, shifts = effect_class.grid
    densities = likelihood.log_density(shifts)
    place, width = int(np.argmax(densities)), float(np.log(strengths[1, 0] / strengths[0, 0]))
    best, peak = strengths[place], float(densities[place])
    for _ in range(REFINEMENTS):
        magnitudes = np.abs(best) * np.exp(np.linspace(-width, width, REFINED_STRENGTHS))
        trials = np.clip(magnitudes, effect_class.least, effect_class.most) * np.sign(best)
        densities = likelihood.at_strength(trials[:, None])
        place = int(np.argmax(densities))
        if densities[place] > peak:
            best, peak = trials[place:place + 1], float(densities[place])
        width *= 2.0 / (REFINED_STRENGTHS - 1)
    return _Peak(best, peak)


def _by_gauss_newton(likelihood: _Likelihood) -> _Peak:
    """The likeliest strength of several parameters, by Gauss-Newton with shortened steps."""
    best, peak = _start(likelihood)
    for _ in range(MOST_STEPS):
        before = peak
        step = _step(likelihood, best)
        for fraction in STEP_FRACTIONS:
            trial = likelihood.clipped(best + fraction * step)
            density = float(likelihood.at_strength(trial[None])[0])
            if density > peak:
                best, peak = trial, density
                break
        if peak < before + LEAST_STEP_GAIN:
            break
    return _Peak(best, peak)


def _start(likelihood: _Likelihood) -> _Peak:
    """The best of several first strengths: least squares with the slopes at several magnitudes."""
    effect_class, best, peak = likelihood.effect_class, np.zeros(0), -np.inf
    for magnitude in np.geomspace(effect_class.least, effect_class.most, START_MAGNITUDES):
        slopes = likelihood.slopes(np.full(effect_class.parameters, magnitude / np.sqrt(effect_class.parameters)))
        trial = likelihood.clipped(np.linalg.lstsq(slopes.T, likelihood.values, rcond=None)[0])
        density = float(likelihood.at_strength(trial[None])[0])
        if density > peak:
            best, peak = trial, density
    return _Peak(best, peak)


def _step(likelihood: _Likelihood, strength: np.ndarray) -> np.ndarray:
    """The step (parameters,) of Gauss-Newton at a strength: least squares weighed by the covariance there."""
    shift, slopes = likelihood.effect_class.mean(strength[None])[0], likelihood.slopes(strength)
    weighed = likelihood.over_covariance(shift, slopes)
    residual = likelihood.values - likelihood.rescaling(shift)
    return np.linalg.lstsq(weighed @ slopes.T, weighed @ residual, rcond=STEP_RCOND)[0]


def _log_occam_factor(likelihood: _Likelihood, strength: np.ndarray) -> float:
    """Log of the Occam factor, marginal likelihood over peak likelihood, by Laplace's approximation, nats.

    MacKay, Information Theory, Inference, and Learning Algorithms, 2003, section 28.1. A strength may be anything
    between the least and the most that was flown, on a logarithmic scale, in any direction.
    """
    effect_class, parameters = likelihood.effect_class, len(strength)
    slopes = likelihood.slopes(strength)
    precision = likelihood.over_covariance(effect_class.mean(strength[None])[0], slopes) @ slopes.T
    magnitude = float(np.linalg.norm(strength))
    # log area of the unit sphere, whose points are the directions: log 2 for one parameter, of either sign
    log_directions = np.log(2.0) + 0.5 * parameters * np.log(np.pi) - gammaln(0.5 * parameters)
    if parameters == 1 and not effect_class.signed:
        log_directions = 0.0
    prior = -np.log(np.log(effect_class.most / effect_class.least)) - log_directions - parameters * np.log(magnitude)
    return 0.5 * parameters * LOG_2PI - 0.5 * float(np.linalg.slogdet(precision)[1]) + prior
