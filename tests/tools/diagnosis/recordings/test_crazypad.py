"""What CrazyPAD's conditions say, and its figures, on synthetic results whose counts are known."""

import numpy as np
import pytest

from tools.diagnosis.recordings.crazypad import figures, labels

SMALL, LARGE = "cut_M3_0.5mm_0.5mm", "cut_M2_3.5mm_3.0mm_40.5mm"  # 1 mm and 6.5 mm gone; the last is the blade's length


def result(condition, rotors=(), name="weak_motor", verdict="effect", loss=0.1, drone="A"):
    """A flight of a condition and what its diagnosis names: an effect of these rotors, or of none."""
    parameters = [{"rotor": {"value": float(r)}, "thrust_loss": {"value": loss}} for r in rotors] or [{}]
    effects = [{"name": name, "parameters": p} for p in parameters] if verdict == "effect" else []
    return {"condition": condition, "drone": drone, "verdict": verdict, "effects": effects}


@pytest.mark.parametrize(("condition", "family", "rotors", "cut_mm", "large"), [
    ("normal_flight", "normal", [], np.nan, False),
    (SMALL, "rotor damage", [3], 1.0, False),
    (LARGE, "rotor damage", [2], 6.5, True),
    ("cut_M2_1.0mm_M1_0.5mm_1.0mm", "rotor damage", [1, 2], 2.5, True),
    ("tape_M4", "rotor damage", [4], np.nan, False),
    ("add_weight_W1_near_M3", "added weight", [], np.nan, False),
    ("add_weight_string_W2", "slung load", [], np.nan, False)])
def test_a_condition_names_family_rotors_and_millimetres(condition, family, rotors, cut_mm, large):
    assert labels.family(condition) == family and labels.rotors(condition) == rotors
    assert labels.cut_mm(condition) == pytest.approx(cut_mm, nan_ok=True) and labels.large(condition) is large


def test_millimetres_of_a_condition():
    assert labels.millimetres("cut_M2_3.5mm_3.0mm_40.5mm_M1_3.0mm_3.0mm_41mm") == {2: 6.5, 1: 6.0}
    assert labels.millimetres("cut_propeller_M3_1mm") == {3: 1.0} and not labels.large("cut_propeller_M3_1mm")
    assert labels.large("cut_M2_1mm_0.5mm_45.5mm_M1_1mm_0.5mm_45.5mm")
    assert labels.millimetres("tape_on_propeller_M3") == {}


def test_all_flights_of_each_fourth_defect_are_kept_for_looking():
    names = [f"cut_M1_{i}.0mm" for i in range(1, 9)]
    rows = [{"condition": c} for c in (*names, *names, "normal_flight")]
    viewed = {r["condition"] for r, build in zip(rows, labels.building(rows), strict=True) if not build}
    assert viewed == {names[3], names[7]} and labels.building(rows).count(False) == 4


def test_each_family_counts_the_same_however_many_flights_it_has():
    flights = [result("normal_flight", verdict="none"), result(LARGE, [2]), result(LARGE, verdict="none"),
               result(LARGE, verdict="unknown"), result(LARGE, name="mass")]
    assert figures.balanced_accuracy(flights) == pytest.approx((1.0 + 0.25) / 2.0)
    assert np.isnan(figures.balanced_accuracy([]))


def test_rotors_are_exact_or_only_damaged_ones():
    two = "cut_M1_2.0mm_M3_2.0mm"
    flights = [*(result(two, rotors) for rotors in ([3, 1], [1], [1, 2])), result(two, verdict="none"),
               result("normal_flight")]
    assert figures.exact_rotors(flights) == pytest.approx(1 / 4)
    assert figures.only_damaged_rotors(flights) == pytest.approx(2 / 4)
    assert figures.large_exact_rotors([*flights, result(SMALL, [1])]) == pytest.approx(1 / 4)


def test_a_small_cut_may_be_called_normal_and_a_large_one_not():
    for condition, forgiven in ((SMALL, 1.0), (LARGE, 0.0)):
        flights = [result(condition, verdict="none")]
        assert figures.balanced_accuracy(flights) == 0.0 and figures.forgiven(flights) == forgiven


def test_a_refused_flight_is_not_right_and_is_not_called_unknown():
    refused = result(LARGE, verdict="refused")
    assert figures.answer(refused) == "refused" and figures.balanced_accuracy([refused]) == 0.0
    assert figures.named_rotors(refused) == [] and figures.thrust_loss(refused) == 0.0


def test_severity_is_the_order_of_the_losses():
    flights = [result(f"cut_M1_{mm}.0mm", [1], loss=0.01 * mm ** 2) for mm in (1, 2, 3, 4)]
    assert figures.severity(flights) == pytest.approx(1.0)
    backwards = [{**one, "effects": other["effects"]} for one, other in zip(flights, flights[::-1], strict=True)]
    assert figures.severity(backwards) == pytest.approx(-1.0) and np.isnan(figures.severity(flights[:2]))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("flights", [
    [result("normal_flight", verdict="none"), result(LARGE, [2]), result(SMALL, [3]),
     result("add_weight_string_W2", name="slung_load")],  # those of `gap_real.py --quick`: two have a cut
    [result(condition, verdict="none") for condition in (LARGE, SMALL, "cut_M1_2.0mm")]])  # all have the same loss
def test_a_severity_that_flights_do_not_say_is_a_dash(flights):
    assert figures.with_interval(flights, figures.severity) == "-"


def test_intervals_resample_conditions_not_flights():
    """Two conditions, one always right: a quarter of the samples hold it alone, a quarter the other alone.

    How many flights each has does not matter. With a single condition the interval has no width.
    """
    right, wrong = [result(LARGE, [2])] * 9, [result("cut_M1_2.0mm", verdict="none")] * 9
    assert figures.interval([*right, *wrong], figures.balanced_accuracy) == (0.0, 1.0)
    assert figures.interval([*right, *wrong[:1]], figures.balanced_accuracy) == (0.0, 1.0)
    assert figures.interval([*right], figures.balanced_accuracy) == (1.0, 1.0)
