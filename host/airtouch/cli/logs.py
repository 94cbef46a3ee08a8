"""`airtouch logs`: look at, check and convert flight logs."""

import json
import math
import os
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import click

from airtouch import logs
from airtouch.cli import Suggesting
from airtouch.cli.shared.flights import flights_of_folder
from airtouch.cli.shared.options import Finite
from airtouch.errors import AirTouchError
from airtouch.logs.files import write
from airtouch.logs.formats.rosbag import is_bag
from airtouch.vehicle import arm_pwm_of

RERUN = "rrd"  #: ending of Rerun files, which are only written
WRITTEN = ("csv", "csv.gz", "parquet", RERUN)
FILES = click.argument("files", nargs=-1, required=True, type=click.Path())


@click.group(name="logs", cls=Suggesting)
def command() -> None:
    """Look at, check and convert flight logs.

    The format is found from the content: the paper's authors' CSV, Bitcraze uSD-card logs, PX4 ULog, ROS 2 bags,
    CrazyPAD, IMRCLab, AirTouch's own CSV and Parquet, gzipped or not. FILES may be folders.

    \b
    Example:
      airtouch logs info flights/
      airtouch logs check flights/imu_data_0201-2204_h79.csv.gz
      airtouch logs convert log00 --out converted --format parquet --rate 100
    """


def _summary(path: Path) -> dict[str, Any]:
    log = logs.read(path)
    return logs.summary(log, arm_pwm_of(log.meta))


def _report(path: Path) -> dict[str, Any]:
    log = logs.read(path)
    return logs.check(log, arm_pwm_of(log.meta)).as_dict()


@command.command()
@FILES
@click.option("--json", "as_json", is_flag=True, help="Print JSON instead of a table.")
def info(files: tuple[str, ...], as_json: bool) -> None:
    """One table: format, length, rate, channels and true edges of each flight.

    \b
    Example:
      airtouch logs info flights/*.csv.gz
    """
    summaries, left_out = _each(_inputs(files), _summary)
    if as_json:
        _print_json(summaries, left_out)
    else:
        _print_table(summaries)
    _finish(len(summaries), left_out, "read")


@command.command()
@FILES
@click.option("--json", "as_json", is_flag=True, help="Print JSON instead of text.")
def check(files: tuple[str, ...], as_json: bool) -> None:
    """The quality report of each flight: rate, gaps, channels, segments.

    Exit code 2 when a file could not be read; the others are still reported.

    \b
    Example:
      airtouch logs check flights/ --json > quality.json
    """
    reports, left_out = _each(_inputs(files), _report)
    if as_json:
        _print_json(reports, left_out)
    else:
        for report in reports:
            _print_report(report)
    _finish(len(reports), left_out, "checked")


@command.command()
@FILES
@click.option("--out", required=True, type=click.Path(),
              help="Folder for the converted files; made when missing.")
@click.option("--format", "ending", type=click.Choice(WRITTEN), default="csv.gz",
              show_default=True, help="Kind of file to write.")
@click.option("--columns", "mapping", type=click.Path(), metavar="MAP.toml",
              help="TOML file that maps the columns of other programs' CSV files to the schema.")
@click.option("--plain", is_flag=True,
              help="With csv: a header and numbers alone, as PlotJuggler and spreadsheets want it.")
@click.option("--rate", type=Finite(0, min_open=True),
              help="Resample to exactly this rate in Hz (else samples stay as logged).")
@click.option("--force", is_flag=True, help="Replace files that exist.")
def convert(files: tuple[str, ...], out: str, ending: str, mapping: str | None, plain: bool, rate: float | None,
            force: bool) -> None:
    """Write flights in the canonical schema, SI units in the column names.

    Nothing is resampled unless --rate is given: then a low-pass comes first when
    going down, and gaps longer than both 0.1 s and 1.5 sample periods become NaN.

    \b
    Example:
      airtouch logs convert log00 log01 --out converted --rate 100
    """
    from airtouch.extras import need
    from airtouch.logs.files import make_folder, no_empty_folders, write_bytes
    from airtouch.logs.formats import canonical, mapped, rerun_file

    if plain and ending != "csv":
        raise AirTouchError("--plain is for --format csv")
    if ending == RERUN:
        need("rerun", "writing Rerun recordings")
    if mapping:
        mapped.load(mapping)
    folder = Path(out)
    click.get_current_context().with_resource(no_empty_folders(folder))
    make_folder(folder)
    written: set[Path] = set()
    inputs = _inputs(files)
    input_files = {os.path.realpath(path) for path in inputs[0]}

    def one(path: Path) -> Path:
        target = folder / f"{_stem(path)}.{ending}"
        if target in written:
            raise AirTouchError(f"{path}: another file of this call is {target} already; rename one of them")
        if os.path.realpath(target) in input_files:
            raise AirTouchError(f"{path}: its conversion would replace {target}, a file to convert; choose another "
                                "--out")
        log = mapped.read(path, mapping) if mapping else logs.read(path)
        log = log if rate is None else logs.resample(log, rate)
        if plain:
            write_bytes(canonical.plain_csv(log), target, force)
        elif ending == RERUN:
            write_bytes(rerun_file.recording(log, arm_pwm_of(log.meta)), target, force)
        else:
            write(log, target, force)
        written.add(target)
        return target

    written_files, left_out = _each(inputs, one)
    _finish(len(written_files), left_out, f"written to {folder}")


def _inputs(files: Iterable[str]) -> tuple[list[Path], list[dict[str, str]]]:
    """The flight logs that the names stand for, and the names that stand for none with their reasons."""
    paths: list[Path] = []
    left_out = []
    for name in files:
        try:
            paths += _expand(Path(name))
        except AirTouchError as error:
            left_out.append({"file": name, "reason": str(error)})
    return paths, left_out


def _each(inputs: tuple[list[Path], list[dict[str, str]]], act: Callable[[Path], Any],
          ) -> tuple[list[Any], list[dict[str, str]]]:
    """Call `act` on every file of `_inputs`. Returns the results, and the failed files with their reasons."""
    paths, left_out = inputs
    results = []
    for path in _progress(paths):
        try:
            results.append(act(path))
        except AirTouchError as error:
            left_out.append({"file": str(path), "reason": str(error)})
    return results, left_out


def _expand(path: Path) -> list[Path]:
    """The flight logs that a name stands for. Says how many files of a folder are none."""
    return flights_of_folder(path) if os.path.isdir(path) and not is_bag(path) else [path]


def _progress(paths: list[Path]) -> Iterable[Path]:
    if len(paths) < 5 or not sys.stderr.isatty():
        return paths
    from rich.console import Console
    from rich.progress import track

    return track(paths, description="flights", console=Console(stderr=True), transient=True)


def _print_table(rows: list[dict[str, Any]]) -> None:
    if not rows:
        return
    titles = ("flight", "format", "samples", "s", "Hz", "entries", "exits", "warnings", "channels",
              "condition")
    cells = [titles] + [
        (Path(r["source"]).name, r["format"], str(r["samples"]), f"{r['duration_s']:.1f}",
         _hertz(r["rate_hz"]), str(r["entries"]), str(r["exits"]), str(r["warnings"]), " ".join(r["channels"]),
         r["condition"])
        for r in rows
    ]
    widths = [max(len(row[i]) for row in cells) for i in range(len(titles))]
    for row in cells:
        padded = [c.rjust(w) if 2 <= i <= 7 else c.ljust(w)
                  for i, (c, w) in enumerate(zip(row, widths, strict=True))]
        click.echo("  ".join(padded).rstrip())


def _print_report(report: dict[str, Any]) -> None:
    click.echo(f"{report['source']}: {report['format']}, {report['samples']} samples, "
               f"{report['duration_s']:.1f} s at {_hertz(report['rate_hz'])} Hz, {report['lost']} lost")
    phases = ", ".join(f"{s['kind']} {s['start']}-{s['stop']}" for s in report["segments"])
    click.echo(f"  segments: {phases or 'none'}")
    edges = ", ".join(
        f"{e['kind']} at {e['sample']} ({e['height_before_m']:.2f} to {e['height_after_m']:.2f} m)"
        for e in report["edges"])
    click.echo(f"  edges: {edges or 'none'}")
    for warning in report["warnings"]:
        click.echo(f"  warning: {warning}")
    if not report["warnings"]:
        click.echo("  no faults found")


def _hertz(rate: float | None) -> str:
    return "?" if rate is None else f"{rate:.2f}"


def _print_json(reports: list[dict[str, Any]], left_out: list[dict[str, str]]) -> None:
    click.echo(json.dumps(_finite({"flights": reports, "left_out": left_out}), indent=1))


def _finite(value: Any) -> Any:
    """The data with None for NaN and infinities, which JSON lacks."""
    if isinstance(value, dict):
        return {k: _finite(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _finish(done: int, left_out: list[dict[str, str]], verb: str) -> None:
    """Print the files that were left out with their reasons, and exit with code 2 if there are any."""
    for item in left_out:
        click.echo(f"airtouch: {item['reason']}", err=True)
    click.echo(f"{done} {'flight' if done == 1 else 'flights'} {verb}, {len(left_out)} left out", err=True)
    if left_out:
        sys.exit(2)


def _stem(path: Path) -> str:
    endings = (".csv.gz", ".csv", ".parquet", ".gz")
    return next((path.name[:-len(e)] for e in endings if path.name.lower().endswith(e)), path.name)
