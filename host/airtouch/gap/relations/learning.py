"""Flights simulated to learn from: nominal ones, ones with each effect, ones with a nameless disturbance."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.gap.features.flight_features import features
from airtouch.gap.flights.flight import ready
from airtouch.gap.relations import exposure
from airtouch.gap.relations.readout import amount_of
from airtouch.gap.signatures.random_draws import Kind, kinds_of, log_uniform, own_parameter
from airtouch.gap.signatures.signature import free_of, signature_of
from airtouch.logs.flight_log import FlightLog
from airtouch.simulation.batch import flights as simulated_flights
from airtouch.simulation.effects import EFFECTS, NAMES, Active, get
from airtouch.vehicle import Vehicle

SEED = 8_000_000  #: of all flights that are learned from; nobody draws sealed sets from it
#: nominal standard deviations, length of the shift of a class's weakest flights, which hardly shows beside nominal
#: scatter; chosen. A larger number learns nothing of weaker effects
WEAKEST_SHIFT = 6.0
#: halvings, at most, of a class's highest strength down to its weakest flights; chosen. With a smaller number a class
#: that still shows there begins at too high a strength
LEARNING_HALVINGS = 17
#: factor by which a shape's value becomes part of a random generator's seed, a whole number; chosen, so large that no
#: two shapes have one seed
SEED_PER_SHAPE = 1e6
Progress = Callable[[str], None]  #: what a long run reports its progress to


class Stream(IntEnum):
    """Second number of a random generator's seed, after SEED, one for each purpose.

    `drawn_flights` and `disturbed_flights` have the number of a flight in this place.
    """

    WEAKEST = 5
    CALIBRATION = 95
    PAIR = 97
    CALIBRATION_PAIR = 98


@dataclass(frozen=True)
class Scene:
    """What is flown: a scenario and the vehicle as declared."""

    scenario: str
    vehicle: Vehicle


def fly(scene: Scene, number: int, active: Sequence[Active] = ()) -> np.ndarray | None:
    """Features (features,) of flight number `number` with effects; None where it does not end well."""
    log = next(iter(simulated_flights(scene.scenario, [number], vehicle=scene.vehicle, effects=list(active), seed=SEED,
                                      workers=1)))
    if not isinstance(log, FlightLog):
        return None
    try:
        return features(ready(log, scene.vehicle), scene.vehicle)
    except AirTouchError:
        return None


@dataclass(frozen=True)
class Drawing:
    """One class of flights: a kind of effect in one of its shapes, and how it is drawn.

    name: of the kind; shape: value of the parameter that shapes it, None where none does.
    """

    name: str
    kind: Kind
    shape: float | None = None

    def active(self, strength: float, rng: np.random.Generator) -> Active:
        """The effect at a strength, its direction drawn."""
        active = self.kind.active(strength, rng)
        parameter = signature_of(active.effect).class_by
        return active if self.shape is None else Active(active.effect, {**active.values, parameter: self.shape})

    @property
    def free(self) -> tuple[str, ...]:
        """Names of the effect's free parameters; of one where the class is of that one alone."""
        own = own_parameter(self.kind.effect, self.name)
        return tuple(p for p in free_of(get(self.kind.effect)) if own in (None, p))


def all_drawings() -> list[Drawing]:
    """The classes of flights of all effects of the package."""
    return [d for effect in NAMES if effect in EFFECTS for d in drawings(effect)]


def drawings(effect: str) -> list[Drawing]:
    """The classes of flights of an effect: one for each kind of it, and for each value of what shapes that kind."""
    shapes = signature_of(get(effect)).class_values or (None,)
    return [Drawing(name, kind, shape) for name, kind in kinds_of(get(effect)).items() for shape in shapes]


def halved(highest: float, most: int, hides: Callable[[float], bool]) -> float:
    """The highest strength of a class, halved until flights hide it, `most` times at most."""
    strength = highest
    for _ in range(most):
        if hides(strength):
            break
        strength /= 2.0
    return strength


def weakest_strength(highest: float, shifts: Callable[[float], Sequence[np.ndarray]]) -> float:
    """The highest strength of a class, halved until the median shift of its flights is WEAKEST_SHIFT or shorter.

    shifts: those (coordinates,) of the flights at a strength that end well, in standard deviations of nominal ones. A
    strength at which none ends well is halved.
    """
    def hides(strength: float) -> bool:
        """Whether the median shift at a strength is short."""
        lengths = [np.linalg.norm(shift) for shift in shifts(strength)]
        return bool(lengths) and float(np.median(lengths)) <= WEAKEST_SHIFT

    return halved(highest, LEARNING_HALVINGS, hides)


class DrawnFlight(NamedTuple):
    """Number of a flight, what acts in it, and its features (features,)."""

    number: int
    active: Active
    features: np.ndarray


def drawn_flights(scene: Scene, drawing: Drawing, strengths: tuple[float, float], count: int) -> Iterator[DrawnFlight]:
    """Flights with an effect whose strengths are log-uniform between two, without those that do not end well."""
    for number in range(count):
        shape = int(SEED_PER_SHAPE * (drawing.shape or 0.0))
        rng = np.random.default_rng([SEED, number, *drawing.name.encode(), shape])
        active = drawing.active(log_uniform(*strengths, rng), rng)
        measured_features = fly(scene, number, [active])
        if measured_features is not None:
            yield DrawnFlight(number, active, measured_features)


def disturbed_flights(scene: Scene, count: int) -> Iterator[DrawnFlight]:
    """Flights with a nameless disturbance, without those that do not end well."""
    for number in range(count):
        active = exposure.draw(np.random.default_rng([SEED, number, 1]))
        measured_features = fly(scene, number, [active])
        if measured_features is not None:
            yield DrawnFlight(number, active, measured_features)


def scaled(drawing: Drawing, active: Active) -> np.ndarray:
    """Free parameters (p,) of an effect as amounts: natural steps from neutral, of factors the logarithm."""
    effect = get(drawing.kind.effect)
    return np.array([amount_of(effect, name, active.values[name]) for name in drawing.free])
