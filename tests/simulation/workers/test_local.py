"""Flights written by processes are those that one process writes, byte for byte, and those that `fly` returns."""

import numpy as np

from airtouch import logs
from airtouch.simulation import scenario
from airtouch.simulation.flight import fly
from airtouch.simulation.workers import local, store
from short_scenario import SHORT


def test_two_processes_write_what_one_does(tmp_path, vehicle):
    scene = scenario.parse(SHORT, "short")
    numbers = [3, 0, 7]
    for workers in (1, 2):
        folder = tmp_path / str(workers)
        folder.mkdir()
        ended = list(local.write(folder, scene, numbers, vehicle=vehicle, effects={"wind": {"x": 0.4}}, seed=5,
                                 workers=workers))
        assert ended == [None] * 3
    for number in numbers:
        by_one, by_two = (store.path_of(tmp_path / name, "short", 5, number) for name in "12")
        assert by_one.read_bytes() == by_two.read_bytes()
        log = fly(scene, vehicle, 5, number, effects={"wind": {"x": 0.4}})
        np.testing.assert_allclose(logs.read(by_one)["m1_pwm"], log["m1_pwm"])
    assert len(list((tmp_path / "2").glob("*"))) == 3
