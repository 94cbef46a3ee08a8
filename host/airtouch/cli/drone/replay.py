"""`airtouch replay`: a recorded flight as it would look live."""

import sys
import time
from pathlib import Path

import click

from airtouch.cli.shared import output
from airtouch.cli.shared.options import SPEED_MPS, Finite
from airtouch.errors import AirTouchError
from airtouch.parameters import SAMPLE_RATE_HZ


@click.command("replay")
@click.argument("flight", type=click.Path(path_type=Path))
@click.option("--rate", "--speed", "speed", default=0.0, show_default="as fast as it goes", metavar="X",
              type=Finite(0, 1000), help="Of the playback, times real time; 1 is as it was flown. The drone's speed is "
                                        "--flown-at.")
@click.option("--flown-at", type=SPEED_MPS, metavar="M/S",
              help="Commanded speed of a flight without one in its manifest; the log's if left out.")
@click.option("--model", type=click.Path(path_type=Path),
              help="Trained `best` model (.npz); the shipped one if left out.")
def command(flight: Path, speed: float, flown_at: float | None, model: Path | None) -> None:
    """Feed FLIGHT sample by sample to the detector that flies, and show it as `monitor` shows a drone.

    \b
    airtouch replay flights/edge_0001.csv.gz --rate 1
    airtouch replay log.csv --flown-at 0.3            # prints edges and scores as fast as it goes

    The edges at the end are those of `airtouch evaluate`, figure for figure.
    """
    from airtouch.cli.drone.collect import stopping
    from airtouch.crazyflie import replay
    from airtouch.crazyflie.view import board as boards
    from airtouch.crazyflie.view.host_detector import HostDetector
    from airtouch.detector import best
    from airtouch.detector.evaluation import evaluate
    from airtouch.detector.evaluation.data import dataset
    from airtouch.detector.shared import sensors
    from airtouch.logs.formats.rosbag import is_bag

    files = dataset.collect([flight], flown_at)
    if len(files) != 1 or flight.is_dir() and not is_bag(flight):
        raise AirTouchError(f"{flight}: give one flight, not a folder")
    try:
        trained = best.load(model)
        log = evaluate.read_flight(files[0], evaluate.spare_of(best), evaluate.arm_pwm_by(best, trained))
    except AirTouchError as error:
        raise AirTouchError(str(error).replace("--speed", "--flown-at")) from None
    file = dataset.with_flown_speed(files[0], log)
    detector = HostDetector(trained, sensors.missing_sensors(log))
    board = boards.Board(flight.name, "best", detector.lag_s)
    with stopping(quiet=True) as stop, screen(bool(speed)) as (show, say):
        fed = replay.run(log, board, detector, speed=speed, speed_mps=file.condition.speed_mps, stop=stop,
                         show=show, on_edge=lambda edge: say(boards.edge_line(edge)))
    if fed < len(log):
        click.echo(f"stopped after {fed / SAMPLE_RATE_HZ:.1f} of {len(log) / SAMPLE_RATE_HZ:.1f} s; no score")
        sys.exit(1)
    result = replay.result(file, log, detector)
    for edge in result.score.edges:
        click.echo(_in_words(edge))
    if result.score.false:
        click.echo("false: " + ", ".join(f"{s / SAMPLE_RATE_HZ:.2f} s" for s in result.score.false))
    figures = evaluate.as_json("best", [result.score], [], detector.lag_s, {})
    title = f"best: lag of {detector.lag_s:.2f} s taken off"
    output.print_table(output.console(), {"best": figures}, title)


def _in_words(edge) -> str:
    true = f"{edge.kind:5} at {edge.true_sample / SAMPLE_RATE_HZ:6.2f} s (down range)"
    if edge.detected_sample is None:
        return f"{true}: missed"
    metres = "" if edge.error_m is None else f" = {edge.error_m:+.3f} m"
    report = f"said at {edge.detected_sample / SAMPLE_RATE_HZ:.2f} s"
    return f"{true}: {report}, error {edge.error_s:+.2f} s{metres} (+ is early)"


class screen:
    """A live view; without a terminal a line for each second and each edge."""

    def __init__(self, live: bool = True, every_s: float = 1.0) -> None:
        self.live, self.every_s, self.printed_s, self.drawn = live, every_s, -1.0, 0.0

    def __enter__(self):
        from rich.console import Console

        console = Console()
        self.view = None
        if console.is_terminal and self.live:
            from rich.live import Live

            self.view = Live(console=console, auto_refresh=False)
            self.view.__enter__()
        return self.show, self.say

    def __exit__(self, *error) -> None:
        if self.view:
            self.view.__exit__(*error)

    def show(self, board) -> None:
        """Draw ten times a second; without a terminal print once in each second of the drone's time."""
        if self.view:
            if time.monotonic() - self.drawn > 0.1:
                self.drawn = time.monotonic()
                self.view.update(board.render(), refresh=True)
        elif self.live and board.now_s - self.printed_s >= self.every_s:
            self.printed_s = board.now_s
            click.echo(board.line())

    def say(self, text: str) -> None:
        """Print a line above the live view."""
        if self.view:
            self.view.console.print(text)
        else:
            click.echo(text)
