"""Commands that a diagnosis advises can be pasted: they hold the names that were given."""

import shlex
from dataclasses import replace

import pytest

from airtouch.cli.gap.next_commands import MOST_NAMES, with_names
from airtouch.gap.answer.advice import next_steps
from made_diagnosis import VEHICLE, diagnosis


def commands(vehicle, real, baseline, verdict="unknown"):
    answer = replace(diagnosis((), verdict, ()), indistinguishable=())
    steps = next_steps(answer, [], replace(VEHICLE, name="own"))
    return [step.command for step in with_names(replace(answer, next=steps), vehicle, real, baseline).next]


def test_names_are_those_that_were_given_and_the_rest_stays():
    _, own = commands("my drone.toml", ("a b.csv",), ("n1.csv", "n2.csv"))
    assert shlex.split(own) == ["airtouch", "gap", "diagnose", "a b.csv", "--vehicle", "my drone.toml", "--baseline",
                                "n1.csv", "n2.csv", "--effect-file", "mine.py"]


@pytest.mark.parametrize("many", [(), tuple(f"{i}.csv" for i in range(MOST_NAMES + 1))])
def test_a_placeholder_stands_for_many_names_and_for_none(many):
    baseline, _ = commands(None, many, ())
    assert baseline == "airtouch gap diagnose REAL --vehicle VEHICLE.toml --baseline NOMINAL..."
