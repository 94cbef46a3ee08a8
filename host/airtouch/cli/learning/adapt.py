"""`airtouch adapt`: a detector for the drone that flew some flights."""

import time
from pathlib import Path
from typing import Any

import click

from airtouch.cli.shared.options import seed_option, speed_option
from airtouch.cli.shared.progress import Bar
from airtouch.cli.shared.typed import typed
from airtouch.extras import need
from airtouch.logs.files import check_free
from airtouch.vehicle import DEFAULT_VEHICLE

MORE = 5  #: further flights whose benefit is estimated


@click.command(name="adapt")
@click.argument("flights", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), default=Path("mine.npz"), show_default=True,
              help="Model file to write.")
@click.option("--twin", "twin_folder", type=click.Path(path_type=Path, file_okay=False),
              help="Folder of `airtouch twin`; one is fitted to the flights if left out.")
@click.option("--vehicle", metavar="NAME", help="Vehicle that this fit starts from, a name or a .toml file; default "
              f"{DEFAULT_VEHICLE}.")
@click.option("--from", "origin", default="shipped", show_default=True, metavar="MODEL",
              help="Weights to start from: shipped, scratch, or a model file.")
@speed_option
@click.option("--fold", "folds", type=int, multiple=True, metavar="N",
              help="Only flights of this fold of the manifest; may be repeated.")
@click.option("--hold-out/--no-hold-out", default=True, show_default=True, help="Measure what to expect, by flight.")
@click.option("--withhold-range", is_flag=True,
              help="Use no labels in the last stage, to measure the benefit of unlabelled flights.")
@seed_option("Fixes every bit of the result on one machine.")
@click.option("--force", is_flag=True, help="Replace the model file.")
def command(flights: tuple[Path, ...], out: Path, twin_folder: Path | None, vehicle: str | None, origin: str,
            speed: float | None, folds: tuple[int, ...], hold_out: bool, withhold_range: bool, seed: int,
            force: bool) -> None:
    """Train a detector for the drone that flew FLIGHTS: logs, or folders (the clean flights of a manifest.csv).

    \b
    airtouch adapt my-flights --out mine.npz
    airtouch evaluate new-flights --model mine.npz
    airtouch export mine.npz --out model

    It starts from the shipped weights, trains in the twin, and then on the flights themselves: their down range
    labels them. Flights without down range are labelled by the detector from the twin. With four flights or more
    over a platform, the labels of a quarter of them are held out in turn to measure what to expect. Finished stages
    are stored beside --out, in a folder that ends in .adapt: the same command continues after a stop.
    """
    from airtouch.detector import best
    from airtouch.detector.evaluation.data import dataset
    from airtouch.detector.evaluation.data.folds import in_folds
    from airtouch.twin import adapt, adapt_report

    need("train", "training")
    started = time.monotonic()
    check_free(out, force)
    adapt_report.check_vehicle(twin_folder, vehicle)
    start = None if origin == "scratch" else best.load(None if origin == "shipped" else Path(origin))
    files = in_folds(dataset.collect(flights, speed), folds)
    usable, _, twin, work = adapt_report.prepared(files, out, twin_folder, vehicle, speed_mps=speed, seed=seed, bar=Bar,
                                                  start=start, note=lambda reason: click.echo(f"airtouch: {reason}",
                                                                                              err=True))
    labelled = [f for f in usable if f.labelled]
    click.echo(f"{len(labelled)} flights that their down range labels, {len(usable) - len(labelled)} without; "
               f"{twin.what}")
    with Stages() as stages:
        adapted = adapt.adapt(usable, twin.scenario, twin.vehicle, work, start=start, seed=seed, hold_out=hold_out,
                              withhold=withhold_range, progress=stages, command=typed())
    adapted.model.save(out, force)
    _say(adapted, len(labelled), hold_out)
    click.echo(f"written: {out} ({out.stat().st_size} bytes), {time.monotonic() - started:.0f} s")


def _say(adapted: Any, labelled: int, hold_out: bool) -> None:
    """Print what to expect of the detector."""
    from airtouch.detector.evaluation import summary
    from airtouch.twin import adapt, adapt_report

    rows = {"twin only": adapted.twin_only, "held out, half of the others": adapted.held_out_half,
            "held out, all others": adapted.held_out}
    for name, scores in rows.items():
        if scores:
            click.echo(f"{name}: {in_words(summary.summarise(scores))}")
    if adapted.twin_only and "free_air_of" in adapted.model.metadata.get("adapted", {}).get("twin", {}):
        click.echo("the simulated flights of every training hold these flights' free air and strength of edges: new "
                   "ones may do worse")
    if any(s.in_training for s in adapted.twin_only):
        click.echo("the weights it started from have seen some of these flights: these figures are too good; "
                   "--from scratch measures without them")
    if not hold_out:
        click.echo("nothing was held out, as asked: what to expect of new flights is not known")
        return
    if not adapted.held_out:
        click.echo(f"nothing was held out: {labelled} flights label themselves, {adapt.MIN_LABELLED} are needed to say "
                   "what to expect")
        return
    ahead = adapt_report.expected_error(adapted, labelled, MORE)
    if ahead:
        click.echo(f"the next {MORE} flights: {ahead['now_m']:.3f} m would become about {ahead['then_m']:.3f} m "
                   f"(from {ahead['half_m']:.3f} m with half of the flights; a guess, see the intervals)")


def in_words(table: dict[str, Any]) -> str:
    """Error, missed and false edges with intervals and sample size."""
    def cell(name: str, scale: float, form: str) -> str:
        if table[name] is None:
            return "-"
        ends = table["intervals"].get(name)
        value = format(scale * table[name], form)
        return value + (f" ({format(scale * ends[0], form)} to {format(scale * ends[1], form)})" if ends else "")

    return (f"error {cell('mean_abs_error_m', 1, '.3f')} m, missed {cell('missed', 100, '.1f')} %, false "
            f"{cell('false_per_minute', 1, '.2f')} a minute; {table['flights']} flights, {table['edges']} edges, "
            "95 % by flight")


class Stages:
    """One progress bar for each stage: call it with (stage, done, total, note)."""

    def __init__(self) -> None:
        self.name = ""
        self.bar: Bar | None = None

    def __enter__(self) -> "Stages":
        return self

    def __exit__(self, *error: object) -> None:
        if self.bar is not None:
            self.bar.__exit__(*error)

    def __call__(self, stage: str, done: int, total: int, note: str) -> None:
        if stage != self.name or self.bar is None:
            self.__exit__(None, None, None)
            self.name, self.bar = stage, Bar(stage).__enter__()
        self.bar(done, total, note)
