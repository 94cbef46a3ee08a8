"""`airtouch gap diagnose`: which effect the simulator lacks."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from airtouch.cli.gap.options import NAMES_SHOWN, Greedy, check_outputs, inputs_and_outputs, runner, written
from airtouch.cli.gap.progress import LateBar
from airtouch.cli.shared import output
from airtouch.cli.shared.help import examples
from airtouch.cli.shared.modules import loaded_for_good
from airtouch.cli.shared.typed import typed
from airtouch.errors import AirTouchError


@click.command("diagnose", cls=Greedy, epilog=examples(
    "airtouch gap diagnose flight.csv --report which.html",
    "airtouch gap diagnose real/*.csv --baseline nominal --vehicle mine.toml --json which.json",
    "airtouch gap diagnose real --baseline nominal --each"))
@inputs_and_outputs
@click.option("--without", multiple=True, metavar="EFFECT", help="Exclude a candidate; may be repeated.")
@click.option("--effect-file", "--effects-file", "effect_files", multiple=True, metavar="FILE",
              help="Python file with effects of your own; may be repeated.")
@click.option("--partner", multiple=True, metavar="LOG",
              help="Log of another vehicle in the air with REAL, of one clock and frame; may be repeated. Needs "
                   "--baseline.")
@click.option("--each", is_flag=True, help="Diagnose each flight alone.")
def diagnose_command(real: tuple[str, ...], vehicle_name: str | None, baseline: tuple[str, ...],
                     report: Path | None, plots: Path | None, json_path: Path | None, dask: str | None,
                     force: bool, without: tuple[str, ...], effect_files: tuple[str, ...], partner: tuple[str, ...],
                     each: bool) -> None:
    """Find the unmodelled effect that REAL flights have in common, and the part of the gap that it explains.

    REAL and --baseline are log files, folders or patterns; give REAL first. One flight is enough. With
    --baseline, nominal flights of the same vehicle, weaker effects are found; with --partner as well, shorter
    wakes. Prints where the gap lies, which effect causes it and how far it closes; `none` and `unknown` are answers
    too, with exit code 0.
    """
    check_outputs(report, plots, json_path, force)
    if each and (report or plots):
        raise AirTouchError("--report and --plots show one diagnosis; leave --each out")
    if dask and not each:
        raise AirTouchError("--dask spreads flights that are diagnosed one by one; add --each")
    if each and partner:
        raise AirTouchError("--partner is of one flight; leave --each out")
    if partner and not baseline:
        raise click.UsageError("--partner needs --baseline, nominal flights of the same vehicle")
    drawn: list[Path] = []
    with LateBar() as bar:
        with loaded_for_good():
            from airtouch.cli.gap import files, next_commands, show
            from airtouch.simulation import effects
            from airtouch.vehicle import name_in

        for path in effect_files:
            effects.load_file(path)
        for name in without:
            effects.get(name)
        flights, nominal, partners = files.Flights(real), files.Flights(baseline), files.Flights(partner)
        nominal_logs, logs = list(nominal), [] if each else list(flights)
        craft = files.vehicle_of(vehicle_name, flights if each else logs, nominal_logs)
        case = _case(craft, nominal_logs, without, list(partners))
        vehicle_named = vehicle_name or next(filter(None, (name_in(log.meta) for log in [*logs, *nominal_logs])), None)
        if same := files.also_in(flights, nominal):
            click.echo(f"airtouch: {min(same).name}: is a baseline flight as well, and cannot differ from itself; "
                       f"give it once ({len(same)} of {len(flights)} flights)", err=True)
        if not each:
            if not logs:
                raise AirTouchError(next(iter(flights.failed.values()), "no flight to diagnose"))
            diagnosis = next_commands.with_names(case(logs, progress=bar, curves=bool(report or plots)),
                                                 vehicle_named, real, baseline)
            if json_path:
                output.write_json(json_path, diagnosis.plain(), force)
            if report or plots:
                from airtouch.report import gap_report
            if report:
                bar("report")
                gap_report.write_diagnosis(report, diagnosis, command=typed(NAMES_SHOWN), force=force)
            if plots:
                drawn = gap_report.write_plots(plots, diagnosis.curves, force)
    diagnosed = 1
    if each:
        diagnosed = _each(flights, case, lambda d: next_commands.with_names(d, vehicle_named, d.flights, baseline),
                          json_path, runner(dask, effect_files), force)
    else:
        show.diagnosis(output.console(), diagnosis)
    show.left_out([*flights.failed.values(), *nominal.failed.values(), *partners.failed.values()])
    if not diagnosed:
        raise AirTouchError(f"none of {len(flights)} flights can be diagnosed; the reasons are above")
    written(json_path, report, *drawn)


def _case(vehicle: Any, nominal: list, without: tuple[str, ...], partner: list) -> Callable:
    """A function that diagnoses flights, with all other arguments fixed."""
    from functools import partial

    import airtouch.gap.diagnosis as diagnose

    return partial(diagnose.diagnose, vehicle=vehicle, baseline=nominal, without=tuple(without), partner=partner)


def _each(flights: Any, case: Callable, with_names: Callable, json_path: Path | None, run: Callable,
          force: bool) -> int:
    """Diagnose each flight alone and print one row for each. Returns how many were; of none it writes nothing.

    The JSON is written anew after each flight, so that what is done stays if the rest is broken off. with_names:
    gives a diagnosis the names that were given in its commands.
    """
    from functools import partial

    from rich.table import Table

    from airtouch.cli.gap import show
    from airtouch.gap.answer import words

    table = Table("flight", "verdict", "effects", "probability")
    rows = []
    with LateBar(len(flights), "diagnosing") as bar:
        for diagnosis in run(partial(_alone, case), _named_on(bar, flights)):
            if isinstance(diagnosis, AirTouchError):
                show.left_out([str(diagnosis)])
                continue
            bar(diagnosis.flights[0])
            first = diagnosis.ranking[0]
            table.add_row(Path(diagnosis.flights[0]).name, diagnosis.verdict,
                          "; ".join(words.effect_in_words(e) for e in diagnosis.effects),
                          f"{first.probability:.0%}")
            rows.append(with_names(diagnosis).plain())
            if json_path:
                output.write_json(json_path, {"cases": rows}, force or len(rows) > 1)
    if rows:
        output.console().print(table)
    return len(rows)


def _named_on(bar: LateBar, flights: Any) -> Iterator[Any]:
    """The flights, each named on the bar before it is diagnosed."""
    for log in flights:
        bar.now(f"diagnosing {Path(log.source).name}")
        yield log


def _alone(case: Callable, log: Any) -> Any:
    """The diagnosis of one flight, or the AirTouchError that says why it has none."""
    try:
        return replace(case([log]), calibrated=None, map=None)  # which need not travel
    except AirTouchError as error:
        return error
