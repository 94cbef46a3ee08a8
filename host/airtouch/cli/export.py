"""`airtouch export`: a trained network as C sources."""

from pathlib import Path

import click

from airtouch.detector import archive, export, model_file, paper_stream
from airtouch.detector.stream import model as stream_model
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
    """Write MODEL (.npz; all shipped ones if left out) as C: weights, shapes, scales, golden vectors.

    With --check: exit code 2 and the reason where the folder is not what MODEL exports to: stale, from another
    model, edited, incomplete, or, for the shipped ones, with sources that none of them gives.
    """
    shipped = [] if model else [model_file.load(), paper_stream.load(None), stream_model.load()]
    for trained in [_load(model)] if model else shipped:
        name = model.name if model else ""
        if only_check:
            export.check(trained, out, name)
            click.echo(f"{out}: up to date with {trained.metadata['detector']} model {trained.digest[:12]}")
            continue
        for path in export.export(trained, out, name, force):
            click.echo(f"written: {path}")
        click.echo(f"{trained.metadata['detector']} model {trained.digest[:12]}: "
                   f"{parameter_bytes(trained.int8)} bytes of constants")
    if only_check and shipped:
        export.check_nothing_else(shipped, out)


def _load(path: Path) -> model_file.Model | stream_model.StreamModel:
    """A model of either kind."""
    data = archive.read(path)
    _, metadata = archive.parse(data, str(path))
    module = stream_model if metadata.get("network") == "stream" else model_file
    return module.parse(data, str(path))
