"""Steps of ridge regression against SciPy's and NumPy's own least squares."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import lsq_linear, minimize_scalar

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.flattened import Offset
from airtouch.gap.evidence.least_squares import Bounds, bounded_step, normal_equations, weights_of, without_offsets
from airtouch.gap.evidence.problem import problem_of, whole_of
from airtouch.gap.signals.channels import COUNT
from airtouch.gap.signals.command_view import LikelihoodSlopes
from hovers import FLOOR, hover

FREE = Bounds(np.full(3, -9.0), np.full(3, 9.0))


@pytest.fixture
def system():
    """Columns (3, 200), values (200,), weights (200,), prior (3,), and the same as real rows with the prior's."""
    rng = np.random.default_rng(0)
    columns = rng.normal(size=(3, 200)) + 1j * rng.normal(size=(3, 200))
    values = np.array([-1.0, 2.0, -0.5]) @ columns + 0.3 * (rng.normal(size=200) + 1j * rng.normal(size=200))
    weights, prior = rng.uniform(0.1, 2.0, 200), np.array([0.5, 1.0, 3.0])
    return columns, values, weights, prior, *as_real_rows(columns, values, weights, prior)


def as_real_rows(columns, values, weights, prior):
    """Rows of a real regression with the prior's, and what they aim at without these."""
    root = np.sqrt(2.0 * weights)
    rows = np.vstack([(root * columns.real).T, (root * columns.imag).T, np.diag(1.0 / prior)])
    return rows, -np.concatenate([root * values.real, root * values.imag])  # a step lowers values + columns * step


@pytest.mark.parametrize("parameters", [0, 1, 3])
def test_a_step_is_the_weighted_ridge_regression(system, parameters):
    """With as many parameters; the other columns are offsets, none with an index in common."""
    columns, values, weights, prior, _, _ = system
    n, at = parameters, np.array([0.2, -0.1, 0.3])
    for i in range(n, 3):
        columns[i, np.arange(200) % 3 != i] = 0.0
    rows, aim = as_real_rows(columns, values, weights, prior)
    places = [np.flatnonzero(c) for c in columns[n:]]
    offsets = [Offset(here, -c[here], p) for here, c, p in zip(places, columns[n:], prior[n:], strict=True)]
    equations = normal_equations(columns[:n], prior, values, weights, at, offsets)
    step, covariance = bounded_step(equations, at[:n], (FREE[0][:n], FREE[1][:n]))
    expected = np.linalg.lstsq(rows, np.concatenate([aim, -at / prior]), rcond=None)[0]
    np.testing.assert_allclose(step, expected, rtol=1e-9)
    np.testing.assert_allclose(covariance, np.linalg.inv(rows.T @ rows)[:n, :n], rtol=1e-9)


def test_a_parameter_at_its_bound_stays_and_the_others_are_best_beside_it(system):
    columns, values, weights, prior, rows, aim = system
    x, low, high = np.zeros(3), np.full(3, -9.0), np.array([0.0, 9.0, 9.0])  # the first would rise to 1
    equations = normal_equations(columns, prior, values, weights, x)
    step, covariance = bounded_step(equations, x, (low, high))
    expected = lsq_linear(rows, np.concatenate([aim, np.zeros(3)]), (low, np.maximum(high, 1e-300)), tol=1e-12).x
    assert step[0] == 0.0
    np.testing.assert_allclose(step, expected, atol=1e-6)
    np.testing.assert_allclose(covariance[1:, 1:], np.linalg.inv((rows.T @ rows)[1:, 1:]), rtol=1e-9)
    down, _ = bounded_step(equations, x, (np.array([-9.0, 0.0, -9.0]), FREE[1]))
    assert down[1] == 0.0 < down[0]
    away, _ = bounded_step(normal_equations(columns, prior, -values, weights, x), x, (low, high))
    assert away[0] < 0.0, "away from its bound it is free"
    none, all_known = bounded_step(normal_equations(columns[:1], prior[:1], values, weights, x[:1]), x[:1],
                                   (low[:1], high[:1]))
    assert none.tolist() == [0.0]
    np.testing.assert_allclose(all_known, [[1.0 / (rows.T @ rows)[0, 0]]], err_msg="at its bound: all else known")


def test_gradient_and_information_of_elsewhere_are_added_and_damping_shortens(system):
    columns, values, weights, prior, rows, aim = system
    rng = np.random.default_rng(1)
    jacobian, misfit = rng.normal(size=(8, 3)), rng.normal(size=8)
    equations = normal_equations(columns, prior, values, weights, np.zeros(3))
    elsewhere = LikelihoodSlopes(jacobian.T @ misfit, jacobian.T @ jacobian)
    step, _ = bounded_step(equations.with_power(elsewhere), np.zeros(3), FREE)
    both = np.linalg.lstsq(np.vstack([rows, jacobian]), np.concatenate([aim, np.zeros(3), misfit]), rcond=None)[0]
    np.testing.assert_allclose(step, both, rtol=1e-9)
    damped, _ = bounded_step(equations, np.zeros(3), FREE, damping=1.0)
    normal = rows.T @ rows
    doubled = normal + np.diag(np.diag(normal))
    np.testing.assert_allclose(doubled @ damped, rows.T @ np.concatenate([aim, np.zeros(3)]))


@pytest.fixture(scope="module")
def problem():
    """Two hovers, the second under a steady force; the means of two channels may differ from flight to flight."""
    spread = np.zeros(COUNT)
    spread[[0, 2]] = 0.05, 0.02
    study = replace(FLOOR, floor=replace(FLOOR.floor, offset=spread))
    data = Data(study, [hover(1, length_s=12.0), hover(2, (0.06, 0.0, -0.04), length_s=12.0, name="forced")])
    return problem_of(data, whole_of(data))


def test_weights_are_those_of_the_likelihoods_slope(problem):
    """Least squares with these weights rise as minus the log likelihood does, for small changes of the values."""
    rng = np.random.default_rng(4)
    values = 3.0 * problem.elements.residual
    added = problem.elements.floor_power * rng.uniform(0.0, 2.0, len(values))
    weights = weights_of(problem, values, added)
    for _ in range(5):
        noise = rng.normal(size=(2, len(values)))
        column = np.sqrt(problem.elements.floor_power) * (noise[0] + 1j * noise[1])
        up, down = (problem.likelihood(values + sign * 1e-5 * column, added) for sign in (1.0, -1.0))
        assert 2.0 * (weights @ (column.conj() * values).real) == pytest.approx(-(up - down) / 2e-5, rel=1e-4, abs=1e-2)
    unknown = replace(problem, flat=replace(problem.flat, elements=replace(
        problem.elements, valid=np.arange(len(values)) % 2 == 0)))
    np.testing.assert_array_equal(weights_of(unknown, values, added)[1::2], 0.0)


@pytest.mark.parametrize("louder", [0.0, 5.0])
def test_offsets_that_are_subtracted_are_the_likeliest(problem, louder):
    """Each against SciPy's maximum of likelihood and prior; two steps of least squares come near it."""
    values, added = problem.elements.residual, louder * problem.elements.floor_power
    gap, cost = without_offsets(problem, values, added)
    amounts = []
    for offset in problem.offsets:
        changed = values.copy()

        def lost(amount, offset=offset, changed=changed):
            changed[offset.indices] = values[offset.indices] - amount * offset.column
            return 0.5 * (amount / offset.prior_std) ** 2 - problem.likelihood(changed, added)

        best = minimize_scalar(lost, bounds=(-5.0 * offset.prior_std, 5.0 * offset.prior_std), method="bounded",
                               options={"xatol": 1e-9})
        here = offset.indices[np.argmax(np.abs(offset.column))]
        amount = ((values - gap)[here] / offset.column[np.argmax(np.abs(offset.column))]).real
        np.testing.assert_allclose((values - gap)[offset.indices], amount * offset.column, atol=1e-9)
        assert amount == pytest.approx(best.x, abs=0.02 * offset.prior_std) and lost(amount) < best.fun + 0.01
        amounts.append(amount / offset.prior_std)
    assert cost == pytest.approx(0.5 * np.sum(np.square(amounts))) and np.abs(amounts).max() > 0.5
