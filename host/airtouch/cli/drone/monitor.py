"""`airtouch monitor`: watch a drone live."""

from pathlib import Path

import click

from airtouch.cli.drone.collect import stopping, waiting
from airtouch.cli.drone.replay import screen
from airtouch.cli.shared.options import Finite


@click.command("monitor")
@click.option("--uri", required=True, help="Of the drone: radio://0/80/2M/E7E7E7E7E7, udp://127.0.0.1:19850.")
@click.option("--duration", type=Finite(0, min_open=True), metavar="S", help="Stop after so long.")
@click.option("--host-detector", is_flag=True,
              help="Run the detector here though the drone has the app; without the app it always does.")
@click.option("--param", "settings", multiple=True, metavar="GROUP.NAME=VALUE",
              help="Set a parameter of the drone first.")
@click.option("--cache", type=click.Path(path_type=Path),
              help="Folder for the drone's tables, to connect faster; ~/.cache/airtouch if left out.")
def command(uri: str, duration: float | None, host_detector: bool, settings: tuple[str, ...],
            cache: Path | None) -> None:
    """Show signals, P(over a platform), edges on a map, losses and latency; never flies.

    \b
    airtouch monitor --uri radio://0/80/2M/E7E7E7E7E7
    airtouch monitor --uri udp://127.0.0.1:19850 --duration 30 > watched.txt    # a line a second

    Where another program flies the drone over the same radio, let that one log instead.
    """
    click.echo(f"connecting to {uri}", err=True)
    from airtouch.crazyflie.checks import parse_setting
    from airtouch.crazyflie.connection.drone import Drone
    from airtouch.crazyflie.connection.link import default_cache

    pairs = [parse_setting(text) for text in settings]
    with stopping(quiet=True) as stop:
        drone = Drone(uri, cache or default_cache(), unanswered=waiting(uri, stop))
        try:
            from airtouch.crazyflie import monitor  # takes seconds: only once somebody has answered
            from airtouch.crazyflie.connection.intake import Intake
            from airtouch.crazyflie.view import board as boards

            for name, text in pairs:
                drone.set_parameter(name, text)
            slow, detector = monitor.start(drone, host_detector)
            board = boards.Board(uri, "the app")
            if detector:
                board = boards.Board(uri, "best on the host", detector.lag_s)
            with screen() as (show, say):
                watcher = monitor.Monitor(board, Intake(slow), detector,
                                          lambda edge: say(boards.edge_line(edge)))
                monitor.watch(drone, watcher, duration, stop, show, say)
        finally:
            drone.close()
    click.echo(board.closing_line())
