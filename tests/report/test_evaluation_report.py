"""The report: self-contained, well formed, with the figures of the summary in it."""

import re
from dataclasses import replace

import numpy as np
import pytest

from airtouch.detector.evaluation.data.dataset import Condition
from airtouch.detector.evaluation.evaluate import Result
from airtouch.detector.evaluation.score import score_flight
from airtouch.detector.evaluation.score_report import (
    Reliability,
    ShownFlight,
    hit_curve,
    reliability_of,
    score_report,
    shown_flights,
)
from airtouch.detector.evaluation.summary import summarise
from airtouch.detector.trace import Detection, Trace
from airtouch.errors import AirTouchError
from airtouch.logs import Edge
from airtouch.logs.flight_log import FlightLog
from airtouch.report import evaluation_figures as figures
from airtouch.report.columns import COLUMNS, cell
from airtouch.report.evaluation_report import answer, in_words, write_report
from html_page import PageReader

N = 600
EDGES = [Edge(200, "entry", 0.8, 0.05), Edge(400, "exit", 0.05, 0.8)]


DETECTIONS = (Detection(210, "entry", 0.9), Detection(50, "exit", 0.8))


def flight_shown(name="a<b>.csv", detections=DETECTIONS):
    rng = np.random.default_rng(0)
    log = FlightLog({"zrange_m": np.full(N, 0.8)}, {"source": name})
    signals = {"channels": rng.normal(size=(N, 9)), "band_power": rng.exponential(size=(N, 9)),
               "force": rng.normal(size=(N, 3)), "cfar_power": rng.exponential(size=N),
               "threshold": np.r_[np.full(65, np.nan), np.full(N - 65, 3.0)], "alert": np.arange(N) == 300}
    signals["band_power"][:200] = np.nan
    trace = Trace(np.r_[np.full(300, np.nan), rng.uniform(size=N - 300)], list(detections), signals)
    condition = Condition(height="low", angle_deg=0.0, wind="none", speed_mps=0.2)
    score = score_flight(name, condition, EDGES, np.ones(N, bool), trace)
    return ShownFlight(log, trace, EDGES, score, {"baseline": Trace(np.full(N, np.nan), [Detection(90, "edge")])})


def test_report_is_one_file_with_the_figures(tmp_path):
    flight = flight_shown()
    path = tmp_path / "report.html"
    scores = {"paper": [flight.score, flight.score], "baseline": []}
    write_report(path, "A & B", score_report(scores, [flight]), parameters={"p_fa": 1e-6}, command="airtouch demo",
                 left_out=[("x.csv", "x.csv: the file is empty")])
    text = path.read_text()
    page = PageReader()
    page.feed(text)
    assert not page.open and page.loaded and all(v.startswith("data:image/png;base64,") for v in page.loaded)
    assert "http" not in re.sub(r"base64,[^\"]*", "", text)
    assert "A &amp; B" in text and "a&lt;b&gt;.csv" in text and "<b>.csv" not in text
    table = summarise(scores["paper"])
    for key, form in COLUMNS.values():
        assert cell(table, key, form).value in text
    assert "x.csv: the file is empty" in text and "viewport" in text
    with pytest.raises(AirTouchError, match="--force"):
        write_report(path, "again", score_report(scores), parameters={}, command="x")


def test_the_sentence_above_a_plot_names_its_detector_and_the_plots_say_that_they_show_its_lag(tmp_path):
    """As the errors are without it, a marker lies later than the sentence says."""
    flight = flight_shown()
    for name, shown in (("with", [flight]), ("without", [])):
        write_report(tmp_path / name, "x", score_report({"paper": [flight.score], "baseline": []}, shown),
                     parameters={}, command="x")
    text = (tmp_path / "with").read_text()
    assert f"<p>paper: {in_words(flight.score)}</p>" in text
    assert text.index("Flight a&lt;b&gt;.csv") > text.index("shows an edge when it was reported")
    assert "shows an edge when it was reported" not in (tmp_path / "without").read_text()


def test_words_say_misses_and_false_edges():
    flight = flight_shown()
    assert in_words(flight.score) == ("entry at 2.00 s detected 0.10 s late (0.020 m); exit at 4.00 s missed; "
                                      "1 false edges.")
    sentence = answer("paper", summarise([flight.score]))
    assert "1 missed (50%)" in sentence and "1 false (10.0 a minute)" in sentence and "0.020 m" in sentence


def test_plots_are_made_of_whatever_is_there():
    flight = flight_shown()
    no_trace = Trace(np.full(N, np.nan), [])
    for figure in (figures.flight(flight.log, no_trace), figures.reliability({"none": reliability_of([])}),
                   figures.reliability({"paper": reliability_of([flight.score])}),
                   figures.error_distribution({"paper": hit_curve([flight.score])})):
        figure.draw_without_rendering()
        assert all(ax.get_ylabel() for ax in figure.axes) and figure.axes[-1].get_xlabel()


def test_each_detector_has_a_curve_of_its_edges_and_one_of_its_probability():
    """Of one edge in two hit, and of none; probabilities of which as many are right as stated lie on the diagonal."""
    hits = {name: hit_curve([flight_shown(detections=d).score]) for name, d in (("best", DETECTIONS), ("paper", ()))}
    (ax,) = figures.error_distribution(hits).axes
    assert [line.get_ydata().max() for line in ax.get_lines()] == [0.5, 0.0]
    assert [t.get_text() for t in ax.get_legend().get_texts()] == ["best, 2 edges", "paper, 2 edges"]
    assert ax.get_xlabel() == "distance error, m"
    right = Reliability(np.array([0.25, 0.75]), np.array([0.25, 0.75]), np.array([0.5, 0.5]), 0.0)
    (ax,) = figures.reliability({"best": right, "paper": right}).axes
    diagonal, *curves = ax.get_lines()
    assert len(curves) == len(ax.collections) == 2
    for curve in (diagonal, *curves):
        np.testing.assert_allclose(curve.get_xdata(), curve.get_ydata())
    assert [t.get_text() for t in ax.get_legend().get_texts()] == ["perfect", "best, ECE 0.000", "paper, ECE 0.000"]


def figure_of_flight(edges):
    """The plot of a flight with these true edges."""
    flight = flight_shown()
    return figures.flight(flight.log, flight.trace, edges)


@pytest.mark.parametrize(("edges", "explained"), [(EDGES, True), (None, False), ([], False)])
def test_true_edges_are_explained_where_they_are_drawn(edges, explained):
    *_, lowest = (ax for ax in figure_of_flight(edges).axes if ax.get_xlabel())
    assert lowest.get_xlabel().startswith("time, s") and ("dashed green" in lowest.get_xlabel()) is explained


def test_band_power_has_a_scale_beside_it_and_all_panes_keep_one_time_axis():
    figure = figure_of_flight(EDGES)
    figure.draw_without_rendering()
    (scale,) = (ax for ax in figure.axes if "dB" in ax.get_ylabel())
    (powers,) = (ax for ax in figure.axes if ax.images)
    panes = [ax for ax in figure.axes if ax is not scale]
    assert scale.get_ylim() == powers.images[0].get_clim()
    assert scale.get_position().y0 == pytest.approx(powers.get_position().y0, abs=0.01)
    assert np.ptp([[ax.get_position().x0, ax.get_position().x1] for ax in panes], axis=0).max() < 1e-6


def test_curves_are_those_of_the_edges_and_samples():
    both_hit, none_hit = flight_shown().score, flight_shown(detections=()).score
    hits = hit_curve([both_hit, none_hit])
    np.testing.assert_allclose(hits.distance_m, [0.0, 0.02, 1.0])  # 0.1 s at 0.2 m/s
    assert hits.edges == 4 and hits.share.tolist() == [0.0, 0.25, 0.25]  # one of four
    curve = reliability_of([both_hit])
    assert curve.samples.sum() == pytest.approx(1.0)
    assert np.sum(curve.samples * np.abs(curve.stated - curve.truly)) == pytest.approx(curve.ece)


def test_flights_are_shown_from_the_best_found_to_the_worst():
    results = {"best": [result(f"{n}.csv", detections) for n, detections in
                        (("false", DETECTIONS), ("good", (Detection(210, "entry"), Detection(400, "exit"))),
                         ("blind", ()))],
               "paper": [result("good.csv", ())]}
    chosen = shown_flights(results, 3)
    assert [f.score.file for f in chosen] == ["good.csv", "false.csv", "blind.csv"]
    assert [set(f.others) for f in chosen] == [{"paper"}, set(), set()]
    assert [f.score.file for f in shown_flights(results, 2)] == ["good.csv", "blind.csv"]
    assert [f.score.file for f in shown_flights(results, 6)] == ["good.csv", "false.csv", "blind.csv"]


def test_flights_of_one_name_in_two_folders_have_their_own_traces():
    own = {name: [replace(r, score=replace(r.score, path=f"{folder}/f.csv"))
                  for folder, r in (("a", result("f.csv", DETECTIONS)), ("b", result("f.csv", ())))]
           for name in ("best", "paper")}
    shown = {f.score.path: len(f.others["paper"].edges) for f in shown_flights(own, 2)}
    assert shown == {"a/f.csv": len(DETECTIONS), "b/f.csv": 0}


def result(name, detections):
    flight = flight_shown(name, detections)
    return Result(flight.log, flight.trace, flight.score)


def test_an_axis_holds_the_middle_99_percent_of_each_of_its_curves():
    """The second of three curves alone is off by 5 in 1 % of the flight: a third of that of all values together."""
    flight = flight_shown()
    channels = np.zeros((N, 9))
    channels[:6, 4] = np.deg2rad(5.0)
    trace = Trace(flight.trace.probability, [], {"channels": channels})
    rates = figures.flight(flight.log, trace).axes[1]
    assert rates.get_ylabel().startswith("rates") and rates.get_ylim()[1] > 5.0
