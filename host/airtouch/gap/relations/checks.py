"""Check and calibrate a library on simulated flights that it was not learned from."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.stats import t as student

from airtouch.gap.relations.hypotheses import FlightFeatures, Hypothesis
from airtouch.gap.relations.inference import LEAST_EVIDENCE
from airtouch.gap.relations.learning import SEED, Drawing, Scene, drawings, fly, scaled
from airtouch.gap.relations.library import Library
from airtouch.gap.relations.readout import Readout
from airtouch.gap.signatures.alike import interchangeable
from airtouch.gap.signatures.drawn import log_uniform
from airtouch.simulation.effects import EFFECTS, NAMES, Active

#: nominal flights; flights of each class; of them, those beside whose effect a second one is tried; flights of a pair
CHECKS, CALIBRATION, SECONDS, PAIRS = 300, 80, 12, 150
#: numbers of the flights; each class has 1000 of its own
FIRST_CHECK, FIRST_OF_PAIR, FIRST_CALIBRATION = 1_000_000, 1_100_000, 1_200_000
RANGE = 30.0  #: factor of strengths from which the effects of a pair are drawn
HALVINGS = 12  #: of the highest strength, at most, down to that which hardly shows
KEPT = 0.8  #: share of the flights of a class that keep the shares of their evidence that are stored
TAIL = 3.0  #: degrees of freedom of Student's t, as which distances scatter: a few flights hit something
LEAST_SCATTER = 1e-4  #: of a distance, over the evidence
LEAST_GAIN = 10.0  #: nats that chance and a crude model may gain beside any class
LEAST_FLIGHTS = 12  #: calibration flights that show the effect; with fewer a class gives no parameters
Say = Callable[[str], None]


def checked(scene: Scene, library: Library, say: Say = lambda _: None) -> Library:
    """The library with its distances, its shares and the calibration of its classes."""
    flown = [f for i in range(CHECKS) if (f := fly(scene, FIRST_CHECK + i)) is not None]
    squared = (library.coordinates(np.array(flown)) ** 2).sum(axis=1)
    low, high = np.quantile(squared, [0.16, 0.84])
    library = replace(library, distance=(float(np.median(squared)), float(0.5 * (high - low))))
    drawing_of = {(d.name, d.shape): d for e in NAMES if e in EFFECTS for d in drawings(e)}
    own = [drawing_of[c.name, c.shape] for c in library.model.classes]
    classes, shares = [], []
    for i, (c, d) in enumerate(zip(library.model.classes, own, strict=True)):
        say(f"calibration of {c.name} {c.shape or ''}")
        shown = _calibration_flights(scene, library, i, d)
        classes.append(replace(c, readout=_readout(d, shown)))
        shares.append((_share((f.nameless, f.evidence) for f in shown),
                       _share((f.second, f.evidence) for f in shown if f.second is not None),
                       scatter(np.array([f.excess for f in shown]), np.array([f.evidence for f in shown]),
                               library.nominal_scatter)))
    nameless, second, distance = np.array(shares).T
    library = replace(library, nameless_share=nameless, second_share=second, distance_scatter=distance,
                      model=replace(library.model, classes=tuple(classes)))
    say("pairs")
    return replace(library, pair_scatter=_scatter_of_pairs(scene, library, own))


@dataclass(frozen=True)
class Calibrated:
    """A flight that shows an effect: strength (s,) of its class as fitted, true amounts (p,), evidence for the class,

    and the nats that a disturbance without a name gains beside it, a second effect (None where none was tried), and
    by which the flight lies farther from the class than the median nominal flight from none.
    """

    strength: np.ndarray
    amount: np.ndarray
    evidence: float
    nameless: float
    second: float | None
    excess: float


def _calibration_flights(scene: Scene, library: Library, place: int, drawing: Drawing) -> list[Calibrated]:
    """Flights of a class from the strength that hardly shows to the highest, of them those that show it."""
    own, high = library.model.classes[place], drawing.kind.highest
    rng = np.random.default_rng([SEED, 95, place])
    numbers = iter(range(FIRST_CALIBRATION + 1000 * place, FIRST_CALIBRATION + 1000 * (place + 1)))

    def fitted(strength: float) -> tuple[Active, FlightFeatures, Hypothesis] | None:
        """A flight with the effect at a strength, and the class fitted to it; None where it does not end well."""
        active = drawing.active(strength, rng)
        flight = _flown(scene, library, next(numbers), [active])
        return None if flight is None else (active, flight, flight.with_class(own))

    low = high
    for _ in range(HALVINGS):
        ended = [f for f in (fitted(low) for _ in range(3)) if f is not None]
        if ended and np.mean([here.evidence > LEAST_EVIDENCE for _, _, here in ended]) < 0.5:
            break
        low /= 2.0
    shown: list[Calibrated] = []
    for strength in np.exp(rng.uniform(np.log(min(low, 0.5 * high)), np.log(high), CALIBRATION)):
        flight_and_fit = fitted(strength)
        if flight_and_fit is None or flight_and_fit[2].evidence <= LEAST_EVIDENCE:
            continue
        active, flight, here = flight_and_fit
        second = None if len(shown) >= SECONDS else flight.with_one_more(
            here, lambda c, _: not interchangeable(c.effect, own.effect))[0].evidence - here.evidence
        shown.append(Calibrated(here.fits[0].strength, scaled(drawing, active), here.evidence,
                                flight.nameless_evidence(here) - here.evidence, second,
                                library.excess(flight.squared_distance(here))))
    return shown


def _share(gains: Iterable[tuple[float, float]]) -> float:
    """The share of the evidence that what is beside a class gains at most in KEPT of its flights: gain and evidence."""
    return float(np.quantile([0.0, *(max(gain - LEAST_GAIN, 0.0) / evidence for gain, evidence in gains)], KEPT))


def scatter(excess: np.ndarray, evidence: np.ndarray, nominal: np.ndarray | float) -> float:
    """Likeliest scatter s of distances over the evidence: excess (n,) ~ sqrt(nominal^2 + (s evidence)^2) Student's t.

    nominal: scatter that the flights have whatever the evidence, scalar or (n,), nats.
    """
    def against(logarithm: float) -> float:
        """Minus the log likelihood of a scatter."""
        return -float(student.logpdf(excess, TAIL, 0.0, np.hypot(nominal, np.exp(logarithm) * evidence)).sum())

    return float(np.exp(minimize_scalar(against, bounds=(np.log(LEAST_SCATTER), 0.0), method="bounded").x))


def _readout(drawing: Drawing, shown: Sequence[Calibrated]) -> Readout | None:
    """Calibration of a class by flights that show it; None where too few do."""
    if len(shown) < LEAST_FLIGHTS:
        return None
    amount = np.array([f.amount for f in shown])
    free = np.abs(amount).max(axis=0) > 0.0
    return Readout(tuple(np.array(drawing.free)[free].tolist()), np.array([f.strength for f in shown]), amount[:, free])


def _scatter_of_pairs(scene: Scene, library: Library, drawings: Sequence[Drawing]) -> float:
    """`Library.pair_scatter`: by flights with two effects, each hypothesis started from either."""
    excess, evidence, of_classes = [], [], []
    for i in range(PAIRS):
        rng = np.random.default_rng([SEED, 98, i])
        a, b = two_of(drawings, rng)
        active = [d.active(log_uniform(d.kind.highest / RANGE, d.kind.highest, rng), rng)
                  for d in (drawings[a], drawings[b])]
        flight = _flown(scene, library, FIRST_OF_PAIR + i, active)
        if flight is None:
            continue
        one, two = (library.model.classes[j] for j in (a, b))
        both = max((flight.with_two(one, two), flight.with_two(two, one)), key=lambda h: h.evidence)
        alone = max(flight.with_class(c).evidence for c in (one, two))
        if both.evidence < alone + LEAST_EVIDENCE:
            continue  # the weaker one does not show
        excess.append(library.excess(flight.squared_distance(both)))
        evidence.append(both.evidence)
        of_classes.append(library.scatter(max(library.distance_scatter[[a, b]]), both.evidence))
    return scatter(np.array(excess), np.array(evidence), np.array(of_classes))


def two_of(drawings: Sequence[Drawing], rng: np.random.Generator) -> tuple[int, int]:
    """Places of two classes whose effects are not two names of one thing."""
    while True:
        a, b = (int(j) for j in rng.choice(len(drawings), 2, replace=False))
        if not interchangeable(drawings[a].kind.effect, drawings[b].kind.effect):
            return a, b


def _flown(scene: Scene, library: Library, number: int, active: Sequence[Active]) -> FlightFeatures | None:
    """The features of a flight with effects; None where it does not end well."""
    features = fly(scene, number, active)
    return None if features is None else FlightFeatures(library.coordinates(features[None])[0], library.model)
