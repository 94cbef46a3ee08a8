"""The study without baseline flights: its floor is the sensors' declared noise, its commands say nothing."""

import numpy as np

from airtouch.gap.nominal.build_study import declared_study, sensor_noise
from airtouch.gap.signals.channels import COMMAND, FORCE, RATE
from airtouch.gap.signals.spectra import AIR, REST, short_time_spectra
from gap_flights import VEHICLE


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
