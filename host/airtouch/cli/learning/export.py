"""`airtouch export`: a trained network, or a vehicle, as C sources."""

from pathlib import Path

import click

from airtouch import vehicle as vehicles
from airtouch.cli.shared.help import examples
from airtouch.detector.best import export as best_export
from airtouch.detector.best import model as best_model
from airtouch.detector.paper import model as model_file
from airtouch.detector.paper import rolling
from airtouch.detector.shared import archive, export, vehicle_header
from airtouch.kernels.network import parameter_bytes

Trained = model_file.Model | best_model.BestModel


@click.command(name="export", epilog=examples(
    "airtouch export --force                  # the shipped networks, to gap8/model",
    "airtouch export mine.npz --out model",
    "airtouch export --vehicle mine.toml       # a header of firmware/app/vehicles",
    "airtouch export --check"))
@click.argument("model", required=False, type=click.Path(path_type=Path))
@click.option("--vehicle", metavar="NAME", help="Write a vehicle's header for the STM32 app instead: a name, or a "
              ".toml file.")
@click.option("--out", type=click.Path(path_type=Path, file_okay=False),
              help="Folder to write to, or to check; gap8/model if left out, firmware/app/vehicles for a vehicle.")
@click.option("--check", "only_check", is_flag=True,
              help="Write nothing; refuse a folder that is stale or foreign.")
@click.option("--force", is_flag=True, help="Replace files that differ.")
def command(model: Path | None, vehicle: str | None, out: Path | None, only_check: bool, force: bool) -> None:
    """Write MODEL (.npz; all shipped ones if left out) as C: weights, shapes, scales, golden vectors.

    A MODEL of `best` is first compared with tflite-micro, where that is installed, and refused where a bit differs.
    With --check: exit code 2 and the reason where the folder is not what MODEL exports to: stale, from another
    model, edited, incomplete, or, for the shipped ones, with sources that none of them gives.
    """
    if vehicle:
        if model:
            raise click.UsageError("either MODEL or --vehicle, not both")
        craft, folder = vehicles.load(vehicle), out or vehicle_header.FOLDER
        if only_check:
            click.echo(f"{vehicle_header.check(craft, folder)}: up to date with {craft.name}")
        else:
            click.echo(f"written: {vehicle_header.export(craft, folder, force)}")
        return
    out = out or Path("gap8/model")
    shipped: list[Trained] = [] if model else [model_file.load(), rolling.load(None), best_model.load()]
    for trained in [_load(model)] if model else shipped:
        name = model.name if model else ""
        if only_check:
            export.check(trained, out, name)
            click.echo(f"{out}: up to date with {trained.metadata['detector']} model {trained.digest[:12]}")
            continue
        comparison = _comparison(trained) if model else ""
        for path in export.export(trained, out, name, force):
            click.echo(f"written: {path}")
        click.echo(f"{trained.metadata['detector']} model {trained.digest[:12]}: "
                   f"{parameter_bytes(trained.int8)} bytes of constants{comparison}")
    if only_check and shipped:
        export.check_nothing_else(shipped, out)


def _comparison(trained: Trained) -> str:
    """The outcome of the comparison with tflite-micro, of models of `best`; AirTouchError where it differs."""
    if not isinstance(trained, best_model.BestModel):
        return ""
    windows = best_export.check_against_tflite_micro(trained)
    return (f"; tflite-micro gives the same bits on {windows} windows" if windows else
            "; not compared with tflite-micro, which is not installed: pip install '.[test]'")


def _load(path: Path) -> Trained:
    """The model in a file, of `best` or of `paper`."""
    data = archive.read(path)
    _, metadata = archive.parse(data, str(path))
    module = best_model if metadata.get("network") == "stream" else model_file
    return module.parse(data, str(path))
