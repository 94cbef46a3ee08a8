"""Infer the effects in a flight from the relations of its signals: likeliest hypothesis, evidence for each effect.

`infer` adds effects one by one while each gains enough (`_search`), a third only where two do not suffice. The
counterevidence is measured in two ways, each with its limit: what a nameless disturbance gains beside the effects
(`_nameless_gain`), and how far the flight lies from them (`_excess_distance`).
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.special import logsumexp

from airtouch.gap.evidence.counterevidence import Counterevidence
from airtouch.gap.relations.effect_class import EffectClass
from airtouch.gap.relations.hypotheses import FlightHypotheses, LearnedModel, RelationsHypothesis
from airtouch.gap.relations.library import Library
from airtouch.gap.relations.readout import Reading, Readout, read_out
from airtouch.gap.signatures.alike import interchangeable, same_things
from airtouch.simulation.effects import get

# A share is a fraction of the evidence of the effects named.

#: nats. An effect must gain as many over no effect, a second one over the first. A larger number misses weak effects, a
#: smaller one names effects in nominal flights: 1 of 150 nominal flights gained more, 99 of 100 flights with an effect
#: from its weakest strength on gained as many (all of `learning.SEED`)
LEAST_EVIDENCE = 18.0
#: nats. A nameless disturbance may gain as many beside the right effects, whatever their evidence; chosen. A smaller
#: number answers `unknown` more often: 7 was tried on 2026-11-25 and taken back after the opened set of seed 112233
#: (host/docs/looks.md)
NAMELESS_ALLOWANCE = 10.0
#: nats. Effects must be so much likelier than without the last one and with a nameless disturbance in its place. A
#: larger number names fewer pairs: of 44 wrong pairs, found where the right effect was left out, 36 were not
NAMELESS_MARGIN = 30.0
#: share that a nameless disturbance may gain beside the effects, added to that of their classes, as no curve is exact;
#: chosen on flights of `learning.SEED`. A larger number answers `unknown` less often
MODEL_ERROR_SHARE = 0.01
#: share that is added once more for several effects, as two effects are not their sum; chosen there. A larger number
#: answers `unknown` less often
PAIR_ERROR_SHARE = 0.01
#: standard deviations of the excess distance of right effects. A flight may lie as far from the effects named; farther
#: ones are `unknown`. With an evidence below 10,000 nats 2 to 3 of 100 right flights lie farther, half of them because
#: they hit something (2,750 flights of `learning.SEED`, standard deviations and limit by other halves). A larger number
#: answers `unknown` less often
MOST_EXCESS_DEVIATIONS = 3.5
MOST_EFFECTS = 3  #: effects that are named together, at most; chosen. Each more costs a round of fits
#: hypotheses to which one more effect is added, and additions to each that are fitted in turn; chosen. A larger number
#: takes more time
BEAM_WIDTH = 3
#: divisor of the evidence in probabilities, as the densities' tails are heavier than normal; chosen. A larger number
#: makes probabilities less certain
EVIDENCE_TEMPERATURE = 2.0


@dataclass(frozen=True)
class Inference:
    """What the relations of a flight's signals show.

    classes: classes of the likeliest effects; evidence: nats that each effect alone gains over none; counterevidence:
    against the likeliest effects, the gain of a nameless disturbance beside them or the flight's excess distance from
    them, whichever is larger relative to its limit; readings: parameters of the likeliest effects, of those that the
    library is calibrated for, by effect and parameter; without_sign: those of these effects whose sign does not show.
    """

    classes: tuple[EffectClass, ...]
    evidence: Mapping[str, float]
    counterevidence: Counterevidence
    readings: Mapping[str, Mapping[str, Reading]] = field(default_factory=dict)
    without_sign: tuple[str, ...] = ()

    @property
    def likeliest(self) -> str:
        """The effect that alone gains most over none; "" where there is none."""
        return max(self.evidence, key=lambda name: self.evidence[name], default="")

    def probabilities(self) -> dict[str, float]:
        """Probabilities of each effect alone and of `none`; they sum to 1.

        `none` counts as an effect of LEAST_EVIDENCE: an effect that has just enough evidence is as likely as none.
        """
        names = [*self.evidence, "none"]
        score = np.array([*self.evidence.values(), LEAST_EVIDENCE]) / EVIDENCE_TEMPERATURE
        return dict(zip(names, np.exp(score - logsumexp(score)).tolist(), strict=True))


def infer(library: Library, coordinates: np.ndarray) -> Inference:
    """Infer the effects that flights with coordinates (n, Q) have in common."""
    count = len(coordinates)
    flight = FlightHypotheses(np.sqrt(count) * coordinates.mean(axis=0), model_of_mean(library.model, count))
    singles = flight.single_effects()
    best, counterevidence = _search(flight, singles, library)
    return Inference(
        classes=best.classes, evidence=_by_effect(singles), counterevidence=counterevidence,
        readings=_readings(best), without_sign=_without_sign(best))


def _readings(best: RelationsHypothesis) -> Mapping[str, Mapping[str, Reading]]:
    """Parameters of the effects of a hypothesis, by effect and name.

    An effect of which several parameters act gives none: each was calibrated acting alone.
    """
    count = Counter(best.effect_names)
    return {effect: read_out(readout, get(effect), strength)
            for effect, readout, strength in _calibrated(best) if count[effect] == 1}


def _without_sign(best: RelationsHypothesis) -> tuple[str, ...]:
    """The effects of a hypothesis whose strength does not tell their sign."""
    return tuple(effect for effect, readout, strength in _calibrated(best) if not readout.shows_sign(strength))


def _calibrated(best: RelationsHypothesis) -> list[tuple[str, Readout, np.ndarray]]:
    """Effect, readout and strength of each class of a hypothesis whose strength was calibrated."""
    return [(c.effect, c.calibration.readout, f.strength) for c, f in zip(best.classes, best.fits, strict=True)
            if c.calibration.readout is not None]


def _counterevidence(flight: FlightHypotheses, best: RelationsHypothesis, library: Library) -> Counterevidence:
    """The evidence against effects, by the measure of the two that is larger relative to its limit."""
    of_two = _nameless_gain(flight, best), _excess_distance(flight, best, library)
    return max(of_two, key=lambda c: c.nats / c.limit)


def _nameless_gain(flight: FlightHypotheses, best: RelationsHypothesis) -> Counterevidence:
    """What a nameless disturbance gains beside effects."""
    largest = max((c.calibration.nameless_share for c in best.classes), default=0.0)
    share = largest + MODEL_ERROR_SHARE + PAIR_ERROR_SHARE * (len(best.fits) > 1)
    return Counterevidence(flight.nameless_evidence(best) - best.evidence, NAMELESS_ALLOWANCE + share * best.evidence,
                           of_distance=False)


def _excess_distance(flight: FlightHypotheses, best: RelationsHypothesis, library: Library) -> Counterevidence:
    """How much farther a flight lies from effects than nominal flights from none."""
    largest = max((c.calibration.distance_scatter for c in best.classes), default=0.0)
    distance_scatter = float(np.hypot(largest, library.pair_distance_scatter * (len(best.fits) > 1)))
    limit = MOST_EXCESS_DEVIATIONS * library.excess_deviation(distance_scatter, best.evidence)
    return Counterevidence(library.excess(flight.squared_distance(best)), limit, of_distance=True)


def model_of_mean(model: LearnedModel, count: int) -> LearnedModel:
    """The model of the mean of `count` flights times the square root of their number.

    Nominal scatter stays as it is, shifts are longer by that root, and single flights lie about them as before.
    """
    if count == 1:
        return model
    return replace(model, classes=tuple(replace(c, table=np.sqrt(count) * c.table, variances=c.variances / count)
                                        for c in model.classes))


def _search(flight: FlightHypotheses, singles: list[RelationsHypothesis], library: Library,
            ) -> tuple[RelationsHypothesis, Counterevidence]:
    """The likeliest hypothesis, with no more effects than its evidence supports, and the counterevidence.

    A second effect is always tried, a third only where the counterevidence to the two is too much. A third is tried
    beside the chosen two alone, a second beside each of the BEAM_WIDTH likeliest: which of them is right may show only
    with the second.
    """
    if not singles or singles[0].evidence < LEAST_EVIDENCE:
        return flight.no_effect, _counterevidence(flight, flight.no_effect, library)
    best, beam, counterevidence = _likeliest_name(singles, library), singles[:BEAM_WIDTH], None
    while len(best.fits) < MOST_EFFECTS and (counterevidence is None or counterevidence.is_too_much):
        larger = _with_one_more(flight, beam)
        first = _likeliest_name(larger, library) if larger else None
        if first is None or first.evidence < _required_of_one_more(flight, best):
            break
        best, beam, counterevidence = first, [first], _counterevidence(flight, first, library)
    return best, _counterevidence(flight, best, library) if counterevidence is None else counterevidence


def _required_of_one_more(flight: FlightHypotheses, best: RelationsHypothesis) -> float:
    """Evidence, nats, that a hypothesis with one more effect than this one must have.

    It must gain LEAST_EVIDENCE and what wrong second effects gain beside those classes, and explain the flight better
    than a nameless disturbance in the place of the effect would.
    """
    share = max(c.calibration.second_share for c in best.classes)
    return max(best.evidence + LEAST_EVIDENCE + share * best.evidence,
               flight.nameless_evidence(best) + NAMELESS_MARGIN)


def _likeliest_name(hypotheses: Sequence[RelationsHypothesis], library: Library) -> RelationsHypothesis:
    """The likeliest hypothesis of the likeliest thing: hypotheses that are names of one thing count together.

    Each has the weight that the choice among the classes of its effects leaves; evidence counts as in probabilities.
    """
    groups: list[list[RelationsHypothesis]] = []
    for h in hypotheses:
        group = next((g for g in groups if same_things(h.effect_names, g[0].effect_names)), None)
        if group is None:
            groups.append([h])
        else:
            group.append(h)
    cost = library.choice_cost
    log_weights = [[h.evidence / EVIDENCE_TEMPERATURE - sum(cost[name] for name in h.effect_names) for h in group]
                   for group in groups]
    weights = [logsumexp(of_group) for of_group in log_weights]
    return max(groups[int(np.argmax(weights))], key=lambda h: h.evidence)


def _with_one_more(flight: FlightHypotheses, beam: list[RelationsHypothesis]) -> list[RelationsHypothesis]:
    """Hypotheses with one more effect, all effects refitted in turn, the likeliest first.

    Of the same classes, reached from two hypotheses of the beam, the likelier is kept.
    """
    additions = sorted((h for one in beam for h in flight.with_one_more(one, may_stand_beside)[:BEAM_WIDTH]),
                      key=lambda h: h.evidence)
    by_classes = {frozenset((f.effect_class.name, f.effect_class.shape) for f in h.fits): h for h in additions}
    likeliest = sorted(by_classes.values(), key=lambda h: -h.evidence)[:BEAM_WIDTH]
    return sorted((flight.refitted(h) for h in likeliest), key=lambda h: -h.evidence)


def may_stand_beside(other: EffectClass, hypothesis: RelationsHypothesis) -> bool:
    """Whether a class may be added to a hypothesis.

    It may not be another name of an effect in it; it may be another parameter of one, if each parameter has a class.
    """
    another = other.own_parameter is not None and other.name not in hypothesis.names
    return all(not interchangeable(other.effect, e) or (another and other.effect == e) for e in hypothesis.effect_names)


def _by_effect(singles: list[RelationsHypothesis]) -> dict[str, float]:
    """Evidence for each effect, nats: the log of the mean of its classes' Bayes factors."""
    by_effect: dict[str, list[float]] = {}
    for h in singles:
        by_effect.setdefault(h.fits[0].effect_class.effect, []).append(h.evidence)
    return {name: float(logsumexp(v) - np.log(len(v))) for name, v in by_effect.items()}
