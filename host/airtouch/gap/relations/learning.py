"""Flights simulated to learn from: nominal ones, ones with each effect, ones with a nameless disturbance."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.gap.features.flight_features import features
from airtouch.gap.flights.flight import ready
from airtouch.gap.relations import exposure
from airtouch.gap.relations.readout import amount_of
from airtouch.gap.signatures.random_draws import Kind, kinds_of, log_uniform
from airtouch.gap.signatures.signature import free_of, signature_of
from airtouch.logs.flight_log import FlightLog
from airtouch.simulation.batch import flights as flown
from airtouch.simulation.effects import EFFECTS, NAMES, Active, get
from airtouch.vehicle import Vehicle

SEED = 8_000_000  #: of all flights that are learned from; nobody draws sealed sets from it
WEAKEST_SHIFT = 6.0  #: length of the shift of a class's weakest flights, which hardly shows beside nominal ones; chosen
HALVINGS = 17  #: of the highest strength, at most, down to the weakest; chosen
Say = Callable[[str], None]  #: what a long run reports its progress to


class Stream(IntEnum):
    """Second number of a random generator's seed, after SEED, one for each purpose.

    `disturbed_flights` has the number of a flight there: those of the numbers below share the numbers drawn.
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
    log = next(iter(flown(scene.scenario, [number], vehicle=scene.vehicle, effects=list(active), seed=SEED, workers=1)))
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
        drawn = self.kind.active(strength, rng)
        parameter = signature_of(drawn.effect).class_by
        return drawn if self.shape is None else Active(drawn.effect, {**drawn.values, parameter: self.shape})

    @property
    def free(self) -> tuple[str, ...]:
        """Names of the effect's free parameters; of one where the class is of that one alone."""
        alone = self.name.partition(" ")[2]
        return tuple(p for p in free_of(get(self.kind.effect)) if alone in ("", p))


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

    return halved(highest, HALVINGS, hides)


def drawn_flights(scene: Scene, drawing: Drawing, strengths: tuple[float, float], count: int,
                  ) -> Iterator[tuple[int, Active, np.ndarray]]:
    """Number, effect and features of flights with an effect whose strengths are log-uniform between two."""
    for number in range(count):
        rng = np.random.default_rng([SEED, number, *drawing.name.encode(), int(1e6 * (drawing.shape or 0.0))])
        active = drawing.active(log_uniform(*strengths, rng), rng)
        made = fly(scene, number, [active])
        if made is not None:
            yield number, active, made


def disturbed_flights(scene: Scene, count: int) -> Iterator[tuple[int, np.ndarray]]:
    """Number and features of flights with a nameless disturbance."""
    for number in range(count):
        made = fly(scene, number, exposure.draw(np.random.default_rng([SEED, number, 1])))
        if made is not None:
            yield number, made


def scaled(drawing: Drawing, active: Active) -> np.ndarray:
    """Free parameters (p,) of an effect as amounts: natural steps from neutral, of factors the logarithm."""
    effect = get(drawing.kind.effect)
    return np.array([amount_of(effect, name, active.values[name]) for name in drawing.free])
