"""Classes of effects that a library lacks, such as a user's own: learned from some hundred simulated flights.

What an effect does to the signals is so known in closed loop too, where it changes the plant and no force shows it.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from airtouch.gap.relations.build import HALVINGS, WEAKEST_SHIFT
from airtouch.gap.relations.calibration import HIGHEST_START, ClassCalibration, calibrate_class, with_calibrations
from airtouch.gap.relations.effect_class import ClassFlights, learn_class
from airtouch.gap.relations.learning import SEED, Drawing, Scene, fly, halved, scaled
from airtouch.gap.relations.library import SHARES, Library
from airtouch.gap.second_process import map_on_two_cores
from airtouch.gap.signatures.random_draws import kinds_of, log_uniform
from airtouch.simulation.effects import get
from airtouch.vehicle import Vehicle

PAIRS = 40  #: flights with the effect, and as many without, of which its class is learned; chosen for time
CALIBRATION = 24  #: flights by which the class is calibrated; chosen for time
LEAST_PAIRS = 20  #: of PAIRS that must end well; chosen


class Pair(NamedTuple):
    """A flight with an effect beside the nominal flight of the same number.

    amount (p,): true parameters (`learning.scaled`); flight, nominal (Q,): coordinates.
    """

    amount: np.ndarray
    flight: np.ndarray
    nominal: np.ndarray


def completed(library: Library, vehicle: Vehicle, names: Iterable[str]) -> Library:
    """The library with a class of each of these effects that it lacks; not of one whose flights seldom end well.

    vehicle: as declared, that of the library. Takes about ten seconds an effect.
    """
    scene = Scene(library.scenario, vehicle)
    for name in sorted(set(names) - library.effects):
        library = _with_class(library, scene, name)
    return library


def _with_class(library: Library, scene: Scene, name: str) -> Library:
    """The library with a class of one more effect, learned and calibrated; as it is if too few flights end well."""
    drawing = Drawing(name, kinds_of(get(name))[name])
    high = drawing.kind.highest
    low = min(_weakest(library, scene, drawing), HIGHEST_START * high)
    strengths = [log_uniform(low, high, np.random.default_rng([SEED, i, *name.encode()])) for i in range(PAIRS)]
    flown = map_on_two_cores(partial(_pair, library, scene, drawing), enumerate(strengths))
    pairs = [p for p in flown if p is not None]
    if len(pairs) < LEAST_PAIRS:
        return library
    amount, flight, nominal = (np.array(column) for column in zip(*pairs, strict=True))
    amount = amount[:, np.abs(amount).max(axis=0) > 0.0]
    own = learn_class(name, name, None, ClassFlights(amount, flight - nominal, flight))
    known = [ClassCalibration(c.readout, *shares) for c, *shares in zip(
        library.model.classes, library.nameless_share, library.second_share, library.distance_scatter, strict=True)]
    uncalibrated = with_calibrations(
        replace(library, model=replace(library.model, classes=(*library.model.classes, own))),
        [*known, ClassCalibration(None, 0.0, 0.0, 0.0)])
    found = calibrate_class(scene, uncalibrated, len(known), drawing, CALIBRATION)
    return with_calibrations(uncalibrated, [*known, _at_least(found, known)])


def _at_least(found: ClassCalibration, known: Sequence[ClassCalibration]) -> ClassCalibration:
    """A calibration with shares no smaller than any known one's: a curve through few flights is less exact."""
    return ClassCalibration(found.readout, *(max(getattr(one, name) for one in (found, *known)) for name in SHARES))


def _weakest(library: Library, scene: Scene, drawing: Drawing) -> float:
    """The highest strength of an effect, halved until it moves the coordinates of a flight by WEAKEST_SHIFT or less."""
    def hides(strength: float) -> bool:
        """Whether a flight at a strength is moved that little; False where it does not end well."""
        pair = _pair(library, scene, drawing, (0, strength))
        return pair is not None and float(np.linalg.norm(pair.flight - pair.nominal)) <= WEAKEST_SHIFT

    return halved(drawing.kind.highest, HALVINGS, hides)


def _pair(library: Library, scene: Scene, drawing: Drawing, numbered: tuple[int, float]) -> Pair | None:
    """The flight of a number with the effect at a strength, and that without; None where one does not end well."""
    number, strength = numbered
    active = drawing.active(strength, np.random.default_rng([SEED, number, *drawing.name.encode(), 1]))
    features = [fly(scene, number, effects) for effects in ([active], [])]
    known = [f for f in features if f is not None]
    if len(known) < len(features):
        return None
    flight, nominal = library.coordinates(np.array(known))
    return Pair(scaled(drawing, active), flight, nominal)
