"""Which names stand: those that close too little of the gap are withdrawn, and the candidates are put in order."""

from collections.abc import Mapping, Sequence

from airtouch.gap.balance.hover_posterior import OTHER_WEIGHT, answer_of
from airtouch.gap.naming.policy import LEAST_CLOSED, STANDS_OUT
from airtouch.gap.result import Closure, Quantity, RankedCandidate

NO_EFFECTS = ("none", "unknown")  #: candidates that name no effect
NOT_IN_BALANCE = "the gap is at its floor, and the balance of the motors alone does not speak for it"
LEAST_PROBABILITY = 1e-12  #: of a candidate that others are so many times more probable than, at least


def closes_too_little(closure: Closure) -> bool:
    """Whether an effect closes less than LEAST_CLOSED of a gap over STANDS_OUT, too little to be its cause.

    Of a smaller gap it need close nothing, but must not make it larger. The tails of the likelihood forgive one number
    of the balance that is far off, however far: an effect may be much more probable than the others, and leave the gap
    as it is.
    """
    if closure.before <= STANDS_OUT:
        return closure.after > closure.before
    return closure.shrink.value < LEAST_CLOSED


def balance_does_not_show(name: str, closure: Closure, by_balance: Mapping[str, float]) -> bool:
    """Whether the gap is at its floor, and the balance alone does not make an effect more probable than none.

    by_balance: the probabilities without the powers. There unsteadiness alone names nothing, as many things shake a
    vehicle.
    """
    return closure.before <= STANDS_OUT and _weights_together(name, by_balance)[name] <= by_balance["none"]


def with_names_withdrawn(probability_of: Mapping[str, float], closures: Mapping[str, Closure],
                         by_balance: Mapping[str, float]) -> tuple[dict[str, float], list[str]]:
    """The probabilities with those of names that are withdrawn at 0, and these names, the likeliest first.

    Those are withdrawn that close too little, or that the balance does not show. by_balance: the probabilities without
    the powers. A weight is withdrawn in both forms. If an effect that is not withdrawn is then the likeliest, the
    others add up to 1; if one of NO_EFFECTS is, `unknown` takes the probability of these names.
    """
    probability, withdrawn, withdrawn_probability = dict(probability_of), [], 0.0
    while (first := answer_of(probability)[0]) not in NO_EFFECTS and (
            closes_too_little(closures[first]) or balance_does_not_show(first, closures[first], by_balance)):
        withdrawn.append(first)
        withdrawn_probability += _weights_together(first, probability)[first]
        probability.update({n: 0.0 for n in (first, OTHER_WEIGHT.get(first)) if n in probability})
    if first in NO_EFFECTS:
        return {**probability, "unknown": probability["unknown"] + withdrawn_probability}, withdrawn
    total = sum(probability.values()) if withdrawn else 1.0
    return {n: p / total for n, p in probability.items()}, withdrawn


def ranking_of(first: str, probability_of: Mapping[str, float], closures: Mapping[str, Closure],
               withdrawn: Sequence[str] = ()) -> list[RankedCandidate]:
    """Every candidate, best first. A weight's two forms count as one where one of them is the answer.

    No effect and a nameless change are no effects to switch on: how far they close the gap is not measured. Names that
    were withdrawn follow the answer.
    """
    together = _weights_together(first, probability_of)
    best = max(together.values())

    def reason(name: str, probability: float) -> str:
        """Why a candidate is not the answer; empty for the answer."""
        if name == first:
            return ""
        if name in withdrawn and closures[name].before <= STANDS_OUT:
            return NOT_IN_BALANCE
        if name in withdrawn:
            return f"closes {max(closures[name].shrink.value, 0.0):.0%} of the gap, too little to be its cause"
        if probability == 0.0 and (other := OTHER_WEIGHT.get(name)) in (first, *withdrawn):
            return f"counted with {other}: a weight, whether its own mass shows or not"
        return f"{best / max(probability, LEAST_PROBABILITY):.3g} times less probable than {first}"

    def candidate(name: str, probability: float) -> RankedCandidate:
        """A candidate's row."""
        is_effect = name not in NO_EFFECTS
        return RankedCandidate(name, probability, closures[name].shrink if is_effect else Quantity(0.0),
                               reason(name, probability), measured=is_effect)

    order = [first, *withdrawn]
    return sorted((candidate(n, p) for n, p in together.items()),
                  key=lambda r: (order.index(r.name) if r.name in order else len(order), -r.probability))


def _weights_together(first: str, probability_of: Mapping[str, float]) -> dict[str, float]:
    """The probabilities, those of a weight's two forms summed in the one that is the answer, if it is."""
    other = OTHER_WEIGHT.get(first)
    if other is None or other not in probability_of:
        return dict(probability_of)
    return {**probability_of, first: probability_of[first] + probability_of[other], other: 0.0}
