"""Calibrate a library on simulated flights that it was not learned from: distances, shares of evidence, parameters.

Three steps: the distance of nominal flights (`nominal_distance`), then in `calibrated` each class by flights with its
effect (`calibrate_class`) and two effects together (`_pair_distance_scatter`).

How many flights it takes is in `settings`. Thresholds without another source were chosen on flights of `learning.SEED`
alone (host/docs/looks.md, 2026-11-24, 12:43 UTC, and 2026-11-25, 09:07 UTC). What other values were tried is not
recorded.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.stats import t as student

from airtouch.gap.features.feature_space import MIDDLE_TWO_THIRDS
from airtouch.gap.relations.effect_class import ClassCalibration
from airtouch.gap.relations.hypotheses import FlightHypotheses, RelationsHypothesis
from airtouch.gap.relations.inference import LEAST_EVIDENCE, NAMELESS_ALLOWANCE
from airtouch.gap.relations.learning import SEED, Drawing, Progress, Scene, Stream, all_drawings, fly, halved, scaled
from airtouch.gap.relations.library import Coordinates, Library, NominalDistance
from airtouch.gap.relations.readout import Readout
from airtouch.gap.relations.settings import CalibrationSettings
from airtouch.gap.signatures.alike import interchangeable
from airtouch.gap.signatures.random_draws import log_uniform
from airtouch.simulation.effects import Active

#: numbers of the first nominal flight, the first with two effects and the first of a class
FIRST_NOMINAL, FIRST_OF_TWO, FIRST_OF_CLASS = 1_000_000, 1_100_000, 1_200_000
NUMBERS_OF_CLASS = 1000  #: flight numbers that each class has of its own
#: factor between the highest and the lowest strength of two effects that act together. With a larger number more pairs
#: have a weaker effect that does not show
RANGE_OF_TWO = 30.0
#: halvings, at most, of a class's highest strength down to the one that hardly shows. With a smaller number a class
#: that still shows there is calibrated from too high a strength on
CALIBRATION_HALVINGS = 12
#: largest fraction of the highest strength at which a class's flights begin. With a larger number classes that hardly
#: show are calibrated over a smaller range
HIGHEST_START = 0.5
#: fraction of the flights at a strength that show the effect, from which on it shows there. With a larger number
#: flights begin at a higher strength
DETECTION_RATE = 0.5
#: fraction of the flights of a class whose own share lies below the one that is stored. A larger number stores larger
#: shares, so that more may be gained beside a right effect
QUANTILE_OF_SHARES = 0.8
#: degrees of freedom of Student's t, as which distances scatter: a few flights hit something. With a larger number
#: these few make the scatter larger
DISTANCE_FREEDOM = 3.0
#: bounds of the search for a distance scatter, a fraction of the evidence
LEAST_SCATTER, LARGEST_SCATTER = 1e-4, 1.0


def calibrated(scene: Scene, library: Library, settings: CalibrationSettings, progress: Progress = lambda _: None,
               ) -> Library:
    """The library with the calibration of its classes, alone and by two.

    progress: called with the name of each step.
    """
    drawing_of = {(d.name, d.shape): d for d in all_drawings()}
    drawings = [drawing_of[c.name, c.shape] for c in library.model.classes]
    classes = []
    for place, (own, drawing) in enumerate(zip(library.model.classes, drawings, strict=True)):
        progress(f"calibration, {place + 1} of {len(drawings)}: {own.name} {own.shape or ''}")
        classes.append(replace(own, calibration=calibrate_class(scene, library, place, drawing, settings)))
    library = library.with_classes(classes)
    progress("flights of two effects")
    return replace(library, pair_distance_scatter=_pair_distance_scatter(scene, library, drawings,
                                                                         settings.flights_of_two))


def calibrate_class(scene: Scene, library: Library, place: int, drawing: Drawing, settings: CalibrationSettings,
                    ) -> ClassCalibration:
    """Measure the class at a place of the library."""
    flights = _calibration_flights(scene, library, place, drawing, settings)
    return ClassCalibration(
        readout_of(drawing, flights, settings.least_flights), share_of((f.nameless_gain, f.evidence) for f in flights),
        share_of((f.second_gain, f.evidence) for f in flights if f.second_gain is not None),
        likeliest_distance_scatter(np.array([f.excess for f in flights]), np.array([f.evidence for f in flights]),
                                   library.nominal_excess_deviation))


def nominal_distance(scene: Scene, coordinates: Coordinates, count: int) -> NominalDistance:
    """The squared distance of nominal flights: its median, and its standard deviation by the middle two thirds.

    count: of flights that are flown for it.
    """
    features = [f for i in range(count) if (f := fly(scene, FIRST_NOMINAL + i)) is not None]
    squared_distance = (coordinates(np.array(features)) ** 2).sum(axis=1)
    low, high = np.quantile(squared_distance, MIDDLE_TWO_THIRDS)
    return NominalDistance(float(np.median(squared_distance)), float(0.5 * (high - low)))


@dataclass(frozen=True)
class CalibrationFlight:
    """A flight that shows an effect, with the class of that effect fitted to it.

    strength (s,): of the class, as fitted; amount (p,): true parameters (`learning.scaled`). In nats: evidence: for the
    class; nameless_gain: of a nameless disturbance beside it; second_gain: of a second effect beside it, None where
    none was tried; excess: the flight's excess distance from the class (`Library.excess`).
    """

    strength: np.ndarray
    amount: np.ndarray
    evidence: float
    nameless_gain: float
    second_gain: float | None
    excess: float


@dataclass(frozen=True)
class FittedFlight:
    """A flight with one effect, and the hypothesis of its class."""

    active: Active
    flight: FlightHypotheses
    hypothesis: RelationsHypothesis

    @property
    def shows(self) -> bool:
        """Whether the class has the evidence that an effect needs."""
        return self.hypothesis.evidence > LEAST_EVIDENCE


def _calibration_flights(scene: Scene, library: Library, place: int, drawing: Drawing, settings: CalibrationSettings,
                         ) -> list[CalibrationFlight]:
    """Flights of a class from the strength that hardly shows to the highest, of them those that show it."""
    own, high = library.model.classes[place], drawing.kind.highest
    rng = np.random.default_rng([SEED, Stream.CALIBRATION, place])
    first = FIRST_OF_CLASS + NUMBERS_OF_CLASS * place
    numbers = iter(range(first, first + NUMBERS_OF_CLASS))

    def fly_and_fit(strength: float) -> FittedFlight | None:
        """A flight with the effect at a strength, and the class fitted to it; None where it does not end well."""
        active = drawing.active(strength, rng)
        flight = _hypotheses_on_flight(scene, library, next(numbers), [active])
        return None if flight is None else FittedFlight(active, flight, flight.with_class(own))

    low = min(weakest_detected_strength(fly_and_fit, high, settings.flights_per_strength), HIGHEST_START * high)
    flights: list[CalibrationFlight] = []
    for strength in np.exp(rng.uniform(np.log(low), np.log(high), settings.class_flights)):
        fitted = fly_and_fit(strength)
        if fitted is not None and fitted.shows:
            with_second = len(flights) < settings.flights_with_second
            flights.append(_calibration_flight(library, drawing, fitted, with_second))
    return flights


def weakest_detected_strength(fly_and_fit: Callable[[float], FittedFlight | None], highest: float, count: int,
                              ) -> float:
    """The highest strength of a class, halved until fewer than DETECTION_RATE of its flights show it.

    fly_and_fit: a flight at a strength with its class fitted, None where it does not end well; count: of flights that
    are tried at a strength. A strength at which none ends well is halved.
    """
    def hides(strength: float) -> bool:
        """Whether fewer than DETECTION_RATE of the flights at a strength show the class."""
        flights = [f for f in (fly_and_fit(strength) for _ in range(count)) if f is not None]
        return bool(flights) and float(np.mean([f.shows for f in flights])) < DETECTION_RATE

    return halved(highest, CALIBRATION_HALVINGS, hides)


def _calibration_flight(library: Library, drawing: Drawing, fitted: FittedFlight, with_second: bool,
                        ) -> CalibrationFlight:
    """The evidence for the class of a flight and beside it; with_second: whether a second effect is tried."""
    flight, hypothesis, effect = fitted.flight, fitted.hypothesis, drawing.kind.effect
    second = None
    if with_second:
        two = flight.with_one_more(hypothesis, lambda c, _: not interchangeable(c.effect, effect))[0]
        second = two.evidence - hypothesis.evidence
    return CalibrationFlight(hypothesis.fits[0].strength, scaled(drawing, fitted.active), hypothesis.evidence,
                             flight.nameless_evidence(hypothesis) - hypothesis.evidence, second,
                             library.excess(flight.squared_distance(hypothesis)))


def share_of(gains: Iterable[tuple[float, float]]) -> float:
    """The share of a class's evidence that something beside it gains in most of its flights.

    gains: for each flight the gain beside the class and the evidence for the class, nats. Chance gains
    NAMELESS_ALLOWANCE; one share of 0 is always among those of which the quantile is taken, so that a class without
    flights has none.
    """
    shares = [max(gain - NAMELESS_ALLOWANCE, 0.0) / evidence for gain, evidence in gains]
    return float(np.quantile([0.0, *shares], QUANTILE_OF_SHARES))


def likeliest_distance_scatter(excess: np.ndarray, evidence: np.ndarray, deviation: np.ndarray | float) -> float:
    """The likeliest distance scatter s, a fraction of the evidence: excess ~ sqrt(deviation^2 + (s evidence)^2) t.

    t: Student's, of DISTANCE_FREEDOM. excess, evidence (n,): excess distances and evidence of flights, nats; deviation:
    that of the excess whatever the evidence, scalar or (n,), nats. Without flights s is 0.
    """
    if not len(excess):
        return 0.0

    def minus_log_likelihood(log_scatter: float) -> float:
        """Minus the log likelihood at the logarithm of a distance scatter."""
        scale = np.hypot(deviation, np.exp(log_scatter) * evidence)
        return -float(student.logpdf(excess, DISTANCE_FREEDOM, 0.0, scale).sum())

    bounds = np.log(LEAST_SCATTER), np.log(LARGEST_SCATTER)
    return float(np.exp(minimize_scalar(minus_log_likelihood, bounds=bounds, method="bounded").x))


def readout_of(drawing: Drawing, flights: Sequence[CalibrationFlight], least: int) -> Readout | None:
    """The readout of a class from flights that show it; None where they are fewer than `least`.

    Its parameters are those that vary between the flights.
    """
    if len(flights) < least:
        return None
    amount = np.array([f.amount for f in flights])
    free = np.abs(amount).max(axis=0) > 0.0
    names, strength = tuple(np.array(drawing.free)[free].tolist()), np.array([f.strength for f in flights])
    return Readout(names, strength, amount[:, free])


def _pair_distance_scatter(scene: Scene, library: Library, drawings: Sequence[Drawing], count: int) -> float:
    """`Library.pair_distance_scatter` by so many flights with two effects, each hypothesis started from either."""
    excess, evidence, deviation_by_classes = [], [], []
    for i in range(count):
        rng = np.random.default_rng([SEED, Stream.CALIBRATION_PAIR, i])
        a, b = two_of(drawings, rng)
        active = [d.active(log_uniform(d.kind.highest / RANGE_OF_TWO, d.kind.highest, rng), rng)
                  for d in (drawings[a], drawings[b])]
        flight = _hypotheses_on_flight(scene, library, FIRST_OF_TWO + i, active)
        if flight is None:
            continue
        one, two = (library.model.classes[j] for j in (a, b))
        both = max((flight.with_two(one, two), flight.with_two(two, one)), key=lambda h: h.evidence)
        alone = max(flight.with_class(c).evidence for c in (one, two))
        if both.evidence < alone + LEAST_EVIDENCE:
            continue  # the weaker one does not show
        excess.append(library.excess(flight.squared_distance(both)))
        evidence.append(both.evidence)
        larger = max(c.calibration.distance_scatter for c in (one, two))
        deviation_by_classes.append(library.excess_deviation(larger, both.evidence))
    return likeliest_distance_scatter(np.array(excess), np.array(evidence), np.array(deviation_by_classes))


def two_of(drawings: Sequence[Drawing], rng: np.random.Generator) -> tuple[int, int]:
    """Places of two classes whose effects are not two names of one thing."""
    while True:
        a, b = (int(j) for j in rng.choice(len(drawings), 2, replace=False))
        if not interchangeable(drawings[a].kind.effect, drawings[b].kind.effect):
            return a, b


def _hypotheses_on_flight(scene: Scene, library: Library, number: int, active: Sequence[Active],
                          ) -> FlightHypotheses | None:
    """A flight with effects, ready for hypotheses; None where it does not end well."""
    features = fly(scene, number, active)
    return None if features is None else FlightHypotheses(library.coordinates(features[None])[0], library.model)
