"""When recorded flights may name an effect: it must close a part of their gap where they differ by it anyway.

Between two days the gains of a loop differ a little, and nominal flights meet gusts. Neither is what a gap comes from.
"""

from collections.abc import Sequence
from dataclasses import replace

from airtouch.gap.evidence.data import Data
from airtouch.gap.naming.selection import Selection
from airtouch.gap.passing.gates import KNOWN_OVERHEAD
from airtouch.gap.signatures.signature import MEAN
from airtouch.gap.signatures.term import Term

#: share of the gap that the effect named must close: as much as the loop model may be wrong by,
#: `torque_power.TORQUE_DOUBT`; chosen
LEAST_CLOSED = 0.25
#: gap, in units of the floor, from which what comes and goes must close it: the two halves of the data seldom share its
#: seconds; chosen
STANDS_OUT = 1.1


def must_close_the_gap(data: Data, selection: Selection) -> bool:
    """Whether these are recorded flights whose named effect lies between any two days: a loop's, or one that passes.

    An effect whose seconds are known from another vehicle's log is no gust.
    """
    if not data.study.recorded:
        return False
    return changes_the_loop(data, selection) or (comes_and_goes(selection) and selection.named[0].key != KNOWN_OVERHEAD)


def closes_too_little(data: Data, selection: Selection, gap: float, closed: float) -> bool:
    """Whether such an effect closes too little of the gap to be named.

    gap: before it is in the model, in units of the floor; closed: share of it that the effect takes away. What comes
    and goes is held to that only where a gap stands out that it could take away.
    """
    return closed < LEAST_CLOSED and (changes_the_loop(data, selection) or gap > STANDS_OUT)


def with_none_named(selection: Selection) -> Selection:
    """The same flights with no effect named; what the nameless model gains is that of none."""
    nameless = replace(selection.nameless, beside=selection.nameless.alone)
    return replace(selection, steps=(), nameless=nameless, assumed=False)


def comes_and_goes(selection: Selection) -> bool:
    """Whether one effect is named, and it comes and goes."""
    chosen = selection.chosen
    return chosen is not None and len(selection.named) == 1 and all(t.gate for t in chosen.terms)


def changes_the_loop(data: Data, selection: Selection) -> bool:
    """Whether one effect is named, and it is one of the control loop."""
    chosen = selection.chosen
    return chosen is not None and len(selection.named) == 1 and _of_the_loop(data, chosen.terms)


def named_beside_the_loop(data: Data, selection: Selection) -> list[str]:
    """Effects that recorded flights name beside some of the control loop, which must close LEAST_CLOSED more.

    None where no effect of the loop is named, or nothing else.
    """
    chosen = selection.chosen
    if not data.study.recorded or chosen is None:
        return []
    names = [s.name for s in selection.named]
    others = [n for n in names if not _of_the_loop(data, [t for t in chosen.terms if t.name == n])]
    return others if len(others) < len(names) else []


def _of_the_loop(data: Data, terms: Sequence[Term]) -> bool:
    """Whether terms that always act change the control loop."""
    law, mean = data.study.controller, [t for t in terms if t.shows_in == MEAN and not t.gate]
    if law is None or not mean:
        return False
    return law.changes_loop([t.active() for t in mean]) or any(t.signature.loop_only for t in mean)
