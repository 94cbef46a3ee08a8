"""Whether recorded flights may name an effect of the control loop, or one that comes and goes.

Between two days the gains of a loop differ a little, and nominal flights meet gusts. Neither makes a gap. So such an
effect is named only where it closes a part of the gap.
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
    """Whether these are recorded flights with one named effect, of the control loop or one that comes and goes.

    An effect whose seconds are known from another vehicle's log is no gust, and need not close the gap.
    """
    if not data.study.recorded:
        return False
    if names_one_of_the_loop(data, selection):
        return True
    return names_one_that_passes(selection) and selection.named[0].key != KNOWN_OVERHEAD


def closes_too_little(data: Data, selection: Selection, gap: float, closed: float) -> bool:
    """Whether such an effect closes too little of the gap to be named.

    gap: before it is in the model, in units of the floor; closed: share of it that the effect takes away. What comes
    and goes is held to that only where a gap stands out that it could take away.
    """
    return closed < LEAST_CLOSED and (names_one_of_the_loop(data, selection) or gap > STANDS_OUT)


def with_none_named(selection: Selection) -> Selection:
    """The selection with no effect named, beside which the nameless model gains what it gains over none."""
    nameless = replace(selection.nameless, beside=selection.nameless.alone)
    return replace(selection, steps=(), nameless=nameless, assumed=False)


def names_one_that_passes(selection: Selection) -> bool:
    """Whether one effect is named, and it comes and goes."""
    chosen = selection.chosen
    return chosen is not None and len(selection.named) == 1 and all(t.gate for t in chosen.terms)


def names_one_of_the_loop(data: Data, selection: Selection) -> bool:
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
    loop, mean = data.study.controller, [t for t in terms if t.shows_in == MEAN and not t.gate]
    if loop is None or not mean:
        return False
    return loop.changes_loop([t.active() for t in mean]) or any(t.signature.loop_only for t in mean)
