"""`airtouch demo`: the whole pipeline once, in a few minutes."""

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from airtouch.cli.shared import output
from airtouch.cli.shared.flights import find_flights
from airtouch.cli.shared.help import examples
from airtouch.cli.shared.options import speed_option
from airtouch.cli.shared.progress import Bar
from airtouch.cli.shared.typed import typed
from airtouch.detector import registry
from airtouch.detector.evaluation import evaluate
from airtouch.detector.evaluation.data import demo_flights
from airtouch.detector.evaluation.data.dataset import FlightFile
from airtouch.detector.evaluation.score_report import score_report, shown_flights
from airtouch.errors import AirTouchError
from airtouch.extras import need
from airtouch.logs.files import make_folder, no_empty_folders

EPOCHS, STEPS = 8, 800  #: epochs of `paper`, training steps of `best`: two minutes on two cores
SCORED = ("best", "paper", "baseline")  #: detectors, the best first
SHOWN = 4  #: flights plotted in the report
COMPILES = "the first time compiles the simulator, which takes a minute"


@click.command(name="demo", epilog=examples(
    "airtouch demo",
    "airtouch demo --flights my-flights --out out/mine"))
@click.option("--out", type=click.Path(path_type=Path), default=Path("out/demo"), show_default=True,
              help="Folder for the report, the model and simulated flights.")
@click.option("--flights", type=click.Path(path_type=Path),
              help="Recorded flights; AIRTOUCH_FLIGHTS or ../shared/flights if left out, else simulated.")
@speed_option
@click.option("--epochs", type=click.IntRange(1), default=EPOCHS, show_default=True, help="Training epochs.")
@click.option("--force", is_flag=True, help="Replace what an earlier demo wrote.")
def command(out: Path, flights: Path | None, speed: float | None, epochs: int, force: bool) -> None:
    """Train, prune, quantise, export to C, detect with the C code, and report.

    Takes about two minutes on two cores. You will see a score table of three detectors on held-out flights, and
    get an HTML report with plots.
    """
    need("train", "the demo trains a detector (airtouch gap demo needs nothing more), which")
    from airtouch.report.evaluation_report import write_report

    started = time.monotonic()
    report = out / "report.html"
    if report.exists() and not force:
        raise AirTouchError(f"{report}: exists already; use --force to replace it")
    if not force and any((out / "model").glob("*")):
        raise AirTouchError(f"{out / 'model'}: holds a model already; use --force to replace it")
    click.get_current_context().with_resource(no_empty_folders(out))
    make_folder(out)
    headings = Headings(started)

    headings.say("Flights")
    with Bar("  flights ") as bar:
        demo = demo_flights.choose(flights or find_flights(), out / "flights", speed,
                                     lambda line: click.echo(f"airtouch: {line}", err=True),
                                     lambda done, total: bar(done, total, "" if done else COMPILES))
    test, origin = demo.test, demo.origin
    click.echo(f"  {origin}: {len(demo.train)} to train on, {len(test)} held out, split by flight")
    training, left_out = demo_flights.readable(demo.train)

    headings.say(f"Training, short: {epochs} epochs, pruned, int8; thresholds from training flights")
    short = {"paper": {"epochs": epochs}, "best": {"steps": STEPS}}
    models = {name: fit(name, training, short.get(name, {})) for name in SCORED}

    headings.say("Export: C sources for the GAP8")
    export({name: models[name] for name in ("paper", "best")}, out / "model")

    headings.say("Detection on the held-out flights, through the C kernels and the C int8 network")
    results = {name: detect(name, model, test, left_out) for name, model in models.items()}
    if not results[SCORED[0]]:
        raise AirTouchError(f"no flight could be scored; the first was left out because: {left_out[0][1]}")
    scored = score_report({name: [r.score for r in of_detector] for name, of_detector in results.items()},
                          shown_flights(results, SHOWN))
    output.print_table(output.console(), scored.summaries, origin)
    for _, reason in left_out:
        click.echo(f"airtouch: {reason}", err=True)

    headings.say("Report")
    write_report(report, f"AirTouch demo: {origin}", scored,
                 parameters={f"{n}: {key}": value for n, model in models.items()
                             for key, value in registry.get(n).parameters(model).items()},
                 command=typed(), left_out=left_out, force=True)
    click.echo(f"  written: {report} (open it in a browser), {out / 'model'}")
    click.echo(f"\ndone in {time.monotonic() - started:.0f} s")


class Headings:
    """Headings with the time since the start."""

    def __init__(self, started: float) -> None:
        self.started, self.number = started, 0

    def say(self, what: str) -> None:
        """Print the next heading."""
        self.number += 1
        click.echo(f"\n[{time.monotonic() - self.started:4.0f} s] {self.number}. {what}")


def fit(name: str, training: Sequence[Any], options: dict[str, Any]) -> Any:
    """A detector's model, with a bar for its longest stage."""
    with Bar(f"  {name:8}") as bar:
        def progress(stage: str, done: int, total: int, note: str) -> None:
            if stage != "features":
                bar(done, total)

        return registry.get(name).fit(training, progress=progress, **options)


def detect(name: str, model: Any, flights: Sequence[FlightFile],
           left_out: list[tuple[Any, str]]) -> list[evaluate.Result]:
    """A detector's result on each flight; flights that cannot be scored are added to `left_out`, once."""
    outcomes: list[evaluate.Result | AirTouchError] = []
    _, failures = evaluate.evaluate(flights, registry.get(name), model, outcomes.append)
    left_out += [f for f in failures if f not in left_out]
    return [r for r in outcomes if isinstance(r, evaluate.Result)]


def export(models: dict[str, Any], folder: Path) -> None:
    """Write the model files, and the C sources generated from them, to a folder."""
    from airtouch.detector.shared import export as gap8

    folder.mkdir(exist_ok=True)
    for name, model in models.items():
        model.save(folder / f"{name}.npz", force=True)
        written = gap8.export(model, folder, f"{name}.npz", force=True)
        click.echo(f"  {folder}: {name}.npz, {', '.join(path.name for path in written)}")
