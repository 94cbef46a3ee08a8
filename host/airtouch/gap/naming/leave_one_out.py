"""What each of several effects adds to the others: its leave-one-out gain.

The gains of all effects and of all but one are those of `judging.cross_validated`: `Charges.uncertain_floor_loss` is
added to both.
"""

from collections.abc import Hashable, Sequence
from dataclasses import replace

from airtouch.gap.evidence.fit import FittedTerms, fit, mean_parameters
from airtouch.gap.evidence.problem import TWO_FOLDS
from airtouch.gap.evidence.sensing import gain_outside
from airtouch.gap.naming.judging import Trial, gain_of, price_of, uncertain_floor_loss
from airtouch.gap.naming.records import Step, new_terms
from airtouch.gap.passing.gates import KNOWN_OVERHEAD
from airtouch.gap.signatures.candidates import random_of
from airtouch.gap.signatures.signature import CLOCK
from airtouch.gap.signatures.term import Term


def with_leave_one_out_gains(trial: Trial, steps: Sequence[Step]) -> list[Step]:
    """The steps of a selection, with the leave-one-out gain of those that stand beside others.

    These are all that are named, where there are several, and a passing one beside any other: what is as
    strong as in nominal flights may have its seconds as well. Seconds that another vehicle's log tells are sure.
    """
    several_named = sum(s.is_named for s in steps) > 1

    def stands_beside_others(step: Step) -> bool:
        searched_for = step.passing_key not in (None, KNOWN_OVERHEAD)
        return step.is_named and (several_named or (searched_for and len(steps) > 1))

    return [replace(s, leave_one_out_gain=steps[-1].gain - _gain_without(trial, steps, index))
            if stands_beside_others(s) else s for index, s in enumerate(steps)]


def _gain_without(trial: Trial, steps: Sequence[Step], index: int) -> float:
    """Held-out nats of the last step's hypothesis without the effect of one step, the others fitted anew."""
    last, dropped = steps[-1], _new_slots(steps, index)
    others = _without(last.terms, dropped)
    gain = gain_outside(trial.data, others)
    cost_of_dropped = steps[index].charges.choice_cost - (steps[index - 1].charges.choice_cost if index else 0.0)
    cost_of_others = last.charges.choice_cost - cost_of_dropped
    if all(t.shows_in == CLOCK for t in others):
        return gain - cost_of_others
    refits = [_refit(trial, half, _without(last.fits[half].terms, dropped)) for half in (0, 1)]
    gain += sum(gain_of(trial, test, refits[train].terms) for train, test in TWO_FOLDS)
    gain += _loss_without(trial, steps, index)
    return gain - price_of(refits[-1].terms) - cost_of_others


def _loss_without(trial: Trial, steps: Sequence[Step], index: int) -> float:
    """`Charges.uncertain_floor_loss` of the last step's hypothesis without the effect of the step at an index.

    It is 0 where no other effect stands before the first random one, or none is random: nothing lost certainty. It is
    that of the last step where the dropped effect came after the first random one, which it did not change. Else the
    effects before the first random one are fitted anew by themselves, without the dropped one, for what they lose.
    """
    first_random = next((i for i in range(len(steps)) if i != index and random_of(new_terms(steps, i))), None)
    if first_random is None:
        return 0.0
    earlier = [i for i in range(first_random) if i != index]
    if not earlier:
        return 0.0
    if index > first_random:
        return steps[-1].charges.uncertain_floor_loss
    later = frozenset().union(*(_new_slots(steps, i) for i in range(len(steps)) if i not in earlier))
    refits = [_refit(trial, half, _without(steps[-1].fits[half].terms, later)) for half in (0, 1)]
    return uncertain_floor_loss(trial, refits)


def _refit(trial: Trial, half: int, terms: Sequence[Term]) -> FittedTerms:
    """Effects fitted to a half anew, from their values on."""
    return fit(trial.data, trial.halves[half], terms, mean_parameters(terms))


def _new_slots(steps: Sequence[Step], index: int) -> frozenset[Hashable]:
    """Slots of the terms that the step at an index has added."""
    return frozenset(t.slot for t in new_terms(steps, index))


def _without(terms: Sequence[Term], dropped: frozenset[Hashable]) -> list[Term]:
    """The terms whose slot is not among those that are dropped."""
    return [t for t in terms if t.slot not in dropped]
