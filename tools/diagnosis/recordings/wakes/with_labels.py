"""How many wakes classifiers detect that have the labels of all other flights, without the wakes' seconds."""

from pathlib import Path

import numpy as np

from airtouch import vehicle as vehicles
from airtouch.detector.evaluation.data.folds import BUILD_DAYS
from airtouch.gap.evidence.data import Data
from airtouch.gap.nominal.apparent import passing_sizes
from airtouch.gap.passing.bursts import piece_powers
from airtouch.gap.sealed.intervals import auroc, share_text
from airtouch.gap.signals.channels import FORCE, TORQUE

from .. import swarm_cuts
from ..learners import discriminant, forest, scikit, standardised
from .without_seconds import wakes_and_nominal

BANDS_HZ = ((1.0, 2.0), (2.0, 4.0), (4.0, 8.0), (8.0, 16.0), (16.0, 30.0), (30.0, 50.0))  #: octaves, nearly
PIECE_S = 0.5  #: s of which a power is taken: about as long as a vehicle is under another at a time
HIGH = (0.9, 1.0)  #: quantiles of the pieces' powers, over their median
FALSE_ALARMS = 0.05  #: share of nominal flights beyond the limit: the goal of nominal flights that are not `none`
LEARNERS = {"discriminant": discriminant, "forest": forest}


def numbers_of(data: Data) -> np.ndarray:
    """Numbers (k,) of a flight against itself: its passing effects' sizes, and log ratios of power to the median."""
    (flight,), ratios = data.flights, []
    for column in (*range(FORCE.start, FORCE.stop), *range(TORQUE.start, TORQUE.stop)):
        for band_hz in BANDS_HZ:
            power = piece_powers(data.study, flight, column, band_hz, PIECE_S)
            known = power[power > 0.0]
            ratios += list(np.log(np.quantile(known, HIGH) / np.median(known)))
    sizes = passing_sizes(data)
    return np.array([*ratios, *(sizes[name] for name in sorted(sizes))])


def relative_numbers(numbers: np.ndarray, vehicle: np.ndarray, wake: np.ndarray) -> np.ndarray:
    """Numbers (flights, k) less their mean over the vehicle's other nominal flights; wake: bool (flights,)."""
    index = np.arange(len(numbers))
    return numbers - np.array([numbers[(vehicle == vehicle[i]) & ~wake & (index != i)].mean(axis=0) for i in index])


def held_out_scores(numbers: np.ndarray, wake: np.ndarray, fold: np.ndarray, learner: str) -> np.ndarray:
    """Probability of a wake (flights,) by a learner that has the labels of all flights outside each one's fold."""
    scores = np.zeros(len(wake))
    for one in np.unique(fold):
        train = fold != one
        model = standardised(LEARNERS[learner](wake[train])).fit(numbers[train], wake[train])
        scores[~train] = model.predict_proba(numbers[~train])[:, 1]
    return scores


def detected(scores: np.ndarray, wake: np.ndarray) -> np.ndarray:
    """Wakes, bool (flights,), beyond all but FALSE_ALARMS of the nominal flights; the scores decide the limit too."""
    calm = np.sort(scores[~wake])
    return wake & (scores > calm[len(calm) - 1 - int(FALSE_ALARMS * len(calm))])


def show_with_labels(flights: Path, part: str) -> None:
    """Print a line for each learner and each kind of fold: AUROC, wakes detected, and those that are not.

    part: as of `wakes_and_nominal`; of "all" the limit is that of all nominal flights, and day 21 is counted apart too.
    """
    scikit("ensemble")  # before the flights are read
    rows = [(Path(case.flight).name, vehicles.load(case.vehicle).name, case.truth == "downwash", numbers_of(data))
            for case, data in wakes_and_nominal(flights, part)]
    files, vehicle, wake = (np.array([row[k] for row in rows]) for k in range(3))
    numbers = relative_numbers(np.array([row[3] for row in rows]), vehicle, wake)
    drones = {r["file"]: f"{r['cf']} {r['day']}" for r in swarm_cuts.cuts(flights / "neuralswarm")}
    folds = {"all other flights": np.arange(len(files)), "other drones and days": np.array([drones[f] for f in files])}
    built_on = np.array([drones[f].rsplit(" ", 1)[1] in BUILD_DAYS for f in files])
    print(f"{len(files)} flights, {wake.sum()} wakes, {numbers.shape[1]} numbers\n"
          "| learner | labels of | AUROC | wakes detected | of days not built on | not detected |\n"
          "|---|---|---|---|---|---|")
    for learner in LEARNERS:
        for labels, fold in folds.items():
            scores = held_out_scores(numbers, wake, fold, learner)
            hit = detected(scores, wake)
            print(f"| {learner} | {labels} | {auroc(scores[wake].tolist(), scores[~wake].tolist()):.2f} | "
                  f"{share_text(int(hit.sum()), int(wake.sum()))} | {(hit & ~built_on).sum()} of "
                  f"{(wake & ~built_on).sum()} | {' '.join(files[wake & ~hit])} |", flush=True)
