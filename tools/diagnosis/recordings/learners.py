"""Classifiers that have the labels of recorded flights, which the diagnosis has not: how much can be told at all."""

from importlib import import_module
from typing import Any

import numpy as np

from airtouch.errors import AirTouchError

TREES = 300  #: of a forest; no source: round number, more than scikit-learn's 100


def scikit(module: str) -> Any:
    """A module of scikit-learn by its name there. Raises AirTouchError where it is not installed."""
    try:
        return import_module(f"sklearn.{module}")
    except ImportError:
        raise AirTouchError("the classifiers need scikit-learn: pip install 'airtouch[train]'") from None


def discriminant(classes: np.ndarray) -> Any:
    """A linear discriminant that takes each class as equally likely."""
    count = len(set(classes))
    return scikit("discriminant_analysis").LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto",
                                                                      priors=np.full(count, 1.0 / count))


def forest(_: np.ndarray) -> Any:
    """A forest of TREES that takes each class as equally likely."""
    return scikit("ensemble").RandomForestClassifier(TREES, class_weight="balanced_subsample", random_state=0)


def standardised(model: Any) -> Any:
    """A classifier or regression on standardised numbers."""
    return scikit("pipeline").make_pipeline(scikit("preprocessing").StandardScaler(), model)
