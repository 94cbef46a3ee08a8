"""`airtouch simulate`: fly a scenario many times and write the flight logs."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from airtouch.cli.shared.help import examples
from airtouch.cli.shared.options import seed_option
from airtouch.vehicle import DEFAULT_VEHICLE

if TYPE_CHECKING:
    from airtouch.logs.flight_log import FlightLog
    from airtouch.simulation.flight import Diverged

FLIGHTS_A_PROCESS = 10  #: least flights for each process
SAID = 20  #: diverged flights that are named


def _list_effects(ctx: click.Context, _: click.Parameter, value: bool) -> None:
    if not value:
        return
    from airtouch.simulation.effects import EFFECTS

    for effect in EFFECTS.values():
        click.echo(f"{effect.name}: {effect.summary}")
        for p in effect.parameters:
            unit = "" if p.unit == "1" else f" {p.unit}"
            click.echo(f"    {p.name} = {p.default:g}{unit}  ({p.low:g} to {p.high:g}{unit}) {p.summary}")
        for name, values in effect.presets.items():
            click.echo(f"    preset={name}: " + ", ".join(f"{k} = {v:g}" for k, v in values.items()))
    ctx.exit()


def _list_scenarios(ctx: click.Context, _: click.Parameter, value: bool) -> None:
    if not value:
        return
    from airtouch.crazyflie import mission
    from airtouch.simulation import scenario

    for name in scenario.names():
        click.echo(f"{name}: {scenario.load(name).summary}")
    for name in mission.names():
        click.echo(f"{name}: {mission.scene_of(name).summary} (a mission: `airtouch collect` flies it too)")
    ctx.exit()


@click.command("simulate", epilog=examples(
    "airtouch simulate paper-low -n 20 --out flights",
    "airtouch simulate paper-4cm -n 5 --out windy --effect wind:x=0.5m/s --without gust",
    "airtouch simulate mine.toml -n 1000 --out many --workers 8",
    "airtouch simulate --list-effects"))
@click.argument("scenario")
@click.option("--flights", "-n", type=click.IntRange(1), default=1, show_default=True, help="How many flights.")
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), required=True,
              help="Folder for the logs.")
@click.option("--vehicle", default=DEFAULT_VEHICLE, show_default=True, help="Name or .toml file.")
@click.option("--effect", "chosen", multiple=True, metavar="NAME[:P=V...]",
              help="Switch an effect on, as in wind:x=0.3m/s; a scenario's own of that name is replaced.")
@click.option("--without", multiple=True, metavar="NAME", help="Switch an effect of the scenario off.")
@click.option("--effect-file", "files", multiple=True, help="Python file with an effect of your own.")
@seed_option("Of the whole batch.")
@click.option("--workers", type=click.IntRange(1), help="Processes; default one a core.")
@click.option("--dask", metavar="SCHEDULER", help="Address of a dask.distributed scheduler.")
@click.option("--force", is_flag=True, help="Remove flights of another request from --out.")
@click.option("--list-effects", is_flag=True, is_eager=True, expose_value=False, callback=_list_effects,
              help="Every effect with its parameters, and exit.")
@click.option("--list-scenarios", is_flag=True, is_eager=True, expose_value=False, callback=_list_scenarios,
              help="Every scenario that comes with the package, and exit.")
def command(scenario: str, flights: int, out: Path, vehicle: str, chosen: tuple[str, ...],
            without: tuple[str, ...], files: tuple[str, ...], seed: int, workers: int | None, dask: str | None,
            force: bool) -> None:
    """Fly SCENARIO (a built-in name or a .toml file) and write one log a flight.

    The vehicle's firmware flies, or the scenario's (firmware = "2026.08" or "authors-2024-01", range_module = "map",
    "platform", "none" or "firmware" in the file). The same command continues after a kill. Flights that diverge are
    reported with their number and never written; the exit code is then 1.
    """
    from airtouch import vehicle as vehicles
    from airtouch.logs.files import read_text
    from airtouch.simulation import batch, effects
    from airtouch.simulation import scenario as scenarios
    from airtouch.simulation.flight import choose, refuse_off
    from airtouch.simulation.stepper import Stepper
    from airtouch.simulation.workers import cluster, local, store

    plugins = []
    for path in files:
        effects.load_file(path)
        plugins.append(read_text(path))
    scene = scenarios.load(scenario)
    craft = vehicles.load(vehicle)
    pairs = [effects.parse(text) for text in chosen]
    plan = scenarios.draw_flight(scene, seed, 0)
    refuse_off(plan, without)
    Stepper(plan, craft, seed, 0, choose(plan, pairs, without))  # a vehicle that cannot fly is refused here
    client = cluster.connect(dask) if dask else None
    request = store.request_of(scene, craft, pairs, without, seed, plugins)
    store.open_folder(out, request, force)
    todo = store.missing(out, scene.name, seed, flights)
    if len(todo) < flights:
        click.echo(f"{flights - len(todo)} of {flights} flights are there already")
    results: Iterator[FlightLog | Diverged] | Iterator[Diverged | None]
    if client is not None:
        results = cluster.flights(client, scene, todo, vehicle=craft, effects=pairs, without=without, seed=seed,
                                  plugins=plugins)
    else:
        # starting a process takes 1 s, flying and writing a flight 0.1 s
        most = max(1, min(workers or batch.available_cores(), len(todo) // FLIGHTS_A_PROCESS))
        results = local.write(out, scene, todo, vehicle=craft, effects=pairs, without=without, seed=seed,
                              plugins=plugins, workers=most)
    _write(results, len(todo), out, scene.name)
    there = flights - len(store.missing(out, scene.name, seed, flights))
    diverged = [f for f in store.failures(out) if f["flight"] < flights]
    store.write_manifest(out, scene, seed)
    whole = there - len(diverged)
    click.echo(f"{whole} flight{'s' * (whole != 1)} in {out}")
    if diverged:
        _say_diverged(diverged, out / store.FAILED)
        raise SystemExit(1)


def _say_diverged(flights: Sequence[dict[str, Any]], record: Path) -> None:
    """Say of each flight when and why it diverged, of the first SAID."""
    for f in flights[:SAID]:
        click.echo(f"airtouch: flight {f['flight']} of seed {f['seed']} diverged: {f['reason']} after "
                   f"{f['time_s']:.2f} s; not written", err=True)
    if len(flights) > SAID:
        click.echo(f"airtouch: and {len(flights) - SAID} more, in {record}", err=True)


def _write(results, count: int, out: Path, name: str) -> None:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    from airtouch.simulation.workers import store

    with Progress(TextColumn("flights"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(),
                  console=Console(stderr=True)) as bar:
        task = bar.add_task("flights", total=count)
        for result in results:
            if result is not None:
                store.save(out, name, result)
            bar.advance(task)
