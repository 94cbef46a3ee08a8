"""Studies: without baseline flights the floor is the sensors' declared noise; for a fit of the vehicle it is enough."""

from dataclasses import replace

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.judge import judge
from airtouch.gap.evidence.problem import whole_of
from airtouch.gap.nominal.build_study import declared_study, sensor_noise, study_of
from airtouch.gap.signals.channels import COMMAND, FORCE, RATE
from airtouch.gap.signals.spectra import AIR, REST, short_time_spectra
from gap_flights import VEHICLE, fly


def test_without_flights_the_floor_is_twice_the_declared_noise():
    floor = declared_study(VEHICLE, ()).floor
    noise = sensor_noise(VEHICLE)
    white = np.random.default_rng(3).normal(0.0, noise[FORCE], (60000, 3))
    power = (np.abs(short_time_spectra(white, np.arange(0, 59000, 128), AIR)) ** 2).mean(axis=0)
    assert np.allclose(floor.power[AIR][1:-1, FORCE] / power[1:-1], 2.0, rtol=0.35)
    assert np.allclose((floor.power[AIR][1:-1, FORCE] / power[1:-1]).mean(axis=0), 2.0, rtol=0.02)


def test_without_flights_commands_and_rates_say_nothing():
    study = declared_study(VEHICLE, ())
    assert study.loop is None and study.response is None and not study.simulated
    for state in (AIR, REST):
        assert (study.floor.power[state][:, COMMAND] > 1e9).all() and (study.floor.power[state][:, RATE] > 1e3).all()
    assert not study.floor.offset.any()


def test_the_loop_changes_nothing_of_what_a_fit_of_the_vehicle_judges():
    """A fit takes the torque in its means alone, which say nothing of the loop and how the gyro follows commands."""
    flights = fly(2, 51)
    whole, floor_alone = (study_of(VEHICLE, (), flights, identified) for identified in (True, False))
    assert whole.loop is not None and whole.response is not None and whole.echo is not None
    assert floor_alone.loop is None and floor_alone.response is None and floor_alone.echo is None
    data = [Data(replace(study, loop=None, response=None), flights) for study in (whole, floor_alone)]
    assert judge(data[0], whole_of(data[0]), ()) == judge(data[1], whole_of(data[1]), ())
