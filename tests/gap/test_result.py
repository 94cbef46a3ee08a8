"""The answer as an object: one that contradicts itself cannot be made; its line and its JSON."""

import json
import re
from dataclasses import asdict, replace
from pathlib import Path

import pytest

import made_diagnosis
from airtouch.gap.flights.flight import ready
from airtouch.gap.measurement import measure
from airtouch.gap.result import NamedEffect, OpenCell, Quantity, RankedCandidate, Rejected
from airtouch.gap.where.command_power import command_power, mean_spectra
from airtouch.gap.where.rotor_speeds import RotorSpeed
from made_diagnosis import VEHICLE, cell, diagnosis, of_flights

PAGE = (Path(__file__).parents[2] / "host/docs/gap-json.md").read_text("utf-8")


def keys_under(heading):
    """What stands in code in the first column of the first table under a heading of the page."""
    rows = re.search(rf"^## {heading}\n(?:(?!## ).*\n)*?\|[-| ]+\|\n((?:\|.*\n)+)", PAGE, re.M).group(1)
    return [key for row in rows.splitlines() for key in re.findall(r"`(\w+)`", row.split("|")[1])]


def example_under(heading):
    """The JSON that a section of the page shows."""
    return json.loads(re.search(rf"^## {heading}\n.*?^```json\n(.*?)^```", PAGE, re.M | re.S).group(1))


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


def test_the_page_has_each_key_of_the_answer():
    fields = diagnosis([cell("force_z", "hover", 1.0, after=0.1)]).plain()
    assert sorted(keys_under("Keys of the answer")) == sorted(fields)
    row = next(line for line in PAGE.splitlines() if line.startswith("| `ranking`"))
    candidate = RankedCandidate("mass", 0.5, Quantity(0.0), "why", 1.0, measured=False).plain()
    assert all(key in row for key in (*candidate, "measured"))
    quantity = re.search(r"^## Quantities\n(.*)", PAGE, re.M | re.S).group(1).split("\n## ")[0]
    assert set(re.findall(r"`(\w+)`", quantity)) == set(Quantity(1.0, 0.9, 1.1).plain())


def test_the_page_has_each_key_of_the_map():
    logs = made_diagnosis.fly_pushed()
    gap = measure(logs[:1], VEHICLE)
    assert sorted(keys_under("Keys of the map")) == sorted(gap.plain())
    rows = {key: line for line in PAGE[:PAGE.index("## Keys of the answer")].splitlines()
            for key in re.findall(r"^\| `(\w+)` \|", line)}
    power = [command_power(ready(log, VEHICLE), VEHICLE) for log in logs[:1]]
    spectra = mean_spectra(power, power).plain()
    assert all(f"`{key}`" in rows["spectra"] for key in (*spectra, *spectra["roll"]))
    assert all(f"`{key}`" in rows["rotors"] for key in RotorSpeed._fields)


def test_the_page_has_each_key_of_a_cell():
    fields = {*asdict(cell("force_z", "hover", 1.0)), "words"}
    assert set(keys_under("A cell of the map")) == set(example_under("A cell of the map")) == fields
    cells = measure(made_diagnosis.fly_pushed()[:1], VEHICLE).plain()
    assert set(cells["where"][0]) - fields == set() and "words" not in cells["map"][0]
    example = example_under("A cell of `unexplained`")
    full = OpenCell("force_z", (0.5, 2.0), "cruise", "a.csv", 1.0, 2.0, 3.0, nearest=(Rejected("wind", "why"),)).plain()
    assert set(example) == set(full) and set(example["nearest"][0]) == set(full["nearest"][0])
