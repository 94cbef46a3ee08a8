"""Windows that set the int8 ranges: spread over the flights, however many there are."""

import numpy as np
import pytest

from airtouch.detector.best.quantisation import windows
from airtouch.detector.best.recipe import CHANNELS, Recipe
from airtouch.errors import AirTouchError


@pytest.mark.parametrize("flights", [3, 87, 100, 150, 300])
def test_windows_are_not_all_at_the_ends_of_flights(flights):
    recipe = Recipe()
    spare_rows = 600
    length = recipe.receptive_samples + spare_rows
    along = np.repeat(np.arange(length, dtype=np.float32)[:, None], CHANNELS, axis=1)
    chosen = windows([along + 10000 * i for i in range(flights)], recipe)
    assert chosen.shape == (400, recipe.receptive_samples, CHANNELS)
    starts, of_flight = chosen[:, 0, 0] % 10000, chosen[:, 0, 0] // 10000
    assert np.mean((starts > 0) & (starts < spare_rows)) >= 0.5
    counts = np.bincount(of_flight.astype(int), minlength=flights)
    assert counts.max() - counts.min() <= 1, "every flight has its part"


def test_flights_that_are_all_too_short_are_told():
    recipe = Recipe()
    with pytest.raises(AirTouchError, match="no flight is as long as what the network reads"):
        windows([np.zeros((recipe.receptive_samples - 1, CHANNELS), np.float32)], recipe)
