"""Effects in slots: the body feels the sum of what each gives alone, with its own parameters, memory and noise."""

import numba
import numpy as np
import pytest

from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import PWM, FlightLog
from airtouch.simulation import effects, replay
from airtouch.simulation.effects import slots
from airtouch.simulation.effects.effect import MEMORY
from airtouch.simulation.random_generator import generator

CHOSEN = {"wind": {"x": 0.5, "y": -0.2}, "gust": {"rms": 0.4}, "slung_load": {"load": 0.004},
          "downwash": {"strength": 0.2}, "rotor_drag": {"horizontal": 0.02}}


@numba.njit  # without a cache, which would not notice another slots.py
def all_of(active, signals, memory, out):
    for k in range(len(signals)):
        slots.add(active, signals[k], memory, out[k])


def test_the_sum_is_that_of_each_alone(signals):
    signals = np.ascontiguousarray(np.tile(signals, (5, 1)))
    active = effects.activate(CHOSEN)
    assert len(active) == len(CHOSEN)
    out = np.zeros((len(signals), 6))
    all_of(slots.slots(active, [generator(3, 0, a.effect.name) for a in active]), signals,
           np.zeros((slots.SLOTS, MEMORY)), out)
    summed = sum(replay.wrench_of(a, signals, seed=3) for a in active)
    np.testing.assert_allclose(out, summed, rtol=1e-12, atol=1e-15)
    assert np.abs(out).max() > 0.01


def test_more_effects_than_slots_are_refused():
    active = effects.activate({"wind": {}}) * (slots.SLOTS + 1)
    with pytest.raises(AirTouchError, match="17 effects with a force at once; at most 16"):
        slots.slots(active, [generator(0, 0, "wind")] * len(active))


def test_a_replayed_effect_that_comes_twice_draws_other_numbers(vehicle):
    """Two equal, independent gusts have sqrt(2) times the rms of one, not twice; 200 s are some hundred draws."""
    log = FlightLog({name: np.full(20000, 36000.0) for name in PWM})
    gust = effects.activate({"gust": {"rms": 0.3}})
    one, two = (replay.run(log, vehicle, active).specific_force[:, 0] for active in (gust, gust * 2))
    assert 1.2 < two.std() / one.std() < 1.7
