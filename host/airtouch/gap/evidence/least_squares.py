"""Steps of weighted ridge regression on flattened spectra: those of a fit, and the offsets between flights."""

from collections.abc import Sequence

import numpy as np

from airtouch.gap.evidence.problem import Problem
from airtouch.gap.signals.spectra import OVERLAP_WEIGHT, squared
from airtouch.gap.signatures.term import Term


def limits(mean: Sequence[Term]) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest scaled parameters (k,) of all terms."""
    pairs = [t.bounds() for t in mean]
    return (np.concatenate([p[0] for p in pairs]), np.concatenate([p[1] for p in pairs])) if pairs \
        else (np.zeros(0), np.zeros(0))


def weights_of(problem: Problem, values: np.ndarray, added: np.ndarray | float) -> np.ndarray:
    """Weights of a least-squares step whose optimum is that of the tailed likelihood, flattened; 0 where unknown."""
    power = problem.power + added
    e = squared(values) / power
    return OVERLAP_WEIGHT * (problem.freedom + 1.0) / (problem.tail + e) / power * problem.known


def _normal(columns: Sequence[np.ndarray] | np.ndarray, prior: np.ndarray, values: np.ndarray,
            weights: np.ndarray, at: np.ndarray, commands: tuple[np.ndarray, np.ndarray],
            ) -> tuple[np.ndarray, np.ndarray]:
    """Normal matrix and right-hand side of the ridge regression that lowers values + sum(step * column).

    commands: gradient and information of the likelihood from the commands' spectra.
    """
    j = np.ascontiguousarray(columns, complex).view(float)  # real and imaginary parts side by side
    wj = j * np.repeat(weights, 2)
    normal = 2.0 * (wj @ j.T) + np.diag(1.0 / prior ** 2)
    slope = -2.0 * (wj @ np.ascontiguousarray(values, complex).view(float)) - at / prior ** 2
    return normal + commands[1], slope + commands[0]


def bounded_step(columns: Sequence[np.ndarray] | np.ndarray, prior: np.ndarray, values: np.ndarray, weights: np.ndarray,
                 x: np.ndarray, offsets: np.ndarray, low: np.ndarray, high: np.ndarray,
                 commands: tuple[np.ndarray, np.ndarray], damping: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """A step that leaves parameters at a bound there when it would take them past it, and the covariance (k, k) of x.

    columns (k + m, n): change of the values per parameter and offset; prior (k + m,): their standard deviations; values
    (n,): the residual; weights (n,): `weights_of`; x (k,), offsets (m,): where the step begins; low, high (k,): bounds
    of x; commands: gradient (k,) and information (k, k) of the likelihood from the power that parameters change;
    damping: share of the normal matrix's diagonal that is added to it for the step. The step is (k + m,).
    """
    all_parameters, n = np.concatenate([x, offsets]), len(x)
    free = np.ones(len(all_parameters), bool)
    covariance = np.zeros((n, n))
    gradient, information = np.zeros(len(all_parameters)), np.zeros((len(all_parameters), len(all_parameters)))
    gradient[:n], information[:n, :n] = commands
    normal, slope = _normal(columns, prior, values, weights, all_parameters, (gradient, information))
    for _ in range(n + 1):
        change = np.zeros(len(all_parameters))
        where = np.flatnonzero(free)
        if not len(where):
            break
        full = np.linalg.pinv(normal[np.ix_(where, where)], hermitian=True)
        damped = normal[np.ix_(where, where)] + damping * np.diag(np.diag(normal)[where])
        change[where] = np.linalg.solve(damped, slope[where]) if damping else full @ slope[where]
        stuck = np.zeros(len(all_parameters), bool)
        stuck[:n] = free[:n] & (((x <= low) & (change[:n] < 0.0)) | ((x >= high) & (change[:n] > 0.0)))
        if not stuck.any():
            free_parameters = where[where < n]
            covariance = np.diag(1.0 / np.maximum(np.diag(normal)[:n], 1e-300))  # of those at a bound: all else known
            covariance[np.ix_(free_parameters, free_parameters)] = full[:len(free_parameters), :len(free_parameters)]
            break
        free &= ~stuck
    return change, covariance


def cost_of(problem: Problem, values: np.ndarray, added: np.ndarray | float, x: np.ndarray,
            offsets: np.ndarray, prior: np.ndarray) -> float:
    """Minus the log of the posterior of a residual, of parameters x and of offsets, both with a Gaussian prior."""
    return -problem.likelihood(values, added) + 0.5 * float(((np.concatenate([x, offsets]) / prior) ** 2).sum())


def without_offsets(problem: Problem, values: np.ndarray, added: np.ndarray | float) -> tuple[np.ndarray, float]:
    """Values less the offsets between flights of highest posterior, and minus the log of these offsets' prior.

    An offset is that of one channel of one flight, so each is found alone, in two steps of weighted ridge regression.
    """
    power, residual, cost = problem.power + added, values.copy(), 0.0
    for index, column, spread in problem.offsets:
        amount = 0.0
        largest_weight = OVERLAP_WEIGHT * (problem.freedom[index] + 1.0) * problem.known[index] / power[index]
        for _ in range(2):
            weights = largest_weight / (problem.tail[index] + squared(residual[index]) / power[index])
            normal = 2.0 * float(weights @ squared(column)) + 1.0 / spread ** 2
            slope = 2.0 * float(np.vdot(column, weights * residual[index]).real) - amount / spread ** 2
            amount += slope / normal
            residual[index] = values[index] - amount * column
        cost += 0.5 * (amount / spread) ** 2
    return residual, cost
