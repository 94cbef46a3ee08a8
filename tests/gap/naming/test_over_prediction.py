"""Effects that say what made flights do not show."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.gap.answer.probabilities import probabilities
from airtouch.gap.answer.reasons import cell_in_words, shortfall
from airtouch.gap.evidence.cells import CELLS, REST_VIEW, VIEW_STRIDE, place_of
from airtouch.gap.evidence.judge import judge
from airtouch.gap.evidence.problem import BlockSet
from airtouch.gap.naming import judging
from airtouch.gap.naming.over_prediction import over_prediction_by_channel, over_prediction_of
from airtouch.gap.naming.policy import policy_of
from airtouch.gap.naming.records import OverPrediction
from airtouch.gap.naming.unknown import against_over_limit, is_explained
from airtouch.gap.signals.channels import CHANNELS, COUNT
from airtouch.gap.signals.spectra import REST
from hovers import DOWN, hover, scattered, select_from


def pushed_in_the_air_alone(seed):
    """At rest for 4 s, then 26 s of hover in which something pushes."""
    push = np.where(np.arange(3000)[:, None] < 400, 0.0, [0.0, 0.0, -DOWN])
    return hover(seed, push, resting_s=4.0)


def test_wrong_effect_over_predicts():
    """A bias of the accelerometer would stand at rest as well, and a push does not: its loss there is known."""
    selection, data = select_from([pushed_in_the_air_alone(7)], ("imu_bias",), scattered(imu_bias=[1e-3] * 6))
    (step,) = selection.steps
    on = judging.trial_of(data)
    loss, worst = over_prediction_of(on, selection.named_hypothesis)
    assert step.name == "imu_bias" and (place_of(worst).channel, place_of(worst).view) == ("force_z", REST_VIEW)
    resting = [BlockSet(tuple(p for p in part.pieces if p[1] == REST)) for part in on.halves]
    by_hand = sum(judge(data, resting[test], ()) - judge(data, resting[test], step.fits[train].terms)
                  for train, test in ((0, 1), (1, 0)))
    assert loss == pytest.approx(by_hand, rel=0.1) and loss > 30.0
    assert selection.over_prediction == OverPrediction(), "recorded flights are not asked"
    weaker = replace(step, gain=100.0)
    exact = replace(
        selection, policy=policy_of(replace(data.study, nominal_count=6), data.seconds), steps=(weaker,),
        nameless=replace(selection.nameless, over_last_step=1.0), over_prediction=OverPrediction(loss, worst))
    assert against_over_limit(exact) == pytest.approx(loss / (12.0 * 7 / 5)), "with six flights 17 nats may be chance"
    assert not is_explained(exact) and probabilities(exact, "unknown")["unknown"] > 0.5
    assert shortfall(exact, selection.single_effects["imu_bias"]).startswith(f"it loses {loss:.0f} nats where") \
        and cell_in_words(worst) in shortfall(exact, selection.single_effects["imu_bias"])


def test_a_right_effect_does_not_over_predict():
    selection, data = select_from([pushed_in_the_air_alone(7)], ("mass", "thrust_coefficient"), scattered(mass=[1e-3]))
    named = selection.named_hypothesis
    assert over_prediction_of(judging.trial_of(data), named).nats < 2.0 and named.gain > 100.0


def test_loss_by_channel():
    gains = np.zeros(CELLS)
    lift, forward, at_rest = 2, 0, REST_VIEW * VIEW_STRIDE
    gains[[lift, lift + COUNT]] = 100.0, -30.0  # it explains the means, and is wrong faster than that
    gains[[forward, forward + COUNT, forward + 2 * COUNT]] = -0.9, -5.0, -3.0
    gains[at_rest + forward] = -8.0
    sideways, roll, pitch = 1, 3, 4
    gains[[sideways, roll + COUNT, pitch]] = -50.0, -4.0, -6.0  # of x and y together nothing gains
    loss = over_prediction_by_channel(gains)
    assert loss[roll] == 3.0 + 5.0
    assert loss[lift] == pytest.approx(30.0 - 1.0 - 0.2 * 100.0)
    assert loss[forward] == pytest.approx(0.0 + 4.0 + 2.0 + 49.0) and loss[at_rest + forward] == pytest.approx(7.0)
    assert np.count_nonzero(loss) == 4


@pytest.mark.parametrize(("explained", "wrong"), [
    ("force_x", "force_y"), ("torque_y", "torque_x"), ("command_roll", "command_pitch")])
def test_what_is_explained_along_one_horizontal_axis_may_be_wrong_along_the_other(explained, wrong):
    """A push of 1 along x, taken to come 6 degrees from the side, is 0.1 along y that is not there."""
    names = [c.name for c in CHANNELS]
    gains = np.zeros(CELLS)
    gains[names.index(explained)], gains[names.index(wrong)] = 400.0, -45.0
    gains[names.index("force_z")], gains[names.index("command_yaw")] = 900.0, -7.0
    lost = {names[i]: lost for i, lost in enumerate(over_prediction_by_channel(gains)[:COUNT]) if lost}
    assert lost == {"command_yaw": 6.0}
