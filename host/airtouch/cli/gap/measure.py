"""`airtouch gap measure`: where flights and model differ."""

from dataclasses import replace
from pathlib import Path

import click

from airtouch.cli.gap.options import NAMES_SHOWN, Greedy, check_outputs, inputs_and_outputs, written
from airtouch.cli.gap.progress import LateBar
from airtouch.cli.shared import output
from airtouch.cli.shared.help import examples
from airtouch.cli.shared.typed import typed


@click.command("measure", cls=Greedy, epilog=examples(
    "airtouch gap measure my-flights --report where.html",
    "airtouch gap measure real/*.csv --baseline nominal --vehicle mine.toml"))
@inputs_and_outputs
def measure_command(real: tuple[str, ...], vehicle_name: str | None, baseline: tuple[str, ...],
                    report: Path | None, plots: Path | None, json_path: Path | None, dask: str | None,
                    force: bool) -> None:
    """Map the gap between REAL flights and the model, by channel, band, phase and regime.

    REAL and --baseline are log files, folders or patterns; give REAL first.
    """
    check_outputs(report, plots, json_path, force)
    with LateBar() as bar:
        import airtouch.gap.measurement as measure
        from airtouch.cli.gap import files, show
        from airtouch.gap.sealed import on_cluster

        flights, nominal = files.Flights(real), files.Flights(baseline)
        vehicle = files.vehicle_of(vehicle_name, flights, nominal)
        run = on_cluster.mapper(dask) if dask else map
        bar.expect(len(flights) + bool(baseline))
        measurement = measure.measure(flights, vehicle, nominal, progress=bar, mapper=run)
    failed = (*flights.failed.values(), *nominal.failed.values())
    measurement = replace(measurement, left_out=(*failed, *measurement.left_out))
    if json_path:
        output.write_json(json_path, measurement.plain(), force)
    drawn: list[Path] = []
    if report or plots:
        from airtouch.report import gap_report

        measurement = replace(measurement, curves=measure.curves_of_measurement(measurement, flights, vehicle))
        if report:
            gap_report.write_measurement(report, measurement, force=force, command=typed(NAMES_SHOWN))
        if plots:
            drawn = gap_report.write_plots(plots, measurement.curves, force)
    show.measurement(output.console(), measurement)
    show.left_out(measurement.left_out)
    written(json_path, report, *drawn)
