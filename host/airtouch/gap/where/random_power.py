"""The power that random effects add to the block sums of a flight, and what a cell of the map has left of them.

Their spectra are those of measured minus replayed (`random_effects.replayed_power`), whose squares the map sums. A bin
counts in the bands that it reaches into, and a sample has the mean of the blocks of spectra around it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.random_effects import replayed_power
from airtouch.gap.flights.blocks import hann_window
from airtouch.gap.flights.flight import GROUND, PERIOD_S, Flight
from airtouch.gap.signals.channels import COUNT, inside
from airtouch.gap.signals.spectra import AIR, LENGTH, REST, frequencies
from airtouch.gap.signatures.candidates import mean_of, random_of
from airtouch.gap.signatures.term import Term
from airtouch.gap.study import Study
from airtouch.gap.where.band_sums import Sums, block_sums, join, sums_over_blocks
from airtouch.gap.where.cell_tables import degrees_of_freedom
from airtouch.gap.where.filter_bank import MAP_BANDS_HZ, gains

WITHIN_BIN = 16  #: frequencies at which the gains of the bands are averaged over a bin; chosen
LEAST_WEIGHT = 1e-3  #: of blocks' windows, over the largest, below which they say nothing of a sample; chosen


@dataclass(frozen=True)
class SumsWith:
    """Block sums with effects in the model.

    gap: with the mean of the effects; random: what their random parts are expected to add to it, whose samples nobody
    can predict, or None without a random part.
    """

    gap: Sums
    random: Sums | None

    def of_phase(self, phase: int) -> "SumsWith":
        """The rows of one phase."""
        return SumsWith(self.gap.of_phase(phase), self.random.of_phase(phase) if self.random else None)

    def mean_square(self, noise: np.ndarray) -> np.ndarray:
        """Mean square (r, bands, COUNT) that is left over all rows, with the effects in the model.

        With a random part it is the noise of the sensors, noise (bands, COUNT), and the difference of the rest from the
        power expected; power that the random part has too much counts as gap. A power of noise in a limited time
        scatters by chance: the variance of that (`_chance`) is taken from the square of the difference, so that a right
        random part leaves the noise and seldom more. NaN where no row has the channel.
        """
        square = self.gap.mean_square()
        if self.random is None:
            return square
        known = np.minimum(noise, square)
        difference = square - known - self.random.mean_square()
        return known + np.sqrt(np.maximum(difference ** 2 - _chance(self.random), 0.0))


def sums_with(study: Study, flight: Flight, terms: Sequence[Term]) -> SumsWith:
    """A flight's block sums with effects in the model."""
    gap = block_sums(flight, study.residual(flight, [t.active() for t in mean_of(terms)]), study.vehicle)
    random = random_of(terms)
    if not random or not len(gap.phase):
        return SumsWith(gap, None)
    added = np.where(np.isfinite(gap.power), random_power(study, flight, random), np.nan)
    return SumsWith(gap, replace(gap, power=added))


def join_with(parts: Sequence[SumsWith]) -> SumsWith:
    """Sums of several flights with the same effects in the model, numbered in their order."""
    random = [p.random for p in parts if p.random is not None]
    return SumsWith(join([p.gap for p in parts]), join(random) if random else None)


def _chance(random: Sums) -> np.ndarray:
    """Variance (r, bands, COUNT) of a cell's mean square of noise that has these sums on average, over blocks.

    A block's sum has a variance of 2 / degrees of freedom times its square (Bendat and Piersol, Random Data, 4th ed.,
    section 8.3); the blocks are independent.
    """
    weight = random.known_weight()
    variance = 2.0 / degrees_of_freedom(weight * PERIOD_S, 1.0) * random.power ** 2
    return np.nansum(variance, axis=0) / np.maximum(weight.sum(axis=0), 1.0) ** 2


def random_power(study: Study, flight: Flight, terms: Sequence[Term]) -> np.ndarray:
    """Sums of squares (b, r, bands, COUNT) that random effects add to the block sums of a flight.

    A passing effect adds them in its seconds alone.
    """
    data, per_sample = Data(study, [flight]), np.zeros((len(flight), len(MAP_BANDS_HZ), COUNT))
    for term in terms:
        (power,) = replayed_power(data, replace(term, gate=()))
        acts = inside(term.gate, flight) if term.gate else np.ones(len(flight), bool)
        for state, in_state in ((REST, flight.phase == GROUND), (AIR, flight.phase != GROUND)):
            samples = acts & in_state
            per_sample[samples] += _per_sample(data, state, power[state], term)[samples]
    return sums_over_blocks(flight, per_sample, study.vehicle)


def _per_sample(data: Data, state: str, power: np.ndarray, term: Term) -> np.ndarray:
    """Mean squares (n, bands, COUNT) at each sample from the power (blocks, bins, COUNT) of the blocks around it.

    Where there are none it is the mean of all blocks; 0 without a block.
    """
    total, weight = np.zeros((len(data.flights[0]), len(MAP_BANDS_HZ), COUNT)), np.zeros(len(data.flights[0]))
    if not len(power):
        return total
    in_bands = _share_of_bins(state, known_shape=bool(term.signature.spectrum)) @ power
    window = hann_window(LENGTH[state])[0][:, 0] ** 2
    for first, of_block in zip(data.block_starts[0][state], in_bands, strict=True):
        here = slice(first, first + LENGTH[state])
        total[here] += window[:, None, None] * of_block
        weight[here] += window
    known = weight > LEAST_WEIGHT
    total[known] /= weight[known, None, None]
    total[~known] = in_bands.mean(axis=0)
    return total


def _share_of_bins(state: str, known_shape: bool) -> np.ndarray:
    """Mean square (bands, bins) in each band for a power of 1 in a bin, Hz.

    A bin reaches half its width to both sides. Of the lowest and the highest a half lies in the band of the log: a
    measured spectrum has half the density there (`short_time_spectra`), one of a known shape all of it.
    """
    f = frequencies(state)
    within = f[1] * ((np.arange(WITHIN_BIN) + 0.5) / WITHIN_BIN - 0.5)
    at = f[:, None] + within
    inside_log = (at > 0.0) & (at < f[-1])
    passed = (gains(at.ravel()) ** 2).reshape(-1, *at.shape) * inside_log
    width = np.full(len(f), f[1]) if not known_shape else f[1] * inside_log.mean(axis=1)
    return passed.sum(axis=2) / inside_log.sum(axis=1) * width
