"""Parts of a diagnosis in words: effects, open cells, numbers with as many digits as their intervals need."""

from dataclasses import replace

import pytest

from airtouch.gap.answer import words
from airtouch.gap.result import NamedEffect, OpenCell, Quantity, RankedCandidate, Rejected
from made_diagnosis import diagnosis


def test_an_effect_is_written_with_its_parameters_and_when_it_acts():
    push = NamedEffect("wind", {"x": Quantity(0.3, unit="m/s"), "y": Quantity(0.11, 0.09, 0.13)},
                       (("a/b.csv", 2.0, 5.04),))
    assert words.effect_in_words(push) == "wind: x 0.3 m/s, y 0.11 (0.09 to 0.13); acts from 2.0 to 5.0 s of b.csv"
    assert words.effect_in_words(replace(push, seconds=())) == "wind: x 0.3 m/s, y 0.11 (0.09 to 0.13)"


def test_the_intervals_of_a_flight_name_its_file_once():
    seconds = (("a/b.csv", 1.0, 1.6), ("a/b.csv", 6.4, 7.0), ("a/b.csv", 11.8, 16.3), ("a/c.csv", 0.0, 2.0))
    assert words.seconds_in_words(NamedEffect("downwash", {}, seconds)) == (
        "1.0 to 1.6 s, 6.4 to 7.0 s and 11.8 to 16.3 s of b.csv, 0.0 to 2.0 s of c.csv")


def test_an_open_cell_is_written_with_its_seconds_and_what_it_follows():
    cell = OpenCell("force_z", (0.5, 2.0), "cruise", "a/b.csv", from_s=12.0, to_s=18.4, over_floor=6.08,
                    follows=("height", "speed"))
    assert words.open_in_words(cell) \
        == "lift, 0.5-2 Hz, cruise: up to 6.1 times the floor from 12.0 to 18.4 s of b.csv; follows height and speed"


def test_every_open_cell_has_a_line():
    cruise = OpenCell("force_z", (0.0, 0.5), "cruise", "a.csv", from_s=1.0, to_s=3.0, over_floor=6.0)
    lines = words.all_open_in_words([cruise, replace(cruise, phase="hover", from_s=2.0)])
    assert [line.split(":")[0] for line in lines] == ["lift, 0-0.5 Hz, cruise", "lift, 0-0.5 Hz, hover"]


def test_the_nearest_effects_are_listed_where_the_ranking_gives_no_reason():
    """Mass is in the ranking that is shown, with its reason; a long list hides wind behind ten others."""
    near = (Rejected("mass", "gains 3 nats"), Rejected("ground_effect", "gains 2 nats"))
    cell = OpenCell("force_z", (0.0, 0.5), "cruise", "a.csv", from_s=1.0, to_s=3.0, over_floor=6.0, nearest=near)
    assert words.nearest_in_words(diagnosis((), "unknown", (), unexplained=(cell,))) == ["ground effect: gains 2 nats"]
    assert words.nearest_in_words(diagnosis((), "unknown", ())) == []


def test_of_a_long_ranking_the_first_are_shown_and_none_and_unknown_wherever_they_are():
    names = [*(f"effect {i}" for i in range(words.MOST_RANKED + 2)), "none", "another", "unknown"]
    shown = words.leading([RankedCandidate(n, 0.0, Quantity(0.0)) for n in names])
    assert [r.name for r in shown] == [*names[:words.MOST_RANKED], "none", "unknown"]


@pytest.mark.parametrize(("names", "text"), [
    ([], ""), (["a"], "a"), (["a", "b"], "a and b"), (["a", "b", "c"], "a, b and c")])
def test_names_are_joined_as_a_list(names, text):
    assert words.joined(names) == text


def test_a_shrink_of_nearly_nothing_has_no_sign():
    assert words.quantity(Quantity(-0.001, -0.012, -0.0001), words.SHRINK_FORM) == "0.00 (-0.01 to 0.00)"


def test_a_rounding_error_is_nothing():
    assert words.quantity(Quantity(7.14e-18, -0.0329, 0.0329, "rad/s")) == "0 rad/s (-0.0329 to 0.0329)"
    assert words.quantity(Quantity(-0.000354, -0.0073, 0.00659)) == "-0.000354 (-0.0073 to 0.00659)"
    assert words.quantity(Quantity(1e-9)) == "1e-09"


def test_interval_has_enough_digits():
    assert words.quantity(Quantity(0.1203, 0.12028, 0.12034)) == "0.1203 (0.12028 to 0.12034)"
    assert words.quantity(Quantity(0.12, 0.09, 0.13)) == "0.12 (0.09 to 0.13)"
