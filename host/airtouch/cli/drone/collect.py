"""`airtouch collect`: fly a mission with a Crazyflie and write the flight logs."""

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

import click

from airtouch import vehicle as vehicles
from airtouch.cli.shared.options import Finite, seed_option
from airtouch.errors import AirTouchError
from airtouch.logs.files import check_free, no_empty_folders

if TYPE_CHECKING:
    from airtouch.crazyflie import collect
    from airtouch.crazyflie.flight import Flight
    from airtouch.crazyflie.mission import Mission


def _list_missions(ctx: click.Context, _: click.Parameter, value: bool) -> None:
    if not value:
        return
    from airtouch.crazyflie import mission

    for name in mission.names():
        click.echo(mission.load(name).describe())
    ctx.exit()


@click.command("collect")
@click.option("--uri", help="Of the drone: radio://0/80/2M/E7E7E7E7E7, usb://0, udp://127.0.0.1:19850.")
@click.option("--mission", "mission_name",
              help="A ready mission, a scenario or a .toml file (the same that `simulate` flies).")
@click.option("--out", required=True, type=click.Path(path_type=Path, file_okay=False),
              help="Folder for the logs.")
@click.option("--name", help="Of the files; the mission's if left out.")
@click.option("--flights", "-n", default=1, show_default=True,
              help="Number of flights; they are numbered after those in the folder.")
@click.option("--number", type=click.IntRange(min=1),
              help="Number of the first flight, instead of the next free one.")
@click.option("--vehicle", default=vehicles.DEFAULT_VEHICLE, show_default=True,
              help="Built-in name or .toml file, written into the log.")
@click.option("--param", "settings", multiple=True, metavar="GROUP.NAME=VALUE",
              help="Set a parameter of the drone first.")
@click.option("--min-battery", type=Finite(min=0.0), default=3.7, show_default=True, metavar="V",
              help="Least voltage on the ground.")
@click.option("--link-timeout", type=Finite(min=0.0, min_open=True), default=3.0, show_default=True, metavar="S",
              help="Silence after which it lands as soon as it is heard again.")
@seed_option("For missions whose values are drawn.")
@click.option("--cache", type=click.Path(path_type=Path),
              help="Folder for the drone's tables, to connect faster; ~/.cache/airtouch if left out.")
@click.option("--yes", "-y", is_flag=True, help="Take off without asking.")
@click.option("--force", is_flag=True, help="Replace a flight that has the number already.")
@click.option("--recover", is_flag=True, help="Only finish what killed flights left in --out.")
@click.option("--list-missions", is_flag=True, is_eager=True, expose_value=False, callback=_list_missions,
              help="Every ready mission, and exit.")
def command(uri: str | None, mission_name: str | None, out: Path, name: str | None, flights: int,
            number: int | None, vehicle: str, settings: tuple[str, ...], min_battery: float,
            link_timeout: float, seed: int, cache: Path | None, yes: bool, force: bool,
            recover: bool) -> None:
    """Fly a mission with the drone's high-level commander and log it at 100 Hz.

    \b
    airtouch collect --uri radio://0/80/2M/E7E7E7E7E7 --mission there-and-back --out flights
    airtouch collect --uri udp://127.0.0.1:19850 --mission sweep.toml --out flights   # beside `airtouch sitl`

    Ctrl-C lands. Every row is on the disk at once, in NAME_0001.csv.gz.part until the flight is over.
    Exit code 1 when a flight ended early; its log is kept and listed as messy.
    """
    from airtouch.crazyflie import collect, mission, recorder
    from airtouch.crazyflie.checks import parse_setting

    if recover:
        _recover(out)
    if not uri or not mission_name:
        raise AirTouchError("give --uri and --mission (airtouch collect --list-missions), or --recover")
    if flights < 1:
        raise AirTouchError("--flights must be 1 or more")
    name = name or Path(mission.scene_of(mission_name).name).name
    plan = collect.Plan(uri, out, name, _checked(vehicle), [parse_setting(text) for text in settings], min_battery,
                        link_timeout, force)
    with no_empty_folders(out):
        collect.prepare_folder(out, click.echo)
        first_number = number or recorder.next_number(out, name)
        numbers = range(first_number, first_number + flights)
        for i in numbers:
            check_free(recorder.flight_path(out, name, i), force)
        missions = {i: mission.load(mission_name, seed, i) for i in numbers}
        click.echo(mission.describe_all(list(missions.values())))
        planned = _fly(plan, missions, cache, ask=sys.stdin.isatty() and not yes)
    sys.exit(0 if planned else 1)


def _checked(vehicle: str) -> str:
    """The vehicle as logs name it: a built-in name, or the absolute path of a file, so that it is found from anywhere.

    Raises AirTouchError for an unknown name and for a wrong file.
    """
    vehicles.load(vehicle)
    return str(Path(vehicle).resolve()) if vehicle.endswith(".toml") else vehicle


def _recover(out: Path) -> None:
    """Finish the flights of killed runs and exit."""
    from airtouch.crazyflie import manifest

    recovered, unreadable = manifest.recover(out)
    lines = [f"recovered: {path}" for path in recovered] + unreadable
    click.echo("\n".join(lines) or f"{out}: nothing to recover")
    sys.exit(2 if unreadable else 0)


def _fly(plan: "collect.Plan", missions: dict[int, "Mission"], cache: Path | None, ask: bool) -> bool:
    """Fly missions, by the flights' numbers, until one ends early. True if all ended as planned.

    Ctrl-C lands a drone in flight; before and between the flights it ends the program, as it does elsewhere.
    """
    from airtouch.crazyflie import collect, readiness
    from airtouch.crazyflie.connection.drone import Drone
    from airtouch.crazyflie.connection.link import default_cache

    with stopping(quiet=True) as stop:
        drone = Drone(plan.uri, cache or default_cache(), unanswered=waiting(plan.uri, stop))
    try:
        if stop.is_set():
            raise click.Abort
        ready = readiness.make_ready(drone, plan.settings, plan.least_v, click.echo)
        for number, mission in missions.items():
            click.echo(f"flight {number}: {mission.describe()}")
            if ask:
                click.confirm(f"flight {number}: drone at the start, nose along x, room clear?", abort=True)
            with _display(mission.seconds) as show, stopping() as stop:
                outcome = collect.fly(drone, ready, mission, plan, number, stop=stop, say=click.echo, show=show)
            _report(outcome)
            if not outcome.planned:
                return False
    finally:
        drone.close()
    return True


@contextmanager
def stopping(quiet: bool = False):
    """An event that Ctrl-C, SIGTERM and SIGHUP set instead of ending the process."""
    stop = threading.Event()

    def request_stop(*_) -> None:
        first = not stop.is_set()
        stop.set()
        if first and not quiet:
            with suppress(OSError):  # the terminal may be gone
                click.echo("landing; the log is kept", err=True)

    if threading.current_thread() is not threading.main_thread():
        yield stop
        return
    before = {s: signal.signal(s, request_stop) for s in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def waiting(uri: str, stop: threading.Event) -> Callable[[str], None]:
    """For `Drone`: what to say while nobody answers, once, on stderr. It raises AirTouchError after `stop`."""
    from airtouch.crazyflie.connection.link import remedy

    reasons: list[str] = []

    def unanswered(reason: str) -> None:
        if stop.is_set():
            raise AirTouchError(f"{uri}: stopped before anybody answered")
        if not reasons:
            reasons.append(reason)
            click.echo(f"airtouch: {uri}: no answer yet: {reason}; {remedy(uri)} Still trying.", err=True)

    return unanswered


@contextmanager
def _display(seconds: float) -> Iterator[Callable[["Flight"], None]]:
    """A status line with leg, time, battery and losses; without a terminal one line for each leg."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    console = Console(stderr=True)
    if not console.is_terminal:
        seen = []

        def plain(flight: "Flight") -> None:
            label = _label(flight)
            if seen[-1:] != [label]:
                seen.append(label)
                click.echo(f"{_time_s(flight):6.1f} s  {label}")

        yield plain
        return
    with Progress(TextColumn("{task.fields[leg]:9}"), BarColumn(), TextColumn("{task.fields[text]}"),
                  console=console, transient=True) as bar:
        task = bar.add_task("flight", total=seconds, leg="", text="")

        def live(flight: "Flight") -> None:
            i = flight.intake
            bar.update(task, completed=_time_s(flight), leg=_label(flight),
                       text=f"{_time_s(flight):5.1f} s  {i.latest.get('vbat_V', float('nan')):.2f} V  "
                            f"{100 * i.lost / max(i.received + i.lost, 1):.1f} % lost")

        yield live


def _label(flight: "Flight") -> str:
    pilot = flight.pilot
    return pilot.leg.kind if pilot.phase == "mission" and pilot.leg else pilot.phase


def _time_s(flight: "Flight") -> float:
    i = flight.intake
    return 0.0 if i.first_ms is None or i.newest_ms is None else (i.newest_ms - i.first_ms) / 1000.0


def _report(outcome: "collect.Outcome") -> None:
    from airtouch import logs
    from airtouch.crazyflie import manifest

    log = outcome.log
    if not len(log):
        click.echo(f"{outcome.ended}: nothing was received, no file written")
        return
    total = len(log) + log.meta["lost_samples"]
    click.echo(f"{outcome.path}: {outcome.ended}; {len(log)} samples, {log.meta['lost_samples']} lost "
               f"({log.meta['lost_samples'] / total:.1%}), longest gap {log.meta['longest_gap_s']:.2f} s")
    start = log["t_s"][0]
    edges = logs.true_edges(log, arm_pwm=vehicles.arm_pwm_of(log.meta))
    if outcome.use == "free-air":
        click.echo("no edge on this flight: listed as free-air, scores leave it out; fly over a platform, as the "
                   "mission sweep does over its own")
    if outcome.planned and manifest.over_low_platforms_only(log):
        click.echo("listed as messy: the platform is higher than 0.12 m but lower than 0.30 m, the least step of a "
                   "true edge, so the flight is neither scored nor in free air; fly over a higher platform")
    for edge in edges:
        click.echo(f"true {edge.kind:5} at {log['t_s'][edge.sample] - start:6.2f} s: "
                   f"down range {edge.height_before_m:.2f} to {edge.height_after_m:.2f} m")
    if not edges:
        click.echo("no true edge: the down range never stepped by more than 0.30 m in flight")
