"""The choice of priors on CrazyPAD, and diagnoses by the balance alone, on synthetic results and patterns."""

import numpy as np
import pytest

from airtouch import vehicle as vehicles
from airtouch.gap.balance.hover_hypotheses import hypotheses
from airtouch.gap.balance.hover_pattern import HoverPattern
from airtouch.gap.balance.priors import PRIORS
from tools.diagnosis import gap_crazypad as tool
from tools.diagnosis.recordings.crazypad.patterns import likeliest

VEHICLE = vehicles.load("crazyflie-2.1")
SCATTER = 0.003  #: of the balance between flights


def result(condition, right):
    """A flight of a condition with a cut rotor, which is named or not."""
    rotor, loss = {"value": int(condition[5])}, {"value": 0.1}
    effects = [{"name": "weak_motor", "parameters": {"rotor": rotor, "thrust_loss": loss}}] if right else []
    return {"condition": condition, "drone": "A", "verdict": "effect" if right else "none", "effects": effects}


def test_the_condition_that_is_judged_has_no_voice_in_the_priors():
    """Three tables, right on the first condition, on the second and third, and on the first and third."""
    names = ("cut_M1_3.0mm", "cut_M2_3.0mm", "cut_M3_3.0mm")
    first, second, third = tables = [[result(name, name in right) for name in names] for right in (
        names[:1], names[1:], names[::2])]
    chosen = tool.best_of_others(tables)
    assert chosen[0] is second[0]  # alone right on both others, though wrong on the first itself
    assert chosen[1] is third[1]  # alone right on both others
    assert chosen[2] is first[2]  # each is right on one of the others: the first of equals


@pytest.mark.parametrize(("logs", "name"), [([0.0, -0.5, -0.5], "two"), ([0.0, -1.0, -1.0], "one")])
def test_hypotheses_of_a_name_count_together(logs, name):
    """Two of exp(-0.5) are more than 1, two of exp(-1) are less; a common factor changes nothing."""
    assert likeliest(np.array(logs), ("one", "two", "two")) == name
    assert likeliest(np.array(logs) - 900.0, ("one", "two", "two")) == name


def pattern(rng, change=0.0):
    """A flight whose balance is changed."""
    return HoverPattern(change + SCATTER * rng.normal(size=4), np.array([-4.0, -4.0]) + 0.01 * rng.normal(size=2),
                        np.full(2, -6.0))


def test_a_flight_is_called_what_its_balance_was_changed_by():
    rng = np.random.default_rng(4)
    weak = next(h for h in hypotheses(VEHICLE, PRIORS) if h.name == "weak_motor")
    loss = weak.effects[0][1]["thrust_loss"]
    strong = weak.change[int(np.argmax(loss))]
    rows = [{"file": f"{i}.csv", "drone": "A", "condition": "normal_flight"} for i in range(6)]
    rows.append({"file": "cut.csv", "drone": "A", "condition": "cut_M1_3.0mm"})
    patterns = [pattern(rng) for _ in range(6)] + [pattern(rng, strong)]
    results = tool.results_with(rows, patterns, VEHICLE, PRIORS)
    assert [r["verdict"] for r in results] == ["none"] * 6 + ["effect"]
    (effect,) = results[-1]["effects"]
    assert effect["name"] == "weak_motor"
    assert effect["parameters"]["rotor"]["value"] == pytest.approx(weak.effects[0][1]["rotor"][0])
    assert effect["parameters"]["thrust_loss"]["value"] == pytest.approx(loss.max(), rel=0.3)
