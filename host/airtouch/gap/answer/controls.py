"""What the answer is compared with: a deliberately wrong effect, and the vehicle as its file declares it."""

from collections.abc import Sequence

from airtouch.gap.answer.ranking import alike_of
from airtouch.gap.answer.shrink import Gap, closure_of, closure_of_jitter, gap_of, is_only_jitter
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.fit import fit, mean_parameters
from airtouch.gap.flights.flight import Flight
from airtouch.gap.naming.judging import halves
from airtouch.gap.naming.records import Hypothesis, Selection
from airtouch.gap.result import Closure, Control, Diagnosis
from airtouch.gap.signatures import candidates
from airtouch.gap.signatures.signature import CLOCK, WRONG
from airtouch.gap.study import Study


def control_of(data: Data, selection: Selection, gap: Gap) -> Control | None:
    """The gap with a deliberately wrong effect in the model.

    None where none of WRONG is wrong, or where jitter alone is named: its gap is that of the logged times, which no
    other effect changes.
    """
    if is_only_jitter(selection.named_hypothesis):
        return None
    right = {name for group in alike_of(selection) for name in group} | {s.name for s in selection.named_steps}
    variants = candidates.all_candidates()
    name = next((n for n in WRONG if n in variants and n not in right), None)
    if name is None:
        return None
    fits = tuple(fit(data, half, variants[name][0]) for half in selection.halves)
    return Control(name, closure_of(data, selection.halves, Hypothesis(name, fits[0].terms, 0.0, fits), gap))


def arms_of(declared: Study | None, judged: Sequence[Flight], selection: Selection, answer: Diagnosis,
            ) -> dict[str, Closure]:
    """How far the effects named close the gap with each of two models of the vehicle, by its name.

    "declared": the vehicle as its file declares it, the effects fitted anew beside it; "calibrated": the vehicle as
    calibrated on the baseline flights, from which the answer is. Without a baseline the answer itself is "declared".

    declared: the study of the vehicle as declared, None where the answer is held against that already; judged: the
    flights that the answer comes from; answer: names an effect.
    """
    assert answer.shrink is not None and selection.named_hypothesis is not None  # it names an effect
    overall = Closure(answer.gap["before"], answer.gap["after"], answer.shrink)
    if declared is None:
        return {"declared": overall}
    data = Data(declared, judged)
    if is_only_jitter(selection.named_hypothesis):
        return {"declared": closure_of_jitter(data), "calibrated": overall}
    both_halves = halves(data)
    terms = tuple(t for t in selection.named_hypothesis.terms if t.shows_in != CLOCK)
    start = mean_parameters(selection.named_hypothesis.fits[0].terms if selection.named_hypothesis.fits else ())
    fits = tuple(fit(data, half, terms, start) for half in both_halves)
    gap = gap_of(data, both_halves, Hypothesis(selection.named_hypothesis.name, terms, 0.0, fits))
    return {"declared": gap.closure, "calibrated": overall}
