"""Blocks without a step of a set-point: against made torque of a known law, with kicks in known blocks."""

import numpy as np
import pytest
from scipy import stats

from airtouch.gap.signals.quiet_blocks import (
    CALM,
    QUIET_BINS,
    STEPPED_TORQUE,
    QuietPower,
    are_quiet,
    estimate_quiet_power,
)

BINS, FLIGHTS, BLOCKS, KICKED_EVERY = 129, 12, 200, 5
SPECTRUM = (1.0 + np.arange(BINS) / 20.0)[:, None] * [0.5, 2.0, 7.0]  #: power (bins, 3) of the made noise
JUDGED = QUIET_BINS.stop - QUIET_BINS.start
EVEN = QuietPower(np.ones((BINS, 3)), np.ones(3))  #: of noise whose every block has the power 1


def noise(rng, blocks):
    """Normal noise (blocks, BINS, 3), whose power follows an exponential law of mean SPECTRUM."""
    parts = rng.normal(size=(2, blocks, BINS, 3))
    return np.sqrt(SPECTRUM / 2.0) * (parts[0] + 1j * parts[1])


@pytest.fixture(scope="module")
def found():
    """What is found in flights whose every fifth block is kicked about roll and yaw, and which blocks those are."""
    rng = np.random.default_rng(6)
    flights, kicked = [noise(rng, BLOCKS) for _ in range(FLIGHTS)], np.zeros((BLOCKS, 3), bool)
    kicked[::KICKED_EVERY, [0, 2]] = True
    for torque in flights:
        torque += 10.0 * np.sqrt(SPECTRUM) * kicked[:, None]
    nominal, quiet = estimate_quiet_power(flights, np.abs(np.concatenate(flights)) ** 2)
    return nominal, quiet, np.tile(kicked, (FLIGHTS, 1))


def test_the_kicked_blocks_are_told_axis_by_axis(found):
    _, quiet, kicked = found
    np.testing.assert_array_equal(quiet, ~kicked)


def test_the_mean_is_that_of_the_noise_without_the_kicks(found):
    """The median of n exponential values has the relative deviation 1 / (log 2 sqrt(n))."""
    nominal, quiet, _ = found
    deviation = 1.0 / (np.log(2.0) * np.sqrt(quiet.sum(axis=0).min()))
    error = nominal.mean / SPECTRUM - 1.0
    assert np.abs(error).max() < 4.5 * deviation and np.abs(error.mean(axis=0)).max() < 0.01


def test_calm_is_the_quantile_of_a_mean_of_exponential_powers(found):
    """The mean over the judged bins follows a gamma law; kicked blocks are the strongest of their flight."""
    nominal, _, kicked = found
    quantile = CALM / (1.0 - kicked.mean(axis=0))
    np.testing.assert_allclose(nominal.calm, stats.gamma.ppf(quantile, JUDGED, scale=1.0 / JUDGED), atol=0.02)


@pytest.mark.parametrize("gain", [0.1, 1.0, 10.0])
@pytest.mark.parametrize("calm", [0.5, 1.0])
def test_a_block_is_quiet_up_to_a_multiple_of_the_calm_ones_of_its_flight_at_any_gain(gain, calm):
    """Calm blocks have the power 1, which is a share `calm` of what the nominal mean is at this gain."""
    limit = STEPPED_TORQUE / calm
    torque = gain * np.sqrt([1.0, 1.0, 0.99 * limit, 1.01 * limit])[:, None, None] * np.ones((4, BINS, 3))
    quiet = are_quiet(torque, QuietPower(np.ones((BINS, 3)), np.full(3, calm)))
    np.testing.assert_array_equal(quiet, np.tile([[True], [True], [True], [False]], 3))


def test_one_calm_block_of_a_short_flight_tells_the_steps_in_all_others():
    """A pass over an edge lasts some blocks, most of them with a step."""
    torque = np.sqrt([15.0, 17.0, 1.0, 14.0, 16.0])[:, None, None] * np.ones((5, BINS, 3))
    np.testing.assert_array_equal(are_quiet(torque, EVEN)[:, 0], [False, False, True, False, False])


def test_what_is_outside_the_bins_of_steps_does_not_count():
    torque = np.ones((4, BINS, 3))
    torque[1, :QUIET_BINS.start] = torque[1, QUIET_BINS.stop:] = 100.0
    assert are_quiet(torque, EVEN).all()


def test_a_flight_without_blocks_has_none_and_changes_nothing():
    assert are_quiet(np.zeros((0, BINS, 3)), EVEN).shape == (0, 3)
    torque = noise(np.random.default_rng(7), 50)
    power = np.abs(torque) ** 2
    alone, beside_none = (estimate_quiet_power(flights, power)[0] for flights in ([torque], [torque[:0], torque]))
    np.testing.assert_array_equal(alone.calm, beside_none.calm)
