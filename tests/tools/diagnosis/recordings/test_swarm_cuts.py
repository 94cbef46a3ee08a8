"""Cuts of flights in which several vehicles fly at once, on a synthetic data set of two flights."""

import itertools

import pytest

from tools.diagnosis.recordings import swarm_cuts

HEADER = "file,flight,cf,start_s,stop_s\n"
#: a cut of vehicle 50 in flight 01, one of 51 that begins 3 s later, one of 51 after both have ended, and flight 02
LABELLED = """a.csv,day19/cf50_01,50,10.0,20.0
b.csv,day19/cf51_01,51,13.0,25.0
c.csv,day19/cf51_02,51,10.0,20.0
"""
NOMINAL = """d.csv,day19/cf51_01,51,25.0,40.0
e.csv,day20/cf51_01,51,10.0,20.0
f.csv,day19/cf50_01,50,20.0,30.0
"""


@pytest.fixture
def rows(tmp_path):
    (tmp_path / "manifest.csv").write_text(HEADER + LABELLED)
    (tmp_path / "baselines.csv").write_text(HEADER + NOMINAL)
    return {row["file"][0]: row for row in swarm_cuts.cuts(tmp_path)}


def pairs(rows, holds):
    return {a + b for a, b in itertools.permutations(rows, 2) if holds(rows[a], rows[b])}


def test_labelled_cuts_come_first_and_each_has_its_flight(rows):
    assert list(rows) == list("abcdef")
    assert [swarm_cuts.flight_of(r) for r in rows.values()] == [
        ("day19", "01"), ("day19", "01"), ("day19", "02"), ("day19", "01"), ("day20", "01"), ("day19", "01")]


def test_partners_are_other_vehicles_of_the_same_flight_of_the_same_day(rows):
    assert pairs(rows, swarm_cuts.partners) == {"ab", "ba", "ad", "da", "bf", "fb", "df", "fd"}


def test_the_clock_of_a_flight_is_that_of_all_its_vehicles(rows):
    assert swarm_cuts.delay_s(rows["a"], rows["b"]) == 3.0 == -swarm_cuts.delay_s(rows["b"], rows["a"])


def test_cuts_that_touch_have_no_time_in_common(rows):
    of_flight = {k: rows[k] for k in "abdf"}  # 10-20, 13-25, 25-40 and 20-30 s
    assert pairs(of_flight, swarm_cuts.overlap) == {"ab", "ba", "bf", "fb", "df", "fd"}
