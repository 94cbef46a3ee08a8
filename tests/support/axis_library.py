"""A library of relations without any learning: six effects along six axes of their coordinates."""

from dataclasses import replace

import numpy as np

from airtouch.gap.features.feature_space import Standard
from airtouch.gap.relations.effect_class import EffectClass
from airtouch.gap.relations.hypotheses import LearnedModel
from airtouch.gap.relations.library import Coordinates, Library, NominalDistance

Q = 100  #: coordinates
KNOTS = np.log([0.5, 5.0, 50.0])
NAMES = ("mass", "wind", "inertia", "motor_lag", "vibration", "gust")


def library():
    """Six effects along six axes, each by its strength alone; what has no name lies anywhere."""
    classes = tuple(EffectClass(n, n, None, 1, False, KNOTS, np.tile(np.eye(Q)[i], (1, 3, 1)), np.zeros((Q, 0)),
                                np.zeros(0)) for i, n in enumerate(NAMES))
    model = LearnedModel(classes, np.zeros((Q, 0)), np.eye(Q) / np.sqrt(Q))
    coordinates = Coordinates(Standard(np.zeros(Q), np.ones(Q)), np.eye(Q), np.zeros(Q))
    return Library("none", "none", coordinates, model, NominalDistance(float(Q), np.sqrt(2.0 * Q)))


def each_calibrated(of, **shares):
    """The library with these fields in the calibration of every class."""
    return of.with_classes(replace(c, calibration=replace(c.calibration, **shares)) for c in of.model.classes)


def noise(seed=1):
    return np.random.default_rng(seed).normal(size=Q)
