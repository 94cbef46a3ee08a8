"""What each of several effects adds to the others: the gain of all, less that of all but one."""

from collections.abc import Sequence
from dataclasses import replace

from airtouch.gap.evidence.clock import clock_gains
from airtouch.gap.evidence.fit import fit, mean_parameters
from airtouch.gap.evidence.problem import ROUND_TRIP
from airtouch.gap.naming.judging import Trial, gain_of, price_of
from airtouch.gap.naming.selection import Candidate
from airtouch.gap.signatures.signature import CLOCK, COMPANIONS
from airtouch.gap.signatures.term import Term


def with_shares(on: Trial, steps: Sequence[Candidate]) -> list[Candidate]:
    """The steps of a selection, those that are named with their `share`, nats, where there are several."""
    if sum(s.named for s in steps) < 2:
        return list(steps)
    return [replace(s, share=steps[-1].gain - _gain_without(on, steps, s)) if s.named else s for s in steps]


def _gain_without(on: Trial, steps: Sequence[Candidate], dropped: Candidate) -> float:
    """Held-out nats of the last step's hypothesis without one of its effects, the others fitted anew."""
    last, place = steps[-1], [s.name for s in steps].index(dropped.name)
    others = _others(last.terms, dropped.name)
    gain = clock_gains(on.data, others)
    if all(t.shows_in == CLOCK for t in others):
        return gain
    for train, test in ROUND_TRIP:
        known = _others(last.fits[train].terms, dropped.name)
        refit = fit(on.data, on.parts[train], known, mean_parameters(known))
        gain += gain_of(on, test, refit.terms)
    cost_of_dropped = dropped.choice_cost - (steps[place - 1].choice_cost if place else 0.0)
    return gain - price_of(refit.terms) - (last.choice_cost - cost_of_dropped)


def _others(terms: Sequence[Term], name: str) -> list[Term]:
    """The terms that are neither an effect's nor its companion's."""
    return [t for t in terms if not (t.name == name or t.companion and t.name == COMPANIONS.get(name))]
