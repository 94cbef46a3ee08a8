"""Why a candidate is not the answer, in a sentence: for the ranking, and for the effects that come nearest."""

from airtouch.gap.answer.words import joined
from airtouch.gap.evidence.cells import REST_VIEW, place_of
from airtouch.gap.naming.policy import PASSING_GAIN
from airtouch.gap.naming.records import Hypothesis, Selection, Step
from airtouch.gap.naming.unknown import (
    counterevidence,
    is_explained,
    over_prediction_ratio,
    remainder_ratio,
    unsteadiness_ratio,
)
from airtouch.gap.relations.inference import LEAST_EVIDENCE, Inference
from airtouch.gap.result import Rejected
from airtouch.gap.signals.channels import CHANNEL_WORDS
from airtouch.gap.signatures.signature import RELATIONS_ONLY

GAP_AT_FLOOR = "the gap as a whole is at its floor"
NEAREST = 3  #: effects that are reported with the reason why they fail; chosen: the rest are in the ranking


def why_not(selection: Selection, name: str, verdict: str) -> str:
    """The reason why a candidate of the ranking is not the answer, "" for the answer.

    name: an effect, "none" or "unknown". verdict: see `ranking.verdict_of`.
    """
    first = selection.named_steps[0].name if selection.named_steps else ""
    step = next((s for s in selection.named_steps[1:] if s.name == name), None)
    if name == verdict or (verdict == "effect" and name == first):
        return ""
    if step is not None and verdict == "effect":
        return _why_beside(selection, step)
    if verdict == "none" and name in {s.name for s in selection.named_steps}:
        return GAP_AT_FLOOR
    if name == "unknown":
        return _why_not_unknown(selection)
    if name == "none":
        return _why_not_none(selection)
    return shortfall(selection, selection.single_effects[name])


def nearest(selection: Selection) -> list[Rejected]:
    """The effects that gain most, each with what speaks against it where the verdict is `unknown`."""
    gaining = [h for h in selection.single_effects.values() if selection.gain(h) > 0.0]
    best_first = sorted(gaining, key=lambda h: -selection.gain(h))
    return [Rejected(h.name, shortfall(selection, h)) for h in best_first[:NEAREST]]


def only_in_relations(selection: Selection, effects: str) -> str:
    """Why the replay does not show some effects. effects: a pronoun for them, `it` or `them`."""
    reason = ("and here the replay gave the answer" if selection.library_holds else
              "of which no library holds for these flights")
    return f"only the relations of the signals show {effects}, {reason}"


def shortfall(selection: Selection, hypothesis: Hypothesis) -> str:
    """What an effect lacks to be the answer, in nats: of held-out log likelihood, or of the signals' relations."""
    if selection.inference is not None:
        return shortfall_by_relations(selection, selection.inference, hypothesis.name)
    if hypothesis.name in RELATIONS_ONLY:
        return only_in_relations(selection, "it")
    least = selection.least_nats[hypothesis.name]
    if hypothesis.name in {s.name for s in selection.named_steps}:  # the best there is, and not enough
        return _against_in_words(selection)
    if hypothesis.evidence < least and hypothesis.name in selection.outgained:
        passing = selection.outgained[hypothesis.name]
        return (f"in some seconds alone it gains {passing.gain:.0f} nats, but {passing.steady_name} all along "
                f"{passing.steady_gain:.0f}, and {PASSING_GAIN:.0f} more than that are needed")
    if hypothesis.gain < least:
        return f"held-out data gain {hypothesis.gain:.1f} nats by it, but {least:.0f} are needed"
    if hypothesis.evidence < least:
        return (f"as strong as it often seems to be in nominal flights: of {hypothesis.gain:.0f} nats "
                f"{max(hypothesis.evidence, 0.0):.1f} are beyond that scatter, but {least:.0f} are needed")
    withdrawn, shrink = selection.withdrawn
    if hypothesis.name in withdrawn:
        others = [name for name in withdrawn if name != hypothesis.name]
        beside = f" together with {joined(others)}" if others else ""
        return (f"closes {max(shrink, 0.0):.0%} of the gap{beside} where the cells in which it gains count as well, "
                "too little to be its cause")
    if withdrawn:
        one = "s" * (len(withdrawn) == 1)
        return (f"gains {hypothesis.gain:.0f} nats, but {joined(list(withdrawn))} explain{one} the flights better, and "
                f"close{one} too little of the gap")
    if selection.named_hypothesis:
        names = [s.name for s in selection.named_steps]
        return (f"gains {hypothesis.gain:.0f} nats, while {joined(names)} gain{'s' * (len(names) == 1)} "
                f"{selection.named_hypothesis.gain:.0f}")
    return f"gains {hypothesis.gain:.0f} nats, while a model without names gains {selection.nameless.over_none:.0f}"


def shortfall_by_relations(selection: Selection, inference: Inference, name: str) -> str:
    """What an effect lacks to be named by the relations of the signals, in nats."""
    gain, named = inference.evidence[name], [s.name for s in selection.named_steps]
    if name in named:
        return _against_in_words(selection)
    if gain < LEAST_EVIDENCE:
        return f"the relations of the signals gain {gain:.1f} nats by it, but {LEAST_EVIDENCE:.0f} are needed"
    if not named:
        return f"the relations of the signals gain {gain:.1f} nats by it, and more by a model without names"
    first = named[0]
    return f"the relations of the signals gain {gain:.0f} nats by it, but {inference.evidence[first]:.0f} by {first}"


def _against_in_words(selection: Selection) -> str:
    """The strongest evidence against the effects named, with its limit, as a clause whose subject is `it`."""
    lost, worst = selection.over_prediction
    others = max(remainder_ratio(selection), unsteadiness_ratio(selection))
    if worst is not None and over_prediction_ratio(selection) >= others:
        return (f"it loses {lost:.0f} nats where it says more than the flights show, most in {cell_in_words(worst)}, "
                f"but only up to {selection.policy.unknown.least:.0f} may be chance")
    return _remainder_in_words(selection, "it")


def _remainder_in_words(selection: Selection, name: str) -> str:
    """The nats that the effects named leave, 0 at least, with their limit. name: of the effects, "" where none is.

    Where that is more over its limit, the nats by which the flights are less steady than nominal ones.
    """
    unsteady_nats, may_be_chance, _ = selection.unsteadiness_rarity
    if unsteadiness_ratio(selection) > remainder_ratio(selection):
        most = f"{'but only' if unsteady_nats > may_be_chance else 'and'} up to {may_be_chance:.1f} may be chance"
        return f"torque and lift are less steady than in nominal flights by {unsteady_nats:.1f} nats, {most}"
    remainder = counterevidence(selection)
    nats = f"{max(remainder.nats, 0.0):.0f} nats"
    most = f"{'but only' if remainder.is_too_much else 'and'} up to {remainder.limit:.0f}"
    if remainder.of_distance:
        place = f"from {name} than nominal flights from none" if name else "from the model than nominal flights do"
        return f"the flight lies {nats} farther {place}, {most} may be chance"
    beside = f" beside {name}" if name else ""
    return f"a model without names gains {nats}{beside}, {most} may be left"


def cell_in_words(cell: int) -> str:
    """A cell of the spectra as `lift at 0-0.6 Hz at rest`: channel, band, and whether on the ground."""
    view, channel, (low, high) = place_of(cell)
    return f"{CHANNEL_WORDS[channel]} at {low:g}-{high:g} Hz{' at rest' if view == REST_VIEW else ''}"


def _why_beside(selection: Selection, step: Step) -> str:
    """The reason why an effect named beside the first has no more probability than the ranking says."""
    first = selection.named_steps[0].name
    if selection.inference is not None:
        return f"named beside {first}: the probability is that it acts alone"
    assert step.leave_one_out_gain is not None  # several are named
    return (f"named beside {first}: adds {step.leave_one_out_gain:.0f} nats to the others; the probability is that it "
            "acts alone")


def _why_not_unknown(selection: Selection) -> str:
    """The reason why the answer is not that no known effect explains the gap."""
    if not is_explained(selection):
        return GAP_AT_FLOOR
    return _remainder_in_words(selection, joined([s.name for s in selection.named_steps]))


def _why_not_none(selection: Selection) -> str:
    """The reason why the answer is not that there is no gap."""
    if selection.named_hypothesis is None:
        return _remainder_in_words(selection, "")
    first = selection.named_steps[0].name
    gain = selection.inference.evidence[first] if selection.inference else selection.named_hypothesis.gain
    return f"{first} gains {gain:.0f} nats over it"
