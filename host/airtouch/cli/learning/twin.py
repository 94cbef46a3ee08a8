"""`airtouch twin`: fit the simulator to recorded flights of one drone."""

import json
from collections.abc import Sequence
from dataclasses import asdict
from itertools import count
from pathlib import Path
from typing import Any

import click

from airtouch.cli.shared.options import seed_option, speed_option
from airtouch.cli.shared.progress import Bar
from airtouch.cli.shared.typed import typed
from airtouch.errors import AirTouchError
from airtouch.logs.files import make_folder, no_empty_folders, write_bytes
from airtouch.vehicle import DEFAULT_VEHICLE

SUMMARY, REPORT = "twin.json", "report.html"


@click.command(name="twin")
@click.argument("flights", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), default=Path("twin"), show_default=True,
              help="Folder for vehicle.toml, scenario.toml, report.html and the fit.")
@click.option("--vehicle", default=DEFAULT_VEHICLE, show_default=True,
              help="What the fit starts from: a name or a .toml file with mass, size and thrust curve.")
@speed_option
@click.option("--fold", "folds", type=int, multiple=True, metavar="N",
              help="Only flights of this fold of the manifest; may be repeated.")
@click.option("--rounds", type=click.IntRange(1), default=12, show_default=True, help="Rounds of simulated flights.")
@click.option("--batch", type=click.IntRange(40), default=240, show_default=True, help="Simulated flights a round.")
@seed_option("Fixes the result.")
@click.option("--workers", type=click.IntRange(1), help="Threads; default one a core.")
@click.option("--resume", is_flag=True, help="Continue a fit that stopped.")
@click.option("--force", is_flag=True, help="Replace the twin in --out.")
def command(flights: tuple[Path, ...], out: Path, vehicle: str, speed: float | None, folds: tuple[int, ...],
            rounds: int, batch: int, seed: int, workers: int | None, resume: bool, force: bool) -> None:
    """Fit the simulator to FLIGHTS of one drone: logs, or folders (the clean flights of a manifest.csv).

    \b
    airtouch twin my-flights --out twin
    airtouch simulate twin/scenario.toml --vehicle twin/vehicle.toml --flights 100 --out simulated
    airtouch gap diagnose my-flights --vehicle twin/vehicle.toml

    What to fly: take off, hover for at least 5 s, fly straight over a table or a box and half a metre further, and
    land. Fly at least four flights, better twenty, at two or three heights over the box (2 to 10 cm). Log
    acceleration, gyro, motor commands and the down range at 100 Hz. Heights, times and speeds come from the logs.

    \b
    report.html    recorded and simulated signals overlaid; medians around edges; AUROC of a classifier of the
                   two, by phase (0.5 is closed); the remaining differences, largest first
    vehicle.toml   and scenario.toml: the twin, for simulate, gap and train
    """
    from airtouch.extras import need

    need("train", "comparing the twin with the drone")
    from airtouch import vehicle as vehicles
    from airtouch.report import twin_report
    from airtouch.twin import files
    from airtouch.twin.comparison import compare
    from airtouch.twin.comparison.curves import curves
    from airtouch.twin.fitting import calibrate, levers

    fit_file = out / calibrate.FIT
    _check_results(fit_file, [out / name for name in (files.VEHICLE, files.SCENARIO, SUMMARY, REPORT)], resume, force)
    with no_empty_folders(out):
        make_folder(out)
        craft = vehicles.load(vehicle)
        recorded = _read(flights, speed, folds)
    if force and not resume:
        fit_file.unlink(missing_ok=True)
    fitted = calibrate.calibrate(recorded, craft, out, rounds=rounds, flights=batch, seed=seed, workers=workers,
                                 bar=Bar)
    with Bar("flying the twin") as bar:
        simulated, diverged = compare.fly_courses(recorded.courses, craft, fitted.levers, fitted.values, seed,
                                                  levers.FIXED, progress=bar)
    with Bar("telling apart") as bar:
        phase = count(1)
        comparison = compare.compare(recorded, fitted.target, simulated, diverged, seed,
                                     lambda name: bar(next(phase), 6, name))
    by_name = {lever.name: float(value) for lever, value in zip(fitted.levers, fitted.values, strict=True)}
    summary = _summary(comparison, by_name, fitted.history, recorded, typed())
    write_bytes(json.dumps(summary, indent=1).encode(), out / SUMMARY, force=True)
    with Bar("report"):
        flown = twin_report.FlownTwin(recorded, fitted, comparison, curves(recorded, comparison.flights))
        twin_report.write_report(out / REPORT, flown, command=typed(), force=True)
    _say(comparison, len(recorded.courses), fitted.history[0]["misfit"])
    click.echo(f"written: {out / files.VEHICLE}, {out / files.SCENARIO}, {out / REPORT}")


def _read(flights: Sequence[Path], speed: float | None, folds: Sequence[int]) -> Any:
    """The recorded flights; says why others were left out."""
    from airtouch.twin.recorded import flights as recorded_flights

    with Bar("reading") as bar:
        recorded = recorded_flights.read(flights, speed_mps=speed, folds=folds, progress=bar)
    for _, reason in recorded.left_out:
        click.echo(f"airtouch: {reason}", err=True)
    return recorded


def _say(comparison: Any, flights: int, first_misfit: Any) -> None:
    """Print how far the fit came, how well a classifier tells twin and drone apart, and what differs most."""
    from airtouch.twin.comparison import words
    from airtouch.twin.fitting import calibrate

    click.echo(f"{flights} flights; misfit in scatters: "
               f"{calibrate.in_words(first_misfit)} -> {calibrate.in_words(comparison.misfit)}")
    for a in comparison.auroc:
        click.echo(f"{a.phase:7} AUROC {a.value:.3f} ({a.low:.3f} to {a.high:.3f}), {a.real_flights} flights, "
                   f"{a.windows} windows; tells: {a.telling[0]}")
    click.echo("largest differences:")
    for gap in comparison.gaps[:5]:
        where, what, difference, scatters, n = words.gap_row(gap)
        click.echo(f"  {where}: {what} {difference}, {scatters} scatters, {n} flights")


def _check_results(fit_file: Path, results: Sequence[Path], resume: bool, force: bool) -> None:
    """Raise AirTouchError for a twin, or files with the names of its results, without --force.

    A fit that goes on replaces its own results.
    """
    if fit_file.exists() and not (resume or force):
        raise AirTouchError(f"{fit_file.parent}: holds a twin already; --resume goes on with it, --force starts anew")
    for path in results:
        if path.exists() and not (force or fit_file.exists()):
            raise AirTouchError(f"{path}: exists already, and is of no fit; choose another --out, or --force to "
                                "replace it")


def _summary(comparison: Any, levers: dict[str, float], history: Any, recorded: Any,
             command_line: str) -> dict[str, Any]:
    """The content of the report as plain values for JSON."""
    return {"command": command_line, "flights": [c.as_dict() for c in recorded.courses], "misfit": comparison.misfit,
            "auroc": [asdict(a) for a in comparison.auroc], "lost": comparison.diverged,
            "gaps": [{"group": g.feature.group, "feature": g.feature.name, "unit": g.feature.unit,
                      "difference": g.difference, "scatters": g.scatters, "flights": g.flights}
                     for g in comparison.gaps],
            "levers": levers, "history": history}
