"""The comparisons of `bench.py`: which medians it reports, and that two that differ are not compared."""

import sys

import pytest

from airtouch.errors import AirTouchError
from made_flight import made_flight
from tools import bench


def test_the_ratio_is_the_median_of_the_pairs_ratios(monkeypatch):
    """Pairs of 1 and 2, 4 and 4, 2 and 10 s: the medians are 2 and 4, of the ratios 2, 1 and 5 the median is 2."""
    times = {"ours": iter([1.0, 4.0, 2.0]), "peer": iter([2.0, 4.0, 10.0])}
    calls = []
    monkeypatch.setattr(bench, "PAIRS", 3)
    monkeypatch.setattr(bench, "seconds", lambda work: (work(), next(times[calls[-1]]))[1])
    assert bench.compare(lambda: calls.append("ours"), lambda: calls.append("peer")) == (2.0, 4.0, 2.0)
    assert calls == ["ours", "peer"] * 4  # a warm-up, then in turn


def test_a_peer_that_computes_something_else_is_refused(monkeypatch):
    monkeypatch.setattr(bench, "PAIRS", 1)
    table = bench.Table(*("what", "ours", "peer", "faster", "peer is", ""))
    bench.bench_band_power(table, [made_flight(n=300)])
    assert table.row_count == 1
    right = bench.scipy_band_power
    monkeypatch.setattr(bench, "scipy_band_power", lambda x: 1.01 * right(x))
    with pytest.raises(AirTouchError, match="is not SciPy's"):
        bench.bench_band_power(table, [made_flight(n=300)])


def test_a_peer_that_is_not_installed_is_named_before_anything_is_timed(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["bench.py"])
    monkeypatch.setattr(bench, "find_spec", lambda name: None)
    monkeypatch.setattr(bench, "load_flights", lambda limit: pytest.fail("flights were read"))
    with pytest.raises(SystemExit) as stop:
        bench.main()
    assert stop.value.code == 2
    assert "tflite-micro is not installed: pip install '.[test]'" in capsys.readouterr().err


def test_a_peers_time_is_that_of_one_window(monkeypatch):
    """Ours computes 20 steps in 1 s, the peer's 4 windows take 2 s: 50 ms against 500 ms, ten times faster."""
    monkeypatch.setattr(bench, "compare", lambda ours, peer: (1.0, 2.0, 2.0))
    monkeypatch.setattr(bench, "micro", lambda content: lambda x: None)
    monkeypatch.setattr(bench, "litert", lambda content: None)
    table = bench.Table(*("what", "ours", "peer", "faster", "peer is", ""))
    bench.row_of_peers(table, "a step", lambda: None, b"", bench.np.zeros((4, 1)), 20)
    assert [list(column.cells)[0] for column in table.columns] == \
        ["a step", "50000.0 us", "500000.0 us", "10x", "tflite-micro", "n = 20 and 4"]
