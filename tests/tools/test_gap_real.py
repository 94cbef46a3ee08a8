"""The diagnosis on a few recorded flights of each kind, and that the check of them can fail."""

import json
import re
from dataclasses import replace

import pytest

from airtouch.errors import AirTouchError
from tools import gap_real
from tools.diagnosis.recordings import cases


def test_a_few_recorded_flights_of_each_kind(flights, capsys):
    assert gap_real.main([str(flights), "--quick", "--jobs", "1"]) == 0
    table = capsys.readouterr().out
    assert all(row in table for row in ("swarm, ns", "crazypad", "peers"))


@pytest.fixture
def diagnosed(monkeypatch):
    """The cases that are diagnosed, in this process, each with the verdict `cases.verdict`: none."""
    class Cases(list):
        verdict = "none"

    out = Cases()

    def diagnose_case(case):
        out.append(case)
        return {**gap_real.identity(case), "truth": case.truth, "condition": case.condition, "effects": [],
                "verdict": out.verdict}

    monkeypatch.setattr(gap_real, "diagnose_case", diagnose_case)
    monkeypatch.setattr(gap_real, "ProcessPoolExecutor", Alone)
    return out


def test_a_diagnosis_that_always_says_none_is_noticed(flights, diagnosed, capsys):
    assert gap_real.main([str(flights), "--quick"]) == 1
    assert "wrong, more than" in capsys.readouterr().err and diagnosed


def test_a_kept_result_is_that_of_the_same_baseline_partners_and_candidates(tmp_path, diagnosed):
    whole = cases.Case("swarm", "none", "v", "a.csv", ("b.csv", "c.csv", "d.csv"))
    asked = [whole, replace(whole, baseline=whole.baseline[:2]), replace(whole, baseline=("b.csv", "c.csv", "f.csv")),
             replace(whole, partner=(("e.csv", 0.0),)),
             replace(whole, left_out=("mass",))]
    for case in asked:
        for _ in range(2):
            (result,) = gap_real.diagnose_cases([case], tmp_path / "results.jsonl", 1)
            assert (result["baseline"], result["partner"]) == (len(case.baseline), len(case.partner))
            assert tuple(result["left_out"]) == case.left_out
    assert diagnosed == asked, "each once"


def test_a_result_of_another_version_of_the_code_is_none(tmp_path, diagnosed, monkeypatch):
    case, store = cases.Case("swarm", "none", "v", "a.csv", ()), tmp_path / "results.jsonl"
    for code in (b"one", b"another", b"one"):
        monkeypatch.setattr(gap_real, "code_digest", lambda code=code: code)
        gap_real.diagnose_cases([case], store, 1)
    assert len(diagnosed) == 2


def test_quick_needs_a_flight_of_each_of_its_kinds():
    of_each_kind = [cases.Case(row, truth, "v", f"{i}.csv", ()) for (row, truth), n in gap_real.QUICK.items()
                    for i in range(n)]
    assert len(gap_real.quick(of_each_kind)) == sum(gap_real.QUICK.values())
    with pytest.raises(AirTouchError, match="swarm: 0 flights of ground_effect"):
        gap_real.quick(of_each_kind[1:])


def test_a_refusal_is_not_kept_and_one_that_was_kept_is_no_result(tmp_path, diagnosed):
    case, store = cases.Case("swarm", "none", "v", "a.csv", ()), tmp_path / "results.jsonl"
    diagnosed.verdict = "refused"
    (refused,) = gap_real.diagnose_cases([case], store, 1)
    assert refused["verdict"] == "refused" and not store.exists()
    store.write_text(json.dumps(refused) + "\n")
    diagnosed.verdict = "none"
    for _ in range(2):
        (result,) = gap_real.diagnose_cases([case], store, 1)
        assert result["verdict"] == "none"
    assert diagnosed == [case] * 2


def test_no_flight_is_refused(flights, diagnosed):
    with pytest.raises(AirTouchError, match="no flight of peers in the part build"):
        gap_real.main([str(flights), "--rows", "peers", "--part", "build"])
    assert not diagnosed


def test_each_flight_is_diagnosed_against_so_many_baseline_flights_at_most(flights, diagnosed):
    assert gap_real.main([str(flights), "--rows", "nominal", "--most-baseline", "3"]) == 0
    whole = {c.flight: c.baseline for c in cases.nominal(flights, "build")}
    assert {c.flight: c.baseline for c in diagnosed} == {flight: baseline[:3] for flight, baseline in whole.items()}
    with pytest.raises(SystemExit):
        gap_real.main([str(flights), "--most-baseline", "-1"])


def test_effects_are_left_out_of_the_flights_that_have_them(flights, diagnosed, capsys):
    assert gap_real.main([str(flights), "--rows", "swarm", "authors", "--leave-out"]) == 0
    swarm = {c.flight: c.truth for c in cases.swarm(flights, "build") if c.truth != "none"}
    assert {c.flight: c.left_out for c in diagnosed} == {flight: (truth,) for flight, truth in swarm.items()}
    assert {c.truth for c in diagnosed} == {"unknown"}
    assert "without downwash | unknown | 0 of" in capsys.readouterr().out


def test_recorded_flights_are_held_against_another_day_of_the_same_drone(flights, diagnosed):
    assert gap_real.main([str(flights), "--rows", "swarm", "nominal", "--other-day"]) == 0
    swarm = [c for c in diagnosed if "neuralswarm" in c.flight]
    assert len(swarm) >= 40 and len(diagnosed) > len(swarm)
    for case in swarm:
        drone, day = re.search(r"_(cf\d+)d(\d\d)_", case.flight).groups()
        held_against = {re.search(r"_(cf\d+)d(\d\d)_", file).groups() for file in case.baseline}
        assert held_against == {(drone, {"19": "20", "20": "19"}[day])}
    with pytest.raises(AirTouchError, match="no flight of swarm in the part view was flown on two days"):
        gap_real.main([str(flights), "--rows", "swarm", "--part", "view", "--other-day"])


def test_nominal_flights_are_held_against_others_of_their_group(flights):
    build, view = (list(cases.nominal(flights, part)) for part in ("build", "view"))
    assert len(build) >= 60 and len(view) >= 30
    assert not {c.flight for c in build} & {c.flight for c in view}
    for case in build + view:
        assert case.truth == "none" and case.flight not in case.baseline
        assert 2 <= len(case.baseline) <= cases.OTHERS
    days = {day for c in build if "neuralswarm" in c.flight for day in re.findall(r"_cf\d+d(\d\d)_", c.flight)}
    assert days == {"19", "20"}


class Alone:
    """A pool of this process alone."""

    def __init__(self, _jobs, _context):
        self.map = map

    def __enter__(self):
        return self

    def __exit__(self, *_):
        return None
