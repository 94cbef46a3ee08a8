"""Steps of weighted ridge regression on the flattened residual: those of a fit, and the offsets between flights.

k: scaled parameters of mean effects; m: offsets; n: flattened values.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from airtouch.gap.evidence.flattened import Offset
from airtouch.gap.evidence.problem import Problem
from airtouch.gap.signals.command_view import LikelihoodSlopes
from airtouch.gap.signals.spectra import LEAST_POWER, OVERLAP_WEIGHT, squared
from airtouch.gap.signatures.term import Term

OFFSET_STEPS = 2  #: steps by which an offset is found; chosen for time. A larger number comes closer to the likeliest


class Bounds(NamedTuple):
    """Lowest and highest scaled parameters (k,)."""

    low: np.ndarray
    high: np.ndarray


class BoundedStep(NamedTuple):
    """A step of parameters and offsets, change (k + m,), and the parameters' covariance (k, k)."""

    change: np.ndarray
    covariance: np.ndarray


class WithoutOffsets(NamedTuple):
    """The residual (n,) less offsets between flights, and what these cost, nats: minus the log of their prior."""

    residual: np.ndarray
    cost: float


class NormalEquations(NamedTuple):
    """Equations of a step of parameters and offsets: matrix (k + m, k + m) times the step is right (k + m,)."""

    matrix: np.ndarray
    right: np.ndarray

    def with_power(self, slopes: LikelihoodSlopes) -> "NormalEquations":
        """The equations where the parameters change the expected power too: `SpectraSlopes.power_slopes`."""
        k, matrix, right = len(slopes.gradient), self.matrix.copy(), self.right.copy()
        matrix[:k, :k] += slopes.information
        right[:k] += slopes.gradient
        return NormalEquations(matrix, right)

    def gain_of(self, change: np.ndarray) -> float:
        """Nats that a step (k + m,) gains as far as the equations know: to second order."""
        return float(change @ (self.right - 0.5 * (self.matrix @ change)))


def normal_equations(columns: Sequence[np.ndarray] | np.ndarray, prior_stds: np.ndarray, residual: np.ndarray,
                     weights: np.ndarray, at: np.ndarray, offsets: Sequence[Offset] = ()) -> NormalEquations:
    """Normal equations of a ridge regression: its step leaves residual + sum(step * column) - sum(step * offset).

    Of this r they minimise sum(weight |r|^2) + sum(((at + step) / prior_std)^2) / 2, hence the factors 2.

    columns (k, n): change of the residual per parameter; prior_stds (k + m,): standard deviations of parameters and
    offsets about 0; residual (n,); weights (n,): `weights_of`; at (k + m,): parameters and offsets where the step
    begins; offsets: m of them, of which no two change the same value.
    """
    columns = np.ascontiguousarray(columns, complex).reshape(-1, len(residual))
    k, m = len(columns), len(offsets)
    matrix, right = np.diag(1.0 / prior_stds ** 2), -at / prior_stds ** 2
    if k:
        as_real = columns.view(float)  # real and imaginary parts side by side
        weighted_real = as_real * np.repeat(weights, 2)
        matrix[:k, :k] += 2.0 * (weighted_real @ as_real.T)
        right[:k] -= 2.0 * (weighted_real @ np.ascontiguousarray(residual, complex).view(float))
    for i, (indices, column, _) in zip(range(k, k + m), offsets, strict=True):
        weighted = (weights[indices] * column).conj()
        matrix[i, i] += 2.0 * (weighted @ column).real
        right[i] += 2.0 * (weighted @ residual[indices]).real
        matrix[:k, i] = matrix[i, :k] = -2.0 * (columns[:, indices] @ weighted).real
    return NormalEquations(matrix, right)


def bounded_step(equations: NormalEquations, x: np.ndarray, bounds: Bounds, damping: float = 0.0) -> BoundedStep:
    """The step that solves the equations, without those parameters that it would move past a bound where they are.

    A parameter at a bound that the step would pass stays there, and the others are solved without it. Its variance is
    that of a parameter beside which all others are known. The end of the step may lie beyond a bound, if it does not
    begin there: the caller clips it.

    x (k,): parameters where the step begins; damping: fraction of the matrix's diagonal that is added to it for the
    step, but not for the covariance (Levenberg-Marquardt).
    """
    matrix, right = equations
    n, (low, high) = len(x), bounds
    free = np.ones(len(right), bool)
    # what stays of it below is that of parameters at a bound
    covariance = np.diag(1.0 / np.maximum(np.diag(matrix)[:n], LEAST_POWER))
    for _ in range(n + 1):
        change = np.zeros(len(right))
        solved = np.flatnonzero(free)
        if not len(solved):
            break
        inverse = np.linalg.pinv(matrix[np.ix_(solved, solved)], hermitian=True)
        damped = matrix[np.ix_(solved, solved)] + damping * np.diag(np.diag(matrix)[solved])
        change[solved] = np.linalg.solve(damped, right[solved]) if damping else inverse @ right[solved]
        stuck = np.zeros(len(right), bool)
        stuck[:n] = free[:n] & (((x <= low) & (change[:n] < 0.0)) | ((x >= high) & (change[:n] > 0.0)))
        if not stuck.any():
            free_parameters = solved[solved < n]
            covariance[np.ix_(free_parameters, free_parameters)] = inverse[:len(free_parameters), :len(free_parameters)]
            break
        free &= ~stuck
    return BoundedStep(change, covariance)


def bounds_of(mean: Sequence[Term]) -> Bounds:
    """The bounds of the scaled parameters of all terms."""
    of_terms = [Bounds(*t.bounds()) for t in mean]
    return Bounds(np.concatenate([np.zeros(0), *(b.low for b in of_terms)]),
                  np.concatenate([np.zeros(0), *(b.high for b in of_terms)]))


def weights_of(problem: Problem, residual: np.ndarray, extra_power: np.ndarray | float) -> np.ndarray:
    """Weights (n,) of a least-squares step whose optimum is that of the likelihood with its tails; 0 where not valid.

    Repeated with weights taken anew, the steps end at that optimum (iteratively reweighted least squares).

    residual (n,); extra_power (n,): what a hypothesis adds to the floor's.
    """
    elements, exponent = problem.elements, problem.likelihood.exponent
    expected_power = elements.floor_power + extra_power
    over_expected = squared(residual) / expected_power
    return OVERLAP_WEIGHT * exponent / (elements.tail_scale + over_expected) / expected_power * elements.valid


def without_offsets(problem: Problem, residual: np.ndarray, extra_power: np.ndarray | float) -> WithoutOffsets:
    """The residual less the offsets between flights of highest posterior, or close to it.

    No two offsets change the same value, so each is found alone, in OFFSET_STEPS steps of weighted ridge regression.

    residual (n,); extra_power (n,): what a hypothesis adds to the floor's.
    """
    elements, exponent = problem.elements, problem.likelihood.exponent
    expected_power, out, cost = elements.floor_power + extra_power, residual.copy(), 0.0
    for indices, column, prior_std in problem.offsets:
        amount, expected = 0.0, expected_power[indices]
        largest_weight = OVERLAP_WEIGHT * exponent[indices] * elements.valid[indices] / expected
        for _ in range(OFFSET_STEPS):
            weights = largest_weight / (elements.tail_scale[indices] + squared(out[indices]) / expected)
            normal = 2.0 * float(weights @ squared(column)) + 1.0 / prior_std ** 2
            slope = 2.0 * float(np.vdot(column, weights * out[indices]).real) - amount / prior_std ** 2
            amount += slope / normal
            out[indices] = residual[indices] - amount * column
        cost += 0.5 * (amount / prior_std) ** 2
    return WithoutOffsets(out, cost)
