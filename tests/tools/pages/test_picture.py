"""The picture of a held-out flight: edges where they were, and refusals with a remedy."""

import sys
from importlib import import_module
from types import SimpleNamespace

import numpy as np
import pytest

from airtouch import logs
from airtouch.detector.trace import Detection, Trace
from airtouch.errors import AirTouchError
from made_flight import made_flight

pytest.importorskip("matplotlib")
picture = import_module("tools.pages.picture")
LAG_S = 0.5  #: of the stand-in of the detector
TRUE = (1200, 1700)  #: samples of the flight's edges


@pytest.fixture
def axes(monkeypatch):
    """The three panes of the picture of a flight whose edges are detected LAG_S late."""
    edges = [Detection(TRUE[0] + 50, "entry"), Detection(TRUE[1] + 50, "exit")]
    monkeypatch.setattr(picture.best, "run", lambda log, model: Trace(np.zeros(len(log)), edges))
    monkeypatch.setattr(picture.best, "lag_s", lambda model: LAG_S)
    log = made_flight()
    assert [abs(e.sample - true) < 5 for e, true in zip(logs.true_edges(log), TRUE, strict=True)] == [True, True]
    return picture.draw(log, SimpleNamespace(), "made.csv").axes


def test_detected_edges_stand_where_the_true_ones_are_without_the_lag(axes):
    markers = {line.get_marker(): line.get_xdata()[0] for line in axes[1].lines if line.get_marker() in "v^"}
    assert markers == pytest.approx({"v": TRUE[0] / 100, "^": TRUE[1] / 100})
    for pane in axes:
        dashed = [line.get_xdata()[0] for line in pane.lines if line.get_linestyle() == "--"]
        assert dashed == pytest.approx([t / 100 for t in TRUE], abs=0.05)


def test_the_picture_begins_before_the_first_edge_and_shows_the_down_range(axes):
    first, last = axes[2].get_xlim()
    assert first == pytest.approx(TRUE[0] / 100 - picture.MARGIN_S[0], abs=0.05)
    assert last == pytest.approx(TRUE[1] / 100 + picture.MARGIN_S[1], abs=0.05)
    np.testing.assert_allclose(axes[2].lines[0].get_ydata(), made_flight()["zrange_m"])


@pytest.mark.parametrize(("arguments", "message"), [
    (["--flight", "other.csv"], "no other.csv: give another one with --flight"),
    (["--models", "none", "--json", "none.json"], "airtouch crossval --out none --json none.json")])
def test_what_is_not_there_is_named_with_what_makes_it(arguments, message, tmp_path, monkeypatch):
    (tmp_path / "manifest.csv").write_text("file,use,fold\na.csv,clean,0\n")
    (tmp_path / "a.csv").touch()
    monkeypatch.setenv("AIRTOUCH_FLIGHTS", str(tmp_path))
    monkeypatch.setattr(sys, "argv", ["picture.py", *(["--flight", "a.csv"] if "--models" in arguments else []),
                                      *arguments])
    with pytest.raises(AirTouchError, match=message):
        picture.main()
