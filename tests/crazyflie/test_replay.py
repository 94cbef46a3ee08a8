"""The stepwise detector and `evaluate` say the same of a flight, whatever the pieces."""

import threading

import numpy as np
import pytest
from click.testing import CliRunner

from airtouch import logs
from airtouch.cli import airtouch
from airtouch.crazyflie import replay
from airtouch.crazyflie.view.board import Board
from airtouch.crazyflie.view.host_detector import HostDetector
from airtouch.detector import best
from airtouch.detector.evaluation import evaluate
from airtouch.detector.evaluation.data import dataset
from airtouch.detector.shared import sensors
from airtouch.logs.flight_log import FlightLog
from airtouch.simulation import batch


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    path = tmp_path_factory.mktemp("replay") / "f.csv.gz"
    logs.write(batch.simulate("paper-4cm")[0], path)
    return path


def assert_equal(path, speed):
    (file,) = dataset.collect([path], speed)
    log = evaluate.read_flight(file)
    at_once = evaluate.evaluate_flight(file, log, best, best.load(None))
    detector, board, edges = HostDetector(), Board("f", "best"), []
    assert replay.run(log, board, detector, stop=threading.Event(), on_edge=edges.append) == len(log)
    stepwise = replay.result(file, log, detector)
    np.testing.assert_array_equal(stepwise.trace.probability, at_once.trace.probability)
    assert stepwise.trace.edges == at_once.trace.edges and len(edges) == len(board.edges) == len(at_once.trace.edges)
    assert [f.kind for f in edges] == [e.kind for e in at_once.trace.edges]
    np.testing.assert_allclose([f.probability for f in edges], [e.probability for e in at_once.trace.edges])
    np.testing.assert_allclose([f.at_s for f in edges], [e.sample / 100 for e in at_once.trace.edges])
    assert str(stepwise.score.as_dict()) == str(at_once.score.as_dict())
    return at_once


def test_on_a_simulated_flight(flight):
    assert assert_equal(flight, 0.3).trace.edges


def test_on_a_recorded_flight(flights):
    assert assert_equal(sorted((flights / "airtouch").glob("*h79*"))[0], None).trace.edges


def test_the_command_prints_what_evaluate_prints(flight):
    result = CliRunner().invoke(airtouch, ["replay", str(flight), "--flown-at", "0.3"])
    scored = CliRunner().invoke(airtouch, ["evaluate", str(flight), "--speed", "0.3"])
    assert result.exit_code == scored.exit_code == 0
    row = next(line for line in scored.output.splitlines() if "│ best" in line)
    assert row in result.output and "detected at" in result.output


def test_the_commanded_speed_is_asked_for_by_its_own_name(flight, tmp_path):
    """--speed is that of the playback here, also called --rate."""
    log = logs.read(flight)
    logs.write(logs.FlightLog(log.columns, {}), tmp_path / "f.csv")
    asked = CliRunner().invoke(airtouch, ["replay", str(tmp_path / "f.csv"), "--speed", "0.3"])
    assert "--flown-at" in str(asked.exception) and "--speed" not in str(asked.exception)
    both = [CliRunner().invoke(airtouch, ["replay", str(flight), name, "1000"]) for name in ("--speed", "--rate")]
    assert both[0].output == both[1].output and both[0].exit_code == 0


@pytest.mark.parametrize("sensor", sensors.SENSORS)
def test_a_flight_without_a_sensor_and_without_down_range_is_replayed(flight, tmp_path, sensor):
    log = sensors.without(logs.read(flight), (sensor,))
    path = tmp_path / "f.csv"
    logs.write(FlightLog({name: x for name, x in log.columns.items() if name not in ("zrange_m", "z_m")}, log.meta),
               path)
    result = CliRunner().invoke(airtouch, ["replay", str(path), "--flown-at", "0.3"])
    assert result.exit_code == 0, result.output
    assert "detected at" in result.output


def test_pieces_of_one_row_give_the_same(flight):
    log, row_by_row, all_at_once = logs.read(flight), HostDetector(), HostDetector()
    for i in range(0, 900):
        row_by_row.next({name: values[i:i + 1] for name, values in log.columns.items()})
    all_at_once.next({name: values[:900] for name, values in log.columns.items()})
    bounded = HostDetector(traced=False)
    edges = [bounded.next({name: values[i:i + 1] for name, values in log.columns.items()})[1]
             for i in range(0, len(log))]
    _, expected = HostDetector().next(log.columns)
    assert [edge for some in edges for edge in some] == expected != []
    assert len(bounded._logits) < len(log) / 2
    with pytest.raises(ValueError, match="keeps no trace"):
        bounded.trace(log)
    beginning = log.slice(0, 900)
    assert row_by_row.trace(beginning).edges == all_at_once.trace(beginning).edges
