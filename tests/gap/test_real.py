"""The diagnosis on a few recorded flights of each kind, and that the check of them can fail."""

import gap_real


def test_a_few_recorded_flights_of_each_kind(flights, capsys):
    assert gap_real.main([str(flights), "--quick", "--jobs", "1"]) == 0
    table = capsys.readouterr().out
    assert all(row in table for row in ("swarm, ns", "crazypad", "peers"))


def test_a_diagnosis_that_always_says_none_is_noticed(flights, monkeypatch, capsys):
    def blind(case):
        return {"row": case.row, "truth": case.truth, "condition": case.condition, "flight": case.flight.split("/")[-1],
                "effects": [], "verdict": "none"}

    monkeypatch.setattr(gap_real, "answered", blind)
    monkeypatch.setattr(gap_real, "ProcessPoolExecutor", Alone)
    assert gap_real.main([str(flights), "--quick"]) == 1
    assert "wrong, more than" in capsys.readouterr().err


class Alone:
    """A pool of this process alone."""

    def __init__(self, _jobs):
        self.map = map

    def __enter__(self):
        return self

    def __exit__(self, *_):
        return None
