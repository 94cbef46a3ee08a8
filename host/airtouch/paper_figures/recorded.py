"""Scores of detectors on recorded flights, cross-validated by flight as in `airtouch crossval`."""

from functools import cache
from pathlib import Path
from typing import Any

from airtouch.detector import ablation
from airtouch.detector.best import free_air
from airtouch.detector.evaluation import crossval
from airtouch.detector.evaluation.crossval import Fold
from airtouch.detector.evaluation.data import dataset, folds
from airtouch.detector.evaluation.score import FlightScore
from airtouch.detector.registry import Detector, get
from airtouch.paper_figures.figure import Job, Missing

#: detector -> training options of a full run and of a quick run
FULL: dict[str, dict[str, Any]] = {"best": {}, "paper": {}, "baseline": {}}
QUICK: dict[str, dict[str, Any]] = {"best": {"steps": 300}, "paper": {"epochs": 3}, "baseline": {}}
QUICK_FOLD = 0  #: the only fold that a quick run holds out
QUICK_SCORED, QUICK_TRAINED = 2, 3  #: a quick run scores every second flight of it, and trains on every third other one
ABLATION_FOLDS = (0, 1)  #: folds that ablations hold out in turn
NAMED = 3  #: flights left out that a caption names
AIR = ("neuralswarm/flights", "crazypad", "imrclab")  #: folders, beside the flights, of flights without edges


def files(job: Job) -> list[dataset.FlightFile]:
    """The clean flights of the folder, fewer of them in a quick run. Raises Missing without a folder."""
    if job.flights is None:
        raise Missing("no recorded flights here: give their folder with --flights, or set AIRTOUCH_FLIGHTS")
    flights = dataset.collect([job.flights])
    if not job.quick:
        return flights
    return [flight for fold, members in folds.by_fold(flights).items()
            for flight in members[::QUICK_SCORED if fold == QUICK_FOLD else QUICK_TRAINED]]


@cache
def scores(job: Job, name: str) -> tuple[list[FlightScore], list[Fold]]:
    """Scores, one for each flight, and the folds, of a detector by cross-validation over flights.

    Results are cached while the program runs, because several figures show the same scores.
    """
    flights = files(job)
    options = (QUICK if job.quick else FULL)[name]
    folders = free_air_folders(job.flights) if job.flights and name == "best" and not job.quick else []
    air = free_air.read(folders) if folders else []
    held_out = folds.by_fold(flights)
    if job.quick:
        held_out = {QUICK_FOLD: held_out[QUICK_FOLD]} if QUICK_FOLD in held_out else dict(list(held_out.items())[:1])
    settings = crossval.Settings(options=options, free_air=air)
    result = crossval.crossval(name, flights, job.work / "folds", settings, folds=held_out,
                                           tell=lambda line: job.tell(f"{name}, {line}"))
    return result.scores, result.folds


def variant_scores(job: Job, name: str, detector: Detector | None, options: dict[str, Any],
           ) -> tuple[list[FlightScore], list[Fold]]:
    """As `scores`, of a variant of a detector, over ABLATION_FOLDS (in a quick run over QUICK_FOLD)."""
    flights = files(job)
    by_fold = folds.by_fold(flights)
    numbers = (QUICK_FOLD,) if job.quick else ABLATION_FOLDS
    held_out = {k: by_fold[k] for k in numbers if k in by_fold} or dict(list(by_fold.items())[:1])
    label = name if detector is None else f"variant-{name}"
    result = crossval.crossval(label, flights, job.work / "folds", crossval.Settings(options=options),
                                           folds=held_out, detector=detector,
                                           tell=lambda line: job.tell(f"{name}, {line}"))
    return result.scores, result.folds


def in_float(job: Job, name: str, held_out: list[Fold]) -> list[FlightScore]:
    """Scores of the float networks of a variant, on the folds and with the models of `variant_scores`."""
    numbers = {fold.fold for fold in held_out}
    return ablation.in_float(get(name), [f for f in files(job) if f.condition.fold in numbers], held_out,
                             job.work / "folds")


def free_air_folders(flights: Path) -> list[Path]:
    """The folders of AIR that are there."""
    return [folder for name in AIR if (folder := flights.parent / name).is_dir()]


def sample_sentence(job: Job, flights: int, edges: int) -> str:
    """The sentences of a caption on the number of flights and edges, how they were split, and what was left out."""
    if job.quick:
        return (f"Recorded flights, {flights} of one fold ({edges} edges), by models of the other folds, briefly "
                f"trained (--quick).{left_out(job)}")
    return (f"{flights} recorded flights of the paper's authors, {edges} edges, cross-validated by flight in "
            f"{len(folds.by_fold(files(job)))} folds.{left_out(job)}")


@cache
def left_out(job: Job) -> str:
    """" Left out: ..." of the flights of the manifest that are missing or cannot be scored; "" if there are none."""
    _, unread = crossval.readable_flights(files(job))
    if not unread:
        return ""
    more = f"; and {len(unread) - NAMED} more" if len(unread) > NAMED else ""
    return f" Left out: {'; '.join(reason for _, reason in unread[:NAMED])}{more}."
