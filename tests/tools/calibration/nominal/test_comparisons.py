"""Which nominal flights are compared with which, and what is done anew, on stand-ins for the flights."""

from contextlib import nullcontext
from types import SimpleNamespace

import numpy as np
import pytest

from airtouch.gap.signatures.scatter import ApparentStrengths, Scatter
from airtouch.simulation import effects
from tools.calibration.nominal import comparisons, scatter_table
from tools.calibration.nominal.groups import Group


def group(name, drone, count):
    """A group of flights that are their names."""
    names = [f"{name}{i}" for i in range(count)]
    return Group("class", drone, name, SimpleNamespace(name="it"), [(n, lambda n=n: n) for n in names])


@pytest.fixture
def compared(monkeypatch):
    """(flight, its baseline) of each comparison, in order; nothing is measured."""
    pairs = []
    monkeypatch.setattr(comparisons, "ready", lambda log, vehicle: log)
    monkeypatch.setattr(comparisons.calibrate, "calibrated", lambda vehicle, base, scatter: (base, None))
    monkeypatch.setattr(comparisons, "Data", lambda base, flights: pairs.append((flights[0], base)))
    return pairs


def test_groups_are_held_against_the_other_groups_of_their_drone_where_these_have_two_flights():
    many, few, other = group("a", "one", 4), group("b", "one", 1), group("c", "two", 4)
    tasks = {(t.group.name, t.note): t.others and [name for name, _ in t.others]
             for t in comparisons.tasks_of([many, few, other])}
    assert tasks == {("a", ""): None, ("b", ""): None, ("c", ""): None,
                     ("b", ", other groups"): ["a0", "a1", "a2", "a3"]}


def test_no_flight_is_in_its_own_baseline_and_that_has_five_at_most(compared):
    names = [name for name, _ in comparisons.held_out(group("a", "one", 9).logs, None, look=lambda data: None)]
    assert names == [f"a{i}" for i in range(9)] == [flight for flight, _ in compared]
    assert all(flight not in base and len(base) == 5 for flight, base in compared)


def test_flights_of_other_groups_have_one_baseline(compared):
    list(comparisons.held_out(group("a", "one", 3).logs, None, group("b", "one", 20).logs, look=lambda data: None))
    assert len(compared) == 3 and len({tuple(base) for _, base in compared}) == 1
    assert {name[0] for name in compared[0][1]} == {"b"} and len(compared[0][1]) == 5


def test_what_the_file_holds_is_not_compared_again(tmp_path, monkeypatch, capsys):
    done = []

    def rows_of(task):
        done.append(task.group.name + task.note)
        return [{"file": name + task.note} for name, _ in task.group.logs]

    monkeypatch.setattr(comparisons, "_rows_of", rows_of)
    monkeypatch.setattr(comparisons, "ProcessPoolExecutor", lambda *_: nullcontext(SimpleNamespace(map=map)))
    groups, keep = [group("a", "one", 4), group("b", "one", 3)], tmp_path / "kept.jsonl"
    tasks = comparisons.tasks_of(groups)
    first = comparisons.compare_all(tasks, keep, 1)
    assert len(first) == 14 and done == ["a", "a, other groups", "b", "b, other groups"]
    assert [line.split(":")[0] for line in capsys.readouterr().err.splitlines()] == [f"{i} of 4" for i in (1, 2, 3, 4)]
    keep.write_text("\n".join(line for line in keep.read_text().splitlines() if '"b1, ' not in line) + "\n")
    assert comparisons.compare_all(tasks, keep, 1) == first and done[4:] == ["b, other groups"]
    assert capsys.readouterr().err.startswith("1 of 1: ")


def test_rates_are_of_the_own_group_alone_and_both_comparisons_are_counted(monkeypatch):
    summed = []
    monkeypatch.setattr(scatter_table, "class_scatter",
                        lambda flights, alike: summed.append((flights, alike)) or Scatter({}, 1.0, (0.0, 0.0)))
    one = group("a", "one", 2)
    rows = {name + note: {"strengths": {}, "errors": {}, "rate": rate, "passing": {}}
            for name, _ in one.logs for note, rate in (("", 1.0), (", other groups", 2.0))}
    classes, counts = scatter_table.scatter_of_classes([one], rows)
    (flights, alike), = summed
    assert sorted(f.rate for f in flights) == [1.0, 1.0, 2.0, 2.0] and [f.rate for f in alike] == [1.0, 1.0]
    assert counts == {"class": "2 flights, 4 comparisons in 1 groups"} and classes["class"].vehicle == "it"
    assert all(isinstance(f, ApparentStrengths) for f in flights)


def test_passing_effects_are_those_of_each_flight_against_the_others_of_its_group(compared, monkeypatch, tmp_path):
    monkeypatch.setattr(comparisons, "ProcessPoolExecutor", lambda *_: nullcontext(SimpleNamespace(map=map)))
    monkeypatch.setattr(comparisons, "passing_sizes", lambda data: {"gust": float(len(compared))})
    tasks = [comparisons.Task(group("a", "one", 3), passing=True), comparisons.Task(group("b", "one", 2), passing=True)]
    for _ in range(2):  # the second run takes what the first kept
        rows = comparisons.compare_all(tasks, tmp_path / "kept.jsonl", 1)
        assert list(rows) == [f"{name}, passing effects" for name in ("a0", "a1", "a2", "b0", "b1")]
        assert [row["passing"]["gust"] for row in rows.values()] == [1.0, 2.0, 3.0, 4.0, 5.0]
    assert compared == [("a0", ["a1", "a2"]), ("a1", ["a0", "a2"]), ("a2", ["a0", "a1"]),
                        ("b0", ["b1"]), ("b1", ["b0"])]


def test_some_effects_alone_are_measured_anew_and_the_rest_of_the_table_stays(compared, monkeypatch):
    """Every effect but these is left out of each comparison, in both kinds of which they are looked for."""
    looked = []
    monkeypatch.setattr(comparisons, "apparent_strengths", lambda data, without: looked.append(without) or
                        ApparentStrengths({"mass": np.array([len(looked)])}, {"mass": np.zeros(1)}, 0.0))
    one, other = group("a", "one", 2), group("b", "one", 2)
    tasks = comparisons.tasks_of([one, other], ("mass",))
    rows = {row["file"]: row for task in tasks for row in comparisons._rows_of(task)}
    assert set(rows) == {f"{name}{note}" for name in ("a0", "a1", "b0", "b1")
                         for note in (", mass", ", other groups, mass")}
    assert all(set(without) == set(effects.NAMES) - {"mass"} for without in looked) and len(looked) == 8
    measured, _ = scatter_table.scatter_of_classes([one, other], rows, ("mass",))
    monkeypatch.setattr(scatter_table, "table", lambda: {"class": Scatter(
        {"mass": np.ones(1), "wind": np.full(3, 2.0)}, 5.0, (0.1, 0.2), {"gust": (0.0, 1.0)})})
    anew = scatter_table.with_effects(measured)["class"]
    np.testing.assert_allclose(anew.rms["mass"], np.sqrt(np.mean(np.arange(1.0, 9.0) ** 2)), rtol=0.05)  # on a grid
    assert anew.rms["wind"].tolist() == [2.0] * 3 and (anew.freedom, anew.rate) == (5.0, (0.1, 0.2))
    assert anew.passing == {"gust": (0.0, 1.0)}
