"""Flights without a gyro: how likely each hypothesis makes the pattern of a hover.

Evidence integrates the likelihood over each hypothesis' prior, so that a hypothesis with more freedom must earn it.

How unsteady a flight is says little of the vehicle unless the position is measured equally well: the controllers answer
every correction of the estimated velocity. Their expected power is own + ANSWER x variance of the corrections, which
the log shows; what is judged is the log10 of the power over that. Where one flight has no velocity, the balance alone
is judged.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from airtouch.gap.balance.hover_hypotheses import Hypothesis
from airtouch.gap.balance.hover_pattern import LEAST_POWER, HoverPattern
from airtouch.gap.balance.priors import PRIORS, Priors

#: power of unsteadiness (1/Hz) and heave (m^2/s^4/Hz) for one (m/s)^2 of corrected velocity, sideways and upwards:
#: CrazyPAD's building conditions, 73 flights. E8 and E9 alone: 10^-1.65 and 10^-1.59, 10^2.16 and 10^2.17
#: (`python tools/diagnosis/gap_crazypad.py FLIGHTS --corrections`)
ANSWER = 10.0 ** np.array([-1.62, 2.17])
BALANCE, POWER = slice(0, 4), slice(4, 6)  #: of the six numbers of a pattern that are judged


@dataclass(frozen=True)
class Reference:
    """Nominal flights: mean (6,) and variance (6,) of BALANCE and POWER of a further nominal flight of any session.

    own_power (2,): log10 of the power of unsteadiness and heave that no correction of the estimate causes. It and
    the numbers of POWER are NaN where a nominal flight has no velocity.
    """

    mean: np.ndarray
    variance: np.ndarray
    own_power: np.ndarray

    def difference(self, pattern: HoverPattern) -> np.ndarray:
        """BALANCE and POWER (6,) of a pattern from the nominal flights' mean, powers over what corrections cause.

        POWER is NaN where the flight, or a nominal one, has no velocity.
        """
        return _over_expected([pattern], self.own_power)[0] - self.mean

    def mean_difference(self, patterns: Sequence[HoverPattern]) -> np.ndarray:
        """Mean `difference` (6,) of the patterns of flights that have a hover; at least one has.

        Each flight's powers are held against its own corrections: what these cause on average is more than what
        their mean logarithm would.
        """
        return np.mean([self.difference(p) for p in patterns if p.known], axis=0)


def reference(patterns: Sequence[HoverPattern], priors: Priors = PRIORS) -> Reference:
    """Mean of nominal flights that have a hover, and the variance of a further one about it.

    The prior's variance counts as that of `priors.nominal_flights` flights more (normal law, conjugate prior); a
    further flight differs from the mean of n by 1 + 1 / n of it.
    """
    known = [p for p in patterns if p.known]
    power, caused = np.array([p.power for p in known]), _power_by_corrections(known)
    own_power = np.array([_own_power(*of) for of in zip(power.T, caused.T, strict=True)])
    table = _over_expected(known, own_power)
    n, prior_n = len(table), priors.nominal_flights
    squares = ((table - table.mean(axis=0)) ** 2).sum(axis=0)
    variance = (squares + prior_n * np.array(priors.nominal) ** 2) / (n - 1.0 + prior_n)
    return Reference(table.mean(axis=0), variance * (1.0 + 1.0 / n), own_power)


class Evidence(NamedTuple):
    """How likely each of some hypotheses makes a difference from nominal flights.

    log (hypotheses,): logarithm of the evidence, its prior probability included, nats, without the constants that all
    share; weights: of the samples of each (samples,), of sum 1.
    """

    log: np.ndarray
    weights: list[np.ndarray]


def evidence(difference: np.ndarray, base: Reference, candidates: Sequence[Hypothesis],
             priors: Priors = PRIORS) -> Evidence:
    """The evidence of each hypothesis for the difference (6,) of flights from the nominal ones, BALANCE and POWER.

    Where POWER is NaN, of BALANCE alone.
    """
    steadiness_known = bool(np.isfinite(difference[POWER]).all())
    of_each, weights = [], []
    for h in candidates:
        variance = base.variance[BALANCE] + (np.array(priors.maintenance) ** 2 if h.after_maintenance else 0.0)
        log, weight = _of_balance(h, difference[BALANCE], variance, priors.freedom)
        of_each.append(_with_power(log, h, difference[POWER], base.variance[POWER]) if steadiness_known else log)
        weights.append(weight)
    return Evidence(np.array(of_each), weights)


def _of_balance(h: Hypothesis, difference: np.ndarray, variance: np.ndarray, nu: float) -> tuple[float, np.ndarray]:
    """Log evidence for a difference (4,) of the balance, its prior probability included, and the samples' weights.

    The mean over samples of the product of four Student densities, each of nu degrees of freedom about the sample's
    change: log t = -(nu + 1) / 2 log(1 + (difference - change)^2 / (nu variance)) - log(variance) / 2.
    """
    tails = np.log1p((difference - h.change) ** 2 / variance / nu)
    distance = 0.5 * (nu + 1.0) * tails.sum(axis=1)
    w = np.exp(distance.min() - distance)
    return np.log(w.mean()) - distance.min() + np.log(h.prior) - 0.5 * np.log(variance).sum(), w / w.sum()


def _with_power(log: float, h: Hypothesis, difference: np.ndarray, variance: np.ndarray) -> float:
    """A log evidence with that for a difference (2,) of the powers: normal about the change that the hypothesis makes.

    variance (2,): of nominal flights.
    """
    for change, power, power_variance in zip(h.power_change, difference, variance, strict=True):
        width = change.deviation ** 2 + power_variance
        log -= 0.5 * (power - change.mean) ** 2 / width + 0.5 * np.log(width)
    return log


def _power_by_corrections(patterns: Sequence[HoverPattern]) -> np.ndarray:
    """Power (flights, 2) of unsteadiness and heave that the corrections cause."""
    return ANSWER * 10.0 ** np.array([p.corrections for p in patterns])


def _over_expected(patterns: Sequence[HoverPattern], own_power: np.ndarray) -> np.ndarray:
    """BALANCE and POWER (flights, 6), log10 of the powers over those that are expected with the corrections."""
    balance, power = np.array([p.balance for p in patterns]), np.array([p.power for p in patterns])
    return np.column_stack([balance, power - np.log10(10.0 ** own_power + _power_by_corrections(patterns))])


def _own_power(power: np.ndarray, caused: np.ndarray) -> float:
    """log10 of the power that flights have beside the one that is caused; NaN where one of the latter is not known.

    power (flights,): log10; caused (flights,).
    """
    if not np.isfinite(caused).all():
        return np.nan

    def mean_over(own: float) -> float:
        """Mean log10 of the power over the expected one."""
        return float(np.mean(power - np.log10(10.0 ** own + caused)))
    return LEAST_POWER if mean_over(LEAST_POWER) <= 0.0 else float(brentq(mean_over, LEAST_POWER, power.max()))
