"""How strong every effect seems to be in a nominal flight, held against others: what the yardstick is made of."""

from collections.abc import Sequence

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.fit import strength_variance
from airtouch.gap.evidence.problem import whole_of
from airtouch.gap.naming.judging import at_bound, trial_of
from airtouch.gap.naming.passing_effect import seconds
from airtouch.gap.naming.rounds import round_of
from airtouch.gap.naming.select import nameless
from airtouch.gap.naming.selection import Judged
from airtouch.gap.passing.gates import gated
from airtouch.gap.signatures.candidates import CLOCK, GATED, SPECTRUM, all_candidates, strength_term
from airtouch.gap.signatures.nominal_scatter import Apparent, size_of

NEUTRAL = 1e-6  #: scaled strength of an effect that only has one sign, below which it is at its bound of none
NOBODY_KNOWS = 1e6  #: standard deviation of a scaled parameter of which the data say nothing


def apparent(data: Data, without: Sequence[str] = ()) -> Apparent:
    """How strong every effect but those of `without` seems to be in flights that have none."""
    on = trial_of(data)
    singles = round_of(on, all_candidates(without), None, thorough=True)
    passing = gated(data, without)
    known = {n: j for n, j in singles.items() if len(j.strength)}
    return Apparent({n: j.strength for n, j in known.items()}, {n: _error(data, j) for n, j in known.items()},
                    nameless(on, None) / seconds(data),
                    {n: size_of(passing[n].gain / seconds(data), passing[n].strength) if n in passing else 0.0
                     for n in GATED})


def _error(data: Data, judged: Judged) -> np.ndarray:
    """Standard deviation (k,) by chance of a candidate's strength."""
    term = strength_term(judged.terms)
    if term.kind == CLOCK:
        return np.zeros(len(judged.strength))
    if term.kind != SPECTRUM:
        low, _ = (term.among_all(b, -np.inf) for b in term.bounds())
        pressed = (low == 0.0) & (judged.strength < NEUTRAL)  # the data would have it below none: how far, nobody knows
        return np.where(at_bound(term, judged.strength) | pressed, NOBODY_KNOWS,
                        np.minimum(np.sqrt(judged.variance), NOBODY_KNOWS))
    fitted = judged.fits[0].terms
    same = next(t for t in fitted if t.name == term.name and t.kind == SPECTRUM)
    variance = np.diag(strength_variance(data, whole_of(data), fitted, same))[:len(term.free)]
    return np.sqrt(np.where(judged.strength > 0.0, variance, 0.0))
