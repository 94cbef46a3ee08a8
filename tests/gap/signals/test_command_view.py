"""The command view on a made loop: its equations written again with SciPy's F distribution and optimiser."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats
from scipy.optimize import minimize

from airtouch.gap.edges import edge_effects, edge_response
from airtouch.gap.loop.command_spectra import COMMAND_FREEDOM, command_frequencies
from airtouch.gap.loop.controller import AXES
from airtouch.gap.signals import command_view
from airtouch.gap.signals.command_floor_correction import COMMAND_DOUBT, SHAPES, SPREAD, UNCERTAIN_FACTOR
from airtouch.gap.signals.command_view import CommandElements, CommandView, view_of
from airtouch.gap.signals.spectra import AIR
from airtouch.simulation.effects import activate
from gap_flights import flight

F = command_frequencies()
TABLE = len(F), len(AXES)
BLOCKS = 6, 9  # of two flights
FLOOR = np.outer(2.0 / F, np.arange(1.0, len(AXES) + 1.0))
OCTAVES = np.log2(F / F[0])[:, None] / 5.0  # 0 at the lowest frequency, about 1 at the highest
#: by what a parameter of 1 raises the logarithm of the power (bins, axes): one of roll and pitch, one of all axes
RISES = np.array([OCTAVES * [0.0, 0.5, 0.4], 0.3 * np.cos(7.0 * OCTAVES) * np.ones(len(AXES))])


class MadeLoop:
    """A loop whose hypotheses are numbers x: each multiplies the power of the commands by exp(x @ RISES)."""

    floor, edges = FLOOR, None

    @staticmethod
    def ratio(x):
        return np.exp(np.tensordot(x, RISES, 1)) if len(x) else np.ones(TABLE)


def made_view(powers):
    """A view of spectra of this power (blocks, bins, axes), one table a flight."""
    floor = np.concatenate([np.broadcast_to(FLOOR, p.shape).ravel() for p in powers])
    flat = np.zeros(len(floor), int)
    elements = CommandElements(np.sqrt(np.concatenate([p.ravel() for p in powers])).astype(complex), floor, flat,
                               flat.astype(float), flat, np.full(len(floor), COMMAND_FREEDOM))
    return CommandView(MadeLoop(), elements, powers)


@pytest.fixture(scope="module")
def powers():
    """Power of two flights whose parameters are 0.8 and -0.5, with the floor off by a level and a slope."""
    rng = np.random.default_rng(3)
    expected = FLOOR * MadeLoop.ratio([0.8, -0.5]) * np.exp(0.1 - 0.05 * OCTAVES)
    return [expected * stats.f(2.0, 2.0 * COMMAND_FREEDOM).rvs((n, *TABLE), random_state=rng) for n in BLOCKS]


def shapes():
    """Half waves over the logarithm of frequency (SHAPES, bins), and the deviation of their amounts' prior."""
    place = np.log(F / F[0]) / np.log(F[-1] / F[0])
    return np.cos(np.pi * np.arange(SHAPES)[:, None] * place)


def deviations(ratio, uncertain_floor):
    """Standard deviation (SHAPES,) of the amounts of the shapes before any flight."""
    known = np.array([SPREAD[0], *[SPREAD[1]] * (SHAPES - 1)]) * (UNCERTAIN_FACTOR if uncertain_floor else 1.0)
    return np.sqrt(known ** 2 + COMMAND_DOUBT ** 2 * np.mean(np.log(ratio) ** 2))


def best_correction(power, ratio, uncertain_floor):
    """Correction (bins, axes) of highest posterior for a flight, and that log posterior less the log of a volume.

    The volume is that of the prior over that of the posterior, by the information of exponential powers.
    """
    spread, log_power, level = deviations(ratio, uncertain_floor), np.zeros(TABLE), 0.0
    for axis in range(len(AXES)):
        expected = FLOOR[:, axis] * ratio[:, axis]

        def cost(amount, expected=expected, axis=axis):
            over = power[:, :, axis] / (expected * np.exp(amount @ shapes()))
            log_density = stats.f.logpdf(over, 2.0, 2.0 * COMMAND_FREEDOM) - np.log(power[:, :, axis] / over)
            return -0.5 * log_density.sum() + 0.5 * ((amount / spread) ** 2).sum()

        optimum = minimize(cost, np.zeros(SHAPES), method="BFGS", options={"gtol": 1e-5})
        log_power[:, axis], level = optimum.x @ shapes(), level - optimum.fun
        information = 0.5 * len(power) * np.einsum("i,if,jf,j->ij", spread, shapes(), shapes(), spread)
        level -= 0.5 * np.linalg.slogdet(np.eye(SHAPES) + information)[1]
    return log_power, level


@pytest.mark.parametrize("uncertain_floor", [False, True])
def test_the_power_is_floor_times_ratio_times_the_correction_of_highest_posterior(powers, uncertain_floor):
    ratio, begin = MadeLoop.ratio([0.8, -0.5]), 0
    expected, cost = made_view(powers).power([0.8, -0.5], uncertain_floor)
    likelihood = level = 0.0
    for power in powers:
        log_power, of_flight = best_correction(power, ratio, uncertain_floor)
        own = expected[begin:begin + power.size].reshape(power.shape)
        np.testing.assert_array_equal(own, np.broadcast_to(own[0], own.shape))  # the same in every block
        np.testing.assert_allclose(np.log(own[0] / (FLOOR * ratio)), log_power, atol=3e-3)
        likelihood += 0.5 * (stats.f.logpdf(power / own, 2.0, 2.0 * COMMAND_FREEDOM) - np.log(own)).sum()
        level += of_flight
        begin += power.size
    assert begin == len(expected)
    assert likelihood - cost == pytest.approx(level, abs=0.02)


def test_a_flight_on_the_floor_needs_no_correction_and_costs_the_volume_alone():
    """A power equal to the expected one is the likeliest of the law, so that no shape moves."""
    power = np.tile(FLOOR, (BLOCKS[0], 1, 1))
    expected, cost = made_view([power]).power([])
    np.testing.assert_allclose(expected, power.ravel(), rtol=1e-12)
    spread = deviations(np.ones(TABLE), False)
    covariance = np.eye(len(F)) + 0.5 * len(power) * shapes().T @ np.diag(spread ** 2) @ shapes()
    assert cost == pytest.approx(0.5 * len(AXES) * np.linalg.slogdet(covariance)[1])


@pytest.mark.parametrize("uncertain_floor", [False, True])
@pytest.mark.parametrize("x", [(0.0, 0.0), (0.8, -0.5), (-1.0, 1.5)])
def test_the_gradient_is_that_of_the_log_likelihood(powers, x, uncertain_floor):
    """By differences of the log likelihood as it is written above."""
    gradient, _ = made_view(powers).slopes(x, RISES, uncertain_floor)
    step = 0.02
    for i in range(len(x)):
        up, down = (sum(best_correction(p, MadeLoop.ratio(x + sign * step * np.eye(2)[i]), uncertain_floor)[1]
                        for p in powers)
                    for sign in (1.0, -1.0))
        assert gradient[i] == pytest.approx((up - down) / (2.0 * step), rel=0.01, abs=0.1)


@pytest.mark.parametrize("uncertain_floor", [False, True])
def test_the_information_is_that_of_powers_whose_floor_has_a_normal_prior(powers, uncertain_floor):
    """Rises seen with a variance of 1 / weight in each bin, and that of the shapes' prior beside it."""
    x = (0.8, -0.5)
    _, information = made_view(powers).slopes(x, RISES, uncertain_floor)
    spread, expected = deviations(MadeLoop.ratio(x), uncertain_floor), np.zeros((2, 2))
    for n in BLOCKS:
        covariance = np.eye(len(F)) / (0.5 * n) + shapes().T @ np.diag(spread ** 2) @ shapes()
        expected += np.einsum("ifa,fg,jga->ij", RISES, np.linalg.inv(covariance), RISES)
    np.testing.assert_allclose(information, expected, rtol=1e-8)


def test_the_gradient_scatters_as_the_information_says():
    """Over flights of the model, their floors off as the prior says; tails take an eleventh of the information."""
    rng, truth, law = np.random.default_rng(4), (0.8, -0.5), stats.f(2.0, 2.0 * COMMAND_FREEDOM)
    expected = FLOOR * MadeLoop.ratio(truth)
    spread, gradients = deviations(MadeLoop.ratio(truth), False), []
    for _ in range(300):
        off = np.exp(shapes().T @ (spread[:, None] * rng.normal(size=(SHAPES, len(AXES)))))
        once = expected * off * law.rvs((6, *TABLE), random_state=rng)
        twice = np.repeat(once, 2, axis=0)  # half overlapping blocks hold every sample twice
        gradient, information = made_view([twice]).slopes(truth, RISES)
        gradients.append(gradient)
    np.testing.assert_allclose(np.mean(gradients, axis=0), 0.0, atol=4.0 * np.sqrt(information.max() / 300))
    np.testing.assert_allclose(np.diag(np.cov(np.array(gradients).T)), np.diag(information), rtol=0.3)


def test_parameters_that_leave_the_commands_alone_have_neither_gradient_nor_information(powers):
    gradient, information = made_view(powers).slopes((0.8, -0.5), np.stack([RISES[0], 0.0 * RISES[0]]))
    assert gradient[1] == 0.0 and not information[1].any() and not information[:, 1].any()
    assert gradient[0] != 0.0 and information[0, 0] > 0.0


def test_a_view_without_a_loop_has_no_element_and_says_nothing():
    hover = flight(10.0)
    first, chosen = {AIR: np.array([0, 128])}, np.ones(2, bool)
    view = view_of(None, [hover], [first], [(0, AIR, chosen)])
    assert len(view) == 0 and all(len(x) == 0 for x in view.elements)
    power, cost = view.power(())
    assert len(power) == 0 and cost == 0.0 and len(view.values_without(())) == 0
    assert view.rise((), ()).shape == (0, len(AXES))
    gradient, information = view.slopes((), np.zeros((3, 0, len(AXES))))
    np.testing.assert_array_equal(gradient, np.zeros(3))
    np.testing.assert_array_equal(information, np.zeros((3, 3)))


def test_what_effects_add_at_edges_is_taken_off_there_alone(monkeypatch):
    """Two edges behind ten values of spectra: each loses what effects add to its own response."""
    count = edge_response.COUNT
    added = {"first": np.arange(count) + 1.0, "second": -np.ones(count)}
    monkeypatch.setattr(edge_effects, "added_response", lambda floor, flight, edge, active: added[edge])
    rng = np.random.default_rng(5)
    values = rng.normal(size=10 + 2 * count) + 0j
    elements = CommandElements(values, *[np.ones(len(values))] * 5)
    view = CommandView(SimpleNamespace(edges="nominal"), elements, (), [(None, "first"), (None, "second")])
    step, heavy = activate({"range_step": {"residual": 0.02, "kick": 0.05}}), activate({"mass": {"fraction": 0.1}})
    np.testing.assert_array_equal(view.values_without(heavy), values)
    without = view.values_without([*heavy, *step])
    np.testing.assert_array_equal(without[:10], values[:10])
    np.testing.assert_array_equal(without[10:10 + count], values[10:10 + count] - added["first"])
    np.testing.assert_array_equal(without[10 + count:], values[10 + count:] - added["second"])
    np.testing.assert_array_equal(view.elements.values, values)  # of none the values stay


def test_an_edge_outside_of_every_block_is_judged_with_none(monkeypatch):
    """The nearest block of 2.56 s begins at sample 300; edges lie in it, before it, and after it."""
    edges = [SimpleNamespace(sample=at) for at in (100, 320, 540, 600)]
    monkeypatch.setattr(edge_response, "edges_of", lambda flight: edges)
    monkeypatch.setattr(command_view, "_of_edge", lambda *_: CommandElements(*np.zeros((6, 0))))
    loop = SimpleNamespace(edges="nominal", levelled_spectra=lambda flight: ((), ()))
    view = view_of(loop, [None], [{AIR: np.array([300])}], [(0, AIR, np.array([True]))])
    assert [e.sample for _, e in view.edges] == [320, 540]
