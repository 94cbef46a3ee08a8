"""`airtouch sitl`: a virtual Crazyflie on a UDP port, for cflib, cfclient and `airtouch collect`."""

import signal
import sys
from pathlib import Path

import click

from airtouch.cli.shared.help import examples
from airtouch.cli.shared.options import Finite, seed_option
from airtouch.vehicle import DEFAULT_VEHICLE

STARTING = "starting; the first time compiles the simulator, which takes a minute"


@click.command("sitl", epilog=examples(
    "airtouch sitl there-and-back                  # then `airtouch collect` in another terminal",
    "airtouch sitl sweep --effect weak_motor:rotor=2,thrust_loss=0.1 --fault loss=0.1",
    "airtouch sitl mine.toml --record truth.csv.gz"))
@click.argument("scenario", default="sweep")
@click.option("--port", default=19850, show_default=True,
              help="UDP port; cflib scans 19850 to 19859. 0: any free one.")
@click.option("--host", default="127.0.0.1", show_default=True, help="Address to listen on.")
@click.option("--speed", type=Finite(0, 100, min_open=True), default=1.0, show_default=True,
              help="Drone seconds a second: the pace of the clock, not of the drone.")
@click.option("--vehicle", default=DEFAULT_VEHICLE, show_default=True, help="Name or .toml file.")
@click.option("--effect", "chosen", multiple=True, metavar="NAME[:P=V...]",
              help="Switch an effect on, as in wind:x=0.3m/s; a scenario's own of that name is replaced.")
@click.option("--without", multiple=True, metavar="NAME", help="Switch an effect of the scenario off.")
@seed_option("Of everything that is drawn.")
@click.option("--flight", type=click.IntRange(0), default=0, show_default=True,
              help="Which flight of the scenario is drawn.")
@click.option("--fault", "faults", multiple=True, metavar="FAULT",
              help="loss=0.3, late=50ms, disconnect=T,5s, gap8-reset=T, gap8-silent=T, low-battery=T; T: s "
                   "after take-off, or start.")
@click.option("--no-ai-deck", is_flag=True, help="Without a GAP8: the STM32 alone.")
@click.option("--record", type=click.Path(path_type=Path, dir_okay=False),
              help="Write the true flight log here.")
@click.option("--force", is_flag=True, help="Replace the file of --record.")
def command(scenario: str, port: int, host: str, speed: float, vehicle: str, chosen: tuple[str, ...],
            without: tuple[str, ...], seed: int, flight: int, faults: tuple[str, ...], no_ai_deck: bool,
            record: Path | None, force: bool) -> None:
    """Serve a virtual Crazyflie that flies over the world of SCENARIO (or of a mission) until Ctrl-C.

    Connect with cflib, cfclient or `airtouch collect --uri udp://127.0.0.1:19850`.
    """
    watched = sys.stderr.isatty()
    if watched:  # before the imports, which take two seconds
        click.echo(STARTING, err=True)
    from airtouch.crazyflie import mission
    from airtouch.logs.files import check_free
    from airtouch.simulation import effects
    from airtouch.simulation.flight import refuse_off
    from airtouch.simulation.scenario import draw_flight
    from airtouch.sitl import Server
    from airtouch.sitl.faults import parse as fault_of

    check_free(record, force)
    scene = mission.scene_of(scenario)
    refuse_off(draw_flight(scene, seed, flight), without)
    acting, failures = [effects.parse(text) for text in chosen], [fault_of(text) for text in faults]
    if not watched:  # after the settings: a wrong one is one line
        click.echo(STARTING, err=True)
    server = Server(scene, port=port, host=host, speed=speed, vehicle=vehicle,
                    effects=acting, without=without, seed=seed, flight=flight, faults=failures,
                    ai_deck=not no_ai_deck, record=record, force=force)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: server.stop())
    click.echo(f"{server.uri}: ready; {scenario}, {vehicle}; each `airtouch collect` starts at the start; Ctrl-C ends "
               "it")
    server.run(click.echo)
    if record:
        click.echo(f"{server.drone.now_s:.0f} s of flight log in {record}")
    if server.slept_s > 0.1:
        click.echo(f"airtouch: this machine was {server.slept_s:.1f} s too slow for --speed {speed:g}",
                   err=True)
