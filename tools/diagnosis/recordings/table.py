"""The table of `gap_real.py`: what each diagnosis says first, counts by row and truth, lift, CrazyPAD's figures.

A case is a dict: row, truth, condition, flight and, from its diagnosis, verdict, effects and seconds.
"""

from collections import Counter, defaultdict
from pathlib import Path

import numpy as np

from airtouch.gap.sealed.intervals import share_text
from airtouch.gap.signatures.alike import interchangeable

from . import swarm_lift
from .crazypad import figures as crazypad

COMES_AND_GOES = ("gust", "wind", "downwash")  #: names that say so of the fan, where they have seconds


def answer(case: dict) -> str:
    """What a diagnosis says first, in the words of its row's truths."""
    if case["row"] == "crazypad":
        return crazypad.answer(case)[0]
    if case["verdict"] != "effect":
        return case["verdict"]
    first = case["effects"][0]
    if case["row"] == "fan" and first["name"] in COMES_AND_GOES and first.get("seconds"):
        return "comes and goes"
    if case["row"] == "peers" and interchangeable(first["name"], case["truth"]):
        return case["truth"]
    return first["name"]


def counts(cases: list[dict]) -> dict[tuple[str, str], Counter[str]]:
    """(row, truth) -> count of each answer. A row of neural-swarm's and of nominal flights has a condition.

    Of the peers, whose flights each have an effect of their own, answers that are right count together as "right".
    """
    table: dict[tuple[str, str], Counter[str]] = defaultdict(Counter)
    for c in cases:
        kind = f"{c['row']}, {c['condition']}" if c["row"] in ("swarm", "nominal") else c["row"]
        peers = c["row"] == "peers"
        word = "right" if peers and answer(c) == c["truth"] else answer(c)
        table[kind, "any effect" if peers else c["truth"]][word] += 1
    return table


def line(row: str, truth: str, answers: Counter[str]) -> str:
    """A line of the table: hits, their fraction with its 95 % interval, every answer, the most frequent first."""
    hits = answers["right" if row == "peers" else truth]
    counted = ", ".join(f"{name} {k}" for name, k in sorted(answers.items(), key=lambda x: -x[1]))
    return f"| {row} | {truth} | {share_text(hits, answers.total())} | {counted} |"


def print_table(cases: list[dict], folder: Path) -> None:
    """Print a line for each row and truth, neural-swarm's lift, times, CrazyPAD's figures. folder: the flights."""
    print("| flights | truth | right | every answer |\n|---|---|---|---|")
    for (row, truth), answers in sorted(counts(cases).items()):
        print(line(row, truth, answers))
    near = [swarm_lift.close(c, folder / "neuralswarm") for c in cases
            if (c["row"], c["truth"]) == ("swarm", "ground_effect")]
    if near:
        print(f"neural-swarm, lift within {swarm_lift.CLOSE:.0%} of the measured at 2 and 4 cm: "
              f"{share_text(sum(near), len(near))}")
    seconds = [c["seconds"] for c in cases if "seconds" in c]
    if seconds:
        middle, most = np.quantile(seconds, [0.5, 0.9])
        print(f"{len(seconds)} diagnoses: {middle:.0f} s in the middle, {most:.0f} s at most in nine of ten")
    pads = [{**c, "drone": c["flight"].split("_")[-2]} for c in cases if c["row"] == "crazypad"]
    if pads:
        figures = {"family, balanced": crazypad.balanced_accuracy,
                   "only damaged rotors named": crazypad.only_damaged_rotors,
                   "severity, Spearman": crazypad.severity}
        for text, figure in figures.items():
            low, high = crazypad.interval(pads, figure)
            print(f"CrazyPAD, {len(pads)} flights: {text} {figure(pads):.2f} (90 % interval {low:.2f} to {high:.2f})")
