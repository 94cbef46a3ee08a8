"""What stays open: cells and seconds of a gap of known shape."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from airtouch.gap.answer.unexplained import ratios_of_blocks, unexplained, worst_interval
from airtouch.gap.evidence.data import Data
from airtouch.gap.naming.passing_effect import unsteadiness_rarity
from airtouch.gap.naming.records import UnsteadinessRarity
from airtouch.gap.result import REST_OF_FLIGHT
from airtouch.gap.signals.channels import COLUMN, COUNT
from airtouch.gap.signals.spectra import AIR, LENGTH, starts
from airtouch.gap.signatures.scatter import UNSTEADY_LIFT, UNSTEADY_TORQUE, Scatter
from airtouch.logs.segments import KINDS
from gap_flights import flight, noise
from made_diagnosis import cell
from shaken_hover import CELL, STUDY, hover, ratio_of


def test_the_ratio_is_the_rms_over_the_floor_of_the_cell():
    """White noise of 0.5 m/s^2 at 100 Hz has 0.5^2 / 50 in each Hz, so 0.5^2 * 4 / 50 between 2 and 6 Hz."""
    ratio = ratio_of(hover(0.5))
    assert len(ratio) == len(starts(hover(0.5), AIR))
    assert np.sqrt(np.mean(ratio ** 2)) == pytest.approx(np.sqrt(0.5 ** 2 * 4.0 / 50.0) / CELL.floor, rel=0.1)
    assert not len(ratio_of(flight(1.0)))


def test_a_channel_that_a_log_lacks_has_no_ratio():
    """Zeros would say that a flight without a gyro has no gap in the rates."""
    gap = np.full((4000, COUNT), 0.5)
    gap[:, COLUMN["rate_x"]] = np.nan
    assert np.isnan(ratios_of_blocks(hover(0.0), gap, replace(CELL, channel="rate_x"))).all()


def test_lost_rows_add_nothing_to_the_ratio():
    """A constant gap has none between 2 and 6 Hz, whatever stands in the rows that were lost."""
    lost = np.arange(4000) % 1000 < 20
    force = np.where(lost, 50.0, 0.3)[:, None] * [1.0, 0.0, 0.0]
    assert ratio_of(flight(40.0, force, lost=lost)).max() < 1e-9


def test_a_command_is_held_against_the_floor_of_its_cell():
    """The replay's own floor says nothing of commands, whose floor is that of the loop."""
    one, gap = hover(0.0), np.zeros((4000, COUNT))
    gap[:, COLUMN["command_thrust"]] = 3e-4 * np.sqrt(2.0) * np.sin(2.0 * np.pi * 4.0 * np.arange(4000) / 100.0)
    command = replace(CELL, channel="command_thrust", floor=1e-4)
    np.testing.assert_allclose(ratios_of_blocks(one, gap, command), 3.0, rtol=0.01)


def test_the_worst_interval_ends_where_the_gap_is_half_way_to_its_median():
    assert worst_interval(np.array([1.0, 1.0, 3.1, 5.0, 2.9, 4.0, 1.0, 1.0, 1.0])) == (2, 3)
    assert worst_interval(np.array([5.0, 1.0, 1.0])) == (0, 0)
    assert worst_interval(np.array([2.0, 2.0, 2.0])) == (0, 2)


def test_the_worst_interval_does_not_reach_over_a_hole():
    """Blocks that begin each 1.28 s, with 10 s between the second and the third."""
    begin = np.array([0, 128, 1128, 1256, 1384, 1512, 1640])
    assert worst_interval(np.array([5.0, 4.9, 5.1, 1.0, 1.0, 1.0, 1.0]), begin) == (2, 2)
    assert worst_interval(np.array([5.0, 5.1, 4.9, 1.0, 1.0, 1.0, 1.0]), begin) == (0, 1)
    assert worst_interval(np.array([5.0, 5.1, 4.9, 1.0, 1.0, 1.0, 1.0]), 128 * np.arange(7)) == (0, 2)


def test_open_cell_has_flight_and_seconds_of_the_largest_gap():
    strength = np.where((np.arange(4000) >= 2000) & (np.arange(4000) < 2800), 3.0, 0.1)
    flights = [hover(0.1, name="calm.csv"), hover(strength, name="windy.csv")]
    (entry,) = unexplained(STUDY, flights, selection(), [cell("force_x", "ground", 9.0), CELL,
                                                         cell("force_x", "hover", 1.0, regime="low")])
    assert entry.flight == "windy.csv" and entry.channel == "force_x" and entry.phase == "hover"
    assert entry.from_s == pytest.approx(20.0, abs=LENGTH[AIR] / 100.0)
    assert entry.to_s == pytest.approx(28.0, abs=LENGTH[AIR] / 100.0)


def test_open_cell_has_seconds_of_its_own_phase():
    """The gap is strongest in cruise; an entry of the hover tells the worst of the hover, and what goes with it there.

    A phase that no flight has is not reported.
    """
    t = np.arange(4000) / 100.0
    strength = np.where(t >= 25.0, 9.0, np.where((t >= 8.0) & (t < 14.0), 3.0, 0.1))
    phase = np.where(t >= 25.0, KINDS.index("cruise"), KINDS.index("hover"))
    cells = [CELL, replace(CELL, phase="cruise"), replace(CELL, phase="landing")]
    hovering, cruising = unexplained(STUDY, [hover(strength, phase=phase)], selection(), cells)
    assert (hovering.from_s, hovering.to_s) == pytest.approx((8.0, 14.0), abs=LENGTH[AIR] / 100.0)
    assert hovering.over_floor < 0.5 * cruising.over_floor and cruising.from_s > 22.0


def test_a_phase_shorter_than_a_block_has_its_own_seconds_and_ratio():
    """A landing of 1 s that shakes at 4 Hz, with an rms of three floors, after a hover whose gap is far larger.

    One number of such a short phase says nothing of what it follows.
    """
    t = np.arange(4000) / 100.0
    landing = t >= 39.0
    force = noise(40.0, 9.0, 2) * ((t >= 8.0) & (t < 14.0))[:, None]
    force[landing, 0] = 3.0 * CELL.floor * np.sqrt(2.0) * np.cos(2.0 * np.pi * 4.0 * t[landing])
    phase = np.where(landing, KINDS.index("landing"), KINDS.index("hover"))
    shaken, calm = flight(40.0, force, phase=phase, name="shaken.csv"), flight(40.0, phase=phase, name="calm.csv")
    cells = [CELL, replace(CELL, phase="landing")]
    hovering, landed = unexplained(STUDY, [calm, shaken], selection(), cells)
    assert hovering.over_floor > 10.0 and hovering.to_s < 20.0
    assert (landed.flight, landed.from_s, landed.to_s) == ("shaken.csv", 39.0, 40.0)
    assert landed.over_floor == pytest.approx(3.0, rel=0.15) and landed.follows == ()


def test_lost_rows_do_not_count_in_a_phase_shorter_than_a_block():
    """The lines that stand for 0.2 s of lost rows differ from a flight at its floor by a hundred floors."""
    t = np.arange(4000) / 100.0
    lost = (t >= 39.4) & (t < 39.6)
    force = np.where(lost, 100.0, np.cos(2.0 * np.pi * 4.0 * t) * np.sqrt(2.0) * (t >= 39.0))[:, None] * CELL.floor
    phase = np.where(t >= 39.0, KINDS.index("landing"), KINDS.index("hover"))
    (landed,) = unexplained(STUDY, [flight(40.0, force, phase=phase, lost=lost)], selection(),
                            [replace(CELL, phase="landing")])
    assert 0.5 < landed.over_floor < 1.2


def test_at_most_five_cells_are_reported():
    cells = [cell("force_x", phase, 1.0, band_hz=band) for band in ((0.5, 2.0), (2.0, 6.0))
             for phase in ("hover", "cruise", "landing")]
    phase = np.repeat([KINDS.index(name) for name in ("hover", "cruise", "landing")], [1500, 1500, 1000])
    assert len(unexplained(STUDY, [hover(0.1, phase=phase)], selection(), cells)) == 5


STEADY = UnsteadinessRarity()


def selection(rarity=STEADY):
    """A selection without candidates."""
    return SimpleNamespace(last_step=None, single_effects={}, named_hypothesis=None, unsteadiness_rarity=rarity)


def test_an_unsteady_flight_has_the_seconds_and_the_channel_that_is_shaken():
    """White noise of one channel, four times as strong in 2 s of one flight: the other signal stays steady."""
    strength = np.where((np.arange(4000) >= 2000) & (np.arange(4000) < 2200), 4.0, 1.0)[:, None]
    shaken = noise(40.0, 0.1, 3) * np.where([False, True, False], strength, 1.0)
    flights = [flight(40.0, noise(40.0, 1.0, 5), noise(40.0, 0.1, 4), name="calm.csv"),
               flight(40.0, noise(40.0, 1.0, 6), shaken, name="shaken.csv")]
    scatter = Scatter({}, 8.0, (0.0, 0.0), {UNSTEADY_TORQUE: (-3.5, 0.2), UNSTEADY_LIFT: (-2.6, 0.2)})
    study = STUDY.with_scatter(scatter)
    rarity = unsteadiness_rarity(Data(study, flights))
    assert rarity.rarest == UNSTEADY_TORQUE and rarity.nats > rarity.limit
    (entry,) = unexplained(study, flights, selection(rarity), [])
    assert (entry.flight, entry.channel, entry.phase) == ("shaken.csv", "torque_y", "hover")
    assert entry.from_s == pytest.approx(20.0, abs=0.4) and entry.to_s == pytest.approx(22.0, abs=0.4)
    assert entry.floor == REST_OF_FLIGHT and entry.over_floor == pytest.approx(4.0, rel=0.25)
    assert unexplained(study, flights, selection(rarity._replace(nats=0.9 * rarity.limit)), []) == []
