"""The power that random effects add to the block sums of a flight.

Their spectra are those of measured minus replayed (`random_effects.replayed_power`), whose squares the map sums.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.random_effects import replayed_power
from airtouch.gap.flights.flight import GROUND, Flight
from airtouch.gap.signals.channels import inside
from airtouch.gap.signals.spectra import AIR, REST, frequencies
from airtouch.gap.signatures.term import Term
from airtouch.gap.study import Study
from airtouch.gap.where.band_sums import Sums, samples_within
from airtouch.gap.where.filter_bank import gains


def random_power(study: Study, flight: Flight, terms: Sequence[Term], of_blocks: Sums) -> np.ndarray:
    """Sums of squares (b, r, bands, COUNT) that random effects add to the block sums of a flight.

    An effect adds its mean power in the flight at each sample at which it acts, and none at the others.
    """
    data, out = Data(study, [flight]), np.zeros_like(of_blocks.power)
    for term in terms:
        power = replayed_power(data, replace(term, gate=()))[0]
        acting = samples_within(flight, inside(term.gate, flight), study.vehicle) if term.gate else of_blocks.weight
        for rows, state in ((of_blocks.phase == GROUND, REST), (of_blocks.phase != GROUND, AIR)):
            if len(power[state]):
                density = gains(frequencies(state)) ** 2 * frequencies(state)[1]
                out[rows] += acting[rows][:, :, None, None] * (density @ power[state].mean(axis=0))
    return out
