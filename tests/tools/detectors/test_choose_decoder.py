"""The choice of the decoder's settings, on synthetic detections whose delays, misses and false edges are known."""

import sys
from pathlib import Path

import numpy as np
import pytest

from airtouch.detector import best
from airtouch.detector.best.recipe import ROW_STRIDE
from airtouch.detector.evaluation.data.dataset import Condition, FlightFile
from airtouch.detector.evaluation.score import TOLERANCE_S
from airtouch.detector.evaluation.summary import summarise
from airtouch.errors import AirTouchError
from airtouch.logs.edges import Edge
from airtouch.parameters import SAMPLE_PERIOD_S
from airtouch.reference.edge_decoder import DecoderConfig
from tools.detectors import choose_decoder as tool

STEPS = 1000
#: delays, s, and false edges in one flight of two edges
PROMPT, LATE, BLIND = (np.array([0.1, 0.1]), 0), (np.array([0.1, 0.5]), 0), (np.array([]), 3)


def flight(edges=(200, 600), fold=0, speed=0.3, minutes=0.5, name=None):
    """A flight with true edges at these samples."""
    file = FlightFile(Path(name or f"{fold}.csv"), Condition(speed_mps=speed))
    return tool.HeldOutFlight(file, fold, speed,
                              [Edge(sample, "entry", 0.0, 0.0) for sample in edges], np.ones(STEPS, bool),
                              np.zeros(STEPS), np.zeros((STEPS, 3)), np.ones(STEPS, bool), minutes)


@pytest.fixture
def detected_at(monkeypatch):
    """detected_at(samples): the decoder sees an edge at these samples, whatever its settings."""
    def at(*samples):
        edges = np.zeros(STEPS, np.uint8)
        edges[[s // ROW_STRIDE for s in samples]] = 1
        monkeypatch.setattr(tool.kernels, "edge_decoder", lambda *_: edges)
    return at


def test_delays_are_those_of_matched_edges_and_the_rest_is_false(detected_at):
    far = 600 + 2 * round(TOLERANCE_S / SAMPLE_PERIOD_S)
    detected_at(190, 220, far)  # the nearer one of two is the edge of sample 200, the other false
    ((delays, false),) = tool.outcomes([flight()], DecoderConfig())
    assert delays == pytest.approx([-0.1]) and false == 2


def test_figures_in_closed_form():
    """Errors of 0.1 and 0.3 s at 0.3 m/s and 0.2 s at 1 m/s after a lag of 0.2 s; one of four edges missed."""
    flights = [flight(), flight(speed=1.0, minutes=1.5)]
    outcomes = [(np.array([0.3, -0.1]), 1), (np.array([0.4]), 0)]
    figures = tool.figures(flights, outcomes, 0.2)
    assert figures == pytest.approx({"error_m": (0.03 + 0.09 + 0.2) / 3, "missed": 0.25, "false_per_minute": 0.5,
                                     "rms_s": np.sqrt((0.01 + 0.09 + 0.04) / 3)})
    assert tool.lag_of(outcomes) == pytest.approx(0.3) and tool.lag_of([BLIND]) == 0.0


def test_the_cost_is_in_metres():
    """Nothing found costs MISS_M and each false edge a minute FALSE_M; the same delay of all edges costs nothing."""
    assert tool.cost([flight()], [BLIND]) == pytest.approx(tool.MISS_M + tool.FALSE_M * 3 / 0.5)
    assert tool.cost([flight()], [PROMPT]) == pytest.approx(0.0)
    assert tool.cost([flight()], [LATE]) == pytest.approx(0.3 * 0.2)  # 0.2 s each beside their median of 0.3 s


def test_a_fold_is_scored_with_settings_that_its_own_flights_did_not_choose():
    """Settings 0 are right on fold 0 alone and settings 1 on fold 1 alone: each fold gets the other's."""
    flights = [flight(fold=0), flight(fold=1)]
    results = [[PROMPT, BLIND], [BLIND, LATE]]
    assert tool.choices(flights, results) == {0: (1, pytest.approx(0.3)), 1: (0, pytest.approx(0.1))}
    assert tool.cheapest(flights, [*results, [PROMPT, PROMPT]]) == 2


def test_a_flight_of_several_folders_counts_once_with_the_settings_of_its_fold(detected_at):
    """Three folders are not three times the flights: as many edges, and an interval as wide as that of the flights."""
    detected_at(210, 610)
    once = [flight(fold=0), flight(fold=1)]
    settings = tool.candidates(2, np.random.default_rng(0), 5)
    scores, by_fold = tool.nested(once * 3, settings, [[PROMPT, BLIND] * 3, [BLIND, LATE] * 3])
    assert [score.flight for score in scores] == ["0.csv", "1.csv"]
    assert [len(score.edges) for score in scores] == [6, 6]
    assert by_fold["0"]["lag_s"] == pytest.approx(0.3) and by_fold["1"]["lag_s"] == pytest.approx(0.1)
    assert by_fold["0"]["entry_score"] == settings[1].entry_score
    alone = tool.nested(once, settings, [[PROMPT, BLIND], [BLIND, LATE]])[0]
    ours, theirs = (summarise(some)["intervals"]["mean_abs_error_s"] for some in (scores, alone))
    assert ours == pytest.approx(theirs) and ours[1] > ours[0]


def test_a_flight_does_not_choose_its_own_settings_by_another_folders_fold():
    with pytest.raises(AirTouchError, match="a.csv: in fold 0 of one folder and in 0126 of another"):
        tool.choices([flight(fold=0, name="a.csv"), flight(fold="0126", name="a.csv")], [[PROMPT, PROMPT]])


def test_settings_are_drawn_from_their_ranges_and_hold_as_told():
    settings = tool.candidates(200, np.random.default_rng(1), 7)
    assert len(set(settings)) == 200 and {s.hold_steps for s in settings} == {7}
    late = np.array([(s.late_entry, s.late_exit) for s in settings])
    assert -0.5 <= late[:, 0].min() < 0.0 < 4.0 < late[:, 0].max() <= 4.5
    assert -4.5 <= late[:, 1].min() < -4.0 and -0.5 < late[:, 1].max() <= 0.0


def test_a_file_of_figures_is_replaced_with_force_alone(tmp_path, monkeypatch):
    figures = tmp_path / "all.json"
    figures.write_text("{}")
    monkeypatch.setattr(tool, "need_flights", lambda: tmp_path)
    for more, refusal in (([], "--force"), (["--force"], "no models of `best`")):
        monkeypatch.setattr(sys, "argv", ["choose_decoder.py", str(tmp_path), "--json", str(figures), *more])
        with pytest.raises(AirTouchError, match=refusal):
            tool.main()


@pytest.mark.parametrize("silent", [(), ("rates",), ("motors",)])
def test_as_shipped_is_what_the_shipped_model_decodes_such_a_log_with(silent):
    model = best.load(None).serving(silent)
    assert tool.shipped(silent) == ("as shipped", model.decoder_without(silent))


def test_without_acceleration_another_model_ships():
    model = best.load(None).serving(("acceleration",))
    title, config = tool.shipped(("acceleration",))
    assert config != model.decoder_without(("acceleration",)) and "another model ships" in title
