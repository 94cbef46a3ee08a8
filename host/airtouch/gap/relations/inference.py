"""Which effects the relations of a flight's signals say: the likeliest hypothesis, and the evidence for each effect."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.special import logsumexp

from airtouch.gap.relations.effect_class import EffectClass
from airtouch.gap.relations.hypotheses import Flown, Hypothesis, Learned
from airtouch.gap.relations.library import Library
from airtouch.gap.relations.readout import Reading, read_out
from airtouch.gap.signatures.candidates import alike
from airtouch.simulation.effects import get

#: nats that an effect must gain over none, and a second one over the first: one of 150 nominal flights gained more, and
#: 99 of 100 flights with an effect from the weakest strength on (all flights of `learning.SEED`)
LEAST_EVIDENCE = 18.0
#: nats that a disturbance without a name may gain beside the right effects, whatever their evidence
LEAST_LEFT = 10.0
#: nats by which two effects must be likelier than one with a disturbance that has no name beside it: of 44 wrong pairs
#: that were found where the right effect was left out, 36 were not
OVER_NAMELESS = 30.0
#: of the evidence of any effects, beside what their classes ask for, that may be left as no curve is exact, and by
#: which a flight may lie off; the same for two effects, which are no sum of each; by what that distance is
#: multiplied. Of 100 flights with an effect 95 are named right so, and 16 get a wrong name where it is left out
#: (`learning.SEED`)
CRUDE_LEFT, CRUDE_FAR, PAIR_LEFT, PAIR_FAR, FAR = 0.01, 0.02, 0.01, 0.07, 1.5
MOST_EFFECTS = 3
BEAM = 3  #: hypotheses beside which another effect is looked for, and of what is found those that are fitted in turn
TEMPERATURE = 2.0  #: of the probabilities: the densities' tails are heavier than normal ones
Shares = Mapping[tuple[str, float | None], float]  #: of each class by its name and shape


@dataclass(frozen=True)
class Inference:
    """classes: of the effects that are there, the likeliest; evidence: nats of each effect alone over none.

    left_before: nats that a disturbance without a name gains over none; left: what is left beside the effects, what it
    gains there or how much farther than nominal flights this one lies; allowed: what may be left where they are right.
    readings: of the likeliest effects, their parameters as far as the library tells them.
    """

    classes: tuple[EffectClass, ...]
    evidence: Mapping[str, float]
    left_before: float
    left: float
    allowed: float
    readings: Mapping[str, Reading] = field(default_factory=dict)

    def probabilities(self) -> dict[str, float]:
        """Of each effect alone and of `none`; they sum to 1."""
        names = [*self.evidence, "none"]
        score = np.array([*self.evidence.values(), LEAST_EVIDENCE]) / TEMPERATURE
        return dict(zip(names, np.exp(score - logsumexp(score)).tolist(), strict=True))


def infer(library: Library, coordinates: np.ndarray) -> Inference:
    """What coordinates (n, Q) of flights say of the effects that they have in common."""
    many = len(coordinates)
    flown = Flown(np.sqrt(many) * coordinates.mean(axis=0), of_mean(library.learned, many))
    singles = flown.singles()
    more, left, far = ({(c.name, c.shape): float(x) for c, x in zip(library.learned.classes, shares, strict=True)}
                       for shares in (library.more, library.left, library.far))
    best = _chosen(flown, singles, more)
    both = _left(flown, best, left), _beyond(flown, library, best, far)
    return Inference(tuple(f.of for f in best.fits), _by_effect(singles), flown.nameless(flown.none),
                     *max(both, key=lambda b: b[0] / b[1]), _readings(best))


def _readings(best: Hypothesis) -> Mapping[str, Reading]:
    """Parameters of the effects of a hypothesis, those of an effect's several classes together."""
    out: dict[str, dict[str, tuple[float, float]]] = {}
    for f in best.fits:
        if f.of.readout is not None:
            out.setdefault(f.of.effect, {}).update(read_out(f.of.readout, get(f.of.effect), f.strength))
    return out


def _left(flown: Flown, best: Hypothesis, shares: Shares) -> tuple[float, float]:
    """Nats that a disturbance without a name gains beside effects, and how many it may gain."""
    share = _largest(best, shares) + CRUDE_LEFT + PAIR_LEFT * (len(best.fits) > 1)
    return flown.nameless(best) - best.evidence, LEAST_LEFT + share * best.evidence


def _beyond(flown: Flown, library: Library, best: Hypothesis, shares: Shares) -> tuple[float, float]:
    """Nats by which a flight lies farther from effects than nominal ones from none, and by how many it may."""
    share = _largest(best, shares) + CRUDE_FAR + PAIR_FAR * (len(best.fits) > 1)
    return library.beyond(flown.distance(best)), FAR * (library.usual + share * best.evidence)


def _largest(of: Hypothesis, shares: Shares) -> float:
    """The largest share of the classes of a hypothesis, 0 without any."""
    return max((shares[f.of.name, f.of.shape] for f in of.fits), default=0.0)


def of_mean(learned: Learned, many: int) -> Learned:
    """What was learned, for the mean of so many flights times the square root of their number.

    Nominal scatter stays as it is, shifts are longer by that root, and single flights lie about them as before.
    """
    if many == 1:
        return learned
    return replace(learned, classes=tuple(replace(c, table=np.sqrt(many) * c.table, spread=c.spread / many)
                                          for c in learned.classes))


def _chosen(flown: Flown, singles: list[Hypothesis], more: Shares) -> Hypothesis:
    """The likeliest hypothesis, with as few effects as its evidence lets it have."""
    best, held = (singles[0] if singles else flown.none), singles[:BEAM]
    if best.evidence < LEAST_EVIDENCE:
        return flown.none
    while len(best.fits) < MOST_EFFECTS:
        tried = _further(flown, held)
        if not tried:
            break
        first = tried[0]
        share = _largest(best, more)
        if first.evidence < best.evidence + LEAST_EVIDENCE + share * best.evidence \
                or first.evidence < flown.nameless(best) + OVER_NAMELESS:
            break
        best, held = first, tried[:1]
    return best


def _further(flown: Flown, held: list[Hypothesis]) -> list[Hypothesis]:
    """Hypotheses with one effect more, fitted in turn, the best first."""
    tried = {frozenset((f.of.name, f.of.shape) for f in h.fits): h
             for one in held for h in reversed(flown.beside(one, may_stand_beside)[:BEAM])}
    worth = sorted(tried.values(), key=lambda h: -h.evidence)[:BEAM]
    return sorted((flown.settled(h) for h in worth), key=lambda h: -h.evidence)


def may_stand_beside(other: EffectClass, held: Hypothesis) -> bool:
    """Whether a class is of another effect than those of a hypothesis, and no other name of one of them.

    Or of another parameter of one of them, where each parameter has a class of its own.
    """
    another = other.of_one_parameter and other.name not in held.names
    return all(not alike(other.effect, e) or (another and other.effect == e) for e in held.effects)


def _by_effect(singles: list[Hypothesis]) -> dict[str, float]:
    """Evidence for each effect, the mean of its classes' likelihoods."""
    own: dict[str, list[float]] = {}
    for h in singles:
        own.setdefault(h.fits[0].of.effect, []).append(h.evidence)
    return {name: float(logsumexp(v) - np.log(len(v))) for name, v in own.items()}
