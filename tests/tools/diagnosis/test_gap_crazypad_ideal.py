"""The classifiers that have labels of CrazyPAD, on synthetic flights."""

import numpy as np
import pytest

from tools.diagnosis import gap_crazypad_ideal as ideal
from tools.diagnosis.recordings.crazypad import figures as pad


@pytest.mark.parametrize("learner", ideal.LEARNERS)
def test_learners_separate_distinct_conditions_and_not_equal_ones(learner, monkeypatch):
    monkeypatch.setattr(ideal, "TREES", 40)  # so few tell these apart; more are time
    generator = np.random.default_rng(2)
    names = ["normal_flight", "cut_propeller_M3_3mm", "add_weight_W1_near_M3", "weight_on_string_W2_near_M3"]
    rows = [{"drone": "E8", "condition": n} for n in names for _ in range(12)]
    separate = np.repeat(np.eye(4), 12, axis=0)
    folds = [np.arange(48) % 4 == i for i in range(4)]
    sure = ideal.cross_validate(ideal.Table(rows, 10.0 * separate + generator.normal(size=(48, 4))), folds, learner)
    chance = ideal.cross_validate(ideal.Table(rows, generator.normal(size=(48, 4))), folds, learner)
    assert pad.balanced_accuracy(sure) > 0.95 and pad.balanced_accuracy(chance) < 0.6


def test_numbers_are_relative_to_the_other_normal_flights_of_the_drone():
    """Of drone A's normal flights 1, 3 and 8: the first is held against 5.5, the cut one, 10, against all three, 4."""
    rows = [{"drone": d, "condition": c} for d, c in (
        ("A", "normal_flight"), ("A", "normal_flight"), ("A", "cut_M1_1mm"), ("B", "normal_flight"),
        ("B", "normal_flight"), ("A", "normal_flight"))]
    table = ideal.relative(rows, np.array([[1.0], [3.0], [10.0], [100.0], [200.0], [8.0]]))
    assert table.numbers[:, 0].tolist() == [-4.5, -1.5, 6.0, -100.0, 100.0, 6.0]


@pytest.mark.parametrize(("prediction", "family", "rotors", "loss"), [
    (("normal", "", 4.0), "normal", [], 0.0), (("slung load", "", 4.0), "slung load", [], 0.0),
    (("added weight", "", 4.0), "added weight", [], 0.0), (("rotor damage", "24", 5.0), "rotor damage", [2, 4], 5.0)])
def test_a_learners_prediction_counts_as_a_diagnosis_would(prediction, family, rotors, loss):
    result = ideal.as_result(*prediction)
    assert (pad.answer(result), pad.named_rotors(result)) == (family, rotors)
    assert pad.thrust_loss(result) == pytest.approx(loss)


def test_nearest_flights_of_the_same_condition_are_counted(capsys):
    """Three flights of a condition side by side, two of another far apart from each other and from all."""
    rows = [{"drone": "A", "condition": c} for c in ("cut_M1_1mm",) * 3 + ("cut_M2_1mm",) * 2]
    ideal.show_distinct(ideal.Table(rows, np.array([[0.0], [0.1], [0.2], [50.0], [-50.0]]) * np.ones(5)))
    assert [line.split(": ")[-1] for line in capsys.readouterr().out.splitlines()] == ["0.60 of 5"] * 2
