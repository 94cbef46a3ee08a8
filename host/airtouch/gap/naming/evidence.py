"""The evidence for an effect: its gain, limited by how rare its strength is in nominal flights.

Nominal flights differ in trim, battery, air and wear, so that an effect which does not act seems to have some strength
in them, and gains likelihood by it. So the gain alone names nothing. The rule, in nats:

    evidence = min(gain - gain of the base, rarity of the strength)    where nominal flights were measured
             = gain - gain of the base                                 where none were
             = min(gain - gain of the base, 0)                         of a strength at its bound

The rarity is the log likelihood of the strength over that of nominal scatter and chance (`Scatter.evidence`). At its
bound the model stretches to fit what another effect does. A passing effect has the same rule for its size
(`passing_effect.passing_evidence`), and the relations of signals have an evidence of their own.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from airtouch.gap.naming.judging import at_bound
from airtouch.gap.naming.records import Candidate
from airtouch.gap.signatures.candidates import strength_term
from airtouch.gap.signatures.scatter import Scatter
from airtouch.gap.signatures.signature import MEAN
from airtouch.gap.signatures.term import Term


def with_evidence(scatter: Scatter | None, best: Mapping[str, Candidate], base_gain: float) -> dict[str, Candidate]:
    """The candidates, by name, each with its evidence.

    scatter: of strengths in nominal flights, None where none were measured; base_gain: nats that the base gains.
    """
    return {name: replace(c, evidence=min(c.gain - base_gain, _limit(scatter, c))) for name, c in best.items()}


def _limit(scatter: Scatter | None, candidate: Candidate) -> float:
    """Nats of evidence that the strength of a candidate allows; infinite where nothing limits it."""
    own, strength = _own_term(candidate), candidate.strength
    if own.shows_in == MEAN and at_bound(own, strength.mean).any():
        return 0.0
    if scatter is None:
        return np.inf
    return scatter.evidence(candidate.name, strength.mean, strength.covariance, strength.half_difference)


def _own_term(candidate: Candidate) -> Term:
    """The term of a candidate's newest effect whose strength it has."""
    of_its_name = [t for t in candidate.terms if t.name == candidate.name]
    with_random_part = of_its_name[-1].companion
    return strength_term(of_its_name[-2:]) if with_random_part else of_its_name[-1]
