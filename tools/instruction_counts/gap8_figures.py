"""Prints what each network costs on the GAP8 and what it is worth, as a Markdown table, beside the paper's figures.

    python -m tools.instruction_counts.gap8_figures [FLIGHTS] [--out out/gap8] [--counts]

Costs come from emulators, 45 s in all. Accuracy and edge error come from five folds by flight; folds that are done are
kept in --out and not trained again (about seven minutes a row on two cores). --counts leaves them out.
"""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import click
import numpy as np

from airtouch.cli.shared.flights import need_flights
from airtouch.detector import paper, registry
from airtouch.detector.best.export import golden_flight
from airtouch.detector.evaluation import crossval, evaluate, summary
from airtouch.detector.evaluation.bootstrap import resampled
from airtouch.detector.evaluation.data import dataset
from airtouch.detector.evaluation.data.dataset import FlightFile
from airtouch.detector.evaluation.score import FlightScore
from airtouch.detector.paper import export
from airtouch.errors import in_one_line
from airtouch.kernels.network import arena_bytes, parameter_bytes
from airtouch.kernels.rolling import rolling_size
from airtouch.kernels.stream import arena_bytes as stream_arena_bytes
from airtouch.logs.files import write_bytes
from airtouch.reference.networks.int8_network import multiplications, rolling_multiplications

from . import gap8
from .build import ROOT

RESAMPLES = 2000  #: bootstrap samples over flights; no source: round number


@dataclass(frozen=True)
class Row:
    """A network: detector and arguments of its fit; shipped: whether its shipped model is counted."""

    name: str
    detector: str
    options: dict[str, Any] = field(default_factory=dict)
    shipped: bool = True


#: networks of the table
ROWS = (Row("`paper`, no zeros", "paper", {"sparsity": 0.0}, shipped=False),
        Row("`paper`, 80 % zeros (shipped)", "paper"),
        Row("`paper`, 90 % zeros", "paper", {"sparsity": 0.9}, shipped=False),
        Row("`paper-stream`, 96 and 80 % zeros", "paper-stream"),
        Row("`best`, 50 % zeros", "best"))
#: What the paper states (sections 5.3 and 7): 14,375 bytes, 1.10 ms an inference; its split of windows leaks.
PAPER = "| paper's own, as published | 14,375 | | | 0.27 M | | | 1.10 ms at 175 MHz = 193 k | | | | |"
#: heads of the table's columns
COLUMNS = ("network",
           "parameters, bytes",
           "flash, bytes",
           "L1, bytes",
           "MAC a 10 ms sample",
           "rv32imc instructions a sample, mean / worst",
           "XPULP cycles a window, 1 core",
           "8 cores",
           "balanced, float / int8, %",
           "edge error, float / int8, mm",
           "int8 more than float on edges that both find, mm",
           "missed, float / int8, %")
#: the table's first two lines
HEAD = f"| {' | '.join(COLUMNS)} |\n{'|---' * len(COLUMNS)}|"


def cost(row: Row, model: Any) -> dict[str, Any]:
    """Bytes, multiplications, instructions and cycles of a model."""
    chip = gap8.compile_model(model)
    network = model.int8
    figures: dict[str, Any] = {"parameters": parameter_bytes(network), "flash": chip.flash_bytes}
    if chip.kind == "stream":
        run = gap8.stream(chip, golden_flight(network)[0][:200])
        arena, columns = stream_arena_bytes(network), network.channels
        figures["mac"] = network.multiplications / network.stride
    elif chip.kind == "rolling":
        stride = paper.stride(model)
        run = gap8.rolling(chip, export.golden_samples(network, stride)[0][:200], stride)
        arena, columns = rolling_size(network, stride).arena_bytes, network.input_shape[1]
        figures["mac"] = rolling_multiplications(network, stride)
    else:
        run = gap8.windows(chip, export.golden_vectors(network)[0])
        figures["mac"] = multiplications(network)
        arena, columns = arena_bytes(network), int(np.prod(network.input_shape))
    figures |= {"instructions": float(run.instructions.mean()), "worst": int(run.instructions.max()),
                "stack": run.stack,
                "l1": chip.constant_bytes + arena + columns + run.stack}
    if chip.kind != "stream":
        cluster = gap8.compile_model(model, gap8.XPULP)
        window = export.golden_vectors(network)[0][0]
        for cores in (1, 8):
            cycles, _ = gap8.team_cycles(cluster, window, cores)
            figures[f"cycles_{cores}"], figures[f"branching_{cores}"] = cycles.looped, cycles.cycles
    return figures


def worth(row: Row, files: list[FlightFile], out: Path) -> tuple[dict[str, Any], Any]:
    """Figures over the folds, int8 and float, and the first fold's model."""
    detector: Any = registry.get(row.detector)  # which has run_float as well

    def tell(line: str) -> None:
        """Print a line about the row to standard error."""
        click.echo(f"{row.name}: {line}", err=True)

    validation = crossval.crossval(row.detector, files, out, crossval.Settings(options=row.options), tell=tell)
    models: dict[Any, Any] = {fold.fold: detector.load(out / fold.model) for fold in validation.folds}
    cache = out / f"float_{Path(validation.folds[0].model).stem}.json"
    if not cache.exists():
        tell("the same models in float")
        float_detector = registry.InFloatOnly(detector)
        readable, _ = crossval.readable_flights(files)
        exact = [evaluate.evaluate_flight(f, readable[f.path], float_detector, models[f.condition.fold]).score
                 for f in files if f.path in readable]
        write_bytes(json.dumps([score.as_dict() for score in exact]).encode(), cache, force=True)
    exact = [FlightScore.from_dict(entry) for entry in json.loads(cache.read_text())]
    return {"int8": summary.summarise(validation.scores), "float": summary.summarise(exact),
            "more_m": more_error(validation.scores, exact)}, models[min(models)]


def more_error(scores: list[FlightScore], exact: list[FlightScore]) -> tuple[float, float, float, int]:
    """How much larger |error| of the first is on edges that both detect, m: mean, its 95 % interval, number of edges.

    The interval is by bootstrap over flights.
    """
    other = {score.file: score for score in exact}
    flights = [[abs(a.error_m) - abs(b.error_m) for a, b in zip(score.edges, other[score.file].edges, strict=True)
                if a.error_m is not None and b.error_m is not None] for score in scores]
    sums, counts = np.array([sum(f) for f in flights]), np.array([len(f) for f in flights])
    low, high = resampled(lambda pick: sums[pick].sum() / max(counts[pick].sum(), 1), len(flights),
                          replicates=RESAMPLES, level=0.95)
    return sums.sum() / max(counts.sum(), 1), low, high, int(counts.sum())


def line(row: Row, costs: dict[str, Any], figures: dict[str, Any] | None) -> str:
    """One row of the table."""
    step = f"{costs['instructions']:,.0f} / {costs['worst']:,}"
    cycles = [f"{costs[f'cycles_{n}']:,} ({costs[f'branching_{n}']:,})" if f"cycles_{n}" in costs else ""
              for n in (1, 8)]
    cells = [row.name, f"{costs['parameters']:,}", f"{costs['flash']:,}", f"{costs['l1']:,}", f"{costs['mac']:,.0f}",
             step, *cycles]
    if figures:
        mean, low, high, edges = figures["more_m"]
        cells += [_pair(figures, "balanced_accuracy", 100), _pair(figures, "mean_abs_error_m", 1000),
                  f"{1000 * mean:+.1f} [{1000 * low:.1f}, {1000 * high:.1f}], n = {edges}",
                  _pair(figures, "missed", 100)]
    else:
        cells += [""] * 4
    return "| " + " | ".join(cells) + " |"


def _pair(figures: dict[str, Any], key: str, factor: float) -> str:
    """A figure of the float and of the int8 network, with the interval of the latter."""
    low, high = figures["int8"]["intervals"][key]
    values = [f"{factor * figures[kind][key]:.1f}" for kind in ("float", "int8")]
    return f"{' / '.join(values)} [{factor * low:.0f}, {factor * high:.0f}]"


@click.command()
@click.argument("folder", required=False, type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), default=ROOT / "out" / "gap8",
              help="Where finished folds are kept.")
@click.option("--counts", is_flag=True, help="Costs of the shipped models only: no flights, no training.")
def main(folder: Path | None, out: Path, counts: bool) -> None:
    """Print the table."""
    files = [] if counts else dataset.collect([need_flights(folder)])
    lines, raw = [HEAD, PAPER], {}
    for row in ROWS:
        if counts and not row.shipped:
            continue
        figures, model = (None, None) if counts else worth(row, files, out)
        costs = cost(row, registry.get(row.detector).load(None) if row.shipped else model)
        lines.append(line(row, costs, figures))
        raw[row.name] = {**costs, **({} if figures is None else figures)}
    click.echo("\n".join(lines))
    if not counts:
        write_bytes(json.dumps(raw, indent=1).encode(), out / "figures.json", force=True)


if __name__ == "__main__":
    with in_one_line("gap8_figures"):
        main()
