"""The evidence for an effect: its gain, limited by how rare its strength is in nominal flights.

Nominal flights differ in trim, battery, air and wear, so that an effect which does not act seems to have some strength
in them, and gains likelihood by it. So the gain alone names nothing. The rule, in nats:

    evidence = min(gain - gain of the base, rarity of the strength)    where nominal flights were measured
             = gain - gain of the base                                 where none were
             = min(gain - gain of the base, 0)                         of a strength at its bound

The rarity is the log likelihood of the strength over that of nominal scatter and chance (`Scatter.evidence`). At its
bound the model stretches to fit what another effect does. A passing effect has the same rule for its size
(`passing_effect.passing_evidence`), and the relations of signals have an evidence of their own.

What an effect gains by another echo of the gyro's noise (`evidence.sensing`) is beyond nominal flights already. So it
is no part of the minimum, and is added to it.

The nominal scatter is that beyond chance. So the chance error of a strength counts beside it, a random effect's too.
The error of the floor adds to it: the floor is measured on few flights, and its error looks like noise in all bins.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.problem import whole_of
from airtouch.gap.evidence.random_strength import strength_variance
from airtouch.gap.evidence.sensing import sensing_gain
from airtouch.gap.naming.judging import at_bound
from airtouch.gap.naming.records import Hypothesis
from airtouch.gap.signals.spectra import AIR
from airtouch.gap.signatures.candidates import strength_term
from airtouch.gap.signatures.signature import MEAN, SPECTRUM
from airtouch.gap.signatures.term import Term


def with_evidence(data: Data, best: Mapping[str, Hypothesis], base_gain: float) -> dict[str, Hypothesis]:
    """The best hypothesis of each candidate, by name, with its evidence; base_gain: nats that the base gains."""
    return {name: replace(h, evidence=_evidence(data, h, base_gain)) for name, h in best.items()}


def _evidence(data: Data, hypothesis: Hypothesis, base_gain: float) -> float:
    """The evidence for a hypothesis' newest effect, nats."""
    of_echo = sensing_gain(data, [_own_term(hypothesis)])
    return min(hypothesis.gain - base_gain - of_echo, _limit(data, hypothesis)) + of_echo


def random_variance(data: Data, judged: Hypothesis, term: Term) -> np.ndarray:
    """Variance (k,) by chance of the strength of a random effect; 0 where none was found. term: of `judged`."""
    fitted = judged.fits[0].terms
    same = next(t for t in fitted if t.name == term.name and t.shows_in == SPECTRUM)
    variance = np.diag(strength_variance(data, whole_of(data), fitted, same))[:len(term.free)]
    return np.where(judged.strength.mean > 0.0, variance, 0.0)


def _limit(data: Data, hypothesis: Hypothesis) -> float:
    """Nats of evidence that the strength of a hypothesis' newest effect allows; infinite where nothing limits it."""
    own, strength, scatter = _own_term(hypothesis), hypothesis.strength, data.study.scatter
    if own.shows_in == MEAN and at_bound(own, strength.mean).any():
        return 0.0
    if scatter is None:
        return np.inf
    covariance = strength.covariance
    if own.shows_in == SPECTRUM and hypothesis.full:
        covariance = (1.0 + _over_baseline(data)) * np.diag(random_variance(data, hypothesis, own))
    return scatter.evidence(hypothesis.name, strength.mean, covariance, strength.half_difference)


def _over_baseline(data: Data) -> float:
    """Blocks in the air of the flights over those that the floor was measured on; 0 without nominal flights.

    The logarithm of a power ratio has the variance 1/n + 1/m, n and m the blocks of its two powers (Fisher's F).
    """
    nominal = data.study.floor.block_counts[AIR]
    if not (data.study.nominal_count and nominal):
        return 0.0
    return sum(len(first[AIR]) for first in data.block_starts) / nominal


def _own_term(hypothesis: Hypothesis) -> Term:
    """The term whose strength that of a hypothesis' newest effect is."""
    of_its_name = [t for t in hypothesis.terms if t.name == hypothesis.name]
    with_random_part = of_its_name[-1].companion
    return strength_term(of_its_name[-2:]) if with_random_part else of_its_name[-1]
