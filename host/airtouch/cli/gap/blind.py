"""`airtouch gap blind`: sealed sets of flights whose effect is withheld."""

from pathlib import Path
from typing import Any

import click

from airtouch.cli import Suggesting
from airtouch.cli.gap.options import check_all_free, runner, written
from airtouch.cli.gap.progress import LateBar, StepLines
from airtouch.cli.shared import output
from airtouch.cli.shared.help import examples
from airtouch.cli.shared.options import seed_option
from airtouch.logs.files import make_folder

SEVERITIES_TAKE = "one to two minutes"  #: on two idle processors, 2026-11-26 (host/docs/gap-blind.md)


@click.group("blind", cls=Suggesting)
def blind() -> None:
    """Sealed sets of flights whose effect is withheld: make them, score a diagnosis of them."""


@blind.command("make", epilog=examples(
    "airtouch gap blind make sealed --flights 100 --seed 7"))
@click.argument("out", type=click.Path(path_type=Path, file_okay=False))
@click.option("--flights", "-n", default=200, show_default=True, type=click.IntRange(1),
              help="How many flights.")
@seed_option("Of the whole set.")
@click.option("--key", type=click.Path(path_type=Path, dir_okay=False), help="Where the key goes; "
              "default: OUT.key.json beside OUT.")
@click.option("--force", is_flag=True, help="Replace a set in OUT.")
def blind_make(out: Path, flights: int, seed: int, key: Path | None, force: bool) -> None:
    """Write a sealed set to the folder OUT: flights, the hash of their answers, the key apart.

    It first measures how strong each effect must be to show at all; that takes minutes, however few the flights.
    """
    make_folder(out)
    click.echo(f"{flights} flights; first the strengths of every effect, which take {SEVERITIES_TAKE}", err=True)
    with LateBar(line_s=StepLines.LINE_S) as bar:
        from airtouch.gap.sealed import make as sealed

        written = sealed.make(out, flights, seed, key=key, force=force, progress=bar)
    click.echo(f"{flights} flights in {out}; the key in {written}")


@blind.command("score", epilog=examples(
    "airtouch gap blind score sealed answers.json --plot score.png"))
@click.argument("folder", type=click.Path(path_type=Path, exists=True, file_okay=False))
@click.argument("answers", type=click.Path(path_type=Path, exists=True))
@click.option("--key", type=click.Path(path_type=Path, dir_okay=False), help="Default: beside FOLDER.")
@click.option("--json", "json_path", type=click.Path(path_type=Path, dir_okay=False),
              help="Write every figure.")
@click.option("--plot", type=click.Path(path_type=Path, dir_okay=False),
              help="Write the confusion matrix and the reliability to this PNG, SVG or PDF.")
@click.option("--force", is_flag=True, help="Replace the files.")
def blind_score(folder: Path, answers: Path, key: Path | None, json_path: Path | None, plot: Path | None,
                force: bool) -> None:
    """Open the key of the set in FOLDER and score the diagnoses in ANSWERS, a folder or a file."""
    from airtouch.extras import need
    from airtouch.gap.sealed import score as sealed

    if plot:
        need("plots", "--plot")
        from airtouch.report.style import format_of

        format_of(plot)  # refuses another before the work
    check_all_free((json_path, plot), force)
    _print_score(sealed.score(folder, answers, key), json_path, plot, force)


@blind.command("run", epilog=examples(
    "airtouch gap blind run check --flights 160 --seed 7"))
@click.argument("out", type=click.Path(path_type=Path, file_okay=False))
@click.option("--flights", "-n", type=click.IntRange(1),
              help="How many flights, by default 480; 42 % have one effect, 42 % none, the rest two.")
@click.option("--seed", type=click.IntRange(0), help="Of the whole set, by default 0.")
@click.option("--key", type=click.Path(path_type=Path, dir_okay=False), help="Where the key is, or goes; "
              "default: OUT.key.json beside OUT.")
@click.option("--workers", default=2, show_default=True, type=click.IntRange(1), help="Processes.")
@click.option("--dask", metavar="SCHEDULER", help="Address of a dask.distributed scheduler, instead of processes here.")
@click.option("--json", "json_path", type=click.Path(path_type=Path, dir_okay=False),
              help="Write every figure; default: OUT/figures.json.")
@click.option("--force", is_flag=True, help="Replace the file of --json.")
def blind_run(out: Path, flights: int | None, seed: int | None, key: Path | None, workers: int, dask: str | None,
              json_path: Path | None, force: bool) -> None:
    """The whole check in the folder OUT: make a set, diagnose it, open the key, score.

    Goes on where it was broken off. Single effects are then diagnosed once more with the
    effect left out, where `unknown` is right.
    """
    from airtouch.extras import need

    need("plots", "scoring a sealed set")
    check_all_free([json_path], force)
    if not (out / "sealed.json").exists():  # figures of this check are replaced when it goes on
        check_all_free((out / "figures.json", out / "figures.png"), force)
    spread = runner(dask, ()) if dask else None
    make_folder(out)
    from airtouch.gap.sealed import run as check

    if not (out / "sealed.json").exists():
        click.echo(f"{flights or check.FLIGHTS} flights; first the strengths of every effect, which take "
                   f"{SEVERITIES_TAKE}", err=True)
    with LateBar() as bar:
        figures = check.run(out, flights, seed, workers=workers, mapper=spread, key=key, progress=bar)
    _print_score(figures, json_path or out / "figures.json", out / "figures.png", True)


def _print_score(figures: dict[str, Any], json_path: Path | None, plot: Path | None, force: bool) -> None:
    """Print the score of a blind check, and write it to files."""
    from rich.table import Table

    from airtouch.report import blind_tables

    for heads, rows in ((("figure (95 % interval)", "measured", "n", "goal"), blind_tables.score_rows(figures)),
                        (("kind", "effect in top-1", "top-3", "parameter error"), blind_tables.effect_rows(figures))):
        table = Table(*heads)
        for row in rows:
            table.add_row(*row)
        output.console().print(table)
    if json_path:
        output.write_json(json_path, figures, force)
    if plot:
        from airtouch.report import blind_figures
        from airtouch.report.style import write_image

        write_image(blind_figures.confusion_and_reliability(figures), plot, force)
    written(json_path, plot)
