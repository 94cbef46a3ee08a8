"""The signals that a gap of known shape follows."""

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import spearmanr

from airtouch.gap.answer.followed_signals import followed_signals, rank_correlation
from airtouch.gap.signals.spectra import AIR, starts
from airtouch.simulation import signals as at
from gap_flights import flight
from shaken_hover import STUDY, hover, ratio_of


def test_signal_that_the_power_follows_is_named():
    """A gap that grows with time; the height, which does not change, and signals of the made hover say nothing."""
    growing = hover(np.linspace(0.1, 3.0, 4000))
    assert followed_signals(STUDY, [(growing, ratio_of(growing))]) == ["time"]
    steady = hover(1.0)
    assert not followed_signals(STUDY, [(steady, ratio_of(steady))])


def test_signals_that_vary_slowly_are_seldom_followed_by_chance():
    """40 blocks of two independent processes whose neighbours correlate by 0.8: one in a hundred is to pass p < 0.01.

    Taken for independent, far more pass. Of flights of 8 blocks each neighbours are those of a flight.
    """
    random = np.random.default_rng(0)
    x, y = lfilter([1.0], [1.0, -0.8], random.standard_normal((2, 400, 140)))[:, :, 100:]
    one, five = np.ones(39, bool), np.arange(1, 40) % 8 != 0
    rates = [np.mean([rank_correlation(a, b, where)[1] < 0.01 for a, b in zip(x, y, strict=True)])
             for where in (one, five)]
    naive = np.mean([spearmanr(a, b).pvalue < 0.01 for a, b in zip(x, y, strict=True)])
    assert max(rates) < 0.03 and naive > 0.1


def test_a_true_relation_of_values_that_are_independent_is_found_as_without_the_correction():
    random = np.random.default_rng(1)
    x = random.standard_normal((300, 40))
    y = 0.6 * x + random.standard_normal((300, 40))
    significant = np.mean([rank_correlation(a, b, np.ones(39, bool))[1] < 0.01 for a, b in zip(x, y, strict=True)])
    independent = np.mean([spearmanr(a, b).pvalue < 0.01 for a, b in zip(x, y, strict=True)])
    assert significant == pytest.approx(independent, abs=0.1)


def test_a_signal_that_one_flight_lacks_is_not_named():
    """Height that goes with the gap in two flights, of which one log has none."""
    climbing = np.linspace(0.1, 3.0, 4000)[::-1]
    pair = []
    for with_height in (True, False):
        one = hover(climbing)
        if with_height:
            one.log.columns["z_m"] = climbing
        one.signals[:, at.LOWER_HEIGHT:at.LOWER_HEIGHT + 4] = climbing[:, None]
        pair.append((one, ratio_of(one)))
    assert "height" in followed_signals(STUDY, pair[:1])
    assert "height" not in followed_signals(STUDY, pair)


@pytest.mark.parametrize(("seconds", "names"), [(19.2, []), (21.8, ["time"])])
def test_fewer_than_eight_separate_blocks_are_not_tested(seconds, names):
    one = flight(seconds)
    assert followed_signals(STUDY, [(one, np.arange(1.0, len(starts(one, AIR)) + 1.0))]) == names
