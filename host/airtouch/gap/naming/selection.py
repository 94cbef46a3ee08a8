"""The result of a selection of effects: candidates judged, the steps, and what speaks against the effects named."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from airtouch.gap.evidence.fit import FittedTerms
from airtouch.gap.evidence.problem import BlockSet
from airtouch.gap.relations.inference import Inference
from airtouch.gap.signatures.signature import CLOCK, COMPANIONS
from airtouch.gap.signatures.term import Terms

#: nats that the nameless model may gain over the effects named before `unknown`: where many nominal flights gave the
#: floor, and where none did; both chosen (host/docs/gap.md, "What `unknown` means")
UNKNOWN_GAIN, UNKNOWN_ALONE = 12.0, 25.0
#: and as a share of what the effects named gain, as no model is exact; larger where one of them is random or changes
#: the loop in recorded flights, since its spectrum is assumed, not measured; both chosen
UNKNOWN_SHARE, UNKNOWN_ASSUMED = 0.1, 0.2
SAME_MODELS = 0.5  #: of these in flights of this project's simulator: twice what right names left there, 78 flights
TEMPERATURE = 6.0  #: of probabilities: log likelihoods of real flights are too sure of themselves; chosen


@dataclass(frozen=True)
class Strength:
    """Scaled parameters of one term, as both halves of the flights have them.

    mean (k,): of both halves; covariance (k, k): by chance, 0 but for mean effects, (0, 0) where nobody asks for it;
    apart (k,): half of what the halves differ by. k: of all parameters that the effect may have free; those that its
    variant leaves alone are 0, and nobody knows how far they lie from it.
    """

    mean: np.ndarray = field(default_factory=lambda: np.zeros(0))
    covariance: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    apart: np.ndarray | float = 0.0

    @property
    def variance(self) -> np.ndarray:
        """Variance (k,) of the mean, no less than what the halves differ by says.

        Where the likelihood has two peaks, its curvature at one of them knows nothing of the other.
        """
        return np.maximum(np.diag(self.covariance), np.square(self.apart))


@dataclass(frozen=True)
class Candidate:
    """A hypothesis with its gain over no effect, held-out nats, and its fits of both halves.

    name: its newest effect; terms: all of them, with their values; full: whether it is fitted in full, not to first
    order only. choice_cost: nats that the choice of the effects' variants has cost, which the gain is without;
    gained_while_certain: nats of the gain that effects before the first random one gained while the commands' floor was
    more certain. strength: of the newest effect. evidence: nats that that effect gains over the hypothesis before, and
    no more than its strength says beyond the scatter of nominal flights. named: whether that is enough; if not, it is a
    deviation that nominal flights have as well, and stands beside the effects that are named. key: of one that comes
    and goes, what of `Scatter.passing` it is compared with. share: where several effects are named, nats over the
    hypothesis of the others alone.
    """

    name: str
    terms: Terms
    gain: float
    fits: tuple[FittedTerms, ...] = ()
    full: bool = True
    choice_cost: float = 0.0
    gained_while_certain: float = 0.0
    strength: Strength = field(default_factory=Strength)
    evidence: float = 0.0
    named: bool = True
    key: str = ""
    share: float = np.inf

    @property
    def of_the_log(self) -> bool:
        """Whether the newest effect is one that the log has done to itself."""
        return any(t.name == self.name and t.shows_in == CLOCK for t in self.terms)


@dataclass(frozen=True)
class Selection:
    """The result of a selection of effects; gains are in held-out nats.

    singles: the best variant of every candidate; steps: effects added one after another. nameless_alone,
    nameless_beside: gain of the nameless model over no effect and over the last step; left_of_times: of the latter,
    what the logged times hold; contradicted: what the effects named lose in cells where they say what the flights do
    not show, and the worst of these cells. parts: the two halves that they were fitted and judged on; least: nats that
    each candidate must gain as the first; inference: what named the effects, where the relations of signals did.

    Of the study: nominal: how many flights gave the floor; nominal_gain: what the nameless model gains in nominal
    flights as long as these; assumed: whether a chosen effect is random, or changes the loop in recorded flights;
    simulated, same_models: as the study has them.
    """

    singles: Mapping[str, Candidate]
    steps: tuple[Candidate, ...]
    nameless_alone: float
    nameless_beside: float
    parts: tuple[BlockSet, BlockSet]
    least: Mapping[str, float]
    nominal: int
    assumed: bool
    nominal_gain: float
    simulated: bool = False
    same_models: bool = False
    left_of_times: float = 0.0
    contradicted: tuple[float, str] = (0.0, "")
    inference: Inference | None = None

    @property
    def whole(self) -> Candidate | None:
        """The effects named and the deviations that nominal flights have as well, as one hypothesis."""
        return self.steps[-1] if self.steps else None

    @property
    def named(self) -> tuple[Candidate, ...]:
        """The steps whose effects are named, what adds most to the others first, what the log did to itself last."""
        return tuple(sorted((s for s in self.steps if s.named), key=lambda s: (s.of_the_log, -s.share)))

    @property
    def chosen(self) -> Candidate | None:
        """The effects named, as fitted beside the deviations, as one hypothesis; None where none is."""
        names, whole = {s.name for s in self.named}, self.whole
        if not names or whole is None:
            return None
        names |= {COMPANIONS[n] for n in names if n in COMPANIONS}
        terms, *fitted = ([t for t in some if t.name in names]
                          for some in (whole.terms, *(f.terms for f in whole.fits)))
        fits = (replace(f, terms=tuple(t)) for f, t in zip(whole.fits, fitted, strict=True))
        return replace(whole, terms=tuple(terms), fits=tuple(fits))

    def gained(self, one: Candidate) -> float:
        """Nats that an effect gains alone: of held-out data, or of the relations of signals where these decide."""
        return float(self.inference.evidence[one.name] if self.inference is not None else one.gain)

    @property
    def allowed(self) -> float:
        """Log likelihood that the nameless model may gain on top of the effects named where they are right.

        The fewer nominal flights there are, the farther off may another one lie.
        """
        if self.inference is not None:
            return self.inference.against.limit
        if self.nominal < 2:
            return max(UNKNOWN_ALONE, UNKNOWN_ASSUMED * self.nameless_alone, self.nominal_gain)
        gained = self.whole.gain if self.whole else 0.0
        share = (UNKNOWN_ASSUMED if self.assumed else UNKNOWN_SHARE) * (SAME_MODELS if self.same_models else 1.0)
        return max(self.least_left, share * gained, 0.0 if self.simulated else self.nominal_gain)

    @property
    def least_left(self) -> float:
        """Log likelihood that is no news however little the effects named gain, with two nominal flights or more."""
        return UNKNOWN_GAIN * (self.nominal + 1) / (self.nominal - 1)

    @property
    def unlike(self) -> float:
        """How much speaks against the effects named, of what may: what is left, or what they lose; 1 is the limit."""
        return max(float(np.logaddexp(self.nameless_beside, 0.0)) / self.allowed, self.loss)

    @property
    def loss(self) -> float:
        """What the effects named lose where they say what is not there, of what may be chance."""
        return self.contradicted[0] / self.least_left if self.contradicted[0] else 0.0

    @property
    def explained(self) -> bool:
        """Whether what is left is the floor, or close to it, and the effects named say nothing that is not there."""
        return self.unlike < 1.0
