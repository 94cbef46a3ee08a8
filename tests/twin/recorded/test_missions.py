"""The recorded courses over shorter platforms."""

import pytest

from airtouch.simulation import scenario
from airtouch.simulation.scenario import Scenario
from airtouch.twin.recorded import missions
from twin_courses import PLAIN, made_course


def test_platforms_are_shorter_by_a_number_each_and_nothing_else_changes():
    courses = [missions.course_values(made_course(i, 0.06)) for i in range(40)]
    scene = Scenario("a", "", missions.table([made_course(i, 0.06) for i in range(40)], PLAIN))
    assert [c["length"] for c in scene.table["values"]["course"]["choice"]] == [c["length"] for c in courses]
    short = missions.shorten(scene, 0.3, seed=1).table["values"]["course"]["choice"]
    shares = [b["length"] / a["length"] for a, b in zip(courses, short, strict=True)]
    assert 0.3 <= min(shares) < 0.4 and 0.9 < max(shares) <= 1.0 and len(set(shares)) == 40
    for a, b in zip(courses, short, strict=True):
        assert {**a, "length": 0.0} == {**b, "length": 0.0}
    assert missions.shorten(scene, 0.3, seed=1).table == missions.shorten(scene, 0.3, seed=1).table
    plan = scenario.draw_flight(missions.shorten(scene, 0.3, seed=1), 0, 0)
    assert plan.world.corners[:, 0].max() - plan.world.corners[:, 0].min() == pytest.approx(plan.values["length"])
    assert plan.values["length"] in [c["length"] for c in short]


def test_a_share_of_one_is_the_scenario():
    scene = Scenario("a", "", missions.table([made_course(1, 0.06)], PLAIN))
    assert missions.shorten(scene, 1.0).table["values"]["course"]["choice"][0]["length"] == pytest.approx(
        scene.table["values"]["course"]["choice"][0]["length"])
