"""The answer in sentences, the ranking and the advice: one diagnosis, told alike on page, terminal and in JSON."""

from dataclasses import replace

import pytest

import made_diagnosis
from airtouch.cli.gap import show as gap_show
from airtouch.cli.shared import scores
from airtouch.gap.answer import advice, words
from airtouch.gap.result import NamedEffect, OpenCell, Quantity, Shrink
from airtouch.gap.signatures.alike import ALIKE, CONFUSED, MISSION
from airtouch.gap.where import summary
from airtouch.report import gap_report, gap_tables
from airtouch.simulation import effects as registry
from airtouch.simulation.effects import EFFECTS
from made_diagnosis import VEHICLE, cell, diagnosis, of_flights


@pytest.fixture(scope="module")
def pushed_flights():
    return made_diagnosis.fly_pushed()


def test_effect_that_does_not_close_the_headline_cell_is_not_its_cause():
    cells = [cell("torque_z", "hover", 2.0, 0.004, after=1.9)]
    sentences = words.sentences(diagnosis(cells, effects=(NamedEffect("motor_noise", {}),)))
    assert sentences[1] == "The effect named, motor noise (probability 93%), does not close this cell."
    assert "500 to 475 times the floor" in sentences[2].replace("  ", " ")


@pytest.mark.parametrize(("other", "begin"), [(0.2, "The gap lies mostly in lift"),
                                              (9.0, "A part of the gap lies in lift")])
def test_mostly_is_said_of_the_largest_cell_alone(other, begin):
    cells = [cell("force_z", "hover", 1.0, after=0.1), cell("torque_x", "hover", other, after=other)]
    sentences = words.sentences(diagnosis(cells, effects=(NamedEffect("ground_effect", {}),),
                                          headline=summary.headline(cells, True)))
    assert sentences[0].startswith(begin) and sentences[1].startswith("Its cause is ground effect")


def test_no_cause_is_given_without_a_headline_cell():
    where, which, _ = words.sentences(diagnosis([cell("force_z", "hover", 0.05)]))
    assert where == "In no cell of the map does the gap stand out of its floor."
    assert which.startswith("The effect named, from all cells together, is imu bias")


def test_weak_motors_are_named_with_their_rotors():
    weak = [NamedEffect("weak_motor", {"rotor": Quantity(i)}) for i in (1, 2)]
    sentence = words.sentences(diagnosis([cell("torque_x", "hover", 1.0, after=0.1)], effects=weak))[1]
    assert sentence == "Its cause is weak motor of rotor 1 (probability 93%), with weak motor of rotor 2 beside it."


def test_cells_that_got_worse_are_counted():
    cells = [cell("force_z", "hover", 1.0, after=0.05), cell("force_x", "ground", 1.5, after=2.2),
             cell("force_y", "ground", 2.6, after=8.8)]
    sentence = words.sentences(diagnosis(cells))[2]
    assert "2 of 3 cells still stand out, mostly on the ground in sideways force" in sentence
    assert "(26 to 88 times the floor)" in sentence
    assert sentence.endswith("and 2 got worse.")
    ground = next(p for p in summary.phases(cells) if p.name == "ground")
    assert (ground.over, ground.stay, ground.worse) == (2, 2, 2)


def test_cells_that_newly_stand_out_are_counted_apart():
    cells = [cell("force_z", "hover", 1.0, after=0.05), cell("force_x", "hover", 0.1, after=0.4),
             cell("force_y", "hover", 0.5, after=0.45)]
    counts = "; 1 of 2 cells still stand out, beside 1 that did not before, mostly in"
    assert counts in words.sentences(diagnosis(cells))[2]


@pytest.mark.parametrize(("before", "size"), [(1.01, "at the floor, so there is nothing to close."),
                                            (1.6, "1.6 times the floor; nominal flights may differ by as much.")])
def test_none_says_how_large_the_gap_is(before, size):
    none = diagnosis(verdict="none", effects=())
    assert words.sentences(replace(none, gap={**none.gap, "before": before}))[2] == f"Over all it is {size}"


def test_headline_and_ranking_cannot_disagree():
    first, beside = NamedEffect("motor_noise", {}), NamedEffect("weak_motor", {})
    sentences = words.sentences(diagnosis([cell("force_z", "hover", 1.0, after=0.1, by="weak_motor")],
                                          effects=(first, beside)))
    assert sentences[1] == "Its cause is motor noise (probability 93%), with weak motor beside it."
    consistent = diagnosis()
    for contradiction in ({"effects": (beside, first)}, {"verdict": "none"}, {"verdict": "unknown"}, {"effects": ()},
                          {"ranking": consistent.ranking[::-1]}):
        with pytest.raises(ValueError, match="ranking begins with"):
            replace(consistent, **contradiction)


def test_a_diagnosis_prints_as_one_line():
    cells = [cell("force_z", "hover", 1.0, after=0.1)]
    two_effects = diagnosis(cells, effects=(NamedEffect("motor_noise", {}), NamedEffect("weak_motor", {})))
    assert repr(two_effects) == str(two_effects) == ("Diagnosis(effect; motor_noise, weak_motor; probability 93%; "
                                                     "gap 4 before, 1.3 after (floor 1))")
    none = replace(diagnosis(cells, "none", ()), ranking=(), gap={})
    assert str(none) == "Diagnosis(none)"


def test_sentences_json_and_page_have_the_same_shrink(pushed_flights, tmp_path):
    """Sentence, JSON and page have one share and one before and after;
    the calibrated arm, which is the same, is not told again."""
    result = of_flights(pushed_flights)
    result = replace(result, arms={"declared": Shrink(5.0, 2.0, Quantity(0.7)),
                                   "calibrated": Shrink(4.0, 1.3, result.shrink)})
    fields = result.plain()
    assert fields["shrink"] == fields["ranking"][0]["shrink"] and fields["gap"]["before"] == 4.0
    assert "from 4 to 1.3 times the floor" in words.sentences(result)[2]
    rows = gap_tables.how_far_rows(result)
    assert [r["name"] for r in rows] == ["imu_bias", "wrong effect: wind", "imu_bias, vehicle as declared"]
    # the row that starts from another gap says why
    assert [r["why"] for r in rows] == ["", "", gap_tables.OTHER_START]
    page = tmp_path / "gap.html"
    gap_report.write_diagnosis(page, result, command="x")
    assert page.read_text().count(gap_tables.OTHER_START) == 1


def test_json_has_headline_map_and_steps(pushed_flights):
    fields = of_flights(pushed_flights).plain()
    assert fields["headline"] in fields["map"] and len(fields["map"]) > len(fields["where"])
    assert fields["next"] == [{"text": "Weigh the <vehicle>.", "command": "airtouch collect --mission hover"}]


def test_terminal_prints_sentences_notes_and_advice(pushed_flights, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "400")
    result = of_flights(pushed_flights)
    gap_show.diagnosis(scores.console(), result)
    out = " ".join(capsys.readouterr().out.split())
    for part in (*words.sentences(result), "another fits better", "Weigh the <vehicle>.",
                 "airtouch collect --mission hover"):
        assert part in out, part


def test_advised_commands_are_valid():
    """Every effect's command is taken by `simulate` as it stands, and every mission advised can be loaded."""
    from airtouch.crazyflie import mission

    for name, effect in EFFECTS.items():
        values = {p.name: Quantity(p.default * 1.23456789 if p.low <= p.default * 1.23456789 <= p.high
                                   and not p.integer else p.default, unit=p.unit) for p in effect.parameters}
        line = advice.switched_on([NamedEffect(name, values)], VEHICLE.name)
        parsed_effect = registry.parse(line.split("--effect ")[1].strip("'"))
        expected = {k: q.value for k, q in values.items()}
        assert parsed_effect[0] == name and parsed_effect[1] == pytest.approx(expected, rel=1e-3)
    for name in (*advice.MISSIONS.values(), *(c.mission for c in (*ALIKE, *CONFUSED) if c.mission), MISSION):
        assert mission.load(name).legs


def test_phases_with_the_same_worst_seconds_share_a_line():
    cruise = OpenCell("force_z", (0.0, 0.5), "cruise", "a.csv", from_s=1.0, to_s=3.0, over_floor=6.0)
    lines = words.all_open_in_words([cruise, replace(cruise, phase="landing"),
                                     replace(cruise, phase="hover", from_s=2.0)])
    assert [line.split(":")[0] for line in lines] == ["lift, 0-0.5 Hz, cruise and landing", "lift, 0-0.5 Hz, hover"]


def test_interval_has_enough_digits():
    assert words.quantity(Quantity(0.1203, 0.12028, 0.12034)) == "0.1203 (0.12028 to 0.12034)"
    assert words.quantity(Quantity(0.12, 0.09, 0.13)) == "0.12 (0.09 to 0.13)"
