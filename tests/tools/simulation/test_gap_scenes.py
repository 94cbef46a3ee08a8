"""The counts of `gap_scenes.py`: which first answers are right, and which flights of a scene are diagnosed."""

from scipy.stats import binomtest

from tools.simulation import gap_scenes


def test_first_answers_are_counted_and_names_of_one_thing_are_one():
    rows = [("mass", "mass", 0.9), ("mass", "thrust_coefficient", 0.5), ("none", "none", 0.8), ("wind", "mass", 0.6)]
    ends = binomtest(3, 4).proportion_ci(method="wilson")
    assert gap_scenes.right(rows) == f"3 of 4 [{ends.low:.0%}, {ends.high:.0%}]"


def test_each_effect_acts_in_one_flight_of_a_seed_of_its_own(monkeypatch):
    flown = []

    def fly(scene, count, seed, effect=""):
        flown.append(seed)
        return [f"{scene} {effect}"] * count

    monkeypatch.setattr(gap_scenes, "flown", fly)
    cases = list(gap_scenes._cases("hover", 3, 100))
    assert cases[:3] == [("none", "hover ")] * 3
    assert cases[3:] == [(effect.split(":")[0], f"hover {effect}") for effect in gap_scenes.EFFECTS]
    assert len(set(flown)) == len(flown) and 100 not in flown
