"""The floor of nominal flights, of white noise whose mean and variance are known."""

import numpy as np
import pytest

from airtouch.gap.flights.flight import PERIOD_S
from airtouch.gap.signals.channels import COUNT
from airtouch.gap.signals.floor import NominalBlocks, floor_of
from airtouch.gap.signals.spectra import AIR, LENGTH, REST, short_time_spectra, starts
from gap_flights import flight


def test_means_of_flights_differ_beyond_chance_only_by_what_their_trims_do():
    """White noise alone leaves nothing between flights; trims are found as they were drawn."""
    rng, rms, length_s, count = np.random.default_rng(5), 0.5, 30.0, 200
    flights = [flight(length_s) for _ in range(count)]
    first = [{r: starts(f, r) for r in (AIR, REST)} for f in flights]
    trims = rng.normal(0.0, 0.02, count)

    def offset(trim):
        residuals = [np.tile(t + rng.normal(0.0, rms, (len(f), 1)), COUNT) for t, f in zip(trim, flights, strict=True)]
        spectra = [{r: short_time_spectra(x, s[r], r) for r in s} for x, s in zip(residuals, first, strict=True)]
        nominal = [NominalBlocks(f, x, s, of_blocks, np.zeros((len(s[AIR]), LENGTH[AIR] // 2 + 1, COUNT)))
                   for f, x, s, of_blocks in zip(flights, residuals, first, spectra, strict=True)]
        return floor_of(nominal, np.zeros(COUNT)).offset_beyond[0]

    chance = rms / np.sqrt(length_s / PERIOD_S)
    assert offset(0.0 * trims) < 0.4 * chance
    assert offset(trims) == pytest.approx(0.02, rel=0.15)
