"""`airtouch paper`: the paper's evaluation, made again by one command."""

import sys
from functools import partial
from pathlib import Path

import click

from airtouch.cli.shared.flights import find_flights
from airtouch.cli.shared.typed import typed
from airtouch.errors import AirTouchError
from airtouch.extras import need

WHAT = """\b
Figures, by the paper's labels:
  fig8a  errors over platforms          fig8b  errors over materials (simulator)
  fig8c  against the baseline           fig8d  by height
  fig8e  by approach angle              fig8f  by pair of materials (simulator)
  fig8g  the disturbance-force loss     fig8h  time resolution
  fig8i  input size of the network      sizes  bytes, speed, accuracy after pruning and int8
  table1 power                          wind   steady wind (simulator)
  table2 resources                      range  larger drones (curves)
  fig11b errors against light, with a rendered camera
  fig11c errors against the size of the network
  fusion camera and AirTouch together
"""


@click.command(name="paper", epilog=WHAT)
@click.option("--only", multiple=True, metavar="FIGURE", help="Make this one; may be given several times. All if left "
                                                              "out.")
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), default=Path("paper"), show_default=True,
              help="Folder for index.html, and PNG, SVG and CSV of each figure. A second run makes what is missing.")
@click.option("--flights", type=click.Path(path_type=Path, file_okay=False),
              help="Recorded flights, a folder with a manifest.csv; AIRTOUCH_FLIGHTS or ../shared/flights if left out.")
@click.option("--power-log", type=click.Path(path_type=Path, dir_okay=False),
              help="An INA219's log with a column of stages, for table1; an estimate if left out.")
@click.option("--quick", is_flag=True, help="Fewer flights, one fold, short trainings.")
@click.option("--workers", type=click.IntRange(1), help="Processes, each with up to 3 GB; one a core, four at most, if "
                                                        "left out.")
@click.option("--force", is_flag=True, help="Make figures again that are there, with new trainings, and replace "
                                           "those of other settings.")
def command(only: tuple[str, ...], out: Path, flights: Path | None, power_log: Path | None, quick: bool,
            workers: int | None, force: bool) -> None:
    """Make every table and figure of the paper's evaluation again, with the paper's method and with `best`.

    Recorded flights where they exist, the simulator where they do not; each caption says which. The page sets the
    paper's numbers beside ours and gives a verdict on each claim: reproduced, not reproduced, undecided, cannot be
    tested here.

    \b
    airtouch paper --quick                       # a first look
    airtouch paper                               # all of it; goes on after a stop
    airtouch paper --only fig8d --only fig11b    # two figures

    Without recorded flights the figures that need them say so; the others are made. Exit code 2 where one was not made.
    """
    from airtouch.paper_figures import run
    from airtouch.paper_figures.figure import Job
    from airtouch.simulation.batch import available_cores

    chosen = run.names(only)
    need("plots", "the pictures of airtouch paper")
    for path in (flights, power_log):
        if path is not None and not path.exists():
            raise AirTouchError(f"{path}: no such file or folder")
    if power_log is not None and "table1" not in chosen:
        raise click.UsageError("--power-log is for table1, which --only leaves out")
    job = Job(flights or find_flights(), out / "work", quick, power_log, partial(click.echo, err=True))
    records = run.run(chosen, out, job, force=force, command=typed(), workers=workers or min(available_cores(), 4))
    for name in chosen:
        for claim in records[name]["claims"].values():
            click.echo(f"{name:7} {claim['verdict']:22} {claim['said']}\n        {claim['found']}")
    click.echo(f"written: {out / 'index.html'} (open it in a browser)")
    if any("missing" in records[name] for name in chosen):
        sys.exit(2)
