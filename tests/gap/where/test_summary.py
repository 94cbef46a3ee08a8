"""The headline: the cell that most of the gap is in, or that the named effects explain."""

from dataclasses import replace

import pytest

from airtouch.gap.answer import advice
from airtouch.gap.answer.sentences import sentences
from airtouch.gap.result import NamedEffect
from airtouch.gap.where import summary
from airtouch.gap.where.cell import BASELINE, Cell, GapMap
from made_diagnosis import VEHICLE, cell, diagnosis


def test_headline_is_what_most_of_the_gap_is_not_the_largest_ratio():
    """A take-off cell of 26 floors in one block against a sideways force of 10 floors in four phases."""
    cells = [cell("force_z", "take-off", 2.6, blocks=1),
             *(cell("force_y", p, 1.0, blocks=10) for p in ("hover", "cruise", "over platform", "landing"))]
    headline = summary.headline(cells)
    assert (headline.channel, headline.phase) == ("force_y", "hover")
    answer = diagnosis(cells, "unknown", ())
    where, _, _ = sentences(answer)
    assert where == ("The gap lies mostly in sideways force at 0-0.5 Hz: in hover it is 1 m/s^2, 10 times the floor, "
                     "and it stands out in 4 of 5 phases in the air.")
    texts = [s.text for s in advice.next_steps(replace(answer, indistinguishable=(), baseline=("a.csv",)), [], VEHICLE)]
    assert "more time in hover" in texts[0] and not any("take-off" in t for t in texts)


def test_a_cell_that_grows_is_not_one_from_which_the_effects_take_most():
    """Of many cells of one phase beyond the largest, the one that shrinks is listed and those that grow are not."""
    many = [cell(f"force_{a}", "hover", 9.0 - low, band_hz=(low, low + 1.0), after=9.5 - low)
            for low in (0.0, 1.0, 2.0, 3.0) for a in "xyz"]
    shrinking = cell("torque_x", "hover", 1.0, after=0.5)
    for cells, more in ((many, []), ([*many, shrinking], [shrinking])):
        shown = summary.cells_to_show(GapMap(tuple(cells), BASELINE, ()))
        assert shown == [*summary.largest(cells), *more]


def test_a_cell_of_the_ground_or_of_one_regime_is_no_headline():
    cells = [cell("force_z", "ground", 9.0), cell("force_z", "hover", 8.0, regime="height < 0.1 m"),
             cell("force_x", "hover", 0.5)]
    assert summary.headline(cells).channel == "force_x"
    assert summary.headline(cells[:2]) is None


def test_headline_of_named_effects_is_where_they_take_most():
    cells = [cell("torque_x", "hover", 16.0, 0.9, after=15.9), cell("force_z", "over platform", 0.43, 0.04, after=0.04)]
    result = diagnosis(cells, effects=(NamedEffect("ground_effect", {}),))
    assert result.headline is cells[1] and "lift" in sentences(result)[0]
    assert ("1 of 2 cells still stand out, mostly in hover in roll torque at 0-0.5 Hz "
            "(18 times the floor, as before)") in sentences(result)[2]


def test_headline_of_an_effect_that_halves_no_cell_is_where_it_takes_most():
    """Of 16 floors 4 % go, of 4 floors 30 %; a cell inside its floor counts only where no other shrinks."""
    large, shrinking = cell("torque_x", "hover", 1.6, after=1.55), cell("force_z", "hover", 0.4, after=0.33)
    inside = cell("force_y", "hover", 0.115, after=0.05)
    assert summary.headline([large, shrinking, inside], True) is shrinking
    assert summary.headline([large, inside], True) is inside
    assert summary.headline([large, replace(inside, blocks=1)], True) is large
    assert summary.headline([large, replace(inside, after=0.11)], True) is large
    assert summary.headline([large, shrinking, inside]) is large


def test_a_cell_without_an_interval_may_stand_out_and_is_not_significant():
    """As those of flights without a gyro."""
    known, unknown = cell("force_z", "hover", 0.5), Cell("force_z", (0.0, 0.2), "hover", 0.5, 0.1, "m/s^2")
    assert summary.stands_out(known) and summary.significant(known)
    assert summary.stands_out(unknown) and not summary.significant(unknown)
    inside = cell("force_z", "hover", 0.13)  # its lower end is 0.117, the floor's upper end 0.12
    assert not summary.stands_out(inside) and not summary.significant(inside)


def test_cells_of_the_ground_that_got_worse_are_counted_in_its_phase():
    cells = [cell("force_z", "hover", 1.0, after=0.05), cell("force_x", "ground", 1.5, after=2.2),
             cell("force_y", "ground", 2.6, after=8.8)]
    ground = next(p for p in summary.phases(cells) if p.name == "ground")
    assert (ground.over, ground.stay, ground.worse) == (2, 2, 2)


@pytest.mark.parametrize(("gap", "after"), [(1.0, 0.5), (1.0, 5e-13), (5e-13, 5e-13), (0.0, None)])
@pytest.mark.parametrize("high", [0.0, None])
def test_a_floor_of_0_is_the_smallest_one_in_all_that_is_said(gap, after, high):
    """Every figure of a cell is that of the same cell with a floor of 1e-12, of its unit."""
    none = replace(cell("force_z", "hover", gap, 0.0, after=after), floor_high=high)
    least = replace(none, floor=1e-12, floor_high=1e-12 if high == 0.0 else None)
    for figure in (summary.over_floor, summary.sure_ratio, summary.significant, summary.stays, summary.energy,
                   summary.removed, summary.closes, lambda c: summary.overall([c]), lambda c: summary.phases([c])):
        assert figure(none) == figure(least)


def test_the_upper_end_of_a_floor_may_be_0():
    """An interval that ends at 0 is one, and not an end that is not known."""
    assert summary.stands_out(replace(cell("force_z", "hover", 0.1, 0.2), floor_high=0.0))
