"""Classes of effects that a library lacks, such as a user's own: learned from some hundred simulated flights.

By them the diagnosis knows what the effect does in closed loop, also where it changes the plant and no force shows it.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from airtouch.gap.relations.calibration import HIGHEST_START, calibrate_class
from airtouch.gap.relations.effect_class import LEAST_SHIFT, ClassCalibration, ClassFlights, EffectClass, learn_class
from airtouch.gap.relations.learning import SEED, Drawing, Scene, fly, scaled, weakest_strength
from airtouch.gap.relations.library import SHARE_FIELDS, Library
from airtouch.gap.relations.settings import OWN_EFFECT, OwnEffectSettings
from airtouch.gap.second_process import map_on_two_cores
from airtouch.gap.signatures.random_draws import kinds_of, log_uniform
from airtouch.simulation.effects import get
from airtouch.vehicle import Vehicle


class Pair(NamedTuple):
    """A flight with an effect beside the nominal flight of the same number.

    amount (p,): true parameters (`learning.scaled`); flight, nominal (Q,): coordinates.
    """

    amount: np.ndarray
    flight: np.ndarray
    nominal: np.ndarray


def completed(library: Library, vehicle: Vehicle, names: Iterable[str],
              settings: OwnEffectSettings = OWN_EFFECT) -> Library:
    """The library with a class of each of these effects that it lacks; not of one whose flights seldom end well.

    vehicle: as declared, that of the library. Takes about ten seconds an effect.
    """
    scene = Scene(library.scenario, vehicle)
    for name in sorted(set(names) - library.effects):
        library = _with_class(library, scene, name, settings)
    return library


def _with_class(library: Library, scene: Scene, name: str, settings: OwnEffectSettings) -> Library:
    """The library with a class of one more effect, learned and calibrated.

    It stays as it is if too few flights end well and show the effect.
    """
    drawing = Drawing(name, kinds_of(get(name))[name])
    high = drawing.kind.highest
    low = min(weakest_strength(high, partial(_shifts, library, scene, drawing)), HIGHEST_START * high)
    strengths = [log_uniform(low, high, np.random.default_rng([SEED, i, *name.encode()]))
                 for i in range(settings.pairs)]
    flights = map_on_two_cores(partial(_pair, library, scene, drawing), enumerate(strengths))
    pairs = [p for p in flights if p is not None and np.linalg.norm(p.flight - p.nominal) > LEAST_SHIFT]
    if len(pairs) < settings.least_pairs:
        return library
    amount, flight, nominal = (np.array(column) for column in zip(*pairs, strict=True))
    amount = amount[:, np.abs(amount).max(axis=0) > 0.0]
    own = learn_class(name, name, None, ClassFlights(amount, flight - nominal, flight), settings.least_pairs)
    if own is None:
        return library
    others = library.model.classes
    calibration = calibrate_class(scene, library.with_classes([*others, own]), len(others), drawing,
                                  settings.calibration)
    return library.with_classes([*others, replace(own, calibration=_with_larger_shares(calibration, others))])


def _with_larger_shares(calibration: ClassCalibration, others: Sequence[EffectClass]) -> ClassCalibration:
    """A calibration with shares no smaller than those of other classes.

    A curve through few flights is less exact than theirs.
    """
    calibrations = (calibration, *(c.calibration for c in others))
    return ClassCalibration(calibration.readout,
                            *(max(getattr(one, name) for one in calibrations) for name in SHARE_FIELDS))


def _shifts(library: Library, scene: Scene, drawing: Drawing, strength: float) -> list[np.ndarray]:
    """The shift (Q,) of the coordinates of one flight by an effect at a strength; none where it does not end well."""
    pair = _pair(library, scene, drawing, (0, strength))
    return [] if pair is None else [pair.flight - pair.nominal]


def _pair(library: Library, scene: Scene, drawing: Drawing, numbered: tuple[int, float]) -> Pair | None:
    """The flight of a number with the effect at a strength, and that without; None where one does not end well."""
    number, strength = numbered
    active = drawing.active(strength, np.random.default_rng([SEED, number, *drawing.name.encode(), 1]))
    features = [fly(scene, number, effects) for effects in ([active], [])]
    complete = [f for f in features if f is not None]
    if len(complete) < len(features):
        return None
    flight, nominal = library.coordinates(np.array(complete))
    return Pair(scaled(drawing, active), flight, nominal)
