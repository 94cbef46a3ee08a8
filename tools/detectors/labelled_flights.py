"""What a few flights of one's own, labelled by their own down range, are worth to the `best` detector.

    python tools/detectors/labelled_flights.py FOLDER... --start MODEL.npz --by halves --out out/labelled
        [--twin FOLDER | --beside FOLDER] [--unlabelled]
        [--labelled 2 --labelled 5] [--draws 5] [--seeds 2] [--steps 300] [--alone-steps 1000] [--speed 0.3]

Each group of flights is scored by models that saw none of it: --start, --start trained further on K flights of the
other groups, and a network trained on the same K alone. Prints a Markdown table: means over all draws and seeds, 95 %
intervals by bootstrap over flights, and missed edges by height. --help explains the options. host/docs/twin.md has the
table of the authors' flights, host/docs/results.md that of another month.
"""

import argparse
import hashlib
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from airtouch import vehicle
from airtouch.detector import best
from airtouch.detector.best.model import BestModel
from airtouch.detector.evaluation import crossval, evaluate
from airtouch.detector.evaluation.data import dataset
from airtouch.detector.evaluation.data.dataset import FlightFile
from airtouch.detector.evaluation.score import FlightScore, WindowCounts
from airtouch.detector.evaluation.summary import summarise
from airtouch.detector.shared import sensors, training_set
from airtouch.errors import AirTouchError, in_one_line
from airtouch.logs.files import write_bytes
from airtouch.logs.flight_log import FlightLog
from airtouch.simulation import scenario
from airtouch.twin import adapt, cache, files

COMMAND = "tools/detectors/labelled_flights.py"  #: in the metadata of models
COUNTS = (2, 5, 10, 20)  #: labelled flights by default, the rows of host/docs/twin.md
FIRST_HALF = 3  #: folds below this one are one half, the others the other


def group_of(file: FlightFile, by: str) -> str:
    """What is held out together."""
    known = file.condition.fold if by == "halves" else file.condition.day
    if known is None:
        raise AirTouchError(f"{file.path}: no {'fold' if by == 'halves' else 'day'} in the manifest beside it")
    return str(known) if by == "day" else "folds 0 to 2" if int(known) < FIRST_HALF else "folds 3 and up"


def draw_flights(pool: Sequence[adapt.LoadedFlight], count: int, draw: int) -> list[adapt.LoadedFlight]:
    """`count` flights of the pool; a draw's smaller sets lie within its larger ones."""
    if count > len(pool):
        raise AirTouchError(f"{count} labelled flights wanted, {len(pool)} are not held out; ask for fewer")
    return [pool[i] for i in np.random.default_rng(draw).permutation(len(pool))[:count]]


def merge(scores: Iterable[FlightScore]) -> list[FlightScore]:
    """One score a flight, with the edges, false detections and minutes of all its draws."""
    flights: dict[str, list[FlightScore]] = {}
    for score in scores:
        flights.setdefault(score.file, []).append(score)
    return [_merge(name, draws) for name, draws in flights.items()]


def _merge(name: str, scores: Sequence[FlightScore]) -> FlightScore:
    """The scores of several draws of one flight as one."""
    windows = WindowCounts(*(sum(counts) for counts in zip(*(s.windows for s in scores), strict=True)))
    return FlightScore(name, scores[0].condition, tuple(e for s in scores for e in s.edges),
                       tuple(e for s in scores for e in s.false or ()), sum(s.detections for s in scores),
                       sum(s.airborne_s for s in scores), windows,
                       np.sum([s.bins for s in scores], axis=0))


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
    readable, left_out = crossval.readable_flights(listed, best.SPARE_SENSORS)
    if left_out:
        raise AirTouchError(f"not usable: {left_out[0][1]}")
    absent = adapt.absent_sensors(pool)
    return adapt.SimulatedFlights([sensors.without(readable[f.path], absent) for f in listed], [None] * len(listed))


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
    settings = settings_of(training, group, options)
    rounds = [adapt.ROUNDS] if training.row == "unlabelled" else []
    path = options.out / f"{training.row}_{training.name}_{digest([*settings, *rounds])}.json"
    if path.is_file():
        return [FlightScore.from_dict(entry) for entry in json.loads(path.read_text())]
    file = options.out / f"labelled_{training.name}_{digest(settings[1:])}.npz"
    scores = held_out_scores(model_of(training, group, file, options), group.held, readable)
    write_bytes(json.dumps([s.as_dict() for s in scores]).encode(), path, force=True)
    return scores


def settings_of(training: Training, group: Group, options: argparse.Namespace) -> list[Any]:
    """All that a training depends on, for the names of its files."""
    row = training.row
    settings = [row, training.count, training.draw, training.seed, group.name, training.steps(options),
                group.start.digest if group.start and row != "alone" else "",
                [f.path.name for f in group.held], [f.log.source for f in group.pool]]
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


def missed_by_height(scores: Sequence[FlightScore]) -> str:
    """Missed edges and all edges of each height in the manifest: "low 0/144, h82 4/20"; "-" without heights."""
    counts: dict[str, list[int]] = {}
    for score in scores:
        if score.condition.height is not None:
            count = counts.setdefault(score.condition.height, [0, 0])
            count[0] += sum(edge.error_s is None for edge in score.edges)
            count[1] += len(score.edges)
    return ", ".join(f"{height} {missed}/{edges}" for height, (missed, edges) in sorted(counts.items())) or "-"


def false_by_place(scores: Sequence[FlightScore]) -> str:
    """False edges before the first true edge, between the true edges and behind the last: "12 / 0 / 4"."""
    counts = [0, 0, 0]
    for score in scores:
        places = [edge.true_sample for edge in score.edges]
        for sample in score.false or ():
            counts[int(sample >= min(places, default=sample + 1))
                   + int(sample >= max(places, default=sample + 1))] += 1
    return " / ".join(map(str, counts))


def line(title: str, scores: Sequence[FlightScore], draws: int) -> str:
    """One row of the table."""
    figures: dict[str, Any] = summarise(merge(scores))

    def text(name: str, scale: float, digits: int) -> str:
        """A figure times `scale` with its interval."""
        if figures[name] is None:
            return "-"
        ends = figures["intervals"][name] or (np.nan, np.nan)
        value, low, high = (f"{scale * x:.{digits}f}" for x in (figures[name], *ends))
        return f"{value} [{low}, {high}]"

    cells = (title, str(draws), f"{figures['flights']} / {figures['edges'] // draws}", text("mean_abs_error_m", 1, 3),
             text("mean_abs_error_s", 1, 2), text("missed", 100, 1), text("false_per_minute", 1, 2),
             missed_by_height(scores), false_by_place(scores))
    return f"| {' | '.join(cells)} |"


def arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", type=Path, nargs="+")
    parser.add_argument("--start", type=Path, action="append", default=[],
                        help="model to go on from, one for all groups or one for each in their order, which knows no "
                             "flight of its group; the rows without it if left out")
    parser.add_argument("--twin", type=Path, action="append", default=[],
                        help="folder of `airtouch twin`, as many as --start: a new network learns its edges, laid over "
                             "the free air of the other groups, with the labelled flights")
    parser.add_argument("--beside", type=Path, action="append", default=[],
                        help="folder of labelled flights to learn beside the K, half of the crops each; none may "
                             "be scored")
    parser.add_argument("--unlabelled", action="store_true",
                        help="with --twin or --beside: a row more, with the other flights learnt without their down "
                             "range, with the edges that the detector of the row before reports")
    parser.add_argument("--by", choices=("halves", "day"), default="halves",
                        help="groups: the manifest's folds 0 to 2, and 3 and up; or each day")
    parser.add_argument("--out", type=Path, default=Path("out/labelled"),
                        help="what is in it already is not done again")
    parser.add_argument("--labelled", type=int, action="append", metavar="K", help="default 2, 5, 10, 20")
    parser.add_argument("--draws", type=int, default=5)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--steps", type=int, default=best.FINE_TUNING["steps"], help="of going on (default 300)")
    parser.add_argument("--alone-steps", type=int, default=1000, help="of training on the K alone; 0: no such rows")
    parser.add_argument("--speed", type=float, help="m/s, for flights whose manifest does not say")
    return parser.parse_args()


def check(options: argparse.Namespace, groups: Sequence[str]) -> None:
    """Ends the program, with one line, where options do not fit each other or the groups."""
    if len(options.start) not in (0, 1, len(groups)):
        raise SystemExit(f"{len(options.start)} models to start from for {len(groups)} groups; give one, or one for "
                         "each")
    if len(options.twin) not in (0, len(options.start)):
        raise SystemExit(f"{len(options.twin)} twins for {len(options.start)} models to start from; give one for each, "
                         "or none")
    if options.unlabelled and not (options.twin or options.beside):
        raise SystemExit("--unlabelled learns beside other flights: give --twin or --beside")
    if options.beside and (options.twin or not options.start):
        raise SystemExit("--beside goes on from a model: give --start, and no --twin")


def groups_of(options: argparse.Namespace, listed: Sequence[FlightFile],
              readable: dict[Path, FlightLog]) -> list[Group]:
    """The groups of all flights. Ends the program, with one line, where the options do not fit them."""
    names = sorted({group_of(file, options.by) for file in listed})
    check(options, names)
    models = [best.load(path) for path in options.start]
    starts = dict(zip(names, models if len(models) > 1 else models * len(names), strict=False))
    twins = dict(zip(names, options.twin if len(options.twin) > 1 else options.twin * len(names), strict=False))
    pools = {g: [adapt.LoadedFlight(f, readable[f.path]) for f in listed if group_of(f, options.by) != g]
             for g in names}
    beside = {g: twin_flights(twins[g], pools[g]) for g in twins}
    if options.beside:
        beside = dict.fromkeys(names, recorded_beside(options.beside, options.speed, list(chain(*pools.values()))))
    return [Group(name, [f for f in listed if group_of(f, options.by) == name], pools[name], starts.get(name),
                  beside.get(name)) for name in names]


def rows_of(options: argparse.Namespace) -> Iterable[tuple[str, str, int]]:
    """(title, kind of training, number of labelled flights) of each row of the table."""
    if options.start:
        yield "as it is", "start", 0
    for count in options.labelled or COUNTS:
        if options.start:
            yield f"and {count} labelled", "labelled", count
        if options.unlabelled:
            yield f"and {count} labelled, the others without labels", "unlabelled", count
        if options.alone_steps:
            yield f"{count} labelled alone", "alone", count


def main() -> None:
    """Print each row as soon as its last draw is done."""
    options = arguments()
    options.out.mkdir(parents=True, exist_ok=True)
    listed = dataset.collect(options.folders, options.speed)
    readable, left_out = crossval.readable_flights(listed, best.SPARE_SENSORS)
    if left_out:
        raise SystemExit(f"not usable: {left_out[0][1]}")
    groups = groups_of(options, listed, readable)
    print("| | draws | flights / edges | error, m | error, s | missed, % | false a minute | missed by height "
          "| false before / over / behind |\n|---|---|---|---|---|---|---|---|---|", flush=True)
    for title, kind, count in rows_of(options):
        draws = [(0, 0)] if kind == "start" else [(draw, seed) for draw in range(options.draws)
                                                  for seed in range(options.seeds)]
        scores = [score for draw, seed in draws for group in groups
                  for score in scores_of(Training(kind, count, draw, seed), group, readable, options)]
        print(line(title, scores, len(draws)), flush=True)


if __name__ == "__main__":
    with in_one_line("labelled_flights"):
        main()
