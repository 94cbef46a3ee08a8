"""Effects that only the log's times show: against drawn times of known jitter and loss."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import binom, norm

from airtouch.gap.evidence import clock
from airtouch.gap.flights.clock import LEAST_JITTER_S
from airtouch.gap.flights.flight import PERIOD_S
from airtouch.gap.signatures.candidates import terms


def flown(times=(0.0,), lost=(False,), clock_s=1e-3, of_lost=2e-3, loop=None):
    """A stand-in for the data of one flight with these times and lost rows; what nominal flights have of both."""
    return SimpleNamespace(flights=[SimpleNamespace(clock_s=np.array(times), lost=np.array(lost))],
                           study=SimpleNamespace(floor=SimpleNamespace(clock_s=clock_s, lost=of_lost), loop=loop))


def test_gain_of_a_jitter_is_that_of_normal_times():
    """Log likelihood under the measured scatter over that under the nominal one, of one value in CORRELATION_S."""
    times = np.random.default_rng(3).normal(0.0, 3e-3, 4000)
    times -= times.mean()
    of_each = np.mean(norm.logpdf(times, 0.0, np.std(times)) - norm.logpdf(times, 0.0, 1e-3))
    independent = 4000 * PERIOD_S / clock.CORRELATION_S
    assert clock.jitter(flown(times)).gain == pytest.approx(independent * of_each)


def test_gain_of_a_loss_is_that_of_a_binomial():
    lost = np.arange(4000) % 40 == 0
    n, k = round(4000 / clock.SAMPLES_OF_ONE), round(100 / clock.SAMPLES_OF_ONE)
    size, gain = clock.loss(flown(lost=lost))
    assert size == 0.025 and gain == pytest.approx(binom.logpmf(k, n, 0.025) - binom.logpmf(k, n, 2e-3))


def test_what_nominal_flights_have_too_gains_nothing():
    times = np.random.default_rng(4).normal(0.0, 0.5e-3, 4000)
    assert clock.jitter(flown(times)) == (0.0, 0.0) == clock.jitter(flown(np.zeros(100), clock_s=0.0))
    assert clock.loss(flown(lost=np.arange(4000) == 7)) == (1.0 / 4000.0, 0.0)


def test_nominal_flights_are_never_perfect():
    """However few nominal flights show, their jitter and loss are some; with a loop, a smaller loss stands out."""
    times = np.random.default_rng(5).normal(0.0, 0.9 * LEAST_JITTER_S, 4000)
    assert clock.jitter(flown(times, clock_s=0.0)).gain == 0.0
    lost = np.arange(4000) < 3
    assert clock.loss(flown(lost=lost, of_lost=0.0)).gain == 0.0
    assert clock.loss(flown(lost=lost, of_lost=0.0, loop="known")).gain > 0.0


def test_clock_and_losses_count_as_unknown_only_where_they_are_not_named():
    rng = np.random.default_rng(2)
    times, lost_rows = rng.normal(0.0, 4e-3, 2000), rng.random(2000) < 0.05
    floor = SimpleNamespace(clock_s=1e-3, lost=1e-3)
    data = SimpleNamespace(flights=[SimpleNamespace(clock_s=times, lost=lost_rows)],
                           study=SimpleNamespace(floor=floor, loop=None))
    extra, gain = clock.jitter(data)
    np.testing.assert_allclose(extra, np.sqrt(4.0 ** 2 - 1.0) * 1e-3, rtol=0.05)
    share, loss_gain = clock.loss(data)
    np.testing.assert_allclose(share, 0.05, rtol=0.3)
    assert clock.unexplained_clock_gain(data, ()) == gain + loss_gain
    assert clock.unexplained_clock_gain(data, terms("time_jitter")) == loss_gain
    assert clock.unexplained_clock_gain(data, [*terms("time_jitter"), *terms("packet_loss")]) == 0.0
