"""Least fraction of the gap that named effects must close in recorded flights.

Between two days the gains of a loop differ a little, and nominal flights meet gusts. Neither makes a gap. Against a
baseline of another drone a bias or a wind may gain held-out likelihood and yet make the gap larger.
"""

from collections.abc import Sequence
from dataclasses import replace

from airtouch.gap.evidence.clock import unexplained_clock_gain
from airtouch.gap.evidence.data import Data
from airtouch.gap.naming.policy import LEAST_CLOSED, STANDS_OUT
from airtouch.gap.naming.records import NamelessGain, Selection, WithdrawnNames
from airtouch.gap.passing.gates import KNOWN_OVERHEAD
from airtouch.gap.signatures.signature import CLOCK, MEAN
from airtouch.gap.signatures.term import Term


def least_shrink(data: Data, selection: Selection, gap: float) -> float | None:
    """Fraction of the gap that effects must close to be named; None where they need not close any.

    gap: before they are in the model, in units of the floor. It holds for recorded flights. Effects of the loop, one or
    several with no other beside them, must close LEAST_CLOSED, and so must a single passing one if the gap is over
    STANDS_OUT. Over STANDS_OUT any other must close more than 0: an effect that leaves the whole gap is not its cause.
    Effects of the logged times, and one whose seconds are known from another vehicle's log, need close nothing.
    """
    hypothesis = selection.named_hypothesis
    of_known_seconds = any(s.passing_key == KNOWN_OVERHEAD for s in selection.named_steps)
    if not selection.policy.must_close_gap or hypothesis is None or of_known_seconds:
        return None
    if is_of_the_loop_alone(data, selection):
        return LEAST_CLOSED
    if gap <= STANDS_OUT or any(t.shows_in == CLOCK for t in hypothesis.terms):
        return None
    return LEAST_CLOSED if is_one_passing_effect(selection) else 0.0


def closes_too_little(data: Data, selection: Selection, gap: float, shrink: float) -> bool:
    """Whether the effects named close less of the gap than they must, or nothing.

    gap: as for `least_shrink`; shrink: fraction of it that they close.
    """
    least = least_shrink(data, selection, gap)
    return least is not None and (shrink < least or shrink <= 0.0)


def with_names_withdrawn(data: Data, selection: Selection, shrink: float) -> Selection:
    """The selection with no effect named, as those that were named close too little of the gap.

    shrink: fraction of the gap that they close. Without them the nameless model gains what it gains over no effect, and
    no fault of the logged times is explained.
    """
    over_none = selection.nameless.over_none
    names = tuple(s.name for s in selection.named_steps)
    return replace(selection, steps=(), nameless=NamelessGain(over_none, over_none, unexplained_clock_gain(data, ())),
                   spectrum_is_assumed=False, withdrawn=WithdrawnNames(names, shrink))


def is_one_passing_effect(selection: Selection) -> bool:
    """Whether one effect is named, and it is a passing one."""
    hypothesis = selection.named_hypothesis
    return hypothesis is not None and len(selection.named_steps) == 1 and all(t.gate for t in hypothesis.terms)


def is_of_the_loop_alone(data: Data, selection: Selection) -> bool:
    """Whether effects are named, and all of them are of the control loop."""
    hypothesis, names = selection.named_hypothesis, [s.name for s in selection.named_steps]
    if hypothesis is None or not names:
        return False
    if len(names) == 1:
        return _of_the_loop(data, hypothesis.terms)
    return not _not_of_the_loop(data, hypothesis.terms, names)


def named_beside_the_loop(data: Data, selection: Selection) -> list[str]:
    """Effects that recorded flights name beside some of the control loop; empty where not both kinds are named.

    Whether those of the loop stay beside them: `loop_closes_too_little`. Where all are of the loop, `least_shrink`.
    """
    hypothesis = selection.named_hypothesis
    if not selection.policy.must_close_gap or hypothesis is None:
        return []
    names = [s.name for s in selection.named_steps]
    others = _not_of_the_loop(data, hypothesis.terms, names)
    return others if len(others) < len(names) else []


def _not_of_the_loop(data: Data, terms: Sequence[Term], names: Sequence[str]) -> list[str]:
    """The effects, by name, of which no term that always acts changes the control loop."""
    return [n for n in names if not _of_the_loop(data, [t for t in terms if t.name == n])]


def loop_closes_too_little(shrink: float, shrink_of_others: float) -> bool:
    """Whether effects of the control loop close less than LEAST_CLOSED beyond what those beside them close alone.

    shrink: fraction of the gap that all close; shrink_of_others: that the others close, judged without them.
    """
    return shrink - shrink_of_others < LEAST_CLOSED


def _of_the_loop(data: Data, terms: Sequence[Term]) -> bool:
    """Whether terms that always act change the control loop."""
    loop, mean = data.study.loop, [t for t in terms if t.shows_in == MEAN and not t.gate]
    if loop is None or not mean:
        return False
    return loop.changes_loop([t.active() for t in mean]) or any(t.signature.loop_only for t in mean)
