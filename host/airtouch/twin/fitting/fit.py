"""Fit of the levers: each round simulates flights, then takes one weighted least-squares step on their features.

Each simulated flight flies the course of a recorded one, with levers drawn around their present values.
The difference of the two flights' features is regressed on the levers (an ensemble of flights gives the
Jacobian; Evensen, The Ensemble Kalman Filter, 2003), and the levers move to where the mean difference, in
units of the recorded flights' scatter, is least. A ridge limits a step to the range that the round tried.
"""

import hashlib
import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import lsq_linear

from airtouch.errors import AirTouchError
from airtouch.logs.files import write_bytes
from airtouch.robust import deviation
from airtouch.twin.cache import equations
from airtouch.twin.fitting import fly
from airtouch.twin.fitting import levers as lever_set
from airtouch.twin.fitting.levers import Lever
from airtouch.twin.recorded.course import Course
from airtouch.twin.recorded.features import GROUPS, names
from airtouch.vehicle import Vehicle

#: The settings below have no source: round numbers, for a fit of 220 s on one core (host/docs/twin-findings.md).
ROUNDS, FLIGHTS = 12, 240  #: rounds of a fit, and simulated flights of each
MEMORY_ROUNDS = 4  #: rounds whose flights enter a regression
RIDGE = 1.0  #: weight of a step of one `Lever.step` against a misfit of one scatter in each group
SLOPE_RIDGE = (0.02, 2.0)  #: flights, for each one and besides, that pull a slope of the regression to 0
INTERCEPT_RIDGE = 1e-9  #: the same for the intercept of a round, which only keeps the equations solvable
MAX_STEP = 2.0  #: largest step of a round, in `Lever.step`
MODEL_STD = 0.25  #: scatters, standard deviation of the model's error in a mean feature
FREEDOM = 40.0  #: independent features that each group counts as, whatever their number
CLIP = 5.0  #: scatters, to which the difference of one flight is clipped
MIN_FLIGHTS = 4  #: least number of recorded flights that must have a feature
MAX_DIVERGED = 0.5  #: fraction of a round's flights that may diverge
LAST_ROUNDS, LAST_FACTOR = 3, 0.5  #: rounds at the end whose steps are shortened, and by what
#: weight of each group's misfit; "over" counts less, as its blocks are short
GROUP_WEIGHT = {"trim": 1.0, "spectrum": 1.0, "coherency": 1.0, "over": 0.7, "entry": 1.0, "exit": 1.0}
#: progress(round, rounds, misfit by group)
Progress = Callable[[int, int, Mapping[str, float]], None]


@dataclass(frozen=True)
class Target:
    """The target of a fit: courses, features (flights, features), and the features' scatter (features,)."""

    courses: Sequence[Course]
    features: np.ndarray
    scatter: np.ndarray

    @property
    def counts(self) -> np.ndarray:
        """Flights that have each feature, (features,), at least 1."""
        return np.maximum(np.isfinite(self.features).sum(axis=0), 1)

    def differences(self, simulated: np.ndarray, chosen: np.ndarray) -> np.ndarray:
        """Simulated features (k, features) less those of the `chosen` flights (k,), in scatters, clipped to CLIP."""
        return np.clip((simulated - self.features[chosen]) / self.scatter, -CLIP, CLIP)


@dataclass
class State:
    """The state of a fit.

    values: (levers,), present values. history: of each round its values, misfit by group, number of diverged flights
    and processor time. samples: of each of the last rounds (flights, levers), the values that were flown. differences:
    of each (flights, features), simulated less recorded, in scatters. refined: (levers,) after the fit to edges
    (`edge_fit`), None before it.
    """

    values: np.ndarray
    history: list[dict[str, Any]]
    samples: list[np.ndarray]
    differences: list[np.ndarray]
    refined: np.ndarray | None = None


@dataclass(frozen=True)
class _Settings:
    """What all rounds of a fit share: the arguments of `fit` of these names."""

    target: Target
    vehicle: Vehicle
    levers: Sequence[Lever]
    rounds: int
    flights: int
    seed: int
    fixed: Mapping[str, Any] | None
    workers: int


def target_of(courses: Sequence[Course], features: np.ndarray) -> Target:
    """The target with the scatter of each feature: 1.48 median absolute deviations, at least `Feature.least`.

    features: (flights, features). The scatter of a feature that fewer than MIN_FLIGHTS flights have is NaN.
    """
    scatter = np.full(len(names()), np.nan)
    for k, feature in enumerate(names()):
        values = features[np.isfinite(features[:, k]), k]
        if len(values) >= MIN_FLIGHTS:
            scatter[k] = max(0.0 if feature.paired else deviation(values), feature.least)
    return Target(list(courses), features, scatter)


def fit(target: Target, vehicle: Vehicle, levers: Sequence[Lever], *, rounds: int = ROUNDS, flights: int = FLIGHTS,
        seed: int = 0, fixed: Mapping[str, Any] | None = None, workers: int = 1, state_file: Path | None = None,
        progress: Progress | None = None) -> State:
    """The state after all rounds. The same arguments give the same result, if the fit began with as many rounds.

    fixed: effects without levers. state_file: each finished round is written to it, and a stopped fit continues from
    it. Raises AirTouchError if it is a fit of other flights or settings, and if most flights of a round diverge.
    """
    fit_key = key(target, vehicle, levers, flights=flights, seed=seed, fixed=fixed)
    state = load(state_file, fit_key) or State(lever_set.starts(levers), [], [], [])
    settings = _Settings(target, vehicle, levers, rounds, flights, seed, fixed, workers)
    for number in range(len(state.history), rounds):
        _round(state, settings, number)
        state.refined = None
        if progress:
            progress(number + 1, rounds, state.history[-1]["misfit"])
        if state_file:
            save(state_file, state, fit_key)
    return state


def key(target: Target, vehicle: Vehicle, levers: Sequence[Lever], *, flights: int = FLIGHTS, seed: int = 0,
        fixed: Mapping[str, Any] | None = None) -> str:
    """Hash, of twelve digits, of everything that a fit depends on but the number of its rounds.

    So a fit can go on for more rounds. As the last steps are shortened, its result is then not that of as many at once.
    """
    courses = [replace(course, source="") for course in target.courses]
    text = repr((courses, vehicle, equations(vehicle), tuple(levers), flights, seed, fixed))
    return hashlib.sha256(text.encode() + np.ascontiguousarray(target.features).tobytes()).hexdigest()[:12]


def best(state: State) -> np.ndarray:
    """The levers, (levers,), of the round with the least weighted sum of squared misfits over the groups.

    The last round is not always the best.
    """
    return np.array(min(state.history, key=lambda entry: total(entry["misfit"]))["values"])


def total(misfit: Mapping[str, float]) -> float:
    """The misfit of all groups, in scatters: root of the weighted sum of squares."""
    return float(np.sqrt(sum((GROUP_WEIGHT[name] * rms) ** 2 for name, rms in misfit.items())))


def _round(state: State, settings: _Settings, number: int) -> None:
    """One round: simulate flights with levers drawn around the present ones, regress, and step. Changes the state."""
    start_s = time.process_time()
    target, levers, flights = settings.target, settings.levers, settings.flights
    rng = np.random.default_rng([settings.seed, number, 13])
    steps = np.array([lever.step for lever in levers])
    values = lever_set.clip(levers, state.values + steps * rng.standard_normal((flights, len(levers))))
    passes = flights // len(target.courses) + 1
    chosen = np.concatenate([rng.permutation(len(target.courses)) for _ in range(passes)])[:flights]
    simulated = fly.simulated_features([target.courses[i] for i in chosen], settings.vehicle, levers, values,
                                       settings.seed, number * flights, settings.fixed, settings.workers)
    diverged = int((~np.isfinite(simulated[:, 0])).sum())
    if diverged > MAX_DIVERGED * flights:
        raise AirTouchError(f"{diverged} of {flights} simulated flights did not end well; give a vehicle file nearer "
                            "to this drone with --vehicle")
    state.samples = [*state.samples[-MEMORY_ROUNDS + 1:], values]
    state.differences = [*state.differences[-MEMORY_ROUNDS + 1:], target.differences(simulated, chosen)]
    jacobian, mean, variance = regression(np.vstack(state.samples), np.vstack(state.differences), state.values, steps,
                                          len(values))
    before = misfit(mean)
    step = least_squares_step(jacobian, mean, variance + 1.0 / target.counts, levers, state.values, steps)
    step *= 1.0 if number < settings.rounds - LAST_ROUNDS else LAST_FACTOR
    state.history.append({"values": state.values.tolist(), "misfit": before, "lost": diverged,
                          "cpu_s": round(time.process_time() - start_s, 1)})
    state.values = lever_set.clip(levers, state.values + steps * step)


def regression(samples: np.ndarray, differences: np.ndarray, centre: np.ndarray, steps: np.ndarray,
               newest: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Jacobian (features, levers) per `Lever.step`; mean difference (features,) at `centre`; its variance; in scatters.

    samples: (flights, levers), values of each flight. differences: (flights, features), NaN for a missing feature.
    centre, steps: (levers,). newest: flights of the last round, of whose differences the mean is taken, corrected by
    the Jacobian to `centre`.
    """
    x = (samples - centre) / steps
    jacobian = np.zeros((differences.shape[1], x.shape[1]))
    mean, variance = np.full(differences.shape[1], np.nan), np.full(differences.shape[1], np.nan)
    masks: dict[bytes, list[int]] = {}
    finite = np.isfinite(differences)
    for k in range(differences.shape[1]):
        masks.setdefault(finite[:, k].tobytes(), []).append(k)
    for columns in masks.values():
        use = finite[:, columns[0]]
        n = int(use.sum())
        last = use[-newest:]
        if n < MIN_FLIGHTS or not last.any():
            continue
        design = np.column_stack([x[use], _rounds(use, newest)])
        ridge = np.diag(np.r_[np.full(x.shape[1], SLOPE_RIDGE[0] * n + SLOPE_RIDGE[1]),
                              np.full(design.shape[1] - x.shape[1], INTERCEPT_RIDGE)])
        solution = np.linalg.solve(design.T @ design + ridge, design.T @ differences[np.ix_(use, columns)])
        jacobian[columns] = solution[:x.shape[1]].T
        recent = slice(len(x) - newest, None)
        residual = differences[recent][last][:, columns] - x[recent][last] @ solution[:x.shape[1]]
        mean[columns], variance[columns] = residual.mean(axis=0), residual.var(axis=0) / len(residual)
    return jacobian, mean, variance


def _rounds(use: np.ndarray, newest: int) -> np.ndarray:
    """Indicator of each flight's round, (used flights, rounds): one intercept for each round."""
    number = np.arange(len(use)) // newest
    return (number[use][:, None] == np.unique(number[use])[None, :]).astype(float)


def misfit(mean: np.ndarray) -> dict[str, float]:
    """Group -> rms of the mean differences (features,), in scatters; only groups that have one."""
    group = np.array([f.group for f in names()])
    return {name: float(np.sqrt(np.nanmean(mean[group == name] ** 2)))
            for name in GROUPS if np.isfinite(mean[group == name]).any()}


def least_squares_step(jacobian: np.ndarray, mean: np.ndarray, variance: np.ndarray, levers: Sequence[Lever],
                       values: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """The steps of the levers, (levers,) in `Lever.step`, with the least weighted sum of squared mean differences.

    jacobian (features, levers), mean and variance (features,): as of `regression`. values, steps: (levers,). Steps are
    at most MAX_STEP and end within the levers' bounds.
    """
    known = np.isfinite(mean)
    group = np.array([f.group for f in names()])
    weight = np.zeros(len(group))
    for name in GROUPS:
        members = known & (group == name)
        if members.any():
            weight[members] = GROUP_WEIGHT[name] * np.sqrt(FREEDOM / members.sum() / (variance[members] + MODEL_STD**2))
    low = np.maximum((np.array([v.low for v in levers]) - values) / steps, -MAX_STEP) - 1e-9
    high = np.minimum((np.array([v.high for v in levers]) - values) / steps, MAX_STEP) + 1e-9
    a = np.vstack([jacobian[known] * weight[known, None], np.sqrt(RIDGE) * np.eye(len(steps))])
    b = np.r_[-mean[known] * weight[known], np.zeros(len(steps))]
    return lsq_linear(a, b, bounds=(low, high)).x


def save(path: Path, state: State, fit_key: str) -> None:
    """Write a fit to a file for `load`. fit_key: its `key`."""
    write_bytes(json.dumps({
        "key": fit_key, "values": state.values.tolist(), "history": state.history,
        "drawn": [s.tolist() for s in state.samples],
        "apart": [[[v if np.isfinite(v) else None for v in row] for row in d.tolist()] for d in state.differences],
        "refined": None if state.refined is None else state.refined.tolist()}).encode(), path, force=True)


def load(path: Path | None, fit_key: str) -> State | None:
    """The fit in a file; None without one. Raises AirTouchError for a damaged file and for a fit of another `key`."""
    if path is None or not path.is_file():
        return None
    try:
        table = json.loads(path.read_text())
        same = table.get("key") == fit_key
        differences = [np.array([[np.nan if v is None else v for v in row] for row in d]) for d in table["apart"]]
        refined = table.get("refined")
        state = State(np.array(table["values"]), table["history"], [np.array(s) for s in table["drawn"]], differences,
                      None if refined is None else np.array(refined))
    except (ValueError, KeyError, TypeError, AttributeError):
        raise AirTouchError(f"{path}: a damaged fit; remove it or use --force") from None
    if not same:
        raise AirTouchError(f"{path}: a fit to other flights, with other settings or firmware, or of another version "
                            "of AirTouch; --force starts anew")
    return state
