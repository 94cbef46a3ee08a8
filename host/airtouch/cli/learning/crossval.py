"""`airtouch crossval`: cross-validate a detector by flight."""

import json
import sys
from datetime import UTC, datetime
from pathlib import Path

import click
from click.core import ParameterSource

from airtouch.cli.shared import output
from airtouch.cli.shared.flights import need_flights
from airtouch.cli.shared.help import examples
from airtouch.cli.shared.options import seed_option, speed_option
from airtouch.detector.best import free_air as free_air_flights
from airtouch.detector.evaluation import crossval, evaluate
from airtouch.detector.evaluation.data import dataset
from airtouch.detector.evaluation.data import folds as folds_of
from airtouch.detector.shared import sensors
from airtouch.logs.files import check_free
from airtouch.logs.flight_log import FlightLog

#: of `best`, printed and in the JSON
DECODER_NOTE = ("the decoder's settings and the recipe (width, steps, delay, choice of crops) are the shipped ones, "
                "chosen over the five folds of the authors' flights (host/docs/looks.md); weights and lag are of each "
                "fold's training flights alone")


@click.command(name="crossval", epilog=examples(
    "airtouch crossval my-flights --json scores.json",
    "airtouch crossval my-flights --detector paper --by day",
    "airtouch crossval my-flights --silence acceleration"))
@click.argument("flights", nargs=-1, type=click.Path(path_type=Path))
@click.option("--detector", default="best", show_default=True, help="best, paper, paper-stream or baseline.")
@click.option("--physical-filter/--no-physical-filter", default=True, show_default=True,
              help="Drop edges without an FR-CFAR alert.")
@click.option("--epochs", type=click.IntRange(1),
              help="paper: training epochs; its own number if left out.")
@click.option("--steps", type=click.IntRange(1), help="best: training steps; its own number if left out.")
@click.option("--by", type=click.Choice(["fold", "day"]), default="fold", show_default=True,
              help="What is held out together: the manifest's folds, or whole days in five groups.")
@click.option("--without", metavar="GROUP", help="One split only: the flights of the folder or day GROUP are scored by "
              "a model of all others.")
@click.option("--silence", multiple=True, type=click.Choice(sensors.SENSORS),
              help="best: remove this sensor from the scored flights.")
@click.option("--silence-training", is_flag=True, help="With --silence: remove it from the training flights too.")
@click.option("--free-air", multiple=True, type=click.Path(path_type=Path, file_okay=False),
              help="best: also train on the flights of this folder, which have no edges. May be repeated.")
@speed_option
@seed_option("Of the training.")
@click.option("--random-windows", is_flag=True,
              help="Also score the paper's random split of windows, which leaks (paper's network only).")
@click.option("--random-epochs", type=click.IntRange(1), default=60, show_default=True,
              help="Training epochs of that split.")
@click.option("--out", type=click.Path(path_type=Path), default=Path("out/crossval"), show_default=True,
              help="Folder for finished folds; a second run continues from it.")
@click.option("--json", "json_path", type=click.Path(path_type=Path), help="Write every figure to this file.")
@click.option("--force", is_flag=True, help="Replace the JSON file.")
@click.option("--ledger", type=click.Path(path_type=Path),
              help="Append a line to this file: how often the folds were looked at.")
def command(flights: tuple[Path, ...], detector: str, physical_filter: bool, epochs: int | None, steps: int | None,
            by: str, without: str | None, silence: tuple[str, ...],
            silence_training: bool, free_air: tuple[Path, ...], speed: float | None, seed: int,
            random_windows: bool, random_epochs: int, out: Path, json_path: Path | None, force: bool,
            ledger: Path | None) -> None:
    """Cross-validate a detector over FLIGHTS, folders with a manifest.csv, split by flight.

    Without FLIGHTS: AIRTOUCH_FLIGHTS or ../shared/flights. Weights and lag, and of the other
    detectors the thresholds, come from the training flights of each fold alone. The decoder of `best` was chosen over
    the five folds of the authors' flights, so its scores there are too good by what that choice gained; the output
    says so. Exit code 2 when a flight was left out.
    """
    check_free(json_path, force)
    check_free(ledger, True)
    if silence_training and not silence:
        raise click.UsageError("--silence-training needs --silence")
    source = click.get_current_context().get_parameter_source("random_epochs")
    if source is ParameterSource.COMMANDLINE and not random_windows:
        raise click.UsageError("--random-epochs needs --random-windows")
    if detector != "best" and (steps or silence or free_air):
        raise click.UsageError("--steps, --silence and --free-air are for --detector best")
    if random_windows and detector != "paper":
        raise click.UsageError("--random-windows is for --detector paper, whose network it trains")
    if detector == "best" and epochs:
        raise click.UsageError("--epochs is for --detector paper and paper-stream; best takes --steps")
    if detector == "baseline" and epochs:
        raise click.UsageError("--epochs is for detectors with a network; the baseline has none")
    files = dataset.collect(flights or [need_flights()], speed)
    split = folds_of.only(files, without) if without else folds_of.by_day(files) if by == "day" else None
    options = {name: value for name, value in {"epochs": epochs, "steps": steps}.items() if value is not None}
    air = _free_air(free_air)
    settings = crossval.Settings(seed, options, air, physical_filter, silence, silence_training)
    validation = crossval.crossval(detector, files, out, settings, folds=split,
                                   tell=lambda line: click.echo(line, err=True))
    scores, folds, left_out = validation.scores, validation.folds, validation.left_out
    for _, reason in left_out:
        click.echo(f"airtouch: {reason}", err=True)
    title = ", ".join([detector, *([] if physical_filter else ["physical filter off"]),
                       *(f"no {sensor}" for sensor in silence), *([f"trained without {without}"] if without else []),
                       *(["whole days held out"] if by == "day" and not without else []),
                       *([f"{len(air)} flights in free air"] if air else [])])
    result = evaluate.as_json(title, scores, left_out, [f.lag_s for f in folds], {})
    result["folds"] = [f.plain() for f in folds]
    if detector == "best":
        result["note"] = DECODER_NOTE
    screen = output.console()
    output.print_table(screen, {title: result, **result["by_height"]},
                     f"{title}: {len(folds)} {'folds' if len(folds) > 1 else 'split'} by flight, seed {seed}")
    if "note" in result:
        screen.print(f"note: {result['note']}")
    if random_windows:
        from airtouch.detector.paper import variants

        leak = variants.random_windows(list(crossval.readable_flights(files)[0].values()), seed=seed,
                                       epochs=random_epochs)
        result["random_windows"] = leak
        screen.print("random split of windows (leaks): balanced window accuracy "
                     f"{leak['balanced_accuracy']:.1%} on {leak['windows']} windows "
                     f"after {leak['epochs']} epochs; "
                     f"by flight {result['balanced_accuracy']:.1%}")
    if json_path:
        output.write_json(json_path, result, force)
        screen.print(f"written: {json_path}")
    if ledger:
        note(ledger, title, result)
    output.left_out(left_out, len(scores))
    if left_out:
        sys.exit(2)


def _free_air(folders: tuple[Path, ...]) -> list[FlightLog]:
    if not folders:
        return []
    return free_air_flights.read(folders, lambda line: click.echo(f"left out of free air: {line}", err=True))


def note(ledger: Path, title: str, result: dict) -> None:
    """Append a line to the ledger of looks at the folds."""
    named = ("mean_abs_error_m", "missed", "false_per_minute", "balanced_accuracy")
    figures = {key: result[key] for key in named}
    line = f"- {datetime.now(UTC):%Y-%m-%d %H:%M} UTC, {title}: {json.dumps(figures)}\n"
    with ledger.open("a", encoding="utf-8") as handle:
        handle.write(line)
