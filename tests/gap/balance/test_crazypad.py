"""Flights without a gyro: hover balance against closed forms, and CrazyPAD's known defects."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch import vehicle
from airtouch.gap.balance import balance_result
from airtouch.gap.balance.balance_result import NO_VELOCITY, UNSTEADINESS
from airtouch.gap.balance.hover_balance import ANSWER, POWER, Reference, evidence, reference
from airtouch.gap.balance.hover_hypotheses import commanded_change, hypotheses, weight_change
from airtouch.gap.balance.hover_pattern import NO_HOVER, HoverPattern, hover_pattern
from airtouch.gap.balance.hover_posterior import answer_of, probabilities
from airtouch.gap.balance.priors import PRIOR_PROBABILITY, PRIORS
from airtouch.gap.diagnosis import diagnose
from airtouch.gap.flights.flight import ready
from airtouch.logs import read
from airtouch.logs.flight_log import VELOCITY, FlightLog
from airtouch.simulation import replay
from airtouch.simulation import signals as at
from airtouch.simulation.effects import Active, get

FLOWN = vehicle.load("crazyflie-2.1")
NOMINAL = Reference(np.zeros(6), np.array(PRIORS.nominal) ** 2, np.zeros(2))  # both powers are 1 without corrections
UNCORRECTED = (-9.0, -9.0)


def pattern(balance, power=(0.0, 0.0), corrections=UNCORRECTED) -> HoverPattern:
    """A pattern as steady as nominal flights, unless powers are given."""
    return HoverPattern(np.array(balance), np.array(power), np.array(corrections))


def commanded(thrusts: np.ndarray) -> HoverPattern:
    """The pattern of commanded thrusts (4,), each over its nominal one."""
    return pattern(commanded_change(thrusts[None])[0])


def best(pattern: HoverPattern) -> tuple:
    explanations = hypotheses(FLOWN)
    logs, weights = evidence(NOMINAL.difference(pattern), NOMINAL, explanations)
    i = int(np.argmax(logs))
    return explanations[i], weights[i]


@pytest.mark.parametrize("rotor", [1, 2, 3, 4])
def test_a_rotor_that_needs_more_by_itself_is_weak(rotor):
    thrusts = np.ones(4)
    thrusts[rotor - 1] = 1.0 / (1.0 - 0.2)
    explanation, weight = best(commanded(thrusts))
    assert [(name, int(v["rotor"][0])) for name, v in explanation.effects] == [("weak_motor", rotor)]
    assert weight @ explanation.effects[0][1]["thrust_loss"] == pytest.approx(0.2, abs=0.03)


def test_two_rotors_across_from_each_other():
    thrusts = np.array([1.0, 1.0 / 0.8, 1.0, 1.0 / 0.8])
    explanation, _ = best(commanded(thrusts))
    assert [int(v["rotor"][0]) for _, v in explanation.effects] == [2, 4]


def test_a_weight_in_front_keeps_yaw():
    share, forward = 0.12, 0.02
    half = FLOWN.arm_m / np.sqrt(2.0)
    front = share * forward / half  # the front pair carries the weight's moment
    thrusts = 1.0 + share + np.array([front, -front, -front, front])
    explanation, weight = best(commanded(thrusts))
    assert [name for name, _ in explanation.effects] == ["mass", "com_offset"]
    assert weight @ explanation.effects[0][1]["fraction"] == pytest.approx(share, abs=0.03)
    assert weight @ explanation.effects[1][1]["x"] == pytest.approx(share / (1.0 + share) * forward, abs=0.0006)


def test_nominal_is_none_and_nonsense_is_unknown():
    explanation, _ = best(pattern([0.0, 0.003, -0.003, 0.002]))
    assert explanation.name == "none"
    explanation, _ = best(pattern([-0.3, 0.3, -0.3, 0.3], power=(0.4, 0.3)))
    assert explanation.name == "unknown"


@pytest.mark.parametrize(("number", "change"), [
    (0, -0.2), (0, -0.4), (3, 0.4), (3, -0.4)])
def test_one_number_alone_that_is_far_off_is_no_nominal_flight(number, change):
    """By 16 to 36 standard deviations of nominal flights, and by 15 to 50 of maintenance: no candidate makes that."""
    one = np.zeros(4)
    one[number] = change
    assert best(pattern(one))[0].name == "unknown"


@pytest.mark.parametrize("fraction", [0.12, 0.2, 0.25])
def test_more_lift_alone_is_a_weight_at_the_centre(fraction):
    change = weight_change(np.array([fraction]), np.zeros(1), np.zeros(1), FLOWN.arm_m)[0]
    candidates = hypotheses(FLOWN)
    of_each = probabilities(evidence(NOMINAL.difference(pattern(change)), NOMINAL, candidates), candidates)
    assert answer_of(of_each)[0] == "mass" and of_each["unknown"] < 0.05


def test_power_that_corrections_of_the_estimate_cause_is_nobodys():
    own, corrected = np.array([-5.8, -2.3]), np.log10([[1e-6, 1e-6], [1e-4, 3e-5], [2e-4, 3e-4], [1e-7, 1e-3]])
    powers = np.log10(10.0 ** own + ANSWER * 10.0 ** corrected)
    table = [pattern(np.zeros(4), *of) for of in zip(powers, corrected, strict=True)]
    base = reference(table[:3])
    np.testing.assert_allclose(base.own_power, own, atol=1e-9)
    np.testing.assert_allclose(base.difference(table[3]), np.zeros(6), atol=1e-9)
    np.testing.assert_allclose(base.mean_difference(table), np.zeros(6), atol=1e-9)  # together, too
    uncorrected = [pattern(np.zeros(4), power) for power in powers]
    np.testing.assert_allclose(reference(uncorrected[:3]).difference(uncorrected[3])[POWER],
                               powers[3] - powers[:3].mean(axis=0), atol=1e-3)


@pytest.mark.parametrize("place", ["nominal", "one nominal", "flight", "one flight"])
def test_where_a_velocity_is_missing_unsteadiness_is_no_evidence(place):
    """Whatever the powers, the answer is that of flights as steady as the nominal ones and of the same balance."""
    def shaken(missing, powers):
        return pattern([0.05, 0.03, 0.0, 0.0], powers, (np.nan, np.nan) if missing else UNCORRECTED)

    nominal = [shaken(place == "nominal" or place == "one nominal" and i == 0, (0.0, 0.1 * i)) for i in range(3)]
    candidates = hypotheses(FLOWN)
    logs = []
    for power in (-2.0, 0.0, 2.0):
        flights = [shaken(place == "flight" or place == "one flight" and i == 0, (power, power)) for i in range(2)]
        base = reference(nominal)
        logs.append(evidence(base.mean_difference(flights), base, candidates).log)
    np.testing.assert_array_equal(logs[0], logs[1])
    np.testing.assert_array_equal(logs[2], logs[1])
    assert np.isfinite(logs[0]).all()


def test_the_mean_is_that_of_the_flights_with_a_hover():
    """By hand; a flight without one takes no part."""
    lift, turn = pattern([0.1, 0.0, 0.0, 0.0], power=(0.2, 0.0)), pattern([0.0, 0.0, 0.0, 0.3])
    np.testing.assert_allclose(NOMINAL.mean_difference([lift, NO_HOVER, turn]), [0.05, 0.0, 0.0, 0.15, 0.1, 0.0],
                               atol=1e-6)


def test_prior_probabilities_add_up_to_one_over_names_and_over_hypotheses():
    explanations = hypotheses(FLOWN)
    assert sum(PRIOR_PROBABILITY.values()) == pytest.approx(1.0) == sum(h.prior for h in explanations)
    rotors = [tuple(int(v["rotor"][0]) for _, v in h.effects) for h in explanations if h.name == "weak_motor"]
    assert sorted(rotors) == [(1,), (1, 2), (1, 3), (1, 4), (2,), (2, 3), (2, 4), (3,), (3, 4), (4,)]


def test_a_weight_over_a_rotor_asks_that_pair_of_sides_for_more():
    """A tenth of the mass halfway between the two front rotors: they carry it, the others as before."""
    half = FLOWN.arm_m / np.sqrt(2.0)
    change = weight_change(np.array([0.1]), np.array([half]), np.array([0.0]), half)[0]
    np.testing.assert_allclose(change, commanded_change(np.array([[1.2, 1.0, 1.0, 1.2]]))[0], atol=1e-12)


def test_a_thread_tied_off_centre_turns_the_vehicle():
    steady = np.zeros((400, at.COUNT))
    steady[:, at.STEP], steady[:, at.GRAVITY], steady[:, at.HEIGHT] = 0.002, 9.81, 1.0
    steady[:, [at.ROTATION, at.ROTATION + 4, at.ROTATION + 8]] = 1.0
    effect, load = get("slung_load"), 0.003
    values = effect.values({"load": load, "length": 0.63, "x": 0.02, "y": -0.01})
    last = replay.wrench_of(Active(effect, values), steady)[-1]
    assert last[2] == pytest.approx(-load * 9.81, rel=0.02)
    np.testing.assert_allclose(last[3:], [-0.01 * last[2], -0.02 * last[2], 0.0], atol=1e-9)


@pytest.fixture(scope="module")
def pad(flights):
    folder = flights / "crazypad"
    if not folder.is_dir():
        pytest.skip("no CrazyPAD flights")
    return lambda name: read(folder / f"pad_{name}.csv.gz")


@pytest.fixture(scope="module")
def nominal(pad):
    return {"E8": [pad(f"normal_flight_E8_log0{i}") for i in range(4)],
            "E9": [pad(f"normal_flight_E9_log0{i}") for i in range(2)]}


@pytest.mark.parametrize(("name", "rotors"), [
    ("cut_propeller_M3_3mm_3mm_41mm_E8_log01", [3]),
    ("cut_propeller_M3_4mm_4mm_39mm_E8_log00", [3]),
    ("cut_M2_3.5mm_3.0mm_40.5mm_M1_3.0mm_3.0mm_41mm_E9_log00", [1, 2]),
])
def test_cut_rotors_are_named(pad, nominal, name, rotors):
    result = diagnose([pad(name)], FLOWN, nominal["E8" if "E8" in name else "E9"])
    assert result.verdict == "effect"
    assert [e.name for e in result.effects] == ["weak_motor"] * len(rotors)
    assert [int(e.parameters["rotor"].value) for e in result.effects] == rotors
    assert result.gap["after"] < 0.6 * result.gap["before"]
    assert sum(r.probability for r in result.ranking) == pytest.approx(1.0)


@pytest.mark.parametrize(("name", "first"), [
    ("add_weight_W1_near_M3_M4_E8_log00", "mass"), ("weight_on_string_W2_near_M3_E8_log00", "slung_load")])
def test_weights_are_named(pad, nominal, name, first):
    result = diagnose([pad(name)], FLOWN, nominal["E8" if "E8" in name else "E9"])
    assert result.effects[0].name == first
    if first == "mass":  # near rotors 3 and 4, on the left
        assert result.effects[1].parameters["y"].low > 0.0


def test_a_further_normal_flight_is_none(pad, nominal):
    result = diagnose([pad("normal_flight_E9_log02")], FLOWN, nominal["E9"])
    assert (result.verdict, result.effects, result.ranking[0].name) == ("none", (), "none")


def test_a_normal_flight_whose_position_was_measured_badly_is_none(pad, nominal):
    result = diagnose([pad("normal_flight_E8_log03")], FLOWN, nominal["E8"][:3])  # 18 times their corrections
    assert (result.verdict, result.effects) == ("none", ())


@pytest.mark.parametrize("which", [1, 2, 3])
@pytest.mark.parametrize("decades", [0.6, 1.0])
def test_a_normal_flight_that_is_less_steady_is_unknown(pad, nominal, which, decades, monkeypatch):
    """As balanced as before: flight 1 was a weak motor at 98 %, as that halved its chance gap at the floor.

    Flight 0 is left out: its gap stands out, at 1.2 times the floor.
    """
    shaken, base = nominal["E8"][which], [log for i, log in enumerate(nominal["E8"]) if i != which]
    columns = ready(shaken, FLOWN).pwm

    def unsteady(flight, *args):
        raised = (decades, 0.0) if np.array_equal(flight.pwm, columns) else (0.0, 0.0)
        measured = hover_pattern(flight, *args)
        return replace(measured, power=measured.power + raised)

    monkeypatch.setattr(balance_result, "hover_pattern", unsteady)
    result = diagnose([shaken], FLOWN, base)
    assert (result.verdict, result.effects) == ("unknown", ())


@pytest.mark.parametrize("all_lack_it", [False, True])
def test_the_same_flight_without_velocity_is_none(pad, nominal, all_lack_it):
    """Its unsteadiness, of the position alone, was a weak motor at 95 %."""
    def without_velocity(log):
        return FlightLog({k: v for k, v in log.columns.items() if k not in VELOCITY}, log.meta)

    base = nominal["E8"][:3]
    result = diagnose([without_velocity(pad("normal_flight_E8_log03"))], FLOWN,
                      [without_velocity(log) for log in base] if all_lack_it else base)
    assert (result.verdict, result.effects) == ("none", ())
    assert NO_VELOCITY in result.notes and UNSTEADINESS not in result.notes[0]


def test_a_normal_flight_of_whose_hover_five_seconds_are_lost_is_none(pad, nominal):
    """Straight lines over the lost rows are steadier than any flight: they were a weak motor, at 92 %."""
    log = pad("normal_flight_E8_log01")
    logged = np.ones(len(log), bool)
    logged[1886:2386] = False
    result = diagnose([FlightLog({k: v[logged] for k, v in log.columns.items()}, log.meta)], FLOWN,
                      [nominal["E8"][i] for i in (0, 2, 3)])
    assert (result.verdict, result.effects) == ("none", ())
    assert any("log01.csv.gz: 34% of what is flown was not logged" in note for note in result.notes)


def test_flights_of_one_condition_together(pad, nominal):
    result = diagnose([pad(f"cut_propeller_M3_3mm_E8_log0{i}") for i in (1, 2, 3)], FLOWN, nominal["E8"])
    assert [(e.name, e.parameters["rotor"].value) for e in result.effects] == [("weak_motor", 3.0)]
