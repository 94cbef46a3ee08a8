"""The answer of a hover's balance from probabilities of known size: a weight has two names, other names compete."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from airtouch.gap.answer.sentences import sentences
from airtouch.gap.balance import balance_result
from airtouch.gap.balance.hover_balance import Evidence
from airtouch.gap.balance.hover_hypotheses import commanded_change, hypotheses
from airtouch.gap.balance.hover_posterior import alike, answer_of, probabilities, rotor_sets_of
from airtouch.gap.balance.hover_ranking import closes_too_little, ranking_of, with_names_withdrawn
from airtouch.gap.naming.policy import LEAST_CLOSED, STANDS_OUT
from airtouch.gap.result import FITTED, Closure, Quantity
from airtouch.logs.flight_log import VELOCITY
from airtouch.report import gap_report
from airtouch.simulation import effects
from gap_flights import VEHICLE, flight, noise


def test_the_hypotheses_of_a_name_count_together():
    """Odds of 1, 1 and 2: two rotors of one name are as probable as the weight."""
    named = [SimpleNamespace(name=n) for n in ("weak_motor", "weak_motor", "mass")]
    evidence = Evidence(np.log([1.0, 1.0, 2.0]) + 900.0, [])
    assert probabilities(evidence, named) == pytest.approx({"weak_motor": 0.5, "mass": 0.5})


def rotors(*numbers):
    """A hypothesis of weak rotors."""
    return SimpleNamespace(name="weak_motor", effects=[("weak_motor", {"rotor": [float(n)]}) for n in numbers])


def test_each_set_of_rotors_has_its_own_probability():
    """Odds of 10, 20, 12 and 8 of weak motors, and 50 of a weight: 0.5 is a weak motor, and 0.2 the likeliest set."""
    named = [rotors(1), rotors(4), SimpleNamespace(name="mass"), rotors(1, 3), rotors(2)]
    sets = rotor_sets_of(Evidence(np.log([10.0, 20.0, 50.0, 12.0, 8.0]) - 900.0, []), named, 0.5)
    assert [s.rotors for s in sets] == [(4,), (1, 3), (1,), (2,)]
    assert [s.probability for s in sets] == pytest.approx([0.2, 0.12, 0.1, 0.08])
    assert balance_result.other_rotors(sets) == [balance_result.OTHER_ROTORS.format("rotors 1 and 3 (12%)")]
    assert balance_result.other_rotors(sets[:1]) == balance_result.other_rotors(()) == []


def test_the_rotors_of_an_answer_are_the_likeliest_set():
    """A fifth more of rotor 2 alone: no set of others competes with it, and all of them are the weak motor."""
    nominal, weak = [hovering(seed, lift) for seed, lift in ((1, 0.99), (2, 1.0), (3, 1.01))], hovering(4)
    result = balance_result.diagnosis([replace(weak, pwm=weak.pwm * [1.0, 1.2, 1.0, 1.0])], nominal, VEHICLE)
    row = result.plain()["ranking"][0]
    assert len(row["rotor_sets"]) == 10 and row["rotor_sets"][0]["rotors"] == [2]
    assert sum(s["probability"] for s in row["rotor_sets"]) == pytest.approx(row["probability"], abs=1e-5)
    assert not any("rotor_sets" in r for r in result.plain()["ranking"][1:])
    assert not any("which rotors are weak" in note for note in result.notes)
    assert "(probability 9" in sentences(result)[1] and ", most likely of rotor 2 (" in sentences(result)[1]


@pytest.mark.parametrize(("total", "answer"), [
    ({"none": 0.4, "mass": 0.35, "com_offset": 0.25}, ("mass", 0.6)),
    ({"none": 0.4, "mass": 0.25, "com_offset": 0.35}, ("com_offset", 0.35)),
    ({"none": 0.5, "mass": 0.2, "com_offset": 0.3}, ("none", 0.5)),
    ({"none": 0.3, "com_offset": 0.7}, ("com_offset", 0.7))])
def test_a_weight_on_the_vehicle_and_off_centre_count_as_one(total, answer):
    name, probability = answer_of(total)
    assert (name, probability) == (answer[0], pytest.approx(answer[1]))


def test_the_other_name_of_a_weight_is_counted_with_the_answer():
    closures = {n: Closure(3.0, 1.0, Quantity(1.0)) for n in ("none", "mass", "com_offset")}
    ranking = ranking_of("mass", {"none": 0.2, "mass": 0.5, "com_offset": 0.3}, closures)
    assert [(r.name, round(r.probability, 6)) for r in ranking] == [("mass", 0.8), ("none", 0.2), ("com_offset", 0.0)]
    assert ranking[2].why.startswith("counted with mass") and ranking[1].why == "4 times less probable than mass"


def test_a_weight_whose_probability_underflows_is_not_counted_with_another_effect():
    closures = {n: Closure(3.0, 1.0, Quantity(1.0)) for n in ("slung_load", "mass")}
    ranking = ranking_of("slung_load", {"slung_load": 1.0, "mass": 0.0}, closures)
    assert ranking[1].why.endswith("times less probable than slung_load")


def test_names_of_half_the_probability_fit_alike():
    total = {"none": 0.26, "mass": 0.5, "slung_load": 0.24, "unknown": 0.3}
    assert alike([], total, "mass", 0.5) == (("mass", "none"),)
    assert alike(["mass"], {"mass": 1.0}, "mass", 1.0) == (("mass", "thrust_coefficient"),)


def test_a_gap_without_a_name_is_not_to_be_told_from_no_effect_by_more_flights():
    """`unknown` is no effect that others could be alike to, nor one that a step tells from none."""
    assert alike([], {"none": 0.4, "mass": 0.1, "unknown": 0.5}, "unknown", 0.5) == ()


def test_the_wrong_effect_of_the_control_is_improbable():
    closures = {n: Closure(3.0, 2.0, Quantity(0.5)) for n in ("com_offset", "slung_load", "mass", "weak_motor")}
    total = {"com_offset": 0.2, "slung_load": 0.05, "mass": 0.7, "weak_motor": 0.05}
    assert balance_result.control_of(total, ["mass"], closures).name == "slung_load"
    assert balance_result.control_of({"mass": 0.8, "com_offset": 0.2}, ["mass"], closures) is None


@pytest.mark.parametrize("named", [["mass", "com_offset"], ["mass"], ["com_offset"]])
def test_the_wrong_effect_of_the_control_is_not_named_itself(named):
    """A weight has two forms and may be named with both: neither is wrong where one of them is named."""
    closures = {n: Closure(3.0, 2.0, Quantity(0.5)) for n in ("com_offset", "slung_load", "mass", "weak_motor")}
    improbable = dict.fromkeys(closures, 0.01)
    assert balance_result.control_of(improbable, named, closures).name == "slung_load"


def test_a_weight_off_centre_has_a_control_that_it_is_not():
    """15 % more lift, and 10 % more of it in front: both forms of the weight are named."""
    nominal, loaded = [hovering(seed) for seed in (1, 2, 3)], hovering(4, 1.15)
    result = balance_result.diagnosis([replace(loaded, pwm=loaded.pwm * [1.05, 0.95, 0.95, 1.05])], nominal, VEHICLE)
    assert {e.name for e in result.effects} == {"mass", "com_offset"}
    assert result.control is not None and result.control.name not in ("mass", "com_offset")


def hovering(seed, lift=1.0):
    """A hover without a gyro whose rotors all give `lift` times the thrust at a command of 40000; it stands still."""
    made = flight(20.0, noise(20.0, 0.1, seed), name=str(seed))
    commands = np.linspace(0.0, 65535.0, 3000)
    level = np.interp(lift * VEHICLE.thrust(np.array([40000.0]))[0], VEHICLE.thrust(commands), commands)
    pwm = level + np.random.default_rng(seed).normal(0.0, 300.0, made.pwm.shape)
    return replace(made, rates=None, log=made.log.with_columns(dict.fromkeys(VELOCITY, np.zeros(len(made)))), pwm=pwm)


def test_captions_say_that_the_gap_drawn_is_another_than_that_of_the_answer(tmp_path):
    """The rotors of nominal flights give a fifth more than declared, those of the flight three tenths more."""
    pytest.importorskip("matplotlib")
    nominal = [hovering(seed, lift) for seed, lift in ((1, 1.19), (2, 1.2), (3, 1.21))]
    result = balance_result.diagnosis([hovering(4, 1.3)], nominal, VEHICLE, curves=True)
    assert result.headline.channel == "force_z" and result.headline.gap < 1.2  # m/s^2
    declared = 4.0 * VEHICLE.thrust(np.array([40000.0]))[0] / VEHICLE.mass_kg
    assert np.nanmean(result.curves.signal.before) == pytest.approx(-0.3 * declared, rel=0.05)
    gap_report.write_diagnosis(tmp_path / "hover.html", result, command="x")
    assert (tmp_path / "hover.html").read_text().count(balance_result.OTHER_GAP) == 2  # of the signal and the spectra


def test_hovers_are_judged_where_no_flight_has_a_gyro_and_both_kinds_hover():
    """Of each kind one that hovers is enough; a gyro in any flight rules it out."""
    hover = hovering(1)
    short, turning = flight(3.0, noise(3.0, 0.1, 2)), replace(hover, rates=np.zeros((len(hover), 3)))
    short = replace(short, rates=None)

    def applies(flights, nominal):
        return balance_result.applies(flights, nominal, VEHICLE)

    assert applies([hover], [hover]) and applies([hover, short], [short, hover])
    assert not applies([hover, turning], [hover])
    assert not applies([short], [hover]) and not applies([hover], [short]) and not applies([hover], [])


def test_flights_without_a_hover_are_named_and_do_not_count():
    """Three seconds, as a flight and as a nominal one: everything but the note is as without them."""
    short = [replace(flight(3.0, noise(3.0, 0.1, seed), name=f"short {seed}"), rates=None) for seed in (8, 9)]
    alone = balance_result.diagnosis([hovering(4, 1.15)], [hovering(1), hovering(2)], VEHICLE)
    beside = balance_result.diagnosis([hovering(4, 1.15), short[0]], [hovering(1), short[1], hovering(2)], VEHICLE)
    assert any("without a hover: short 8, short 9" in note for note in beside.notes)
    assert {**beside.plain(), "notes": []} == {**alone.plain(), "notes": []} and "1" in beside.baseline


@pytest.mark.parametrize(("left_out", "named"), [((), True), (("com_offset",), True), (("mass",), False)])
def test_a_centred_weight_is_named_unless_it_is_left_out_itself(left_out, named):
    """15 % more lift: with the shift of the centre left out, a weight that shifts none is still a candidate."""
    nominal = [hovering(seed) for seed in (1, 2, 3)]
    result = balance_result.diagnosis([hovering(4, 1.15)], nominal, VEHICLE, without=left_out)
    assert not {r.name for r in result.ranking} & set(left_out)
    assert result.judged_on == result.plain()["judged_on"] == FITTED  # of one mean pattern nothing can be held out
    mass = [e.parameters["fraction"] for e in result.effects if e.name == "mass"]
    assert bool(mass) == named
    if named:
        assert [e.name for e in result.effects] == ["mass"] and mass[0].low < 0.15 < mass[0].high


def test_without_the_shift_of_the_centre_a_weight_loads_all_rotors_alike():
    """By hand: all four give as much more as the weight adds, so that only the lift changes."""
    weight = next(h for h in hypotheses(VEHICLE, without=["com_offset"]) if h.name == "mass")
    (name, drawn), = weight.effects
    thrust = np.repeat(1.0 + drawn["fraction"][:, None], 4, axis=1)
    assert name == "mass"
    np.testing.assert_allclose(weight.change, commanded_change(thrust), atol=1e-12)


def test_where_no_effect_is_named_nothing_closes_the_gap():
    """Commands that no known effect asks for: no cell has a gap that is left with it."""
    nominal = [hovering(seed) for seed in (1, 2, 3)]
    odd = hovering(4)
    result = balance_result.diagnosis([replace(odd, pwm=odd.pwm * [0.6, 1.3, 1.3, 0.8])], nominal, VEHICLE)
    plain = result.plain()
    assert result.verdict == "unknown" and plain["gap"]["after"] == plain["gap"]["before"] > 10.0
    assert not any("after" in cell for cell in [*plain["where"], *plain["map"], plain["headline"]])
    shrink = {r["name"]: r["shrink"] for r in plain["ranking"]}
    for name in ("none", "unknown"):
        assert (shrink[name]["value"], shrink[name].get("measured")) == (0.0, False)
    assert "measured" not in shrink["weak_motor"]


def test_where_every_effect_is_left_out_none_is_said_to_fail():
    nominal, odd = [hovering(seed) for seed in (1, 2, 3)], hovering(4)
    result = balance_result.diagnosis([replace(odd, pwm=odd.pwm * [0.6, 1.3, 1.3, 0.8])], nominal, VEHICLE,
                                      without=("weak_motor", "mass", "com_offset", "slung_load"))
    assert result.verdict == "unknown" and result.notes[0].endswith("; no effect was tried")
    assert "no effect was tried" in sentences(result)[1] and "explains" not in sentences(result)[1]


def test_a_name_that_leaves_the_gap_as_it_is_is_withdrawn():
    """Two rotors need more and a third one less, which no candidate makes: the likeliest closes hardly anything."""
    nominal, odd = [hovering(seed, lift) for seed, lift in ((1, 0.98), (2, 1.0), (3, 1.02))], hovering(4)
    result = balance_result.diagnosis([replace(odd, pwm=odd.pwm * [1.15, 1.0, 1.15, 0.85])], nominal, VEHICLE)
    unknown, withdrawn = result.ranking[:2]
    assert (result.verdict, result.effects, unknown.name) == ("unknown", (), "unknown")
    assert withdrawn.why.endswith("of the gap, too little to be its cause") and withdrawn.probability == 0.0
    assert sum(r.probability for r in result.ranking) == pytest.approx(1.0)
    assert result.gap["after"] == result.gap["before"] and not any("--effect " in s.command for s in result.next)


def test_effects_of_ones_own_are_said_not_to_be_tried_and_are_not_advised():
    """Nor is any other that is no candidate: the note names those that are, which are those of the ranking."""
    nominal, odd = [hovering(seed) for seed in (1, 2, 3)], hovering(4)
    odd = replace(odd, pwm=odd.pwm * [0.6, 1.3, 1.3, 0.8])
    before = balance_result.diagnosis([odd], nominal, VEHICLE)
    effects.register(replace(effects.get("mass"), name="made_up_magnet"))
    try:
        result = balance_result.diagnosis([odd], nominal, VEHICLE)
    finally:
        effects.unregister("made_up_magnet")
    assert result.verdict == "unknown" and not any("--effect-file" in s.command for s in result.next)
    assert [n for n in result.notes if n not in before.notes] == [balance_result.OWN_NOT_TRIED.format("made_up_magnet")]
    tried = {n for n in effects.NAMES if re.search(rf"\b{n}\b", result.notes[0])}
    assert tried == {r.name for r in result.ranking} - {"none", "unknown"}


@pytest.mark.parametrize(("before", "shrink", "too_little"), [
    (STANDS_OUT + 0.1, LEAST_CLOSED - 0.01, True), (STANDS_OUT + 0.1, LEAST_CLOSED, False),
    (STANDS_OUT, 0.0, False), (3.0, -0.2, True)])
def test_a_gap_that_stands_out_must_close_by_a_quarter(before, shrink, too_little):
    assert closes_too_little(Closure(before, 1.0, Quantity(shrink))) == too_little


@pytest.mark.parametrize(("after", "too_little"), [(1.02, False), (1.03, False), (1.04, True)])
def test_an_effect_that_makes_a_gap_at_the_floor_larger_closes_too_little(after, too_little):
    assert closes_too_little(Closure(1.03, after, Quantity(0.0))) == too_little


@pytest.mark.parametrize("seed", range(4, 12))
def test_a_flight_that_is_balanced_but_unsteady_has_no_weak_motor(seed):
    """Commands twice as unsteady about the nominal mean: a weak motor is likely by that, and makes the gap larger."""
    nominal, odd = [hovering(seed, lift) for seed, lift in ((1, 0.99), (2, 1.0), (3, 1.01))], hovering(seed)
    mean = odd.pwm.mean(axis=0)
    result = balance_result.diagnosis([replace(odd, pwm=mean + 2.0 * (odd.pwm - mean))], nominal, VEHICLE)
    assert (result.verdict, result.effects) == ("unknown", ())
    assert next(r for r in result.ranking if r.name == "weak_motor").probability == 0.0


@pytest.mark.parametrize(("before", "by_balance", "names"), [
    (1.0, {"none": 0.5, "weak_motor": 0.3, "mass": 0.1, "com_offset": 0.1}, ["weak_motor", "mass"]),
    (1.0, {"none": 0.25, "weak_motor": 0.2, "mass": 0.3, "com_offset": 0.25}, ["weak_motor"]),
    (1.0, {"none": 0.2, "weak_motor": 0.3, "mass": 0.3, "com_offset": 0.2}, []),
    (STANDS_OUT + 0.1, {"none": 0.5, "weak_motor": 0.3, "mass": 0.1, "com_offset": 0.1}, [])])
def test_at_the_floor_an_effect_is_named_only_if_the_balance_makes_it_likelier_than_none(before, by_balance, names):
    """A weight's two forms count together."""
    total = {"none": 0.05, "weak_motor": 0.6, "mass": 0.2, "com_offset": 0.1, "unknown": 0.05}
    closures = {n: Closure(before, 0.5, Quantity(1.0)) for n in total}
    probability_of, withdrawn = with_names_withdrawn(total, closures, by_balance)
    assert withdrawn == names and sum(probability_of.values()) == pytest.approx(1.0)
    rows = {r.name: r.why for r in ranking_of(answer_of(probability_of)[0], probability_of, closures, withdrawn)}
    assert all(rows[n].startswith("the gap is at its floor") for n in names)


CLOSES = {"none": 0.0, "weak_motor": 0.74, "mass": 0.23, "slung_load": 0.1, "com_offset": 0.2, "unknown": 0.6}
EVIDENCE = {"none": 0.05, "weak_motor": 0.3, "mass": 0.35, "slung_load": 0.15, "com_offset": 0.1, "unknown": 0.05}


@pytest.mark.parametrize(("closes", "evidence", "names", "left"), [
    ({}, {}, ["mass"],
     {"none": 0.05 / 0.55, "weak_motor": 0.3 / 0.55, "slung_load": 0.15 / 0.55, "unknown": 0.05 / 0.55}),
    ({"weak_motor": 0.2}, {}, ["mass", "weak_motor", "slung_load"], {"none": 0.05, "unknown": 0.95}),
    ({}, {"none": 0.32, "weak_motor": 0.03}, ["mass"],
     {"none": 0.32, "weak_motor": 0.03, "slung_load": 0.15, "unknown": 0.5}),
    ({"mass": 0.3}, {}, [], EVIDENCE)])
def test_a_name_withdrawn_leaves_the_answer_to_the_next_that_closes_enough(closes, evidence, names, left):
    """Shares of what is left, by hand; where no effect comes next, `unknown` has what was withdrawn."""
    closures = {n: Closure(3.0, 1.0, Quantity(c)) for n, c in {**CLOSES, **closes}.items()}
    probability_of, withdrawn = with_names_withdrawn({**EVIDENCE, **evidence}, closures, {})
    assert withdrawn == names
    assert {n: p for n, p in probability_of.items() if p} == pytest.approx(left)


def test_two_weak_rotors_are_named_though_a_weight_is_more_probable_and_closes_little():
    """Rotors 2 and 4 need more, 1 and 3 what they did: a weight is likelier, but makes no turn about yaw."""
    nominal, weak = [hovering(seed, lift) for seed, lift in ((1, 0.98), (2, 1.0), (3, 1.02))], hovering(4)
    result = balance_result.diagnosis([replace(weak, pwm=weak.pwm * [1.0, 1.1, 1.0, 1.05])], nominal, VEHICLE)
    assert result.verdict == "effect" and {e.name for e in result.effects} == {"weak_motor"}
    assert {e.parameters["rotor"].value for e in result.effects} <= {2.0, 4.0}
    assert result.shrink.value > LEAST_CLOSED and sum(r.probability for r in result.ranking) == pytest.approx(1.0)
    withdrawn = {r.name: r for r in result.ranking if r.why.endswith("too little to be its cause")}
    assert withdrawn and all(r.probability == 0.0 and r.shrink.value < LEAST_CLOSED for r in withdrawn.values())
    assert result.control is None or result.control.name not in withdrawn


def test_the_other_form_of_a_weight_that_is_withdrawn_is_counted_with_it():
    closures = {n: Closure(3.0, 2.0, Quantity(0.1)) for n in ("unknown", "mass", "com_offset")}
    rows = ranking_of("unknown", {"mass": 0.0, "com_offset": 0.0, "unknown": 1.0}, closures, ["mass"])
    assert [r.name for r in rows] == ["unknown", "mass", "com_offset"] and rows[2].why.startswith("counted with mass")


def test_a_weight_makes_the_gap_of_a_lighter_vehicle_larger():
    """A weight asks for more lift, and here less is flown: what it closes is below 0, not 0."""
    result = balance_result.diagnosis([hovering(4, 0.9)], [hovering(seed) for seed in (1, 2, 3)], VEHICLE)
    assert result.gap["before"] > 2.0
    assert all(r.shrink.value < 0.0 for r in result.ranking if r.name in ("mass", "slung_load"))
