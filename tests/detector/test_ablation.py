"""Ablations: the float network is scored on the flights that the int8 network was scored on."""

from airtouch import logs
from airtouch.detector import ablation, best
from airtouch.detector.evaluation.crossval import Fold, readable_flights
from airtouch.detector.evaluation.data.dataset import Condition, FlightFile
from airtouch.detector.evaluation.evaluate import spare_of
from airtouch.detector.shared import sensors
from made_flight import made_flight


def test_a_flight_without_a_sensor_is_scored_in_float_too(small, tmp_path):
    small.save(tmp_path / "m.npz")
    flights = {"whole.csv": made_flight(0), "no_motors.csv": sensors.without(made_flight(1), ("motors",))}
    for name, log in flights.items():
        logs.write(log, tmp_path / name)
    files = [FlightFile(tmp_path / name, Condition(fold=0, speed_mps=0.3)) for name in flights]
    assert len(readable_flights(files, spare_of(best))[0]) == 2, "as int8 is scored"
    scores = ablation.in_float(best, files, [Fold(0, "m.npz", 0.0, {}, 1.0)], tmp_path)
    assert [score.file for score in scores] == list(flights)
