"""The tests of CrazyPAD that are told more than the diagnosis."""

import numpy as np
import pytest

import gap_crazypad_balance as balance
import gap_crazypad_ideal as ideal
from crazypad import figures as pad


def test_millimetres_of_a_condition():
    assert pad.millimetres("cut_M2_3.5mm_3.0mm_40.5mm_M1_3.0mm_3.0mm_41mm") == {2: 6.5, 1: 6.0}
    assert pad.millimetres("cut_propeller_M3_1mm") == {3: 1.0} and not pad.large("cut_propeller_M3_1mm")
    assert pad.large("cut_M2_1mm_0.5mm_45.5mm_M1_1mm_0.5mm_45.5mm")
    assert pad.millimetres("tape_on_propeller_M3") == {}


def test_a_small_cut_may_be_normal():
    table = [{"condition": c, "verdict": "none", "effects": []} for c in ("normal_flight", "cut_propeller_M3_1mm")]
    assert pad.balanced_accuracy(table) == 0.5 and pad.forgiven(table) == 1.0
    table[1]["condition"] = "cut_propeller_M3_3mm"
    assert pad.forgiven(table) == 0.5


def test_a_cut_rotor_is_told_more_in_all_four():
    assert np.sign(balance.change({3: 2.0}, 0.03, 1.0)).tolist() == [1.0, 1.0, 1.0, -1.0]
    lift, roll, pitch, yaw = balance.change({1: 2.0, 2: 2.0}, 0.03, 1.0)
    assert lift > 0.0 > roll and abs(pitch) < 1e-12 and abs(yaw) < 1e-12


def test_slope_and_scatter_are_found_again():
    generator = np.random.default_rng(1)
    cuts = [{int(r): float(mm)} for r, mm in zip(generator.integers(1, 5, 400), generator.uniform(1, 8, 400),
                                                 strict=True)]
    scatter = np.array([0.013, 0.008, 0.008, 0.024])
    means = np.array([balance.change(c, 0.03, 1.2) for c in cuts]) + scatter * generator.standard_t(4, (400, 4))
    coefficients, residuals = balance.fit(means, cuts)
    assert coefficients == pytest.approx([0.03, 1.2], rel=0.1)
    assert balance.maintenance(residuals, np.full((400, 4), 1e-8), 4.0) == pytest.approx(scatter, rel=0.2)


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
