"""Steps of weighted ridge regression on flattened spectra: those of a fit, and the offsets between flights."""

from collections.abc import Sequence

import numpy as np

from airtouch.gap.candidates import Term
from airtouch.gap.problem import Problem
from airtouch.gap.spectra import OVERLAP_WEIGHT


def limits(mean: Sequence[Term]) -> tuple[np.ndarray, np.ndarray]:
    pairs = [t.bounds() for t in mean]
    return (np.concatenate([p[0] for p in pairs]), np.concatenate([p[1] for p in pairs])) if pairs \
        else (np.zeros(0), np.zeros(0))


def weights_of(problem: Problem, values: np.ndarray, added: np.ndarray | float) -> np.ndarray:
    power = problem.power + added
    e = np.abs(values) ** 2 / power
    return OVERLAP_WEIGHT * (problem.freedom + 1.0) / (problem.tail + e) / power * problem.known


def solve(columns: list[np.ndarray], prior: np.ndarray, values: np.ndarray, weights: np.ndarray,
           at: np.ndarray, twin: tuple[np.ndarray, np.ndarray] | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Step of ridge regression that lowers values + sum(step * column), and the covariance.

    twin: gradient and information of the likelihood from the commands' spectra.
    """
    normal, slope = _normal(columns, prior, values, weights, at, twin)
    covariance = np.linalg.pinv(normal, hermitian=True)
    return covariance @ slope, covariance


def _normal(columns: list[np.ndarray], prior: np.ndarray, values: np.ndarray, weights: np.ndarray, at: np.ndarray,
            twin: tuple[np.ndarray, np.ndarray] | None) -> tuple[np.ndarray, np.ndarray]:
    """Normal matrix and right-hand side of that ridge regression."""
    j = np.array(columns)
    wj = j.conj() * weights
    normal = 2.0 * (wj @ j.T).real + np.diag(1.0 / prior ** 2)
    slope = -2.0 * (wj @ values).real - at / prior ** 2
    if twin is not None:
        slope, normal = slope + twin[0], normal + twin[1]
    return normal, slope


def bounded_step(columns: list[np.ndarray], prior: np.ndarray, values: np.ndarray, weights: np.ndarray,
                 x: np.ndarray, offsets: np.ndarray, low: np.ndarray, high: np.ndarray,
                 twin: tuple[np.ndarray, np.ndarray], damping: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """A step that leaves parameters at a bound there when it would take them past it, and the covariance (n, n) of x.

    damping: share of the normal matrix's diagonal that is added to it for the step.
    """
    at, n = np.concatenate([x, offsets]), len(x)
    free = np.ones(len(at), bool)
    covariance = np.zeros((n, n))
    gradient, information = np.zeros(len(at)), np.zeros((len(at), len(at)))
    gradient[:n], information[:n, :n] = twin
    normal, slope = _normal(columns, prior, values, weights, at, (gradient, information))
    for _ in range(n + 1):
        change = np.zeros(len(at))
        where = np.flatnonzero(free)
        if not len(where):
            break
        full = np.linalg.pinv(normal[np.ix_(where, where)], hermitian=True)
        damped = normal[np.ix_(where, where)] + damping * np.diag(np.diag(normal)[where])
        change[where] = np.linalg.solve(damped, slope[where]) if damping else full @ slope[where]
        stuck = np.zeros(len(at), bool)
        stuck[:n] = free[:n] & (((x <= low) & (change[:n] < 0.0)) | ((x >= high) & (change[:n] > 0.0)))
        if not stuck.any():
            inside = where[where < n]
            covariance = np.diag(1.0 / np.maximum(np.diag(normal)[:n], 1e-300))  # of those at a bound: all else known
            covariance[np.ix_(inside, inside)] = full[:len(inside), :len(inside)]
            break
        free &= ~stuck
    return change, covariance


def cost_of(problem: Problem, values: np.ndarray, added: np.ndarray | float, x: np.ndarray,
          offsets: np.ndarray, prior: np.ndarray) -> float:
    return -problem.likelihood(values, added) + 0.5 * float(((np.concatenate([x, offsets]) / prior) ** 2).sum())


def without_offsets(problem: Problem, values: np.ndarray, added: np.ndarray | float,
                     ) -> tuple[np.ndarray, float]:
    constants = problem.constant()
    if not constants:
        return values, 0.0
    prior, found = np.array([p for _, p in constants]), np.zeros(len(constants))
    left = values
    for _ in range(2):
        step, _ = solve([-c for c, _ in constants], prior, left, weights_of(problem, left, added), found)
        found = found + step
        left = values - sum(a * c for a, (c, _) in zip(found, constants, strict=True))
    return left, 0.5 * float(((found / prior) ** 2).sum())
