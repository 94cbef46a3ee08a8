"""The tests of CrazyPAD that are told more than the diagnosis."""

import numpy as np
import pytest

from tools.diagnosis import gap_crazypad_ideal as ideal
from tools.diagnosis.recordings.crazypad import figures as pad


@pytest.mark.parametrize("learner", ideal.LEARNERS)
def test_learners_tell_what_is_apart_and_not_what_is_not(learner, monkeypatch):
    monkeypatch.setattr(ideal, "TREES", 40)  # so few tell these apart; more are time
    generator = np.random.default_rng(2)
    names = ["normal_flight", "cut_propeller_M3_3mm", "add_weight_W1_near_M3", "weight_on_string_W2_near_M3"]
    rows = [{"drone": "E8", "condition": n} for n in names for _ in range(12)]
    separate = np.repeat(np.eye(4), 12, axis=0)
    folds = [np.arange(48) % 4 == i for i in range(4)]
    sure = ideal.cross_validate(ideal.Table(rows, 10.0 * separate + generator.normal(size=(48, 4))), folds, learner)
    chance = ideal.cross_validate(ideal.Table(rows, generator.normal(size=(48, 4))), folds, learner)
    assert pad.balanced_accuracy(sure) > 0.95 and pad.balanced_accuracy(chance) < 0.6
