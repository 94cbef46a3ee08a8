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
from airtouch.gap.relations.hypotheses import FlightHypotheses, Hypothesis
from airtouch.gap.relations.inference import LEAST_EVIDENCE, NAMELESS_ALLOWANCE
from airtouch.gap.relations.learning import SEED, Drawing, Say, Scene, Stream, all_drawings, fly, halved, scaled
from airtouch.gap.relations.library import Coordinates, Library, NominalDistance
from airtouch.gap.relations.readout import Readout
from airtouch.gap.relations.settings import CalibrationSettings
from airtouch.gap.signatures.alike import interchangeable
from airtouch.gap.signatures.random_draws import log_uniform
from airtouch.simulation.effects import Active

#: numbers of the first nominal flight, the first with two effects and the first of a class
FIRST_NOMINAL, FIRST_OF_TWO, FIRST_OF_CLASS = 1_000_000, 1_100_000, 1_200_000
NUMBERS_OF_CLASS = 1000  #: flight numbers that each class has of its own
RANGE_OF_TWO = 30.0  #: factor between the highest and the lowest strength of two effects that act together
HALVINGS = 12  #: most times that the highest strength is halved, down to that which hardly shows
HIGHEST_START = 0.5  #: largest fraction of the highest strength at which a class's flights begin
DETECTION_RATE = 0.5  #: fraction of the flights at a strength that show the effect, from which on it shows there
QUANTILE_OF_SHARES = 0.8  #: fraction of the flights of a class whose own share lies below the one that is stored
DISTANCE_FREEDOM = 3.0  #: degrees of freedom of Student's t, as which distances scatter: a few flights hit something
#: bounds of the search for the standard deviation of a distance over the evidence
LEAST_SCATTER, LARGEST_SCATTER = 1e-4, 1.0


def calibrated(scene: Scene, library: Library, settings: CalibrationSettings, say: Say = lambda _: None) -> Library:
    """The library with the calibration of its classes, alone and by two."""
    drawing_of = {(d.name, d.shape): d for d in all_drawings()}
    drawings = [drawing_of[c.name, c.shape] for c in library.model.classes]
    classes = []
    for place, (own, drawing) in enumerate(zip(library.model.classes, drawings, strict=True)):
        say(f"calibration of {own.name} {own.shape or ''}")
        classes.append(replace(own, calibration=calibrate_class(scene, library, place, drawing, settings)))
    library = library.with_classes(classes)
    say("flights of two effects")
    return replace(library, pair_distance_scatter=_pair_distance_scatter(scene, library, drawings,
                                                                         settings.flights_of_two))


def calibrate_class(scene: Scene, library: Library, place: int, drawing: Drawing, settings: CalibrationSettings,
                    ) -> ClassCalibration:
    """Measure the class at a place of the library."""
    shown = _calibration_flights(scene, library, place, drawing, settings)
    return ClassCalibration(
        _readout(drawing, shown, settings.least_flights), share_of((f.nameless, f.evidence) for f in shown),
        share_of((f.second, f.evidence) for f in shown if f.second is not None),
        likeliest_distance_scatter(np.array([f.excess for f in shown]), np.array([f.evidence for f in shown]),
                          library.nominal_distance_scatter))


def nominal_distance(scene: Scene, coordinates: Coordinates, count: int) -> NominalDistance:
    """The distance of nominal flights by so many of them, the standard deviation from the middle two thirds."""
    flown = [f for i in range(count) if (f := fly(scene, FIRST_NOMINAL + i)) is not None]
    squared = (coordinates(np.array(flown)) ** 2).sum(axis=1)
    low, high = np.quantile(squared, MIDDLE_TWO_THIRDS)
    return NominalDistance(float(np.median(squared)), float(0.5 * (high - low)))


@dataclass(frozen=True)
class CalibrationFlight:
    """A flight that shows an effect, with the class of that effect fitted to it.

    strength (s,): of the class, as fitted; amount (p,): true parameters (`learning.scaled`). In nats: evidence for the
    class; what a nameless disturbance gains beside it (nameless) and what a second effect gains (second, None
    where none was tried); excess, by which the flight lies farther from the class than the median nominal flight from
    none.
    """

    strength: np.ndarray
    amount: np.ndarray
    evidence: float
    nameless: float
    second: float | None
    excess: float


@dataclass(frozen=True)
class _Fitted:
    """A flight with one effect, and the hypothesis of its class."""

    active: Active
    flight: FlightHypotheses
    hypothesis: Hypothesis

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

    def fitted(strength: float) -> _Fitted | None:
        """A flight with the effect at a strength, and the class fitted to it; None where it does not end well."""
        active = drawing.active(strength, rng)
        flight = _flown(scene, library, next(numbers), [active])
        return None if flight is None else _Fitted(active, flight, flight.with_class(own))

    low = min(_weakest_shown(fitted, high, settings.tried), HIGHEST_START * high)
    shown: list[CalibrationFlight] = []
    for strength in np.exp(rng.uniform(np.log(low), np.log(high), settings.class_flights)):
        one = fitted(strength)
        if one is not None and one.shows:
            shown.append(_measured(library, drawing, one, with_second=len(shown) < settings.with_second))
    return shown


def _weakest_shown(fitted: Callable[[float], _Fitted | None], highest: float, tried: int) -> float:
    """The highest strength of a class, halved until fewer than half of its flights show it; tried: flights at each."""
    def hides(strength: float) -> bool:
        """Whether fewer than half of the flights at a strength show the class; False where none ends well."""
        ended = [one for one in (fitted(strength) for _ in range(tried)) if one is not None]
        return bool(ended) and float(np.mean([one.shows for one in ended])) < DETECTION_RATE

    return halved(highest, HALVINGS, hides)


def _measured(library: Library, drawing: Drawing, one: _Fitted, with_second: bool) -> CalibrationFlight:
    """What speaks for the class of a flight, and what beside it; with_second: whether a second effect is tried."""
    flight, here, effect = one.flight, one.hypothesis, drawing.kind.effect
    second = None
    if with_second:
        two = flight.with_one_more(here, lambda c, _: not interchangeable(c.effect, effect))[0]
        second = two.evidence - here.evidence
    return CalibrationFlight(here.fits[0].strength, scaled(drawing, one.active), here.evidence,
                             flight.nameless_evidence(here) - here.evidence, second,
                             library.excess(flight.squared_distance(here)))


def share_of(gains: Iterable[tuple[float, float]]) -> float:
    """The share of a class's evidence that something beside it gains in most of its flights.

    gains: for each flight what is gained and the evidence, nats. Chance gains NAMELESS_ALLOWANCE; one share of 0 is
    always among those of which the quantile is taken, so that a class without flights has none.
    """
    shares = [max(gain - NAMELESS_ALLOWANCE, 0.0) / evidence for gain, evidence in gains]
    return float(np.quantile([0.0, *shares], QUANTILE_OF_SHARES))


def likeliest_distance_scatter(excess: np.ndarray, evidence: np.ndarray, nominal: np.ndarray | float) -> float:
    """Likeliest scatter s of distances over the evidence: excess (n,) ~ sqrt(nominal^2 + (s evidence)^2) Student's t.

    nominal: scatter that the flights have whatever the evidence, scalar or (n,), nats. Without flights it is 0.
    """
    if not len(excess):
        return 0.0

    def against(logarithm: float) -> float:
        """Minus the log likelihood of a scatter."""
        scatter = np.hypot(nominal, np.exp(logarithm) * evidence)
        return -float(student.logpdf(excess, DISTANCE_FREEDOM, 0.0, scatter).sum())

    bounds = np.log(LEAST_SCATTER), np.log(LARGEST_SCATTER)
    return float(np.exp(minimize_scalar(against, bounds=bounds, method="bounded").x))


def _readout(drawing: Drawing, shown: Sequence[CalibrationFlight], least: int) -> Readout | None:
    """The readout of a class from flights that show it; None where fewer than `least` do."""
    if len(shown) < least:
        return None
    amount = np.array([f.amount for f in shown])
    free = np.abs(amount).max(axis=0) > 0.0
    return Readout(tuple(np.array(drawing.free)[free].tolist()), np.array([f.strength for f in shown]), amount[:, free])


def _pair_distance_scatter(scene: Scene, library: Library, drawings: Sequence[Drawing], count: int) -> float:
    """`Library.pair_distance_scatter` by so many flights with two effects, each hypothesis started from either."""
    excess, evidence, scatter_of_classes = [], [], []
    for i in range(count):
        rng = np.random.default_rng([SEED, Stream.CALIBRATION_PAIR, i])
        a, b = two_of(drawings, rng)
        active = [d.active(log_uniform(d.kind.highest / RANGE_OF_TWO, d.kind.highest, rng), rng)
                  for d in (drawings[a], drawings[b])]
        flight = _flown(scene, library, FIRST_OF_TWO + i, active)
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
        scatter_of_classes.append(library.distance_scatter(larger, both.evidence))
    return likeliest_distance_scatter(np.array(excess), np.array(evidence), np.array(scatter_of_classes))


def two_of(drawings: Sequence[Drawing], rng: np.random.Generator) -> tuple[int, int]:
    """Places of two classes whose effects are not two names of one thing."""
    while True:
        a, b = (int(j) for j in rng.choice(len(drawings), 2, replace=False))
        if not interchangeable(drawings[a].kind.effect, drawings[b].kind.effect):
            return a, b


def _flown(scene: Scene, library: Library, number: int, active: Sequence[Active]) -> FlightHypotheses | None:
    """A flight with effects, ready for hypotheses; None where it does not end well."""
    features = fly(scene, number, active)
    return None if features is None else FlightHypotheses(library.coordinates(features[None])[0], library.model)
