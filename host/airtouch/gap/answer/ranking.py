"""The verdict, and every candidate with its probability and how far it closes the gap, best first."""

from airtouch.gap.answer.probabilities import probabilities
from airtouch.gap.answer.reasons import why_not
from airtouch.gap.answer.shrink import Gap, nearer, shrink_of
from airtouch.gap.evidence.data import Data
from airtouch.gap.naming.policy import FIRST_GAIN
from airtouch.gap.naming.records import Selection
from airtouch.gap.naming.unknown import against, is_explained
from airtouch.gap.result import Quantity, RankedCandidate
from airtouch.gap.signatures.alike import names_alike
from airtouch.gap.signatures.signature import CLOCK

AT_FLOOR = 1.0  #: gap, in units of its floor, up to which there is none: by definition
#: nats of held-out log likelihood; two candidates that differ by less cannot be told apart: odds of 20, chosen
CLOSE = 3.0


def verdict_of(data: Data, selection: Selection, gap: Gap) -> str:
    """The verdict: "none", "effect" or "unknown", by the first of these that holds:

    1. the replay decides, and the gap is at its floor: "none", whatever small differences add up to;
    2. what is left beside the effects named is more than chance leaves: "unknown";
    3. no effect is named: "none"; else "effect".

    What the log has done to itself shows in its times alone, and is no part of the gap; a passing effect is
    seldom in both halves of the data, in whose common part the gap is measured. In a simulator's flights some bands may
    be calmer than nominal ones and others less calm: effects that bring them nearer to the floor are there; and no
    nominal flight has odd times. A recorded one had calm air or a poor link.
    """
    if selection.inference is None and _at_its_floor(data, selection, gap):
        return "none"
    if not is_explained(selection):
        return "unknown"
    return "none" if selection.named_hypothesis is None else "effect"


def _at_its_floor(data: Data, selection: Selection, gap: Gap) -> bool:
    """Whether there is no gap, and nothing that would be outside it or within calmer bands; see `verdict_of`."""
    hypothesis = selection.named_hypothesis
    outside_the_gap = hypothesis is not None and all(t.shows_in == CLOCK or t.gate for t in hypothesis.terms)
    if gap.shrink.before > AT_FLOOR or outside_the_gap:
        return False
    odd_times = selection.nameless.of_times > against(selection).limit
    return not data.study.simulated or not (odd_times or nearer(data, selection.halves, hypothesis, gap))


def ranking_of(data: Data, selection: Selection, gap: Gap, verdict: str, answer: str) -> list[RankedCandidate]:
    """Every candidate with its probability and how far it closes the gap, best first.

    answer: the first effect named, else the verdict.
    """
    out = []
    for name, p in probabilities(selection, answer).items():
        single = selection.single_effects.get(name)
        share = Quantity(0.0)
        if name == answer and verdict == "effect" and len(selection.named_steps) == 1:
            share = gap.shrink.share
        elif single is not None and single.full and single.gain > FIRST_GAIN:
            share = shrink_of(data, selection.halves, single, gap).share
        nats = None if single is None else selection.gained(single)
        out.append(RankedCandidate(name, float(p), share, why_not(selection, name, verdict), nats))
    order = {n: selection.gained(c) for n, c in selection.single_effects.items()}
    out.sort(key=lambda r: (r.name != answer, -r.probability, -order.get(r.name, 0.0)))
    return out


def alike_of(selection: Selection) -> tuple[tuple[str, ...], ...]:
    """Sets of names that these logs cannot tell apart: names of one thing, and candidates as good as the best."""
    if not selection.named_steps:
        return ()
    groups = []
    first = selection.single_effects[selection.named_steps[0].name]
    same = [n for n, c in selection.single_effects.items() if (c.full or selection.inference is not None)
            and selection.gained(first) - selection.gained(c) < CLOSE]
    if len(same) > 1:
        groups.append(tuple(sorted(same)))
    for step in selection.named_steps:
        alike = names_alike(step.name)
        if alike and not any(step.name in g for g in groups):
            groups.append(tuple(sorted(alike.effects)))
    return tuple(groups)
