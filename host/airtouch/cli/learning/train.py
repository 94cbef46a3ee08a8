"""`airtouch train`: train a detector on recorded flights, or on simulated ones."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from airtouch import vehicle as vehicles
from airtouch.cli.shared.flights import need_flights
from airtouch.cli.shared.help import examples
from airtouch.cli.shared.options import Finite, seed_option
from airtouch.cli.shared.typed import typed
from airtouch.detector import registry
from airtouch.detector.best import free_air as air
from airtouch.detector.best.quantisation import check_runs_in_c
from airtouch.detector.best.recipe import Recipe
from airtouch.detector.evaluation import crossval, evaluate
from airtouch.detector.evaluation.data import dataset
from airtouch.detector.shared import sensors
from airtouch.errors import AirTouchError
from airtouch.extras import need
from airtouch.logs.files import check_free
from airtouch.logs.flight_log import FlightLog
from airtouch.vehicle import DEFAULT_VEHICLE


@click.command(name="train", epilog=examples(
    "airtouch train my-flights --out mine.npz",
    "airtouch train --simulated 200 --detector paper --out paper.npz",
    "airtouch train my-flights --start mine.npz --out further.npz"))
@click.argument("flights", nargs=-1, type=click.Path(path_type=Path))
@click.option("--detector", default="best", show_default=True,
              help="Which detector to train: best, paper or paper-stream.")
@click.option("--out", type=click.Path(path_type=Path), default=Path("model.npz"), show_default=True,
              help="Model file to write.")
@click.option("--epochs", type=click.IntRange(1), help="paper: most training epochs; its own number if left out.")
@click.option("--steps", type=click.IntRange(1), help="best: training steps; its own number if left out.")
@click.option("--start", type=click.Path(path_type=Path), metavar="MODEL.npz",
              help="best: train this model further; 300 steps if --steps is left out.")
@click.option("--labelled", type=click.IntRange(1), metavar="K",
              help="best: train on K of the flights only, drawn by --seed.")
@click.option("--silence", multiple=True, type=click.Choice(sensors.SENSORS),
              help="best: remove this sensor from the flights, for logs that lack it.")
@click.option("--vehicle", metavar="NAME", help="best: the vehicle whose thrust curve the network is trained for, a "
              f"name or a .toml file; {DEFAULT_VEHICLE} if left out. --simulated flies it, too.")
@click.option("--free-air", multiple=True, type=click.Path(path_type=Path, file_okay=False),
              help="best: also train on the flights of this folder, which have no edges. May be repeated.")
@click.option("--sparsity", type=Finite(0, 1, max_open=True),
              help="Share of zeros: paper, in the first dense layer; best, in the dilated layers.")
@click.option("--block", type=click.Choice(["1", "4"]),
              help="paper: prune single weights or blocks of four; 4 if left out.")
@click.option("--lambda", "df_lambda", type=Finite(0), help="paper: weight of the disturbance-force loss.")
@click.option("--simulated", type=click.IntRange(1), metavar="N", help="Train on N simulated flights instead.")
@click.option("--scenario", metavar="NAME", help="With --simulated: what is flown; paper-mixed if left out.")
@click.option("--without", multiple=True, metavar="EFFECT",
              help="With --simulated: an effect of the scenario to switch off; may be repeated.")
@seed_option("Fixes every bit of the result on one machine, simulated flights included.")
@click.option("--force", is_flag=True, help="Replace the model file.")
def command(flights: tuple[Path, ...], detector: str, out: Path, epochs: int | None, steps: int | None,
            start: Path | None, labelled: int | None, silence: tuple[str, ...],
            vehicle: str | None, free_air: tuple[Path, ...], sparsity: float | None,
            block: str | None, df_lambda: float | None, simulated: int | None,
            scenario: str | None, without: tuple[str, ...], seed: int, force: bool) -> None:
    """Train on FLIGHTS: logs, or folders (the clean flights of its manifest.csv, else all).

    Without FLIGHTS: AIRTOUCH_FLIGHTS or ../shared/flights; with --simulated N, simulated flights. Flights that
    cannot be used are listed and left out, and the exit code is 2. `paper` holds out 15 % of the flights, to stop
    early and to choose its thresholds. `best` trains on all flights; its state is stored beside --out, in a folder
    that ends in .training, and the same command continues after a stop.
    """
    _check_combination(flights, detector, simulated, scenario, without, (start, labelled, free_air, silence, vehicle),
                       steps, (epochs, block, df_lambda))
    need("train", "training")
    check_free(out, force)
    module = registry.get(detector)
    if detector == "baseline":
        raise AirTouchError("baseline has nothing to train; --detector best or paper")
    settings = {"epochs": epochs, "steps": steps, "sparsity": sparsity, "block": block and int(block),
                "df_lambda": df_lambda, "most_flights": labelled}
    options: dict[str, Any] = {name: value for name, value in settings.items() if value is not None}
    what: dict[str, Any] | None = None
    if start:
        options["start"] = module.load(start)
    if detector == "best":
        check_runs_in_c(_recipe(options))  # before flights are read or simulated, which takes long
    if vehicle:
        options["vehicle"] = vehicles.load(vehicle)
    if free_air:
        options["free_air"] = air.read(free_air, lambda line: click.echo(f"left out of free air: {line}", err=True))
    began = time.monotonic()
    if not simulated:
        training, failures = _read(flights, evaluate.spare_of(module), _arm_pwm(detector, options))
    checkpoints = out.with_suffix(".training")
    if detector == "best" and any(checkpoints.glob("*")):
        click.echo(f"{checkpoints}: kept by a stopped training; what it did with the same flights and options is not "
                   "repeated")
    with _progress_bars() as progress:
        if simulated:
            training, what = _simulate(simulated, scenario, without, options.get("vehicle"), seed, progress)
            failures = 0
        if detector == "best":
            options["work"] = checkpoints
        model = module.fit([sensors.without(log, silence) for log in training], seed=seed, progress=progress,
                           command=typed(), **options)
    if what:
        model = replace(model, metadata={**model.metadata, "simulated": what})
    model.save(out, force)
    work = options.get("work")
    if work and work.is_dir() and not any(work.iterdir()):
        work.rmdir()
    _report(model.metadata, time.monotonic() - began)
    click.echo(f"written: {out} ({out.stat().st_size} bytes)")
    if failures:
        click.echo(f"airtouch: {len(training)} flights used, {failures} left out (see above)", err=True)
        sys.exit(2)


def _check_combination(flights: tuple[Path, ...], detector: str, simulated: int | None, scenario: str | None,
                       without: tuple[str, ...], of_best: tuple, steps: int | None, of_paper: tuple) -> None:
    """Raises click.UsageError for options that exclude each other.

    of_best: values of options for `best` alone; so is steps. of_paper: of those for `paper` and `paper-stream`.
    """
    if simulated and flights:
        raise click.UsageError("either FLIGHTS or --simulated, not both")
    if not simulated and (scenario or without):
        raise click.UsageError("--scenario and --without need --simulated N")
    if detector != "best" and any(of_best):
        raise click.UsageError("--start, --labelled, --silence, --vehicle and --free-air are for --detector best")
    if detector != "best" and steps is not None:
        raise click.UsageError("--steps is for --detector best; paper takes --epochs")
    if detector == "best" and any(value is not None for value in of_paper):
        raise click.UsageError("--epochs, --block and --lambda are for --detector paper; best takes --steps")


@contextmanager
def _progress_bars() -> Iterator[Callable[[str, int, int, str], None]]:
    """A bar a stage, on standard error: yields what a training calls with stage, steps done, their total and a note."""
    with Progress(TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(),
                  TextColumn("{task.fields[note]}"), console=_stderr()) as bar:
        tasks: dict[str, TaskID] = {}

        def progress(stage: str, done: int, total: int, note: str) -> None:
            if stage not in tasks:
                tasks[stage] = bar.add_task(stage, total=total, note="")
            bar.update(tasks[stage], completed=done, note=note)

        yield progress


def _arm_pwm(detector: str, options: dict[str, Any]) -> float | None:
    """Mean PWM above which `best` takes the vehicle to be in the air: of --vehicle, --start or its recipe; else None.

    The shipped model has no part in it: after a change of the network it can no longer be loaded.
    """
    if detector != "best":
        return None
    craft = options.get("vehicle")
    return craft.arm_pwm if craft else _recipe(options).motion.arm_pwm


def _recipe(options: dict[str, Any]) -> Recipe:
    """Of `best`: the recipe of --start, else that of this version."""
    return options["start"].recipe if "start" in options else Recipe()


def _read(paths: tuple[Path, ...], spare: int, arm_pwm: float | None) -> tuple[list[FlightLog], int]:
    """The logs that can be trained on with at most `spare` sensors missing, and the number of the others.

    arm_pwm: as in `evaluate.check`.
    """
    logs, left_out = crossval.readable_flights(dataset.collect(paths or (need_flights(),)), spare, scored=False,
                                               arm_pwm=arm_pwm)
    for _, reason in left_out:
        click.echo(f"airtouch: {reason}", err=True)
    training, failures = list(logs.values()), len(left_out)
    if not training:
        raise AirTouchError("no flight that can be trained on")
    return training, failures


def _simulate(count: int, scenario: str | None, without: tuple[str, ...], vehicle: vehicles.Vehicle | None,
              seed: int, progress: Callable[[str, int, int, str], None]) -> tuple[list[FlightLog], dict[str, Any]]:
    """Simulated flights and their description for the model's metadata."""
    from airtouch.detector.evaluation.data import simulated

    return simulated.training_flights(count, scenario or simulated.SCENARIO, vehicle=vehicle, without=without,
                                      seed=seed, progress=progress)


def _report(metadata: dict, seconds: float) -> None:
    held_out = metadata.get("held_out", ())
    fitted = len(metadata["flights"]) - metadata.get("flights_before", 0) - len(held_out)
    click.echo(f"trained on {fitted} flights in {seconds:.0f} s; lag {metadata.get('lag_s', 0.0):.2f} s")
    if held_out:
        click.echo(f"held out ({len(held_out)}): {', '.join(sorted(held_out))}")
    if "simulated" in metadata:
        batch = metadata["simulated"]
        click.echo(f"simulated: {batch['scenario']}, seed {batch['seed']}, effects: {', '.join(batch['effects'])}")
    score = metadata.get("held_out_accuracy", {})
    if score.get("float") is not None:
        click.echo(f"balanced window accuracy on held-out flights: float {score['float']:.1%}, "
                   f"int8 {score['int8']:.1%} (n = {score['windows']} windows)")


def _stderr():
    from rich.console import Console

    return Console(stderr=True)
