"""Windows that set the int8 ranges: spread over the flights, however many there are."""

import numpy as np
import pytest

from airtouch.detector.best.quantisation import windows
from airtouch.detector.best.recipe import CHANNELS, Recipe


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
    assert of_flight.max() >= 0.9 * (flights - 1)
