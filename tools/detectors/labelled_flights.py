"""Prints what a few flights of one's own, labelled by their own down range, are worth to the `best` detector.

    python tools/detectors/labelled_flights.py FOLDER... --start MODEL.npz --by halves --out out/labelled
        [--twin FOLDER | --beside FOLDER] [--unlabelled]
        [--labelled 2 --labelled 5] [--draws 5] [--seeds 2] [--steps 300] [--alone-steps 1000] [--speed 0.3]

Each group of flights is scored by models that saw none of it: --start, --start trained further on K flights of the
other groups, and a network trained on the same K alone. Prints a Markdown table: means over all draws and seeds, 95 %
intervals by bootstrap over flights, and missed edges by height. host/docs/twin-findings.md has the tables of the
authors' flights and of another month.

By default it trains `best` 80 times: two groups, four K, five draws and two seeds, each with 1,000 steps on the K
alone. With --start it trains 80 more, with 300 steps from that model; with --twin these have 2,500 steps, with --beside
400 (`adapt.STEPS`), and --steps is refused. What --out holds is not trained again, so a run that was ended goes on.
"""

import argparse
from collections.abc import Iterable, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from airtouch.cli.shared.arguments import whole_number
from airtouch.cli.shared.progress import with_bar
from airtouch.detector import best
from airtouch.detector.evaluation import crossval
from airtouch.detector.evaluation.data import dataset
from airtouch.detector.evaluation.data.dataset import FlightFile
from airtouch.detector.evaluation.score import FlightScore
from airtouch.detector.evaluation.summary import one_a_flight, summarise
from airtouch.errors import AirTouchError, in_one_line
from airtouch.logs.files import make_folder
from airtouch.logs.flight_log import FlightLog
from airtouch.twin import adapt
from labelled.training import Group, Training, recorded_beside, scores_of, twin_flights

COUNTS = (2, 5, 10, 20)  #: labelled flights by default, the rows of host/docs/twin-findings.md
FIRST_HALF = 3  #: folds below this one are one half, the others the other


def group_of(file: FlightFile, by: str) -> str:
    """What is held out together."""
    known = file.condition.fold if by == "halves" else file.condition.day
    if known is None:
        raise AirTouchError(f"{file.path}: no {'fold' if by == 'halves' else 'day'} in the manifest beside it")
    return str(known) if by == "day" else "folds 0 to 2" if int(known) < FIRST_HALF else "folds 3 and up"


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
    figures: dict[str, Any] = summarise(one_a_flight(scores))

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
    """The command line. Raises AirTouchError where its options do not fit each other."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", type=Path, nargs="+", help="of recorded flights, each with a manifest.csv")
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
    parser.add_argument("--labelled", type=whole_number(1), action="append", metavar="K", help="default 2, 5, 10, 20")
    parser.add_argument("--draws", type=whole_number(1), default=5,
                        help="of labelled flights, for each row (default %(default)s)")
    parser.add_argument("--seeds", type=whole_number(1), default=2, help="trainings of each draw (default %(default)s)")
    parser.add_argument("--steps", type=whole_number(1), help="of going on from --start (default 300)")
    parser.add_argument("--alone-steps", type=whole_number(0), default=1000,
                        help="of training on the K alone; 0: no such rows")
    parser.add_argument("--speed", type=float, help="m/s, for flights whose manifest does not say")
    options = parser.parse_args()
    if options.steps is not None and (options.twin or options.beside):
        raise AirTouchError("--steps has no effect with --twin or --beside, whose steps are fixed: leave it out")
    if len(options.twin) not in (0, len(options.start)):
        raise AirTouchError(f"{len(options.twin)} twins for {len(options.start)} models to start from; give one for "
                            "each, or none")
    if options.unlabelled and not (options.twin or options.beside):
        raise AirTouchError("--unlabelled learns beside other flights: give --twin or --beside")
    if options.beside and (options.twin or not options.start):
        raise AirTouchError("--beside goes on from a model: give --start, and no --twin")
    if options.steps is None:
        options.steps = best.FINE_TUNING["steps"]
    return options


def check(options: argparse.Namespace, groups: Sequence[str]) -> None:
    """Raise AirTouchError where the models to start from do not fit the groups."""
    if len(options.start) not in (0, 1, len(groups)):
        raise AirTouchError(f"{len(options.start)} models to start from for {len(groups)} groups; give one, or one "
                            "for each")


def groups_of(options: argparse.Namespace, listed: Sequence[FlightFile],
              readable: dict[Path, FlightLog]) -> list[Group]:
    """The groups of all flights. Raises AirTouchError where the options do not fit them."""
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
    make_folder(options.out)
    listed = dataset.collect(options.folders, options.speed)
    readable = crossval.all_readable(listed, best.SPARE_SENSORS)
    groups = groups_of(options, listed, readable)
    print("| | draws | flights / edges | error, m | error, s | missed, % | false a minute | missed by height "
          "| false before / over / behind |\n|---|---|---|---|---|---|---|---|---|", flush=True)
    for title, kind, count in rows_of(options):
        draws = [(0, 0)] if kind == "start" else [(draw, seed) for draw in range(options.draws)
                                                  for seed in range(options.seeds)]
        trainings = [(Training(kind, count, draw, seed), group) for draw, seed in draws for group in groups]
        scores = [score for training, group in with_bar(trainings, title)
                  for score in scores_of(training, group, readable, options)]
        print(line(title, scores, len(draws)), flush=True)


if __name__ == "__main__":
    with in_one_line("labelled_flights"):
        main()
