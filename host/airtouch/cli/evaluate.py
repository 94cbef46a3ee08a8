"""`airtouch evaluate`: score a detector on flights."""

import sys
from pathlib import Path

import click

from airtouch.cli.shared import output
from airtouch.cli.shared.help import examples
from airtouch.cli.shared.options import speed_option
from airtouch.detector import registry
from airtouch.detector.evaluation import evaluate
from airtouch.detector.evaluation.data import dataset
from airtouch.detector.evaluation.data import folds as folds_of
from airtouch.detector.evaluation.score import FlightScore
from airtouch.logs.files import check_free


@click.command(name="evaluate", epilog=examples(
    "airtouch evaluate flight.csv --speed 0.3",
    "airtouch evaluate my-flights --detector paper --json scores.json",
    "airtouch evaluate my-flights --model mine.npz --fold 3 --fold 4"))
@click.argument("flights", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--detector", default="best", show_default=True, help="best, paper, paper-stream or baseline.")
@click.option("--model", type=click.Path(path_type=Path),
              help="Trained model (.npz); the shipped one if left out.")
@speed_option
@click.option("--fold", "folds", type=int, multiple=True, metavar="N",
              help="Only flights of this fold of the manifest; may be repeated.")
@click.option("--json", "json_path", type=click.Path(path_type=Path), help="Write every figure to this file.")
@click.option("--force", is_flag=True, help="Replace the JSON file.")
def command(flights: tuple[Path, ...], detector: str, model: Path | None, speed: float | None,
            folds: tuple[int, ...], json_path: Path | None, force: bool) -> None:
    """Score a detector on FLIGHTS: files, or folders (the clean flights of its manifest.csv, else all).

    True edges are steps of the down range, which no detector reads. An error in metres is the error in time times
    the speed, positive when early. The exit code is 2 if a flight was left out.
    """
    check_free(json_path, force)
    module = registry.get(detector)
    trained = module.load(model)
    collected = dataset.collect(flights, speed)
    files = folds_of.in_folds(collected, folds)
    reasons = dataset.not_taken(flights)
    reasons["of another fold"] += len(collected) - len(files)
    if reasons.total():
        click.echo(f"airtouch: {len(files)} flights are scored, {reasons.total()} are not: "
                   + ", ".join(f"{count} {reason}" for reason, count in (+reasons).items()), err=True)
    noted: list[tuple[FlightScore, list[str]]] = []
    with click.progressbar(length=len(files), label="flights", file=sys.stderr) as bar:
        def done(result: evaluate.Result | Exception) -> None:
            if isinstance(result, Exception):
                click.echo(f"\rairtouch: {result}", err=True)
            else:
                noted.append((result.score, evaluate.remarks(result.log)))
            bar.update(1)

        scores, failures = evaluate.evaluate(files, module, trained, done)
    remarks = evaluate.remarks_by_flight(noted, scores, failures)
    _print_remarks(remarks)
    result = evaluate.as_json(detector, scores, failures, module.lag_s(trained), module.parameters(trained))
    result["remarks"] = remarks
    screen = output.console()
    if scores:
        output.print_table(screen, {detector: result}, f"{detector}: lag of {result['lag_s']:.2f} s taken off")
        for what in ("height", "angle", "wind"):
            if len(result[f"by_{what}"]) > 1:
                output.print_table(screen, result[f"by_{what}"], f"by {what}")
        for name in sorted({s.note for s in scores if s.note}):
            screen.print(f"note: {name} ({sum(s.note == name for s in scores)} flights)")
    trained_on = len(result["in_training"])
    if trained_on:
        screen.print(f"warning: the model was trained on {_which(trained_on, len(scores))}, so these figures do not "
                     "hold for other flights; airtouch crossval estimates those")
    if json_path:
        output.write_json(json_path, result, force)
        screen.print(f"written: {json_path}")
    output.left_out(failures, len(scores))
    if failures:
        sys.exit(2)


def _which(count: int, of: int) -> str:
    """So many of the flights, in words."""
    if count < of:
        return f"{count} of these {of} flights"
    return "this flight" if of == 1 else f"all {of} of these flights"


def _print_remarks(remarks: dict[str, list[str]]) -> None:
    """Print the warnings of the quality checks on stderr, one line each."""
    files: dict[str, list[str]] = {}
    for file, lines in remarks.items():
        for line in lines:
            files.setdefault(line, []).append(file)
    for line, some in files.items():
        click.echo(f"airtouch: {some[0] if len(some) == 1 else f'{len(some)} flights'}: {line}", err=True)
    if files:
        click.echo("airtouch: airtouch logs check says more", err=True)
