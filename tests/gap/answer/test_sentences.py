"""The answer in three sentences, by what the diagnosis names and by what its cells show."""

import re
from dataclasses import replace
from pathlib import Path

import pytest

from airtouch.gap.answer.sentences import sentences
from airtouch.gap.result import FITTED, HELD_OUT, REST_OF_FLIGHT, NamedEffect, OpenCell, Quantity, RotorSet
from airtouch.gap.where import summary
from made_diagnosis import cell, diagnosis

PAGE = Path(__file__).parents[3] / "host/docs/unknown.md"


def test_effect_that_shrinks_no_cell_is_the_cause_by_all_of_them():
    cells = [cell("torque_z", "hover", 2.0, 0.004, after=1.9)]
    _, which, how_far = sentences(diagnosis(cells, effects=(NamedEffect("motor_noise", {}),)))
    assert which.startswith("Its cause is motor noise (probability 93%): so say all cells together, though it does not "
                            "shrink this one, nor halve any other.")
    assert "500 to 475 times the floor" in how_far.replace("  ", " ")


@pytest.mark.parametrize(("other", "begin"), [(0.2, "The gap lies mostly in lift"),
                                              (9.0, "A part of the gap lies in lift")])
def test_mostly_is_said_of_the_largest_cell_alone(other, begin):
    cells = [cell("force_z", "hover", 1.0, after=0.1), cell("torque_x", "hover", other, after=other)]
    where, which, _ = sentences(diagnosis(cells, effects=(NamedEffect("ground_effect", {}),),
                                          headline=summary.headline(cells, True)))
    assert where.startswith(begin) and which.startswith("Its cause is ground effect")


@pytest.mark.parametrize(("judged_on", "others", "data"), [
    (FITTED, 0, "that it was fitted to"), (FITTED, 1, "that they were fitted to"), (HELD_OUT, 0, "held out")])
def test_the_data_are_said_on_which_the_gap_is_measured(judged_on, others, data):
    effects = (NamedEffect("downwash", {}), *[NamedEffect("mass", {})] * others)
    judged = replace(diagnosis([cell("force_z", "hover", 1.0, after=0.1)], effects=effects), judged_on=judged_on)
    assert f"of the gap above the floor on data {data}, from 4 to" in sentences(judged)[2]


def test_without_a_headline_cell_the_cause_is_by_all_cells_together():
    where, which, _ = sentences(diagnosis([cell("force_z", "hover", 0.05)]))
    assert where == "In no cell of the map does the gap stand out from its floor."
    assert which == "Its cause is imu bias (probability 93%): so say all cells together."


def test_a_cell_inside_its_floor_that_the_effect_halves_is_said_to_be_one():
    """As the lift of a ground effect, beside a forward force that it does not touch."""
    cells = [cell("force_x", "cruise", 0.5, after=0.5), cell("force_z", "cruise", 0.115, after=0.05)]
    where, which, _ = sentences(diagnosis(cells, effects=(NamedEffect("ground_effect", {}),)))
    assert where.startswith("The effect named takes most from lift at 0-0.5 Hz: in cruise it is 0.12 m/s^2 without and "
                            "0.05 m/s^2 with it.")
    assert which.startswith("Its cause is ground effect (probability 93%)")


@pytest.mark.parametrize(("name", "says_why"), [("downwash", True), ("motor_noise", True), ("mass", False)])
def test_why_cells_grow_is_said_of_what_acts_at_random(name, says_why):
    cells = [cell("torque_x", "hover", 1.0, after=0.5), cell("torque_y", "hover", 1.0, after=1.5)]
    where, which, how_far = sentences(diagnosis(cells, effects=(NamedEffect(name, {}),)))
    assert how_far.count("and 1 got worse.") == 1 and ("acts at random" in how_far) is says_why
    assert "roll torque" in where and ("the wake of another vehicle overhead" in which) is (name == "downwash")


def test_weak_motors_are_named_with_their_rotors():
    weak = [NamedEffect("weak_motor", {"rotor": Quantity(i)}) for i in (1, 2)]
    sentence = sentences(diagnosis([cell("torque_x", "hover", 1.0, after=0.1)], effects=weak))[1]
    assert sentence == "Its cause is weak motor of rotor 1 (probability 93%), with weak motor of rotor 2 beside it."


@pytest.mark.parametrize(("rotors", "words"), [((1,), "rotor 1"), ((1, 3), "rotors 1 and 3")])
def test_a_weak_motor_without_a_gyro_has_the_probability_of_its_rotors_too(rotors, words):
    """That of the effect is of all sets of rotors together."""
    one = diagnosis(effects=tuple(NamedEffect("weak_motor", {"rotor": Quantity(float(r))}) for r in rotors))
    first = replace(one.ranking[0], rotor_sets=(RotorSet(rotors, 0.42), RotorSet((4,), 0.22), RotorSet((2,), 0.1)))
    sentence = sentences(replace(one, ranking=(first, *one.ranking[1:])))[1]
    assert sentence.startswith(f"Its cause is weak motor (probability 93%), most likely of {words} (42%)")


def test_cells_that_got_worse_are_counted():
    cells = [cell("force_z", "hover", 1.0, after=0.05), cell("force_x", "ground", 1.5, after=2.2),
             cell("force_y", "ground", 2.6, after=8.8)]
    sentence = sentences(diagnosis(cells))[2]
    assert "2 of 3 cells still stand out, mostly on the ground in sideways force" in sentence
    assert "(26 to 88 times the floor)" in sentence
    assert sentence.endswith("and 2 got worse.")


def test_cells_that_newly_stand_out_are_counted_apart():
    cells = [cell("force_z", "hover", 1.0, after=0.05), cell("force_x", "hover", 0.1, after=0.4),
             cell("force_y", "hover", 0.5, after=0.45)]
    counts = "; 1 of 2 cells still stand out, beside 1 that did not before, mostly in"
    assert counts in sentences(diagnosis(cells))[2]


@pytest.mark.parametrize(("before", "size"), [(1.01, "at the floor, so there is nothing to close."),
                                            (1.6, "1.6 times the floor; nominal flights may differ by as much.")])
def test_none_says_how_large_the_gap_is(before, size):
    none = diagnosis(verdict="none", effects=())
    assert sentences(replace(none, gap={**none.gap, "before": before}))[2] == f"The gap over all cells is {size}"


def test_an_effect_beside_the_first_is_named_as_one_though_the_headline_is_its_own():
    cells = [cell("force_z", "hover", 1.0, after=0.1, by="weak_motor")]
    effects = NamedEffect("motor_noise", {}), NamedEffect("weak_motor", {})
    _, which, _ = sentences(replace(diagnosis(cells, effects=effects), baseline=("nominal.csv",)))
    assert which == "Its cause is motor noise (probability 93%), with weak motor beside it."


@pytest.mark.parametrize(("name", "baseline", "caveat"), [
    ("motor_noise", (), True), ("motor_noise", ("nominal.csv",), False), ("weak_motor", (), False)])
def test_motor_noise_without_a_baseline_is_no_sure_answer(name, baseline, caveat):
    answer = replace(diagnosis(effects=(NamedEffect(name, {}),)), baseline=baseline)
    assert ("often called motor noise" in sentences(answer)[1]) == caveat


def test_unknown_names_what_comes_nearest_and_closes_nothing():
    where, which, how_far = sentences(diagnosis([cell("force_z", "hover", 0.5)], "unknown", ()))
    assert where == ("The gap lies mostly in lift at 0-0.5 Hz: in hover it is 0.5 m/s^2, 5 times the floor.")
    assert which == "No known effect explains it (probability 93%); the nearest is mass with 4.0%."
    assert how_far == "Nothing closes it yet: the gap over all cells stays 4 times the floor."

    far = diagnosis([cell("force_z", "hover", 0.5)], "unknown", ())
    ranking = tuple(replace(r, probability=0.0004) if r.name == "mass" else r for r in far.ranking)
    assert sentences(replace(far, ranking=ranking))[1] == "No known effect explains it (probability 93%)."


def test_an_unsteady_flight_is_told_by_its_seconds():
    shaken = OpenCell("torque_z", (15.0, 40.0), "hover", "flights/a.csv", 3.2, 4.8, 4.26, floor=REST_OF_FLIGHT)
    of = replace(diagnosis([], "unknown", ()), unexplained=(shaken,), gap={"before": 0.97, "after": 0.97, "floor": 1.0})
    where, _, how_far = sentences(of)
    assert where == ("The flight is less steady than nominal ones: yaw torque at 15-40 Hz is up to 4.3 times that of "
                     "the rest of the flight from 3.2 to 4.8 s of a.csv.")
    (on_page,) = re.findall(r"^\| `(.*less steady.*)` \|", PAGE.read_text("utf-8"), re.M)
    assert where.startswith(on_page)
    assert how_far == "Over all the gap is at the floor: what acts, acts in some seconds only."
    steady = replace(of, unexplained=(replace(shaken, floor="nominal flights"),))
    assert sentences(steady)[2] == ("Over all the gap is at the floor, but the signals do not fit a flight without an "
                                    "effect.")
