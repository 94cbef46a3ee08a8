"""What a further effect must gain beside those before it.

No model of an effect is exact. Some of the residual that one leaves another one explains, though it does not act.
"""

from collections.abc import Sequence

import numpy as np

from airtouch.gap.evidence.cells import CELLS, sensor_cells
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.judge import CELL_GAIN
from airtouch.gap.evidence.sensing import gain_outside
from airtouch.gap.naming.judging import Trial, held_out_cell_gains
from airtouch.gap.naming.policy import LEAST_GAIN, MISFIT_SHARE_RANDOM
from airtouch.gap.naming.records import Hypothesis
from airtouch.gap.signatures.candidates import is_random, mean_of, random_of
from airtouch.gap.signatures.term import Term


def least_further_gain(trial: Trial, base: Hypothesis, extended: Hypothesis) -> float:
    """Held-out nats that a further effect must gain to be added.

    base: the hypothesis of the effects before it; extended: the same with the further one.
    """
    before = {t.slot for t in base.terms}
    new = [t for t in extended.terms if t.slot not in before]
    looks_alike = assumes(trial.data, base.terms) and changes_loop(trial.data, new)
    policy = trial.policy
    share = policy.loop_misfit_share if looks_alike else policy.misfit_share
    by_cell = policy.loop_misfit_by_cell if looks_alike else policy.misfit_by_cell
    return misfit(trial, base, extended, share, everywhere=is_random(extended.name) or not by_cell)


def is_random_misfit(trial: Trial, base: Hypothesis, extended: Hypothesis) -> bool:
    """Whether a further effect is random and gains no more than the effects before it may be wrong by."""
    return is_random(extended.name) and extended.gain - base.gain < misfit(trial, base, extended, MISFIT_SHARE_RANDOM)


def misfit(trial: Trial, base: Hypothesis, extended: Hypothesis, share: float, everywhere: bool = False) -> float:
    """Nats that a further effect may gain because the models of those before it are wrong by a share of their gain.

    It is LEAST_GAIN at least. base, extended: as for `least_further_gain`. What effects gain by the logged times,
    or by the echo of noise, does not count, as these are no models. With `NamingPolicy.misfit_by_cell`, and unless
    `everywhere`, only the gain in cells in which the further effect gains counts (`gain_in_improved_cells`). These
    cells are not worked out for a further effect that gains more than the share of the whole.
    """
    whole = max(LEAST_GAIN, share * (base.gain - gain_outside(trial.data, base.terms)))
    fitted = extended.full and extended.fits and base.fits
    if everywhere or not trial.policy.misfit_by_cell or not fitted or extended.gain - base.gain >= whole:
        return whole
    there = gain_in_improved_cells(held_out_cell_gains(trial, base), held_out_cell_gains(trial, extended))
    return max(LEAST_GAIN, share * there)


def gain_in_improved_cells(base: np.ndarray, extended: np.ndarray) -> float:
    """Nats that a hypothesis gains in those cells in which a longer one gains CELL_GAIN more.

    base, extended (CELLS,): nats that each of the two gains in each cell. The axes of a sensor in one band count as one
    cell: an effect that pushes forward and one that pushes up act on one body.
    """
    sensor = sensor_cells()
    before, further = (np.bincount(sensor, gains, CELLS) for gains in (base, extended - base))
    return float(np.maximum(before[further > CELL_GAIN], 0.0).sum())


def assumes(data: Data, terms: Sequence[Term]) -> bool:
    """Whether the spectrum of one of the effects is assumed: it is random or changes the loop."""
    return bool(random_of(terms)) or changes_loop(data, terms)


def changes_loop(data: Data, terms: Sequence[Term]) -> bool:
    """Whether one of the mean effects, at its values, changes the control loop; False where no loop is modelled."""
    loop = data.study.loop
    return loop is not None and any(loop.changes_loop((t.active(),)) for t in mean_of(terms))
