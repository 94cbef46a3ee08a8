"""Check and calibrate a library on simulated flights that it was not learned from."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from airtouch.gap.relations.hypotheses import FlightFeatures
from airtouch.gap.relations.inference import LEAST_EVIDENCE
from airtouch.gap.relations.learning import SEED, Drawing, Scene, drawings, fly, scaled
from airtouch.gap.relations.library import Library
from airtouch.gap.relations.readout import Readout
from airtouch.gap.signatures.candidates import interchangeable
from airtouch.simulation.effects import EFFECTS, NAMES, Active

CHECKS, A_CLASS, CALIBRATION = 300, 12, 80  #: nominal flights; flights of each class to check it, and to calibrate it
#: numbers of the flights; each class has 1000 of its own
FIRST_CHECK, FIRST_OF_CLASS, FIRST_CALIBRATION = 1_000_000, 1_100_000, 1_200_000
RANGE = 30.0  #: factor of strengths over which classes are checked
HALVINGS = 12  #: of the highest strength, at most, down to that which hardly shows
KEPT = 0.8  #: share of the flights of a class that keep the shares of their evidence that are stored
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
    nameless, second, distance = np.array([_shares(scene, library, i, d) for i, d in enumerate(own)]).T
    classes = []
    for i, (c, d) in enumerate(zip(library.model.classes, own, strict=True)):
        say(f"calibration of {c.name} {c.shape or ''}")
        classes.append(replace(c, readout=_readout(scene, library, i, d)))
    return replace(library, nameless_share=nameless, second_share=second, distance_share=distance,
                   model=replace(library.model, classes=tuple(classes)))


def _shares(scene: Scene, library: Library, place: int, drawing: Drawing) -> tuple[float, float, float]:
    """`Library.nameless_share`, `second_share` and `distance_share` of a class."""
    own, nameless, second, distance = library.model.classes[place], [0.0], [0.0], [0.0]
    for i in range(A_CLASS):
        rng = np.random.default_rng([SEED, 96, place, i])
        strength = float(np.exp(rng.uniform(np.log(drawing.kind.highest / RANGE), np.log(drawing.kind.highest))))
        flight = _flown(scene, library, FIRST_OF_CLASS + 1000 * place + i, drawing.active(strength, rng))
        if flight is None:
            continue
        here = flight.with_class(own)
        two = flight.with_one_more(here, lambda c, _: not interchangeable(c.effect, own.effect))[0]
        excess = library.excess(flight.squared_distance(here))
        for shares, gain in ((nameless, flight.nameless_evidence(here) - here.evidence - LEAST_GAIN),
                             (second, two.evidence - here.evidence - LEAST_GAIN),
                             (distance, excess - library.usual_excess)):
            shares.append(max(gain, 0.0) / max(here.evidence, LEAST_GAIN))
    low, middle, high = (float(np.quantile(shares, KEPT)) for shares in (nameless, second, distance))
    return low, middle, high


def _readout(scene: Scene, library: Library, place: int, drawing: Drawing) -> Readout | None:
    """Calibration of a class by flights from the strength that hardly shows to the highest; None where too few do."""
    own, high = library.model.classes[place], drawing.kind.highest
    rng = np.random.default_rng([SEED, 95, place])
    flights = iter(range(FIRST_CALIBRATION + 1000 * place, FIRST_CALIBRATION + 1000 * (place + 1)))

    def flown(strength: float) -> Calibrated | None:
        """A flight with the effect at a strength; None where it does not end well."""
        active = drawing.active(strength, rng)
        flight = _flown(scene, library, next(flights), active)
        if flight is None:
            return None
        here = flight.with_class(own)
        return Calibrated(here.fits[0].strength, scaled(drawing, active), here.evidence > LEAST_EVIDENCE)

    low = high
    for _ in range(HALVINGS):
        ended = [f for f in (flown(low) for _ in range(3)) if f is not None]
        if ended and np.mean([f.shows for f in ended]) < 0.5:
            break
        low /= 2.0
    drawn = np.exp(rng.uniform(np.log(min(low, 0.5 * high)), np.log(high), CALIBRATION))
    shown = [f for f in (flown(s) for s in drawn) if f is not None and f.shows]
    if len(shown) < LEAST_FLIGHTS:
        return None
    amount = np.array([f.amount for f in shown])
    free = np.abs(amount).max(axis=0) > 0.0
    return Readout(tuple(np.array(drawing.free)[free].tolist()), np.array([f.strength for f in shown]), amount[:, free])


@dataclass(frozen=True)
class Calibrated:
    """A flight with an effect: strength (s,) of its class as fitted, true amounts (p,), whether the effect shows."""

    strength: np.ndarray
    amount: np.ndarray
    shows: bool


def _flown(scene: Scene, library: Library, number: int, active: Active) -> FlightFeatures | None:
    """The features of a flight with an effect; None where it does not end well."""
    features = fly(scene, number, [active])
    return None if features is None else FlightFeatures(library.coordinates(features[None])[0], library.model)
