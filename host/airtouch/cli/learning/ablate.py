"""`airtouch ablate`: what each part of the detectors is worth."""

import sys
from pathlib import Path
from typing import Any

import click
from rich.table import Table

from airtouch.cli.shared import output
from airtouch.cli.shared.flights import need_flights
from airtouch.cli.shared.help import examples
from airtouch.cli.shared.options import seed_option
from airtouch.detector import ablation
from airtouch.detector.ablation import ABLATIONS
from airtouch.detector.evaluation.data import dataset
from airtouch.logs.files import check_free


def _names() -> str:
    return "\n".join(f"  {name:16} {a.title}" for name, a in ABLATIONS.items())


@click.command(name="ablate", epilog=examples(
    "airtouch ablate my-flights --only best --only imu-only") + "\n\n\b\nAblations:\n" + _names())
@click.argument("folder", required=False, type=click.Path(path_type=Path))
@click.option("--only", multiple=True, type=click.Choice(list(ABLATIONS)), metavar="NAME",
              help="Run this one; may be given several times. All of them if left out.")
@click.option("--steps", type=click.IntRange(1), help="Training steps of `best`; its own number if left out.")
@click.option("--epochs", type=click.IntRange(1), help="Training epochs of `paper`; its own number if left out.")
@seed_option("Of the training.")
@click.option("--out", type=click.Path(path_type=Path), default=Path("out/ablate"), show_default=True,
              help="Folder for finished folds; a second run continues from it.")
@click.option("--json", "json_path", type=click.Path(path_type=Path), help="Write every figure to this file.")
@click.option("--force", is_flag=True, help="Replace the JSON file.")
def command(folder: Path | None, only: tuple[str, ...], steps: int | None, epochs: int | None, seed: int, out: Path,
            json_path: Path | None, force: bool) -> None:
    """Cross-validate the detectors on FOLDER with one thing changed at a time, split by flight.

    Without FOLDER: AIRTOUCH_FLIGHTS or ../shared/flights. Takes two to five minutes an ablation on two cores. Exit code
    2 when a flight was left out.
    """
    check_free(json_path, force)
    folder = need_flights(folder)
    results = ablation.ablate(
        only or tuple(ABLATIONS), dataset.collect([folder]), out, seed=seed,
        best_options={} if steps is None else {"steps": steps},
        paper_options={} if epochs is None else {"epochs": epochs},
        tell=lambda line: click.echo(line, err=True))
    screen = output.console()
    for group in dict.fromkeys(row["group"] for row in results.values()):
        rows = {row["what"]: row for row in results.values() if row["group"] == group}
        output.print_table(screen, rows, f"ablation: {group}")
        if any("converged_after_epochs" in f["parameters"] for row in rows.values() for f in row["folds"]):
            screen.print(_training(rows))
        if any("parameter_bytes" in f["parameters"] for row in rows.values() for f in row["folds"]):
            screen.print(_sizes(rows))
    if json_path:
        output.write_json(json_path, results, force)
        screen.print(f"written: {json_path}")
    if any(row["left_out"] for row in results.values()):
        click.echo("airtouch: flights were left out (see above)", err=True)
        sys.exit(2)


def _training(rows: dict[str, dict[str, Any]]) -> Table:
    """Table of the epochs until convergence, mean over the folds."""
    table = Table("", "epochs to converge, mean of the folds", title="training", title_justify="left")
    for what, row in rows.items():
        epochs = [f["parameters"]["converged_after_epochs"] for f in row["folds"]]
        table.add_row(what, f"{sum(epochs) / len(epochs):.1f}")
    return table


def _sizes(rows: dict[str, dict[str, Any]]) -> Table:
    """Table of parameters, operations and the loss of accuracy from float to int8."""
    table = Table("", "parameters, bytes", "state, bytes", "MAC a sample", "balanced, float", "int8", "error, float",
                  "int8", "missed, float", "int8", title="size, cost and what int8 costs", title_justify="left")
    for what, row in rows.items():
        p, exact = row["folds"][0]["parameters"], row.get("float")
        pairs = [f(r) for f in (_accuracy, _error, _missed) for r in (exact, row)]
        table.add_row(what, str(p["parameter_bytes"]), str(p["state_bytes"]), f"{p['mac_per_sample']:.0f}", *pairs)
    return table


def _accuracy(row: dict[str, Any] | None) -> str:
    return f"{row['balanced_accuracy']:.1%}" if row else ""


def _error(row: dict[str, Any] | None) -> str:
    return f"{1000 * row['mean_abs_error_m']:.1f} mm" if row and row["mean_abs_error_m"] is not None else ""


def _missed(row: dict[str, Any] | None) -> str:
    return f"{row['missed']:.1%}" if row else ""
