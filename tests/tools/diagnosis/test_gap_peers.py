"""The counts of `gap_peers.py`, on synthetic answers."""

from scipy.stats import binomtest

from tools.diagnosis import gap_peers
from tools.diagnosis.gap_peers import Answer
from tools.diagnosis.recordings import peers


def test_flights_of_a_vehicle_are_held_against_its_own_two(tmp_path):
    lines = ("file,vehicle,effect", "cal_A_0.csv.gz,A,none", "p1.csv,A,latency", "p2.csv,B,mass")
    (tmp_path / "manifest.csv").write_text("\n".join(lines))
    rows = peers.labelled(tmp_path)
    assert [(r["file"], peers.truth(r)) for r in rows] == [("p1.csv", "sensor_latency"), ("p2.csv", "mass")]
    assert peers.vehicle_file(tmp_path, rows[1]) == tmp_path / "vehicle_b.toml"
    assert [path.name for path in peers.baseline(tmp_path, rows[1])] == ["cal_B_0.csv.gz", "cal_B_1.csv.gz"]


def test_names_of_one_thing_are_the_same_answer():
    """A heavier vehicle and less thrust are one thing in these logs; a weak rotor is another."""
    answer = Answer("mass", ("weak_motor", "thrust_coefficient"), None, None)
    assert not answer.within(1) and answer.within(2)
    assert Answer("mass", ("thrust_coefficient",), None, None).within(1)


def share(hits, n):
    ends = binomtest(hits, n).proportion_ci(method="wilson")
    return f"{hits} of {n} [{ends.low:.0%}, {ends.high:.0%}]"


def test_the_gap_closed_counts_where_the_first_answer_is_right():
    answers = [Answer("mass", ("mass",), 0.9, 0.05), Answer("mass", ("mass",), 0.7, None),
               Answer("mass", ("mass",), 0.95, 0.1), Answer("mass", ("gust", "mass"), 0.1, 0.9),
               Answer("mass", ("mass",), None, None)]
    first, last = gap_peers.summary(answers).splitlines()
    assert first == f"top-1 {share(4, 5)}; top-3 {share(5, 5)} (95 % intervals)"
    assert last == "shrink with the right effect: median 0.90, >= 0.80 in 2 of 3; with a wrong one at most 0.10"
    assert len(gap_peers.summary(answers[3:]).splitlines()) == 1
