"""`airtouch gap`: where real flights and the simulator part, why, and how far an effect closes it."""

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # its threads wait for one another: products are small

from airtouch.cli import Suggesting, scores
from airtouch.errors import AirTouchError
from airtouch.logs.files import check_free


@click.group("gap", cls=Suggesting)
def command() -> None:
    """Diagnose the gap between recorded flights and the simulator."""


class Greedy(click.Command):
    """A command whose --baseline takes all words up to the next option, so that a shell pattern works."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        spread: list[str] = []
        taking = False
        for word in args:
            if word.startswith("-"):
                taking = word == "--baseline"
                spread += [] if taking else [word]
            else:
                spread += ["--baseline", word] if taking else [word]
        if args and args[-1] == "--baseline":
            spread.append("--baseline")  # click says that its value is missing
        return super().parse_args(ctx, spread)


def _shared(function: Callable) -> Callable:
    """Add the options that `measure` and `diagnose` share."""
    path = click.Path(path_type=Path, dir_okay=False)
    for option in (
        click.option("--force", is_flag=True, help="Replace the files."),
        click.option("--dask", metavar="SCHEDULER", help="Address of a dask.distributed scheduler."),
        click.option("--json", "json_path", type=path, help="Write every figure to this file."),
        click.option("--report", type=path, help="Write a report to this HTML file."),
        click.option("--baseline", multiple=True, metavar="NOMINAL...",
                     help="Flights without any unmodelled effect, up to the next option."),
        click.option("--vehicle", "vehicle_name", metavar="V",
                     help="Name or .toml file; else the one that the log names."),
        click.argument("real", nargs=-1, required=True),
    ):
        function = option(function)
    return function


@command.command("measure", cls=Greedy)
@_shared
def measure_command(real: tuple[str, ...], vehicle_name: str | None, baseline: tuple[str, ...],
                    report: Path | None, json_path: Path | None, dask: str | None, force: bool) -> None:
    """Map the gap between REAL flights and the model, by channel, band, phase and regime.

    REAL and --baseline are log files, folders or patterns; give REAL first.
    """
    from airtouch.cli import gap_input, gap_show
    from airtouch.gap import measure
    from airtouch.gap.sealed import on_cluster

    _check_free(report, json_path, force)
    flights, nominal = gap_input.Flights(real), gap_input.Flights(baseline)
    vehicle = gap_input.vehicle_of(vehicle_name, flights)
    run = on_cluster.mapper(dask) if dask else map
    with gap_show.Bar(len(flights) + bool(baseline)) as bar:
        measurement = measure.measure(flights, vehicle, nominal, progress=bar, run=run)
    failed = (*flights.failed.values(), *nominal.failed.values())
    measurement = replace(measurement, left_out=(*failed, *measurement.left_out))
    if json_path:
        scores.write_json(json_path, measurement.plain(), force)
    if report:
        from airtouch.gap.answer import pictures
        from airtouch.report import gap_report

        gap_report.write_measurement(report, measurement, pictures.of_measurement(measurement, flights, vehicle),
                                     force=force, command=_line("measure", real, baseline, vehicle_name))
    gap_show.measurement(scores.console(), measurement)
    gap_show.left_out(measurement.left_out)
    _written(json_path, report)


@command.command("diagnose", cls=Greedy)
@_shared
@click.option("--without", multiple=True, metavar="EFFECT", help="Exclude a candidate; may be repeated.")
@click.option("--effects-file", "--effect-file", "effect_files", multiple=True, metavar="FILE",
              help="Python file with effects of your own; may be repeated.")
@click.option("--each", is_flag=True, help="Diagnose each flight alone.")
def diagnose_command(real: tuple[str, ...], vehicle_name: str | None, baseline: tuple[str, ...],
                     report: Path | None, json_path: Path | None, dask: str | None, force: bool,
                     without: tuple[str, ...], effect_files: tuple[str, ...], each: bool) -> None:
    """Find the unmodelled effect that REAL flights have in common, and the part of the gap that it explains.

    REAL and --baseline are log files, folders or patterns; give REAL first. One flight is enough. The exit
    code is 0 for any verdict.
    """
    from airtouch.cli import gap_input, gap_show
    from airtouch.simulation import effects

    _check_free(report, json_path, force)
    if each and report:
        raise AirTouchError("--report shows one diagnosis; leave --each out")
    if dask and not each:
        raise AirTouchError("--dask spreads flights that are diagnosed one by one; add --each")
    for path in effect_files:
        effects.load_file(path)
    for name in without:
        effects.get(name)
    flights, nominal = gap_input.Flights(real), gap_input.Flights(baseline)
    vehicle = gap_input.vehicle_of(vehicle_name, flights)
    case = _case(vehicle, list(nominal), without)
    if each:
        _each(flights, case, json_path, _runner(dask, effect_files), force)
    else:
        logs = list(flights)
        if not logs:
            raise AirTouchError(next(iter(flights.failed.values()), "no flight to diagnose"))
        with gap_show.Bar() as bar:
            diagnosis = case(logs, progress=bar, pictures=bool(report))
        if json_path:
            scores.write_json(json_path, diagnosis.plain(), force)
        if report:
            from airtouch.report import gap_report

            gap_report.write_diagnosis(report, diagnosis, command=_line("diagnose", real, baseline, vehicle_name),
                                       force=force)
        gap_show.diagnosis(scores.console(), diagnosis)
    gap_show.left_out([*flights.failed.values(), *nominal.failed.values()])
    _written(json_path, report)


@command.command("demo")
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), default=Path("out/gap-demo"),
              show_default=True, help="Folder for the report and the JSON.")
@click.option("--force", is_flag=True, help="Replace what an earlier demo wrote.")
def demo_command(out: Path, force: bool) -> None:
    """Diagnose a flight of the package whose effect is withheld, and compare the answer with the effect.

    Needs no drone, no network and no TensorFlow; about a minute, most of it compiling the first time.
    """
    import time

    from airtouch.cli import gap_show
    from airtouch.gap import example
    from airtouch.gap.answer import words
    from airtouch.gap.diagnose import diagnose
    from airtouch.logs import read
    from airtouch.report import gap_report
    from airtouch.vehicle import load

    report, json_path = out / "report.html", out / "diagnosis.json"
    _check_free(report, json_path, force)
    began = time.monotonic()
    line = f"airtouch gap diagnose {example.real()} --baseline {example.FOLDER / 'nominal_*.csv.gz'} --report {report}"
    click.echo(f"This is: {line}")
    nominal = [read(p) for p in example.nominal()]
    with gap_show.Steps(began) as say:
        say("reading and compiling")
        diagnosis = diagnose([read(example.real())], load(str(nominal[0].meta["vehicle"])), nominal, progress=say,
                             pictures=True)
    scores.write_json(json_path, diagnosis.plain(), force)
    gap_report.write_diagnosis(report, diagnosis, command="airtouch gap demo", force=force)
    gap_show.diagnosis(scores.console(), diagnosis)
    true = {name: ", ".join(f"{k} {v:g}" for k, v in p.items()) for name, p in example.answer().items()}
    answer = words.joined([e.name for e in diagnosis.effects]) or diagnosis.verdict
    click.echo(f"\nSwitched on when the flight was made: {'; '.join(f'{n} ({p})' for n, p in true.items())}; found: "
               f"{answer}.")
    click.echo(f"{time.monotonic() - began:.0f} s; open {report} in a browser")


def _case(vehicle: Any, nominal: list, without: tuple[str, ...]) -> Callable:
    """A function that diagnoses flights, with all other arguments fixed."""
    from functools import partial

    from airtouch.gap import diagnose

    return partial(diagnose.diagnose, vehicle=vehicle, baseline=nominal, without=tuple(without))


def _runner(dask: str | None, effect_files: tuple[str, ...]) -> Callable:
    if not dask:
        return map
    from airtouch.gap.sealed import on_cluster

    return on_cluster.mapper(dask, [Path(p).read_text(encoding="utf-8") for p in effect_files])


def _each(flights: Any, case: Callable, json_path: Path | None, run: Callable, force: bool) -> None:
    """Diagnose each flight alone and print one row for each."""
    from functools import partial

    from rich.table import Table

    from airtouch.cli import gap_show
    from airtouch.gap.answer import words

    table = Table("flight", "verdict", "effects", "probability")
    rows = []
    with gap_show.Bar(len(flights)) as bar:
        for diagnosis in run(partial(_alone, case), flights):
            if isinstance(diagnosis, str):
                gap_show.left_out([diagnosis])
                continue
            bar(diagnosis.flights[0])
            first = diagnosis.ranking[0]
            table.add_row(Path(diagnosis.flights[0]).name, diagnosis.verdict,
                          "; ".join(words.effect_in_words(e) for e in diagnosis.effects),
                          f"{first.probability:.0%}")
            rows.append(diagnosis.plain())
    scores.console().print(table)
    if json_path:
        scores.write_json(json_path, {"cases": rows}, force)


def _alone(case: Callable, log: Any) -> Any:
    try:
        return replace(case([log]), held=None, map=None)  # which need not travel
    except AirTouchError as error:
        return str(error)


@command.group("blind", cls=Suggesting)
def blind() -> None:
    """Sealed sets of flights whose effect is withheld: make them, score a diagnosis of them."""


@blind.command("make")
@click.argument("out", type=click.Path(path_type=Path, file_okay=False))
@click.option("--flights", "-n", default=200, show_default=True, type=click.IntRange(1),
              help="How many flights.")
@click.option("--seed", default=0, show_default=True, type=click.IntRange(0), help="Of the whole set.")
@click.option("--key", type=click.Path(path_type=Path, dir_okay=False), help="Where the key goes; "
              "default: OUT.key.json beside OUT.")
@click.option("--force", is_flag=True, help="Replace a set in OUT.")
def blind_make(out: Path, flights: int, seed: int, key: Path | None, force: bool) -> None:
    """Write a sealed set to the folder OUT: flights, the hash of their answers, the key apart."""
    from airtouch.cli import gap_show
    from airtouch.gap.sealed import blind as sealed

    with gap_show.Bar() as bar:
        written = sealed.make(out, flights, seed, key=key, force=force, progress=bar)
    click.echo(f"{flights} flights in {out}; the key in {written}")


@blind.command("score")
@click.argument("folder", type=click.Path(path_type=Path, exists=True, file_okay=False))
@click.argument("answers", type=click.Path(path_type=Path, exists=True))
@click.option("--key", type=click.Path(path_type=Path, dir_okay=False), help="Default: beside FOLDER.")
@click.option("--json", "json_path", type=click.Path(path_type=Path, dir_okay=False),
              help="Write every figure.")
@click.option("--plot", type=click.Path(path_type=Path, dir_okay=False),
              help="Write the confusion matrix and the reliability to this PNG.")
@click.option("--force", is_flag=True, help="Replace the files.")
def blind_score(folder: Path, answers: Path, key: Path | None, json_path: Path | None, plot: Path | None,
                force: bool) -> None:
    """Open the key of the set in FOLDER and score the diagnoses in ANSWERS, a folder or a file."""
    from airtouch.extras import need
    from airtouch.gap.sealed import blind as sealed

    need("plots", "scoring a sealed set")
    _check_free(json_path, plot, force)
    _scored(sealed.score(folder, answers, key), json_path, plot, force)


@blind.command("run")
@click.argument("out", type=click.Path(path_type=Path, file_okay=False))
@click.option("--flights", "-n", default=480, show_default=True, type=click.IntRange(1),
              help="How many flights; 42 % have one effect, 42 % none, the rest two.")
@click.option("--seed", default=0, show_default=True, type=click.IntRange(0), help="Of the whole set.")
@click.option("--workers", default=2, show_default=True, type=click.IntRange(1), help="Processes.")
@click.option("--dask", metavar="SCHEDULER", help="Address of a dask.distributed scheduler, instead of processes here.")
@click.option("--json", "json_path", type=click.Path(path_type=Path, dir_okay=False),
              help="Write every figure; default: OUT/figures.json.")
def blind_run(out: Path, flights: int, seed: int, workers: int, dask: str | None, json_path: Path | None) -> None:
    """The whole check in the folder OUT: make a set, diagnose it, open the key, score.

    Goes on where it was broken off. Single effects are then diagnosed once more with the
    effect left out, where `unknown` is right.
    """
    from airtouch.cli import gap_show
    from airtouch.extras import need
    from airtouch.gap.sealed import blind_run as check

    need("plots", "scoring a sealed set")
    spread = _runner(dask, ()) if dask else None
    with gap_show.Bar() as bar:
        figures = check.run(out, flights, seed, workers=workers, spread=spread, progress=bar)
    _scored(figures, json_path or out / "figures.json", out / "figures.png", True)


def _scored(found: dict[str, Any], json_path: Path | None, plot: Path | None, force: bool) -> None:
    """Print the score of a blind check, and write it to files."""
    from rich.table import Table

    from airtouch.logs.files import write_bytes
    from airtouch.report import blind_figures

    for heads, rows in ((("figure (95 % interval)", "measured", "n", "goal"), blind_figures.rows(found)),
                        (("effect", "top-1", "top-3", "parameter error"), blind_figures.effect_rows(found))):
        table = Table(*heads)
        for row in rows:
            table.add_row(*row)
        scores.console().print(table)
    if json_path:
        scores.write_json(json_path, found, force)
    if plot:
        write_bytes(blind_figures.picture(found), plot, force)
    _written(json_path, plot)


def _check_free(report: Path | None, json_path: Path | None, force: bool) -> None:
    for path in (report, json_path):
        check_free(path, force)


def _line(name: str, real: tuple[str, ...], baseline: tuple[str, ...], vehicle: str | None) -> str:
    """The command as typed, for the report, with long lists of files shortened."""
    def few(names: tuple[str, ...]) -> str:
        return " ".join(names[:4]) + (f" [and {len(names) - 4} more]" if len(names) > 4 else "")

    return (f"airtouch gap {name} {few(real)}" + (f" --vehicle {vehicle}" if vehicle else "")
            + (f" --baseline {few(baseline)}" if baseline else ""))


def _written(*paths: Path | None) -> None:
    for path in filter(None, paths):
        click.echo(f"written: {path}")
