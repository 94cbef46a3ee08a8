"""`airtouch export`: a trained network as C sources."""

from pathlib import Path

import click

from airtouch.detector import export, model_file
from airtouch.kernels.network import parameter_bytes


@click.command(name="export")
@click.argument("model", required=False, type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path, file_okay=False),
              default=Path("gap8/model"), show_default=True,
              help="Folder to write to, or to check.")
@click.option("--check", "only_check", is_flag=True,
              help="Write nothing; refuse a folder that is stale or foreign.")
@click.option("--force", is_flag=True, help="Replace files that differ.")
def command(model: Path | None, out: Path, only_check: bool, force: bool) -> None:
    """Write MODEL (.npz; the shipped one if left out) as C: weights, shapes, scales, golden vectors.

    With --check: exit code 2 and the reason where the folder is not what MODEL exports to.
    """
    trained = model_file.load(model)
    name = model.name if model else ""
    if only_check:
        export.check(trained, out, name)
        click.echo(f"{out}: up to date with model {trained.digest[:12]}")
        return
    for path in export.export(trained, out, name, force):
        click.echo(f"written: {path}")
    click.echo(f"model {trained.digest[:12]}: {parameter_bytes(trained.int8)} bytes of constants, "
               f"{export.arena_bytes(trained.int8)} bytes of arena")
