"""Detectors that learn from a few labelled flights: what each may learn from, and the scores of flights held out."""

import argparse
import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from airtouch import __version__, vehicle
from airtouch.detector import best
from airtouch.detector.best.model import BestModel
from airtouch.detector.evaluation import crossval, evaluate
from airtouch.detector.evaluation.data import dataset
from airtouch.detector.evaluation.data.dataset import FlightFile
from airtouch.detector.evaluation.score import FlightScore
from airtouch.detector.shared import sensors, training_set
from airtouch.errors import AirTouchError
from airtouch.logs.files import write_bytes
from airtouch.logs.flight_log import FlightLog
from airtouch.simulation import scenario
from airtouch.twin import adapt, cache, files

COMMAND = "tools/detectors/labelled_flights.py"  #: in the metadata of models


def draw_flights(pool: Sequence[adapt.LoadedFlight], count: int, draw: int) -> list[adapt.LoadedFlight]:
    """`count` flights of the pool; a draw's smaller sets lie within its larger ones."""
    if count > len(pool):
        raise AirTouchError(f"{count} labelled flights wanted, {len(pool)} are not held out; ask for fewer")
    return [pool[i] for i in np.random.default_rng(draw).permutation(len(pool))[:count]]


def held_out_scores(model: BestModel, held: Sequence[FlightFile], readable: dict[Path, FlightLog]) -> list[FlightScore]:
    """Scores of the held-out flights. Raises AirTouchError where the model knows one."""
    for file in held:
        if training_set.contains(model.metadata, readable[file.path]):
            raise AirTouchError(f"{file.path}: the model to start from was trained on this flight; train one without "
                                "it")
    return [evaluate.evaluate_flight(f, readable[f.path], best, model).score for f in held]


def twin_flights(folder: Path, pool: Sequence[adapt.LoadedFlight]) -> adapt.SimulatedFlights:
    """Edges of the twin in this folder, laid over the free air of these flights."""
    craft = vehicle.load(str(folder / files.VEHICLE))
    return adapt.simulated_flights(pool, scenario.load(folder / files.SCENARIO), craft, 0, None)[0]


def recorded_beside(folders: Sequence[Path], speed: float | None,
                    pool: Sequence[adapt.LoadedFlight]) -> adapt.SimulatedFlights:
    """Flights of other folders to learn beside the pool's, without the sensors that the pool lacks."""
    listed = dataset.collect(folders, speed)
    readable = crossval.all_readable(listed, best.SPARE_SENSORS)
    absent = adapt.absent_sensors(pool)
    return adapt.SimulatedFlights([sensors.without(readable[f.path], absent) for f in listed], [None] * len(listed))


def identity(file: FlightFile, log: FlightLog) -> list[Any]:
    """A flight's name, its condition and a hash of all that was logged: scores change with each."""
    content = hashlib.sha256()
    for name, values in sorted(log.columns.items()):
        content.update(name.encode() + values.tobytes())
    return [file.path.name, asdict(file.condition), content.hexdigest()]


def digest(settings: Sequence[Any]) -> str:
    """Short hash of the settings of a training, for a file's name."""
    return hashlib.sha256(json.dumps(settings).encode()).hexdigest()[:12]


@dataclass(frozen=True)
class Group:
    """Flights that are held out together, and what the models that score them may learn from.

    held: the flights to score. pool: all others, to draw labelled ones from. start: the model to start from. beside:
    flights to learn with the labelled ones.
    """

    name: str
    held: list[FlightFile]
    pool: list[adapt.LoadedFlight]
    start: BestModel | None
    beside: adapt.SimulatedFlights | None


@dataclass(frozen=True)
class Training:
    """One training: its row ("start", "labelled", "unlabelled" or "alone"), number of flights, draw and seed."""

    row: str
    count: int
    draw: int
    seed: int

    @property
    def name(self) -> str:
        """Its number of flights, draw and seed, for a file's name."""
        return f"{self.count}_draw{self.draw}_seed{self.seed}"

    def steps(self, options: argparse.Namespace) -> int:
        """Steps of the optimiser."""
        return {"start": 0, "alone": options.alone_steps}.get(self.row, options.steps)


def scores_of(training: Training, group: Group, readable: dict[Path, FlightLog],
              options: argparse.Namespace) -> list[FlightScore]:
    """Scores of one training on the group's held-out flights, from the file of an earlier run if there is one."""
    settings = settings_of(training, group, readable, options)
    rounds = [adapt.ROUNDS] if training.row == "unlabelled" else []
    path = options.out / f"{training.row}_{training.name}_{digest([*settings, *rounds])}.json"
    if path.is_file():
        return [FlightScore.from_dict(entry) for entry in json.loads(path.read_text())]
    file = options.out / f"labelled_{training.name}_{digest(settings[1:])}.npz"
    scores = held_out_scores(model_of(training, group, file, options), group.held, readable)
    write_bytes(json.dumps([s.as_dict() for s in scores]).encode(), path, force=True)
    return scores


def settings_of(training: Training, group: Group, readable: dict[Path, FlightLog],
                options: argparse.Namespace) -> list[Any]:
    """All that a training and its scores depend on, for the names of their files: the version and the flights too."""
    row = training.row
    settings = [row, training.count, training.draw, training.seed, group.name, training.steps(options),
                group.start.digest if group.start and row != "alone" else "",
                __version__, [identity(f, readable[f.path]) for f in group.held],
                [identity(f.file, f.log) for f in group.pool]]
    if group.beside and row in ("labelled", "unlabelled"):
        settings += [bool(options.beside), adapt.STEPS, sorted(adapt.AUGMENTATION.items()), repr(adapt.DECODER),
                     [training_set.flight_hash(log) for log in group.beside.logs]]
    return settings


def model_of(training: Training, group: Group, file: Path, options: argparse.Namespace) -> BestModel:
    """The model that is scored. file: where one that learns labelled flights beside others is stored.

    Raises AirTouchError for the row "start" of a group without a model to start from.
    """
    if training.row == "start":
        if group.start is None:
            raise AirTouchError("no model to start from: give --start")
        return group.start
    sample = draw_flights(group.pool, training.count, training.draw)
    if training.row == "alone":
        return best.fit([f.log for f in sample], seed=training.seed, steps=training.steps(options), command=COMMAND)
    return learn(group, sample, training.seed, file, training.row == "unlabelled", options)


def learn(group: Group, sample: Sequence[adapt.LoadedFlight], seed: int, file: Path, unlabelled: bool,
          options: argparse.Namespace) -> BestModel:
    """A detector of a sample of labelled flights, of the flights beside them, and of the model to start from.

    file: where that detector is stored. unlabelled: the pool's other flights are learnt after it, without their labels.
    """
    start = group.start
    if group.beside is None or start is None:
        return cache.model(file, lambda: best.fit([f.log for f in sample], seed=seed, start=start, steps=options.steps,
                                                  command=COMMAND))
    trainer = adapt.Trainer(start if options.beside else None, group.beside, seed, COMMAND)
    model = cache.model(file, lambda: trainer.fit_all(start, sample))
    if not unlabelled:
        return model
    names = {f.log.source for f in sample}
    return trainer.self_train(model, sample, [adapt.without_range(f) for f in group.pool if f.log.source not in names])
