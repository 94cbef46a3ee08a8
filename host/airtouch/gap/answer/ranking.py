"""The verdict, and every candidate with its probability and how far it closes the gap, best first."""

from airtouch.gap.answer.probabilities import probabilities
from airtouch.gap.answer.reasons import why_not
from airtouch.gap.answer.shrink import Gap, closure_of, is_nearer_to_floor
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.sensing import sensing_gain
from airtouch.gap.naming.policy import FIRST_GAIN
from airtouch.gap.naming.records import Selection
from airtouch.gap.naming.unknown import counterevidence, is_explained, unsteadiness_ratio
from airtouch.gap.result import Quantity, RankedCandidate
from airtouch.gap.signatures.alike import names_alike
from airtouch.gap.signatures.signature import CLOCK

AT_FLOOR = 1.0  #: gap, in units of its floor, up to which there is none: by definition
#: nats of held-out log likelihood by which two candidates differ that can be told apart; chosen: odds of 20. A larger
#: number lists more pairs as alike that the flights do tell apart
LEAST_DIFFERENCE = 3.0


def verdict_of(data: Data, selection: Selection, gap: Gap) -> str:
    """The verdict, by the first of these rules that holds.

    1. "none": the gap is at its floor, and nothing acts that the gap cannot show (`_acts_outside_the_gap`). Where the
       relations of signals decide, this rule is skipped.
    2. "unknown": more speaks against the effects named than chance allows (`unknown.is_explained`).
    3. "effect": at least one effect is named.
    4. "none": no effect is named.
    """
    replay_decides = selection.inference is None
    if replay_decides and gap.closure.before <= AT_FLOOR and not _acts_outside_the_gap(data, selection, gap):
        return "none"
    if not is_explained(selection):
        return "unknown"
    return "none" if selection.named_hypothesis is None else "effect"


def _acts_outside_the_gap(data: Data, selection: Selection, gap: Gap) -> bool:
    """Whether something acts that a gap at its floor cannot show. Any one of four signs is enough.

    1. Every effect named is an error of the logged times, passes, or explains another echo of noise. Times and echo are
       no part of the gap. The gap is measured in what both halves of the data show, and an effect that passes is seldom
       in both.
    2. In recorded flights: they are less steady than nominal ones, by more than may be chance. The gap is a mean over
       seconds in which little acts.
    3. In simulated flights: what logged times and echo hold beside the effects is more than chance allows.
    4. In simulated flights: the effects named bring the cells nearer to the floor, be it from below. In recorded
       flights less power than the floor means calm air.
    """
    hypothesis = selection.named_hypothesis
    if hypothesis is not None and all(t.shows_in == CLOCK or t.gate or sensing_gain(data, [t])
                                      for t in hypothesis.terms):
        return True
    if not data.study.simulated:
        return unsteadiness_ratio(selection) >= 1.0
    more_than_chance = selection.nameless.outside_spectra > counterevidence(selection).limit
    return more_than_chance or is_nearer_to_floor(data, selection.halves, hypothesis, gap)


def ranking_of(data: Data, selection: Selection, gap: Gap, verdict: str, answer: str) -> list[RankedCandidate]:
    """Every candidate with its probability and how far it closes the gap, best first.

    answer: the first effect named, else the verdict. The shrink of a candidate that was not fitted in full, or gains
    FIRST_GAIN at most, is not measured.
    """
    out = []
    for name, p in probabilities(selection, answer).items():
        single = selection.single_effects.get(name)
        shrink = None
        if name == answer and verdict == "effect" and len(selection.named_steps) == 1:
            shrink = gap.closure.shrink
        elif single is not None and single.full and single.gain > FIRST_GAIN:
            shrink = closure_of(data, selection.halves, single, gap).shrink
        nats = None if single is None else selection.gain(single)
        out.append(RankedCandidate(name, float(p), shrink or Quantity(0.0), why_not(selection, name, verdict), nats,
                                   measured=shrink is not None))
    gains = {n: selection.gain(h) for n, h in selection.single_effects.items()}
    out.sort(key=lambda r: (r.name != answer, -r.probability, -gains.get(r.name, 0.0)))
    return out


def alike_of(selection: Selection) -> tuple[tuple[str, ...], ...]:
    """Sets of names that these logs cannot tell apart: names of one thing, and candidates as good as the best.

    A candidate with too little evidence to be named is not as good, whatever it gains.
    """
    if not selection.named_steps:
        return ()
    groups = []
    first = selection.single_effects[selection.named_steps[0].name]
    as_good = [n for n, h in selection.single_effects.items()
               if selection.gain(first) - selection.gain(h) < LEAST_DIFFERENCE
               and (h is first or selection.inference is not None
                    or (h.full and h.evidence >= selection.least_nats[n]))]
    if len(as_good) > 1:
        groups.append(tuple(sorted(as_good)))
    for step in selection.named_steps:
        synonyms = names_alike(step.name)
        if synonyms and not any(synonyms.effects <= set(g) for g in groups):
            groups.append(tuple(sorted(synonyms.effects)))
    return tuple(groups)
