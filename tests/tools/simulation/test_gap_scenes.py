"""The counts of `gap_scenes.py`: which first answers are right, and which flights of a scene are diagnosed."""

from scipy.stats import binomtest

from airtouch.errors import AirTouchError
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


def test_an_effect_with_which_no_flight_ends_well_is_left_out_and_said(monkeypatch, capsys):
    """A motor twice as slow crashes `paper-low` each time: the table of all scenes was never printed for it."""
    def fly(scene, count, seed, effect=""):
        if effect.startswith("motor_lag"):
            raise AirTouchError("paper-low motor_lag: of 3 flights 0 end well")
        return [effect] * count

    monkeypatch.setattr(gap_scenes, "flown", fly)
    names = [name for name, _ in gap_scenes._cases("paper-low", 1, 100)]
    assert names == ["none", *(e.split(":")[0] for e in gap_scenes.EFFECTS if not e.startswith("motor_lag"))]
    assert "left out: paper-low motor_lag" in capsys.readouterr().err
