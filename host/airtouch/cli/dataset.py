"""`airtouch dataset`: the authors' public flights, hashes checked."""

from pathlib import Path

import click
from rich.console import Console
from rich.progress import Progress

from airtouch.cli import Suggesting
from airtouch.errors import AirTouchError
from airtouch.logs import public
from airtouch.logs.files import no_empty_folders


@click.group("dataset", cls=Suggesting)
def command() -> None:
    """Public flights to train and score on."""


@command.command("fetch")
@click.option("--out", type=click.Path(path_type=Path), default=Path("flights/airtouch"), show_default=True,
              help="Folder to fill; what is already there and right stays.")
@click.option("--from", "source", type=click.Path(path_type=Path),
              help="Take the files from this folder instead of the network.")
@click.option("--base-url", default=public.BASE_URL, show_default=False, help="Another mirror of the CSV files.")
@click.option("--force", is_flag=True, help="Replace files of the same name with other content.")
def fetch(out: Path, source: Path | None, base_url: str, force: bool) -> None:
    """Fetch the paper's authors' flights, with their manifest.

    \b
    airtouch dataset fetch
    airtouch dataset fetch --from ~/crazyflie_filter_constant/control/data
    airtouch crossval flights/airtouch
    """
    with no_empty_folders(out):
        _fetch(out, source, base_url, force)


def _fetch(out: Path, source: Path | None, base_url: str, force: bool) -> None:
    """Fetch the flights and print their numbers. Raises AirTouchError where some failed."""
    with Progress(transient=True, console=Console(stderr=True)) as bar:
        task = bar.add_task("flights", total=len(public.registry()))
        states = public.fetch(out, source=source, base_url=base_url, force=force,
                              progress=lambda name, state: bar.update(task, advance=1, description=name))
    click.echo(f"{out}: {len(states['new'])} new, {len(states['present'])} already there, "
               f"{len(states['failed'])} failed")
    if states["failed"]:
        shown = ", ".join(states["failed"][:3]) + (", ..." if len(states["failed"]) > 3 else "")
        raise AirTouchError(f"not found, or not the bytes that were published: {shown}; "
                            "check the network, or name another folder with --from")
