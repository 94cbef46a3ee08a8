"""The recorded courses as a scenario: hover, velocity step, platform, stop, landing."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from airtouch.logs.segments import LEVEL_PART
from airtouch.simulation import effects as registry
from airtouch.simulation.scenario import Scenario
from airtouch.twin.recorded.course import RISE_S, Course

NAME = "twin"  #: name of a twin's vehicle and scenario
WIDTH_M = 4.0  #: m, width of the platform across the path; no source: wider than any drift
MIN_APPROACH_M = 0.05  #: m, least distance from the velocity step to the edge; no source: round number
#: m, least distance flown after the platform, so that no flight stops over it by drift; no source: round number
MIN_STOP_M = 0.35
WAIT_S = 0.5  #: s on the ground before take-off; no source: round number
MIN_CLEARANCE_M = 0.012  #: m, least true distance at an entry: twice the 6 mm by which the legs end below the sensor
SETTLED_S = 0.15  #: s after an entry at which the reading behind it is taken
LAND_MPS = 0.2  #: m/s, speed of the firmware's landing
DISTANCES_M = np.linspace(0.0, 0.5, 2001)  #: m, true distances in which a reading is looked up: steps of 0.25 mm
MIN_CLIMB_S, MIN_HOVER_S, MIN_AFTER_S = 1.0, 0.5, 0.1  #: s, shortest that the simulator flies; no source: round numbers
#: values that a flight draws together, from one recorded course
KEYS = ("cruise", "clearance", "top", "speed", "angle", "climb", "hover", "before", "length", "stop", "after", "pulse",
        "every")


def course_values(course: Course, effects: Mapping[str, Any] | None = None, height_m: float = 0.0,
                  pulse_mps: float = 0.0) -> dict[str, float]:
    """The values (KEYS) with which the simulator flies a course: m, s, m/s, degrees.

    The edges are at the positions where the recorded flight, at its speed and with the same rise, crossed them. The
    platform's height is that of the course if known. Otherwise it follows from the readings before and after the
    entry, less the down range's error by `effects`. height_m: added to the set height, for a simulator that
    flies higher than its set point. pulse_mps: speed of the pulses in the hover, if the course has some.
    """
    clearance = max(course.before_m - course.top_m if course.top_m else
                    true_distance(course.entered_m, (effects or {}).get("range_bias", {})), MIN_CLEARANCE_M)
    before = max(course.speed_mps * (course.before_s - 0.5 * RISE_S), MIN_APPROACH_M)
    height = course.cruise_m + height_m
    top = max(min(course.before_m - clearance, height - 0.5 * MIN_CLEARANCE_M), 0.01)
    values = {"cruise": height, "clearance": clearance, "top": top,
              "speed": course.speed_mps, "angle": course.angle_deg,
              "climb": max(course.climb_s / LEVEL_PART, MIN_CLIMB_S),
              "hover": max(course.hover_s, MIN_HOVER_S), "before": before, "length": course.speed_mps * course.over_s,
              "stop": max(course.speed_mps * course.stop_s, MIN_STOP_M),
              "after": max(course.after_s - course.stop_s, MIN_AFTER_S),
              "pulse": pulse_mps if course.pulse_s else 0.0, "every": course.pulse_s or 1.0}
    return {name: round(float(value), 4) for name, value in values.items()}


def true_distance(reading_m: float, bias: Mapping[str, Any]) -> float:
    """The true distance, m, of a down range reading just after an entry, with the effect `range_bias`.

    bias: parameters of the effect; a range counts with its middle.
    """
    bias = {name: 0.5 * (v["low"] + v["high"]) if isinstance(v, Mapping) else v for name, v in bias.items()}
    values = registry.get("range_bias").values(bias) if bias else dict.fromkeys(("near", "dip"), 0.0)
    if not values["near"] and not values["dip"]:
        return reading_m
    reading = reading_m - values["dip"] * math.exp(-SETTLED_S / values["time"])
    readings = DISTANCES_M + values["near"] * np.exp(-DISTANCES_M / values["fade"])
    return float(np.interp(reading, np.maximum.accumulate(readings), DISTANCES_M))


def table(courses: Sequence[Course], effects: Mapping[str, Any], name: str = NAME,
          **mission: float) -> dict[str, Any]:
    """The table of a scenario in which each flight draws one of the courses and flies it with these effects.

    mission: arguments of `course_values`.
    """
    return {
        "name": name,
        "summary": f"{len(courses)} recorded courses, flown again.",
        "values": {"course": {"choice": [course_values(c, effects, **mission) for c in courses]}},
        "platform": [{
            "shape": "rectangle", "size_m": ["= length * cos(angle)", WIDTH_M],
            "centre_m": ["= before + 0.5 * length", 0.0], "angle_deg": "= angle",
            "top_m": "= top", "material": "acrylic"}],
        "mission": {"control": "velocity", "step": [
            {"do": "wait", "time_s": WAIT_S},
            {"do": "take-off", "height_m": "= cruise", "time_s": "= climb"},
            {"do": "hover", "time_s": "= hover", "pulse_mps": "= pulse", "every_s": "= every"},
            {"do": "go", "distance_m": "= before + length + stop", "speed_mps": "= speed"},
            {"do": "hover", "time_s": "= after"},
            {"do": "land", "time_s": f"= cruise / {LAND_MPS}"}]},
        "effects": dict(effects)}


def scenario_of(course: Course, effects: Mapping[str, Any], name: str = NAME, **mission: float) -> Scenario:
    """The scenario of one course. mission: arguments of `course_values`."""
    return Scenario(name, "", table([course], effects, name, **mission))


def shorten(scene: Scenario, least: float, seed: int = 0) -> Scenario:
    """The scenario with shorter platforms: each course's length times a number drawn between `least` and 1.

    A detector of platforms that were all alike in length fails over shorter ones.
    """
    rng = np.random.default_rng([seed, 31])
    course = scene.table["values"]["course"]
    choice = [{**values, "length": values["length"] * float(rng.uniform(least, 1.0))} for values in course["choice"]]
    values = {**scene.table["values"], "course": {**course, "choice": choice}}
    return replace(scene, table={**scene.table, "values": values})
