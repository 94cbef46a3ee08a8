"""The errors of the replay: which value is compared, and the figures of errors that are known."""

from types import SimpleNamespace

import pytest

from airtouch.gap.result import NamedEffect, Quantity
from tools.simulation import replay_error


def test_the_value_compared_is_that_of_the_effect_that_was_switched_on():
    diagnosis = SimpleNamespace(effects=(
        NamedEffect("mass", {"fraction": Quantity(0.07)}),
        NamedEffect("weak_motor", {"rotor": Quantity(2.0), "thrust_loss": Quantity(0.11)})))
    assert replay_error.fitted_value(diagnosis, "weak_motor", "thrust_loss") == 0.11
    assert replay_error.fitted_value(diagnosis, "mass", "fraction") == 0.07
    assert replay_error.fitted_value(diagnosis, "gust", "rms") is None


@pytest.mark.parametrize(("errors", "text"), [
    ([0.03, -0.04], "2 of 8 flights: at most 4.00% off, rms 3.54%"),  # the root of (9 + 16) / 2 is 3.536
    ([-0.02, -0.02, -0.02], "3 of 8 flights: at most 2.00% off, rms 2.00%")])
def test_the_largest_error_counts_without_its_sign(errors, text):
    assert replay_error.summary(errors, 8) == text


def test_each_case_compares_a_parameter_that_it_switches_on():
    assert all(values[parameter] > 0.0 for _, values, parameter in replay_error.CASES)
