"""The power that random effects add to the block sums of a flight, and what a cell of the map has left of them.

Their spectra are those of measured minus replayed (`random_effects.replayed_power`), whose squares the map sums. A bin
counts in the bands that it reaches into, and a sample has the mean of the blocks of spectra around it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

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
from airtouch.gap.where.filter_bank import MAP_BANDS_HZ, gains

WITHIN_BIN = 16  #: frequencies at which the gains of the bands are averaged over a bin; chosen
#: standard deviation of a block's power over its mean, at most; chosen. White noise has more in the lowest band, 0.9 in
#: 2.56 s. There a power of three times the right one leaves no gap in a single block; with 1, none would
MOST_SCATTER = 0.7
LEAST_WEIGHT = 1e-3  #: of blocks' windows, over the largest, below which they say nothing of a sample; chosen


@dataclass(frozen=True)
class SumsWith:
    """Block sums with effects in the model.

    gap: with the mean of the effects; random: the power that their random parts are expected to add to it, whose
    samples nobody can predict; chance: the variance of that power. None without a random part.
    """

    gap: Sums
    random: Sums | None = None
    chance: Sums | None = None

    def of_phase(self, phase: int) -> "SumsWith":
        """The rows of one phase."""
        random, chance = (s and s.of_phase(phase) for s in (self.random, self.chance))
        return SumsWith(self.gap.of_phase(phase), random, chance)

    def mean_square(self, noise: np.ndarray) -> np.ndarray:
        """Mean square (r, bands, COUNT) that is left over all rows, with the effects in the model.

        With a random part it is the noise of the sensors, noise (bands, COUNT), and the difference of the rest from the
        power expected; power that the random part has too much counts as gap. A power of noise in a limited time
        scatters by chance: the variance of that is taken from the square of the difference. So one standard deviation
        of chance is no gap, and of a right random part a cell in three has some left. NaN where no row has the channel.
        """
        square = self.gap.mean_square()
        if self.random is None or self.chance is None:
            return square
        known = np.minimum(noise, square)
        difference = square - known - self.random.mean_square()
        weight = np.maximum(self.chance.known_weight().sum(axis=0), 1.0)
        return known + np.sqrt(np.maximum(difference ** 2 - self.chance.mean_square() / weight, 0.0))


def sums_with(study: Study, flight: Flight, terms: Sequence[Term]) -> SumsWith:
    """A flight's block sums with effects in the model."""
    gap = block_sums(flight, study.residual(flight, [t.active() for t in mean_of(terms)]), study.vehicle)
    random = random_of(terms)
    if not random or not len(gap.phase):
        return SumsWith(gap)
    added = random_power(study, flight, random)
    return SumsWith(gap, *(replace(gap, power=np.where(np.isfinite(gap.power), x, np.nan)) for x in added))


def join_with(parts: Sequence[SumsWith]) -> SumsWith:
    """Sums of several flights with the same effects in the model, numbered in their order."""
    random, chance = ([s for s in of_parts if s is not None] for of_parts in (
        [p.random for p in parts], [p.chance for p in parts]))
    return SumsWith(join([p.gap for p in parts]), *(join(s) for s in (random, chance) if s))


class RandomPower(NamedTuple):
    """Sums of squares (b, r, bands, COUNT) over blocks that random effects add on average, and their variance."""

    mean: np.ndarray
    variance: np.ndarray


def random_power(study: Study, flight: Flight, terms: Sequence[Term]) -> RandomPower:
    """What random effects add to the block sums of a flight; a passing effect in its seconds alone.

    The mean square of noise over a time T has a variance of the integral of its squared spectrum over T (Bendat and
    Piersol, Random Data, 4th ed., section 8.3). Of several effects the spectra are taken to be of one shape, of which
    the variance is largest.
    """
    data = Data(study, [flight])
    mean, deviation = (np.zeros((len(flight), len(MAP_BANDS_HZ), COUNT)) for _ in range(2))
    for term in terms:
        (power,) = replayed_power(data, replace(term, gate=()))
        acts = inside(term.gate, flight) if term.gate else np.ones(len(flight), bool)
        for state, in_state in ((REST, flight.phase == GROUND), (AIR, flight.phase != GROUND)):
            samples, share = acts & in_state, _share_of_bins(state, known_shape=bool(term.signature.spectrum))
            mean[samples] += _per_sample(data, state, share @ power[state])[samples]
            squares = share ** 2 @ power[state] ** 2 / (PERIOD_S * frequencies(state)[1])
            deviation[samples] += np.sqrt(_per_sample(data, state, squares)[samples])
    of_mean, variance = (sums_over_blocks(flight, x, study.vehicle) for x in (mean, deviation ** 2))
    return RandomPower(of_mean, np.minimum(variance, (MOST_SCATTER * of_mean) ** 2))


def _per_sample(data: Data, state: str, of_blocks: np.ndarray) -> np.ndarray:
    """Values (n, bands, COUNT) at each sample: the mean of the blocks of spectra around it.

    of_blocks (blocks, bands, COUNT). Where there are none it is the mean of all blocks; 0 without a block.
    """
    total, weight = np.zeros((len(data.flights[0]), len(MAP_BANDS_HZ), COUNT)), np.zeros(len(data.flights[0]))
    if not len(of_blocks):
        return total
    window = hann_window(LENGTH[state])[0][:, 0] ** 2
    for first, of_block in zip(data.block_starts[0][state], of_blocks, strict=True):
        here = slice(first, first + LENGTH[state])
        total[here] += window[:, None, None] * of_block
        weight[here] += window
    known = weight > LEAST_WEIGHT
    total[known] /= weight[known, None, None]
    total[~known] = of_blocks.mean(axis=0)
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
