"""Scores of constructed detections, worked out by hand."""

import itertools
import json
from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from airtouch.detector.evaluation.data.dataset import Condition
from airtouch.detector.evaluation.score import EdgeScore, FlightScore, match, over_platform, score_edges, score_flight
from airtouch.detector.evaluation.summary import by_centimetre, by_height, summarise
from airtouch.detector.trace import Detection, Trace


@dataclass(frozen=True)
class True_:
    sample: int
    kind: str


ENTRY, EXIT = True_(1000, "entry"), True_(1400, "exit")
AIRBORNE = np.r_[np.zeros(200, bool), np.ones(1600, bool), np.zeros(200, bool)]
LOW = Condition(height="low", angle_deg=0.0, wind="none", speed_mps=0.2)


def flight(detections, condition=LOW, true=(ENTRY, EXIT), probability=None, lag_s=0.0):
    probability = np.full(len(AIRBORNE), np.nan) if probability is None else probability
    return score_flight("f.csv", condition, true, AIRBORNE, Trace(probability, list(detections)), lag_s)


def test_early_is_positive_and_metres_are_seconds_times_speed():
    score = flight([Detection(990, "entry"), Detection(1450, "exit")])
    assert [e.error_s for e in score.edges] == pytest.approx([0.1, -0.5])
    assert [e.error_m for e in score.edges] == pytest.approx([0.02, -0.1])
    assert score.false == ()


def test_lag_is_taken_off_before_matching():
    score = flight([Detection(1160, "entry"), Detection(1440, "exit")], lag_s=0.4)
    assert [e.error_s for e in score.edges] == pytest.approx([-1.2, 0.0])
    assert [e.detected_sample for e in score.edges] == [1160, 1440]


def test_a_detection_serves_one_edge_and_the_rest_are_false():
    near, later = Detection(1010, "entry"), Detection(1020, "entry")
    score = flight([near, later, Detection(100, "exit")])
    assert score.edges[0].detected_sample == 1010
    assert score.edges[1].detected_sample is None
    assert score.false == (1020, 100)


def test_beyond_the_tolerance_is_a_miss_and_a_false_edge():
    score = flight([Detection(1151, "entry")])
    assert [e.detected_sample for e in score.edges] == [None, None]
    assert score.false == (1151,)
    assert flight([Detection(1150, "entry")]).edges[0].detected_sample == 1150


def test_kind_is_not_needed_for_a_match_but_its_mistakes_are_counted():
    scores = [flight([Detection(1000, "exit"), Detection(1400, "edge")])]
    table = summarise(scores)
    assert table["matched"] == 2 and table["kind_mistakes"] == 1


def test_summary_of_two_flights_by_hand():
    first = flight([Detection(1010, "entry"), Detection(1400, "exit"), Detection(600, "entry")])  # 0.02 m, 0 m
    second = flight([Detection(950, "entry")], Condition(height="h85", speed_mps=0.4))  # 0.2 m, one miss
    table = summarise([first, second])
    assert table["flights"] == 2 and table["edges"] == 4 and table["missed_count"] == 1
    assert table["missed"] == pytest.approx(0.25)
    assert table["mean_abs_error_m"] == pytest.approx((0.02 + 0.0 + 0.2) / 3)
    assert table["mean_abs_error_s"] == pytest.approx((0.1 + 0.0 + 0.5) / 3)
    assert table["mean_error_s"] == pytest.approx((-0.1 + 0.0 + 0.5) / 3)
    assert table["entry_mean_abs_error_m"] == pytest.approx(0.11)
    assert table["exit_mean_abs_error_s"] == pytest.approx(0.0)
    assert table["hit"] == pytest.approx({"0.05": 0.5, "0.10": 0.5, "0.25": 0.75})
    assert table["airborne_minutes"] == pytest.approx(32 / 60)
    assert table["false_per_minute"] == pytest.approx(1 / (32 / 60))
    low, high = table["intervals"]["missed"]
    assert low == 0.0 and high == pytest.approx(0.5)
    heights = by_height([first, second])
    assert set(heights) == {"low", "h85", "h82+h85"}
    assert heights["h82+h85"]["missed_count"] == 1


def test_heights_that_were_drawn_are_grouped_by_centimetre():
    heights = ("24mm", "19mm", "101mm", "low", None, "16mm")
    groups = by_centimetre([replace(flight([]), condition=Condition(height=height)) for height in heights])
    assert {name: row["flights"] for name, row in groups.items()} == {"2 cm": 3, "10 cm": 1, "low": 1}
    assert list(groups) == ["2 cm", "10 cm", "low"]


def test_classes_that_are_numbers_keep_their_names():
    groups = by_centimetre([replace(flight([]), condition=Condition(height=h)) for h in ("2", "85", "24mm", "100mm")])
    assert sorted(groups) == ["10 cm", "2", "2 cm", "85"]
    assert all(row["flights"] == 1 for row in groups.values())


def test_half_a_centimetre_is_rounded_up():
    groups = by_centimetre([replace(flight([]), condition=Condition(height=f"{h}mm")) for h in (15, 25, 35)])
    assert list(groups) == ["2 cm", "3 cm", "4 cm"]


def test_balanced_accuracy_uses_airborne_samples_only():
    probability = np.zeros(len(AIRBORNE))
    probability[1000:1200] = 1.0  # half of the platform
    probability[:200] = 1.0  # on the ground: not counted
    score = flight([], probability=probability)
    assert score.windows == (200, 400, 1200, 1200)
    assert score.balanced_accuracy() == pytest.approx(0.75)
    assert summarise([score])["ece"] == pytest.approx(200 / 1600)


def test_without_probabilities_the_state_between_detections_is_judged():
    score = flight([Detection(1100, "edge"), Detection(1400, "edge")])
    assert score.windows == (300, 400, 1200, 1200)


def test_unknown_truth_gives_detections_and_no_false_rate():
    score = flight([Detection(500, "entry")], true=None)
    table = summarise([score])
    assert score.false is None and table["detections"] == 1
    assert table["false_per_minute"] is None and table["mean_abs_error_m"] is None
    assert score.note == "no down range in this log: detections are listed, not judged"


def test_a_flight_without_edges_has_only_false_ones():
    table = summarise([flight([Detection(500, "entry")], true=())])
    assert table["edges"] == 0 and table["false_count"] == 1 and table["missed"] is None
    assert table["false_per_minute"] == pytest.approx(1 / (16 / 60))


def test_no_speed_leaves_seconds():
    scores, _ = score_edges([ENTRY], [Detection(1010, "entry")], None)
    assert scores[0].error_m is None and scores[0].error_s == pytest.approx(-0.1)


def test_over_platform_starts_over_when_the_first_edge_is_an_exit():
    over = over_platform([True_(3, "exit"), True_(5, "entry")], 8)
    assert over.tolist() == [True, True, True, False, False, True, True, True]


def test_an_edge_of_unknown_kind_changes_the_state_and_a_named_one_sets_it():
    first = over_platform([True_(2, "exit"), True_(4, "edge"), True_(6, "edge")], 8)
    assert first.tolist() == [True, True, False, False, True, True, False, False]
    assert over_platform([True_(1, "entry"), True_(3, "entry")], 5).tolist() == [False, True, True, True, True]
    assert over_platform([True_(2, "exit"), True_(3, "exit")], 5).tolist() == [True, True, False, False, False]
    assert over_platform([True_(2, "exit")], 4).tolist() == [True, True, False, False]
    assert over_platform([True_(2, "edge")], 4).tolist() == [False, False, True, True]
    assert over_platform([], 3).tolist() == [False] * 3


def test_a_score_says_which_flight_and_which_edges():
    missed_edge, detected_edge = flight([Detection(1410, "exit")]).edges
    assert missed_edge == EdgeScore("entry", 1000)
    assert detected_edge == EdgeScore("exit", 1400, 1410, "exit", pytest.approx(-0.1), pytest.approx(-0.02))
    for true in ((ENTRY, EXIT), None):
        score = flight([Detection(500, "entry")], true=true)
        assert (score.file, score.condition, score.airborne_s) == ("f.csv", LOW, pytest.approx(16.0))
    assert score_flight("f.csv", LOW, [ENTRY], AIRBORNE,
                        Trace(np.full(2000, np.nan), [Detection(1000, "entry")])).edges[0].error_s == 0.0


def test_a_probability_of_a_half_says_over_and_unknown_ones_count_as_nothing():
    probability = np.full(len(AIRBORNE), 0.5)
    probability[1000:1100] = np.nan
    assert flight([], probability=probability).windows == (300, 300, 0, 1200)


def test_balanced_accuracy_needs_samples_over_and_not_over():
    score = flight([])
    assert replace(score, windows=(5, 10, 0, 0)).balanced_accuracy() is None
    assert replace(score, windows=(0, 0, 5, 10)).balanced_accuracy() is None
    assert replace(score, windows=(1, 4, 3, 4)).balanced_accuracy() == 0.5


def test_a_score_is_the_same_after_it_was_json():
    bins = np.arange(30.0).reshape(10, 3)
    score = replace(flight([Detection(990, "entry"), Detection(500, "edge")]), windows=(3, 4, 1, 2), bins=bins,
                    note="a note", in_training=True)
    entry = json.loads(json.dumps(score.as_dict()))
    assert (entry["balanced_accuracy"], entry["detections"], entry["airborne_s"]) == (0.625, 2, 16.0)
    assert entry["false"] == [500] and entry["condition"]["height"] == "low"
    assert [e["error_s"] for e in entry["edges"]] == [pytest.approx(0.1), None]
    restored = FlightScore.from_dict(entry)
    np.testing.assert_array_equal(restored.bins, bins)
    assert replace(restored, bins=score.bins) == score
    unknown = flight([Detection(500, "entry")], true=None)
    assert FlightScore.from_dict(json.loads(json.dumps(unknown.as_dict()))).false is None
    del entry["in_training"], entry["path"]  # as older files have them
    assert FlightScore.from_dict(entry).in_training is False
    assert set(entry) == {"file", "condition", "edges", "false", "detections", "balanced_accuracy", "airborne_s",
                          "windows", "reliability", "note"}
    with pytest.raises(KeyError):
        FlightScore.from_dict({"file": "f.csv"})


def test_nothing_is_matched_with_nothing():
    assert match([], [3.0], 5.0) == [] == match([3.0], [], 5.0)
    assert match([0.0, 0.4], [0.1], 0.2) == [(0, 0)]  # whatever the unit: no pair is worth a forbidden one


samples = st.lists(st.integers(0, 600), max_size=5)


@given(samples, samples)
def test_matching_is_optimal(true, detected):
    pairs = match(true, detected, 150)
    assert len({r for r, _ in pairs}) == len({c for _, c in pairs}) == len(pairs)
    best = (0, 0)
    small, large, flip = (true, detected, False) if len(true) <= len(detected) else (detected, true, True)
    for order in itertools.permutations(range(len(large)), len(small)):
        distances = [abs(small[i] - large[j]) for i, j in enumerate(order)]
        matches = [d for d in distances if d <= 150]
        best = min(best, (-len(matches), sum(matches)))
    assert (-len(pairs), sum(abs(true[r] - detected[c]) for r, c in pairs)) == best
    assert flip or len(true) <= len(detected)
