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
from airtouch.twin.fitting import fly
from airtouch.twin.fitting import levers as lever_set
from airtouch.twin.fitting.levers import Lever
from airtouch.twin.recorded.course import Course
from airtouch.twin.recorded.features import GROUPS, Feature, names
from airtouch.vehicle import Vehicle

ROUNDS, FLIGHTS = 12, 240  #: rounds of a fit, and simulated flights of each
MEMORY_ROUNDS = 4  #: rounds whose flights enter a regression
RIDGE = 1.0  #: weight of a step of one `Lever.step` against a misfit of one scatter in each group
MOST_STEP = 2.0  #: largest step of a round, in `Lever.step`
MODEL = 0.25  #: scatters, standard deviation of the model's error in a mean feature
FREEDOM = 40.0  #: independent features that each group counts as, whatever their number
CLIP = 5.0  #: scatters, to which the difference of one flight is clipped
FEWEST = 4  #: least number of recorded flights that must have a feature
#: weight of each group's misfit
GROUP_WEIGHT = {"trim": 1.0, "spectrum": 1.0, "coherency": 1.0, "over": 0.7, "entry": 1.0, "exit": 1.0}
#: progress(round, rounds, misfit by group)
Progress = Callable[[int, int, Mapping[str, float]], None]


@dataclass(frozen=True)
class Target:
    """The target of a fit: courses, features (flights, features), and the features' scatter (features,)."""

    courses: Sequence[Course]
    features: np.ndarray
    scatter: np.ndarray


@dataclass
class State:
    """The state of a fit: levers (p,), misfit by group of each round, and the flights of the last rounds.

    refined: (p,) levers after the fit to edges (`edge_fit`), None before it.
    """

    values: np.ndarray
    history: list[dict[str, Any]]
    drawn: list[np.ndarray]
    apart: list[np.ndarray]
    refined: np.ndarray | None = None


def target(courses: Sequence[Course], features: np.ndarray) -> Target:
    """The target with the scatter of each feature: 1.48 median absolute deviations, at least `Feature.least`."""
    listed = names()
    scatter = np.full(len(listed), np.nan)
    for k, feature in enumerate(listed):
        values = features[np.isfinite(features[:, k]), k]
        if len(values) >= FEWEST:
            spread = 0.0 if feature.paired else 1.4826 * np.median(np.abs(values - np.median(values)))
            scatter[k] = max(spread, feature.least)
    return Target(list(courses), features, scatter)


def fit(aim: Target, vehicle: Vehicle, levers: Sequence[Lever], *, rounds: int = ROUNDS, flights: int = FLIGHTS,
        seed: int = 0, fixed: Mapping[str, Any] | None = None, workers: int = 1, kept: Path | None = None,
        progress: Progress | None = None) -> State:
    """The state after all rounds. The same arguments give the same result.

    kept: file to which each finished round is written, and from which a stopped fit continues. Raises AirTouchError if
    it is a fit of other flights or settings.
    """
    asked = key(aim, vehicle, levers, flights=flights, seed=seed, fixed=fixed)
    state = load(kept, asked) or State(lever_set.starts(levers), [], [], [])
    for number in range(len(state.history), rounds):
        _round(state, aim, vehicle, levers, number, rounds, flights, seed, fixed, workers)
        state.refined = None
        if progress:
            progress(number + 1, rounds, state.history[-1]["misfit"])
        if kept:
            save(kept, state, asked)
    return state


def key(aim: Target, vehicle: Vehicle, levers: Sequence[Lever], *, flights: int = FLIGHTS, seed: int = 0,
        fixed: Mapping[str, Any] | None = None) -> str:
    """Hash, of twelve digits, of everything that a round depends on; the number of rounds does not enter."""
    courses = [replace(course, source="") for course in aim.courses]
    text = repr((courses, vehicle, tuple(levers), flights, seed, fixed))
    return hashlib.sha256(text.encode() + np.ascontiguousarray(aim.features).tobytes()).hexdigest()[:12]


def best(state: State) -> np.ndarray:
    """The levers, (levers,), of the round with the least weighted sum of squared misfits over the groups.

    The last round is not always the best.
    """
    return np.array(min(state.history, key=lambda entry: total(entry["misfit"]))["values"])


def total(misfit: Mapping[str, float]) -> float:
    """The misfit of all groups, in scatters: root of the weighted sum of squares."""
    return float(np.sqrt(sum((GROUP_WEIGHT[name] * off) ** 2 for name, off in misfit.items())))


def _round(state: State, aim: Target, vehicle: Vehicle, levers: Sequence[Lever], number: int, rounds: int,
           flights: int, seed: int, fixed: Mapping[str, Any] | None, workers: int) -> None:
    """One round: simulate flights with levers drawn around the present ones, regress, and step. Changes the state."""
    began = time.process_time()
    rng = np.random.default_rng([seed, number, 13])
    steps = np.array([lever.step for lever in levers])
    values = lever_set.clipped(levers, state.values + steps * rng.standard_normal((flights, len(levers))))
    of = np.concatenate([rng.permutation(len(aim.courses)) for _ in range(flights // len(aim.courses) + 1)])[:flights]
    simulated = fly.flown_features([aim.courses[i] for i in of], vehicle, levers, values, seed,
                                   number * flights, fixed, workers)
    apart = np.clip((simulated - aim.features[of]) / aim.scatter, -CLIP, CLIP)
    lost = int((~np.isfinite(simulated[:, 0])).sum())
    if lost > 0.5 * flights:
        raise AirTouchError(f"{lost} of {flights} simulated flights did not end well; give a vehicle file nearer "
                            "to this drone with --vehicle")
    state.drawn, state.apart = [*state.drawn[-MEMORY_ROUNDS + 1:], values], [*state.apart[-MEMORY_ROUNDS + 1:], apart]
    jacobian, gap, variance = regression(np.vstack(state.drawn), np.vstack(state.apart), state.values, steps,
                                         len(values))
    before = misfit(gap)
    recorded = np.maximum(np.isfinite(aim.features).sum(axis=0), 1)
    step = least_squares_step(jacobian, gap, variance + 1.0 / recorded, levers, state.values, steps)
    step *= 1.0 if number < rounds - 3 else 0.5
    state.history.append({"values": state.values.tolist(), "misfit": before, "lost": lost,
                          "cpu_s": round(time.process_time() - began, 1)})
    state.values = lever_set.clipped(levers, state.values + steps * step)


def regression(drawn: np.ndarray, apart: np.ndarray, centre: np.ndarray, steps: np.ndarray,
               newest: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Jacobian (features, levers) per `Lever.step`; mean difference (features,) at `centre`; its variance; in scatters.

    drawn: (flights, levers), levers of each flight. apart: (flights, features), differences, NaN for a missing feature.
    The mean is that of the newest flights, corrected by the Jacobian to `centre`.
    """
    x = (drawn - centre) / steps
    jacobian = np.zeros((apart.shape[1], x.shape[1]))
    gap, variance = np.full(apart.shape[1], np.nan), np.full(apart.shape[1], np.nan)
    masks: dict[bytes, list[int]] = {}
    finite = np.isfinite(apart)
    for k in range(apart.shape[1]):
        masks.setdefault(finite[:, k].tobytes(), []).append(k)
    for columns in masks.values():
        use = finite[:, columns[0]]
        n = int(use.sum())
        last = use[-newest:]
        if n < FEWEST or not last.any():
            continue
        design = np.column_stack([x[use], _rounds(use, newest)])
        ridge = np.diag(np.r_[np.full(x.shape[1], 0.02 * n + 2.0), np.full(design.shape[1] - x.shape[1], 1e-9)])
        solution = np.linalg.solve(design.T @ design + ridge, design.T @ apart[np.ix_(use, columns)])
        jacobian[columns] = solution[:x.shape[1]].T
        recent = slice(len(x) - newest, None)
        rest = apart[recent][last][:, columns] - x[recent][last] @ solution[:x.shape[1]]
        gap[columns], variance[columns] = rest.mean(axis=0), rest.var(axis=0) / len(rest)
    return jacobian, gap, variance


def _rounds(use: np.ndarray, newest: int) -> np.ndarray:
    """Indicator of each flight's round, (used flights, rounds): one intercept for each round."""
    number = np.arange(len(use)) // newest
    return (number[use][:, None] == np.unique(number[use])[None, :]).astype(float)


def misfit(gap: np.ndarray) -> dict[str, float]:
    """Group -> rms of the mean differences, in scatters of the recorded flights."""
    group = np.array([f.group for f in names()])
    return {name: float(np.sqrt(np.nanmean(gap[group == name] ** 2)))
            for name in GROUPS if np.isfinite(gap[group == name]).any()}


def least_squares_step(jacobian: np.ndarray, gap: np.ndarray, variance: np.ndarray, levers: Sequence[Lever],
          values: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """The steps of the levers, (levers,) in `Lever.step`, with the least weighted sum of squared gaps."""
    listed: tuple[Feature, ...] = names()
    known = np.isfinite(gap)
    group = np.array([f.group for f in listed])
    weight = np.zeros(len(listed))
    for name in GROUPS:
        here = known & (group == name)
        if here.any():
            weight[here] = GROUP_WEIGHT[name] * np.sqrt(FREEDOM / here.sum() / (variance[here] + MODEL**2))
    low = np.maximum((np.array([v.low for v in levers]) - values) / steps, -MOST_STEP) - 1e-9
    high = np.minimum((np.array([v.high for v in levers]) - values) / steps, MOST_STEP) + 1e-9
    a = np.vstack([jacobian[known] * weight[known, None], np.sqrt(RIDGE) * np.eye(len(steps))])
    b = np.r_[-gap[known] * weight[known], np.zeros(len(steps))]
    return lsq_linear(a, b, bounds=(low, high)).x


def save(path: Path, state: State, asked: str) -> None:
    """Write a fit to a file for `load`. asked: its `key`."""
    write_bytes(json.dumps({
        "key": asked, "values": state.values.tolist(), "history": state.history,
        "drawn": [d.tolist() for d in state.drawn],
        "apart": [[[v if np.isfinite(v) else None for v in row] for row in a.tolist()] for a in state.apart],
        "refined": None if state.refined is None else state.refined.tolist()}).encode(), path, force=True)


def load(path: Path | None, asked: str) -> State | None:
    """The fit in a file; None without one. Raises AirTouchError for a damaged file and for a fit of another `key`."""
    if path is None or not path.is_file():
        return None
    try:
        table = json.loads(path.read_text())
        same = table.get("key") == asked
        apart = [np.array([[np.nan if v is None else v for v in row] for row in a]) for a in table["apart"]]
        refined = table.get("refined")
        state = State(np.array(table["values"]), table["history"], [np.array(d) for d in table["drawn"]], apart,
                      None if refined is None else np.array(refined))
    except (ValueError, KeyError, TypeError, AttributeError):
        raise AirTouchError(f"{path}: a damaged fit; remove it or use --force") from None
    if not same:
        raise AirTouchError(f"{path}: a fit to other flights, or with other settings; --force starts anew")
    return state
