"""The answer as an object: one that contradicts itself cannot be made; its line and its JSON."""

from dataclasses import replace

import pytest

import made_diagnosis
from airtouch.gap.result import NamedEffect
from made_diagnosis import cell, diagnosis, of_flights


@pytest.mark.parametrize("contradiction", [
    {"effects": (NamedEffect("weak_motor", {}), made_diagnosis.FOUND)}, {"verdict": "none"}, {"verdict": "unknown"},
    {"effects": ()}, {"ranking": diagnosis().ranking[::-1]}])
def test_verdict_effects_and_ranking_cannot_disagree(contradiction):
    with pytest.raises(ValueError, match="ranking begins with"):
        replace(diagnosis(), **contradiction)


def test_a_diagnosis_prints_as_one_line():
    cells = [cell("force_z", "hover", 1.0, after=0.1)]
    two_effects = diagnosis(cells, effects=(NamedEffect("motor_noise", {}), NamedEffect("weak_motor", {})))
    assert repr(two_effects) == str(two_effects) == ("Diagnosis(effect; motor_noise, weak_motor; probability 93%; "
                                                     "gap 4 before, 1.3 after (floor 1))")
    none = replace(diagnosis(cells, "none", ()), ranking=(), gap={})
    assert str(none) == "Diagnosis(none)"


def test_json_has_headline_map_and_steps():
    fields = of_flights(made_diagnosis.fly_pushed()).plain()
    assert fields["headline"] in fields["map"] and len(fields["map"]) > len(fields["where"])
    assert fields["next"] == [{"text": "Weigh the <vehicle>.", "command": "airtouch collect --mission hover"}]
