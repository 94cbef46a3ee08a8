"""Options that commands of `airtouch gap` share, and the lines that they all print."""

from collections.abc import Callable, Iterable
from pathlib import Path

import click

from airtouch.extras import need
from airtouch.logs import files

NAMES_SHOWN = 4  #: files in a row in a report's command, of more the rest is counted; no source: fits a line


class Greedy(click.Command):
    """A command whose --baseline takes all words up to the next option, so that a shell pattern works."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        spread: list[str] = []
        taking = False
        for word, following in zip(args, [*args[1:], "-"], strict=True):
            if word.startswith("-"):
                option, _, name = word.partition("=")
                taking = option == "--baseline"
                if taking and not name and following.startswith("-"):
                    raise click.BadOptionUsage(option, f"Option {option!r} requires an argument.", ctx)
                spread += [word] if not taking else [option, name] if name else []
            else:
                spread += ["--baseline", word] if taking else [word]
        try:
            return super().parse_args(ctx, [*spread])  # click empties its list
        except click.MissingParameter as error:
            if "--baseline" in spread and error.param is not None and error.param.name == "real":
                raise click.UsageError("no flight to examine: give REAL before --baseline, which takes every name "
                                       "up to the next option", ctx) from None
            raise


def inputs_and_outputs(function: Callable) -> Callable:
    """Add the options that `measure` and `diagnose` share."""
    path = click.Path(path_type=Path, dir_okay=False)
    for option in (
        click.option("--force", is_flag=True, help="Replace the files."),
        click.option("--dask", metavar="SCHEDULER", help="Address of a dask.distributed scheduler."),
        click.option("--json", "json_path", type=path, help="Write every figure to this file."),
        click.option("--plots", type=click.Path(path_type=Path, file_okay=False), metavar="FOLDER",
                     help="Write the report's plots to this folder, each as SVG and PDF."),
        click.option("--report", type=path, help="Write a report to this HTML file."),
        click.option("--baseline", multiple=True, metavar="NOMINAL...",
                     help="Flights without any unmodelled effect, up to the next option."),
        click.option("--vehicle", "vehicle_name", metavar="V",
                     help="Name or .toml file; else the one that the log names."),
        click.argument("real", nargs=-1, required=True),
    ):
        function = option(function)
    return function


def check_all_free(paths: Iterable[Path | None], force: bool) -> None:
    """Refuse, before the work, to replace a file without --force."""
    for path in paths:
        files.check_free(path, force)


def check_outputs(report: Path | None, plots: Path | None, json_path: Path | None, force: bool) -> None:
    """Refuse, before the work, to replace what `inputs_and_outputs` names without --force, and to plot in vain."""
    if plots:
        need("plots", "--plots")
        from airtouch.report.gap_report import plot_files

        click.get_current_context().with_resource(files.no_empty_folders(plots))
    check_all_free((report, json_path, *(plot_files(plots) if plots else ())), force)


def written(*paths: Path | None) -> None:
    """Print the files that were written."""
    for path in filter(None, paths):
        click.echo(f"written: {path}")


def runner(dask: str | None, effect_files: tuple[str, ...]) -> Callable:
    """`map`, or the same on a cluster whose workers know the effects of these files."""
    if not dask:
        return map
    from airtouch.gap.sealed import on_cluster

    return on_cluster.mapper(dask, [Path(p).read_text(encoding="utf-8") for p in effect_files])
