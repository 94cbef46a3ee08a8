"""The ratio of responses where its closed form is known: no or all commands follow the loop model, or some do."""

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from airtouch.gap.loop.torque_share import QUIET, SHARE_DOUBT, STEPPED, Change, response_ratio

BINS = 6


@pytest.fixture
def change():
    """Shares and motors of drawn numbers."""
    rng = np.random.default_rng(1)

    def drawn(*shape):
        return 1.0 + 0.4 * rng.normal(size=shape) + 0.4j * rng.normal(size=shape)

    return Change(motors=drawn(BINS, 1), share=drawn(2, BINS, 3), before=0.4 * drawn(2, BINS, 3),
                  cut=np.zeros((BINS, 3)), logged=drawn(BINS, 1), incoherent=np.ones((2, BINS, 3)))


@pytest.mark.parametrize("kind", [QUIET, STEPPED])
def test_where_flights_are_as_the_loop_model_says_the_ratio_is_that_of_motors_and_share(change, kind):
    ratio = response_ratio(change, kind, change.before[kind] / change.logged)
    np.testing.assert_allclose(ratio, change.motors * change.share[kind])


def test_where_every_command_turns_the_vehicle_as_it_says_the_motors_alone_count(change):
    """A measured share of 1 or beyond, far from that of the model: the share follows nothing of the loop."""
    beyond = 1.0 - 5.0 * (change.before[QUIET] - 1.0)
    np.testing.assert_allclose(response_ratio(change, QUIET, beyond / change.logged),
                               np.broadcast_to(change.motors, (BINS, 3)))


def test_between_them_the_fraction_is_the_one_of_highest_posterior(change):
    rng = np.random.default_rng(2)
    own = change.before[QUIET]
    measured = (0.5 * own + 0.5 + 0.2 * rng.normal(size=own.shape)) / change.logged
    ratio = response_ratio(change, QUIET, measured)
    for place in np.ndindex(own.shape):
        b, target = own[place], measured[place] * change.logged[place[0], 0]
        fraction = minimize_scalar(
            lambda a, b=b, target=target: abs(target - (a * b + 1.0 - a)) ** 2 + SHARE_DOUBT ** 2 * (a - 1.0) ** 2,
            bounds=(0.0, 1.0), method="bounded", options={"xatol": 1e-9}).x
        with_effects = change.motors[place[0], 0] * (fraction * change.share[QUIET][place] * b + 1.0 - fraction)
        assert ratio[place] == pytest.approx(with_effects / (fraction * b + 1.0 - fraction), rel=1e-4)
