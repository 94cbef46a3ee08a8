"""What flights must show for a name, by what is known of them."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from airtouch.gap.naming.policy import policy_of

SIMULATED, RECORDED = "simulated", "recorded"
NO_BASELINE = "no baseline"


def policy(kind, count=6, same_models=False, nominal_gain=20.0, loop=True):
    """The policy for flights of 30 s. nominal_gain: nats that the nameless model gains in nominal ones as long."""
    allowed = lambda seconds, least: nominal_gain if (seconds, least) == (30.0, 12.0) else None  # noqa: E731
    return policy_of(SimpleNamespace(
        simulated=kind == SIMULATED, nominal_count=count, same_models=same_models,
        loop=SimpleNamespace() if loop else None,
        scatter=None if kind == NO_BASELINE else SimpleNamespace(allowed=allowed)), 30.0)


@pytest.mark.parametrize(("kind", "same_models", "assumed", "share"), [
    (SIMULATED, False, False, 0.1), (SIMULATED, False, True, 0.2), (SIMULATED, True, False, 0.05),
    (SIMULATED, True, True, 0.1), (RECORDED, False, False, 0.1), (RECORDED, False, True, 0.2)])
def test_a_share_of_what_effects_gain_may_be_left(kind, same_models, assumed, share):
    assert policy(kind, same_models=same_models).unknown.nats(1000.0, 5000.0, assumed) == pytest.approx(share * 1000.0)


def test_least_limit_falls_with_nominal_flights():
    for count in (2, 6):
        limit = policy(SIMULATED, count).unknown
        assert limit.nats(0.0, 5000.0, False) == limit.least == pytest.approx(12.0 * (count + 1) / (count - 1))


def test_recorded_flights_may_leave_what_nominal_ones_leave():
    assert policy(RECORDED, nominal_gain=33.0).unknown.nats(0.0, 5000.0, False) == 33.0
    assert policy(SIMULATED, nominal_gain=33.0).unknown.nats(0.0, 5000.0, False) == pytest.approx(12.0 * 7 / 5)


@pytest.mark.parametrize("kind", [RECORDED, NO_BASELINE])
def test_limit_without_two_nominal_flights(kind):
    limit = policy(kind, count=1).unknown
    assert limit.nats(9000.0, 1000.0, False) == limit.nats(9000.0, 1000.0, True) == pytest.approx(200.0)
    assert limit.nats(9000.0, 10.0, False) == 25.0


def test_models_are_more_exact_in_simulated_flights():
    simulated, own, recorded = policy(SIMULATED), policy(SIMULATED, same_models=True), policy(RECORDED)
    assert (simulated.misfit_share, own.misfit_share, recorded.misfit_share) == (0.01, 0.01, 0.1)
    assert (simulated.loop_misfit_share, own.loop_misfit_share, recorded.loop_misfit_share) == (0.25, 0.1, 0.25)
    assert simulated.misfit_by_cell and not recorded.misfit_by_cell
    assert own.loop_misfit_by_cell and not simulated.loop_misfit_by_cell and not recorded.loop_misfit_by_cell
    assert recorded.loop_is_assumed and not simulated.loop_is_assumed
    assert recorded.must_close_gap and not recorded.judges_over_prediction
    assert simulated.judges_over_prediction and not simulated.must_close_gap


def test_flights_without_a_baseline_count_as_recorded():
    alone, recorded = policy(NO_BASELINE, count=0, loop=False), policy(RECORDED, loop=False)
    assert replace(alone, unknown=recorded.unknown) == recorded


def test_simulated_flights_with_a_loop_need_less_evidence():
    assert [policy(SIMULATED, loop=loop).least_evidence for loop in (True, False)] == [8.0, 12.0]
    assert [policy(RECORDED, loop=loop).least_evidence for loop in (True, False)] == [12.0, 12.0]
