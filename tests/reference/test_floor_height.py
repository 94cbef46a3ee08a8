"""Height over a platform, worked out by hand: what a step of the floor, a climb, a tilt and a gap in time do."""

import math
import re
from pathlib import Path

import pytest

from airtouch.reference import floor_height
from airtouch.reference.floor_height import FADE_MPS, GAP_MS, HOME_M, MOST_M, STEP_M, TRUST_M, FloorHeight

SLANT = 0.9  #: cosine of a tilt that is still believed


def after(*readings):
    """A new one after readings (distance, ms, cosine, climb, height), and what the last of them gave."""
    estimator, height = FloorHeight(), None
    for reading in readings:
        height = estimator.range(*reading)
    return estimator, height


def test_a_step_of_the_floor_is_taken_off_and_a_climb_is_not():
    floor, height = after((0.8, 1000, 1.0, 0.0, 0.8), (0.3, 1025, 1.0, 0.0, 0.8))
    assert (height, floor.floor, floor.steps) == (pytest.approx(0.8), pytest.approx(0.5), 1)
    assert floor.range(0.35, 1050, 1.0, 2.0, 0.85) == pytest.approx(0.85), "5 cm of climb in 25 ms at 2 m/s"
    assert floor.range(0.85, 1075, 1.0, 0.0, 0.85) == pytest.approx(0.85) and floor.steps == 2, "back over the edge"
    assert floor.floor == pytest.approx(0.0, abs=1e-9)
    climbing, height = after((0.5, 0, 1.0, 4.0, 0.5), (0.6, 25, 1.0, 4.0, 0.6))
    assert height == 0.6 and climbing.steps == 0
    falling, height = after((0.5, 0, 1.0, 0.0, 0.5), (0.6, 25, 1.0, 0.0, 0.5))
    assert height == pytest.approx(0.5) and falling.steps == 1


@pytest.mark.parametrize(("change", "steps"), [(0.9 * STEP_M, 0), (-0.9 * STEP_M, 0), (1.1 * STEP_M, 1),
                                               (-1.1 * STEP_M, 1)])
def test_only_a_change_of_more_than_a_step_is_the_floors(change, steps):
    assert after((0.8, 0, 1.0, 0.0, 0.8), (0.8 + change, 25, 1.0, 0.0, 0.8))[0].steps == steps


def test_the_thresholds_are_those_of_the_header_that_flies():
    header = (Path(__file__).parents[2] / "firmware/app/core/floor_height.h").read_text("utf-8")
    thresholds = {name: float(value) for name, value in re.findall(r"#define FLOOR_(\w+) ([\d.]+)[fu]", header)}
    assert len(thresholds) == 10 and thresholds == {name: getattr(floor_height, name) for name in thresholds}


@pytest.mark.parametrize(("step", "steps"), [(STEP_M, 0), (math.nextafter(STEP_M, 1.0), 1)])
def test_a_change_of_a_step_to_the_bit_is_no_step(step, steps):
    """From the ground, where a distance of 0 is a reading as well."""
    assert after((0.0, 0, 1.0, 0.0, 0.0), (step, 25, 1.0, 0.0, 0.0))[0].steps == steps


@pytest.mark.parametrize(("floor", "agrees"), [(TRUST_M, True), (math.nextafter(TRUST_M, 1.0), False)])
def test_a_floor_that_is_off_by_the_trusted_height_to_the_bit_is_kept(floor, agrees):
    """On the ground, over a floor that was taken for `floor`, after a gap: the estimator says 0."""
    estimator, _ = after((floor, 0, 1.0, 0.0, floor), (0.0, 25, 1.0, 0.0, floor), (0.0, 500, 1.0, 0.0, 0.0))
    assert estimator.floor == (floor if agrees else 0.0)


@pytest.mark.parametrize(("floor", "fades"), [(HOME_M, True), (math.nextafter(HOME_M, 1.0), False)])
def test_a_floor_about_home_fades_up_to_its_limit_to_the_bit(floor, fades):
    estimator, _ = after((floor, 0, 1.0, 0.0, floor), (0.0, 100, 1.0, 0.0, floor))
    assert estimator.floor == pytest.approx(floor - 0.1 * FADE_MPS if fades else floor, abs=1e-12)


@pytest.mark.parametrize(("floor", "kept"), [(MOST_M, True), (math.nextafter(MOST_M, 3.0), False)])
def test_the_highest_floor_is_still_one(floor, kept):
    assert after((floor, 0, 1.0, 0.0, floor), (0.0, 25, 1.0, 0.0, floor))[0].floor == (floor if kept else 0.0)


@pytest.mark.parametrize("order", [(1.0, 1.1), (1.1, 1.0)])
def test_a_tilted_beam_needs_a_larger_step_and_is_longer_than_the_height(order):
    """At cosine 0.9 half of a tenth of the longer plumb distance comes on top: 6 + 5.5 cm."""
    first, second = (p / SLANT for p in order)
    assert after((first, 0, SLANT, 0.0, 1.0), (second, 25, SLANT, 0.0, 1.0))[0].steps == 0
    estimator, reading = after((1.0 / SLANT, 0, SLANT, 0.0, 1.0), (0.8 / SLANT, 25, SLANT, 0.0, 1.0))
    assert estimator.floor == pytest.approx(0.2) and reading == pytest.approx(1.0 / SLANT)
    stepped, _ = after((1.0 / SLANT, 0, SLANT, 0.0, 1.0), (1.12 / SLANT, 25, SLANT, 0.0, 1.0))
    assert stepped.steps == 1, "12 cm are more than 6 + 5.6"


@pytest.mark.parametrize("bad", [math.nan, math.inf, -0.1])
def test_a_reading_that_is_no_number_teaches_nothing(bad):
    estimator, _ = after((0.8, 0, 1.0, 0.0, 0.8), (0.3, 25, 1.0, 0.0, 0.8))
    output = estimator.range(bad, 50, 1.0, 0.0, 0.8)
    assert math.isnan(output) if math.isnan(bad) else output == pytest.approx(bad + 0.5)
    for climb, height in ((math.nan, 0.8), (0.0, math.inf), (math.inf, math.inf), (math.inf, -0.8)):
        assert estimator.range(0.6, 60, 1.0, climb, height) == pytest.approx(1.1) and estimator.steps == 1
    assert estimator.range(0.3, 75, 1.0, 0.0, 0.8) == pytest.approx(0.8) and estimator.floor == pytest.approx(0.5)


def test_a_drone_tilted_too_far_keeps_the_floor_as_it_is():
    estimator, _ = after((0.8, 0, 1.0, 0.0, 0.8), (0.3, 25, 1.0, 0.0, 0.8))
    for cosine in (0.86, 0.5, 0.1):
        assert estimator.range(1.0, 50, cosine, 0.0, 0.8) == pytest.approx(1.0 + 0.5 / cosine)
    for cosine in (0.09, -0.5, 1.01, math.nan):
        assert estimator.range(1.0, 50, cosine, 0.0, 0.8) == 1.0
    assert estimator.steps == 1 and estimator.range(0.3, 75, 1.0, 0.0, 0.8) == pytest.approx(0.8)
    at_limit, _ = after((1.0, 0, 0.87, 0.0, 0.87), (0.5, 25, 0.87, 0.0, 0.87))
    assert at_limit.steps == 1, "30 degrees are still believed"


@pytest.mark.parametrize(("away", "agrees"), [(0.9 * TRUST_M, True), (-0.9 * TRUST_M, True), (1.1 * TRUST_M, False),
                                              (-1.1 * TRUST_M, False)])
def test_after_a_gap_the_floor_is_kept_where_it_agrees_with_the_estimator(away, agrees):
    estimator, _ = after((0.8, 0, 1.0, 0.0, 0.8), (0.3, 25, 1.0, 0.0, 0.8))
    height = estimator.range(0.3, 25 + GAP_MS + 1, 1.0, 0.0, 0.8 + away)
    assert height == pytest.approx(0.8 if agrees else 0.3) and estimator.floor == pytest.approx(0.5 if agrees else 0.0)
    assert estimator.steps == 1


def test_a_step_within_the_longest_gap_is_still_a_step():
    estimator, _ = after((0.8, 0, 1.0, 0.0, 0.8), (0.3, GAP_MS, 1.0, 0.0, 0.3))
    assert estimator.steps == 1 and estimator.floor == pytest.approx(0.5)
    later, _ = after((0.8, 0, 1.0, 0.0, 0.8), (0.3, GAP_MS + 1, 1.0, 0.0, 0.3))
    assert later.steps == 0 and later.floor == 0.0


def test_a_floor_higher_than_a_drone_could_be_is_none():
    estimator, height = after((3.5, 0, 1.0, 0.0, 3.5), (3.6 - MOST_M - 0.2, 25, 1.0, 0.0, 3.5))
    assert estimator.floor == 0.0 and height == pytest.approx(3.4 - MOST_M) and estimator.steps == 1
    deep, _ = after((0.5, 0, 1.0, 0.0, 0.5), (0.6 + MOST_M, 25, 1.0, 0.0, 0.5))
    assert deep.floor == 0.0
    high, _ = after((3.0, 0, 1.0, 0.0, 3.0), (3.1 - MOST_M, 25, 1.0, 0.0, 3.0))
    assert high.floor == pytest.approx(MOST_M - 0.1)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_low_floor_fades_and_a_high_one_stays(sign):
    low = sign * 0.07
    estimator, _ = after((0.8, 0, 1.0, 0.0, 0.8), (0.8 - low, 100, 1.0, 0.0, 0.8))
    assert estimator.floor == pytest.approx(low - sign * 0.1 * FADE_MPS)
    estimator.range(0.8 - low, 200, 1.0, 0.0, 0.8)
    assert estimator.floor == pytest.approx(low - sign * 0.2 * FADE_MPS)
    for k in range(20):
        estimator.range(0.8 - low, 300 + 100 * k, 1.0, 0.0, 0.8)
    assert estimator.floor == 0.0 and estimator.steps == 1
    assert low < HOME_M
    high, _ = after((0.8, 0, 1.0, 0.0, 0.8), (0.8 - sign * 0.1, 25, 1.0, 0.0, 0.8))
    high.range(0.8 - sign * 0.1, 50, 1.0, 0.0, 0.8)
    assert high.floor == pytest.approx(sign * 0.1)


def test_flow_sees_the_distance_to_what_is_below():
    estimator, _ = after((0.8, 0, 1.0, 0.0, 0.8), (0.3, 25, 1.0, 0.0, 0.8))
    assert estimator.flow(0.8) == pytest.approx(0.3 / 0.8)
    assert estimator.flow(0.52) == pytest.approx(0.08 / 0.52), "no nearer than 8 cm"
    assert estimator.flow(float("nan")) == 1.0, "as in C"
    assert estimator.flow(0.08) == 1.0 == estimator.flow(0.05) == FloorHeight().flow(0.8)
    below, _ = after((0.8, 0, 1.0, 0.0, 0.8), (1.2, 25, 1.0, 0.0, 0.8))
    assert below.flow(0.8) == pytest.approx(1.5) and below.flow(0.08) == 1.0 == below.flow(0.0)
