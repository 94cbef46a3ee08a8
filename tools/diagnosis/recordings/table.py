"""The table of `gap_real.py`: what each diagnosis says first, counts by row and truth, lift, CrazyPAD's figures.

A result is a dict: row, truth, condition, flight and, from its diagnosis, verdict, effects and seconds.
"""

from collections import Counter, defaultdict
from pathlib import Path

import numpy as np

from airtouch.gap.sealed.intervals import share_text
from airtouch.gap.signatures.alike import interchangeable

from . import swarm_lift
from .crazypad import figures as crazypad
from .crazypad import labels
from .result_store import Result

COMES_AND_GOES = ("gust", "wind", "downwash")  #: names that say so of the fan, where they have seconds


def answer(result: Result) -> str:
    """What a diagnosis says first, in the words of its row's truths; `refused` where it refuses the flight."""
    if result["row"] == "crazypad":
        return crazypad.answer(result)
    if result["verdict"] != "effect":
        return result["verdict"]
    first = result["effects"][0]
    if result["row"] == "fan" and first["name"] in COMES_AND_GOES and first.get("seconds"):
        return "comes and goes"
    if result["row"] == "peers" and interchangeable(first["name"], result["truth"]):
        return result["truth"]
    return first["name"]


def counts(results: list[Result]) -> dict[tuple[str, str], Counter[str]]:
    """(row, truth) -> count of each answer. A row of neural-swarm's and of nominal flights has a condition.

    Of the peers, whose flights each have an effect of their own, answers that are right count together as "right".
    """
    table: dict[tuple[str, str], Counter[str]] = defaultdict(Counter)
    for r in results:
        kind = f"{r['row']}, {r['condition']}" if r["row"] in ("swarm", "nominal") else r["row"]
        peers = r["row"] == "peers"
        word = "right" if peers and answer(r) == r["truth"] else answer(r)
        table[kind, "any effect" if peers else r["truth"]][word] += 1
    return table


def line(row: str, truth: str, answers: Counter[str]) -> str:
    """A line of the table: hits, their fraction with its 95 % interval, every answer, the most frequent first."""
    hits = answers["right" if row == "peers" else truth]
    counted = ", ".join(f"{name} {k}" for name, k in sorted(answers.items(), key=lambda x: -x[1]))
    return f"| {row} | {truth} | {share_text(hits, answers.total())} | {counted} |"


def print_table(results: list[Result], folder: Path) -> None:
    """Print a line for each row and truth, neural-swarm's lift, times, CrazyPAD's figures. folder: the flights."""
    print("| flights | truth | right | every answer |\n|---|---|---|---|")
    for (row, truth), answers in sorted(counts(results).items()):
        print(line(row, truth, answers))
    near = [swarm_lift.close(r, folder / "neuralswarm") for r in results
            if (r["row"], r["truth"]) == ("swarm", "ground_effect")]
    if near:
        print(f"neural-swarm, lift within {swarm_lift.CLOSE:.0%} of the measured at 2 and 4 cm: "
              f"{share_text(sum(near), len(near))}")
    seconds = [r["seconds"] for r in results if "seconds" in r]
    if seconds:
        middle, most = np.quantile(seconds, [0.5, 0.9])
        print(f"{len(seconds)} diagnoses: {middle:.0f} s in the middle, {most:.0f} s at most in nine of ten")
    pads = [r for r in results if r["row"] == "crazypad"]
    if pads:
        drone_of = {row["file"]: row["drone"] for row in labels.manifest(folder / "crazypad", "all")}
        pads = [{**r, "drone": drone_of[r["flight"]]} for r in pads]
        figures = {"family, balanced": crazypad.balanced_accuracy,
                   "only damaged rotors named": crazypad.only_damaged_rotors,
                   "severity, Spearman": crazypad.severity}
        for text, figure in figures.items():
            print(f"CrazyPAD, {len(pads)} flights: {text} "
                  + crazypad.with_interval(pads, figure, label="90 % interval "))
