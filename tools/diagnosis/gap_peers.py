"""Prints diagnoses of flights made with other people's simulators, each alone: first answers, gap closed, parameters.

    python tools/diagnosis/gap_peers.py [FLIGHTS/peers] [--keep x.jsonl]    # 3 to 10 s of one core a flight

Each flight is held against the two `cal` flights of its vehicle; the diagnosis never sees the label.
Names of one thing (`alike.ALIKE`) count as one. Parameters are scored where the effect has the label's name and the
manifest's strength is a parameter of the registry's (`recordings.peers`). Its figures are in host/docs/gap-real.md.
"""

import argparse
import os
import statistics
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
import numpy as np

from airtouch import vehicle as vehicles
from airtouch.cli.shared.flights import check_data_set
from airtouch.cli.shared.progress import with_bar
from airtouch.errors import in_one_line
from airtouch.gap.diagnosis import diagnose
from airtouch.gap.result import NamedEffect
from airtouch.gap.sealed.intervals import median, share_in_groups, share_text
from airtouch.gap.sealed.score import relative_error
from airtouch.gap.signatures.alike import interchangeable
from airtouch.logs import read
from airtouch.logs.files import check_free
from recordings import peers
from recordings.folder import add_folder
from recordings.result_store import Result, add_keep_option, complete

GOAL = 0.8  #: fraction of the gap that the right effect should close (host/docs/gap-real.md)


@dataclass(frozen=True)
class PeerResult:
    """What the diagnosis says of a flight whose effect is `truth`; what --keep holds of it.

    strength: the effect's, as the manifest has it; named: effects with their fitted parameters, as text; ranked:
    likeliest effects, the likeliest first, three at most; shrink, control: fraction of the gap that the named effects
    close, and a wrong one; None where the diagnosis has none. drawn: parameters as the manifest has them; known: of
    these the ones that the diagnosis gives with an interval, as JSON, empty where it names another effect.
    """

    file: str
    truth: str
    strength: str
    verdict: str
    named: str
    ranked: Sequence[str]
    shrink: float | None
    control: float | None
    cpu_s: float
    drawn: Mapping[str, float] = field(default_factory=dict)
    known: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    def within(self, n: int) -> bool:
        """Whether the truth is among the n likeliest."""
        return any(interchangeable(name, self.truth) for name in self.ranked[:n])

    def row(self) -> str:
        """The flight's line of the table."""
        shrink, control = ("" if x is None else f"{x:.2f}" for x in (self.shrink, self.control))
        return (f"| {self.truth} | {self.strength} | {self.verdict} | {self.named} | {shrink} | {control} | "
                f"{self.cpu_s:.0f} |")


def diagnose_flight(folder: Path, label: peers.Row) -> PeerResult:
    """The result of one labelled flight."""
    began = time.process_time()
    diagnosis = diagnose([read(folder / label["file"])], vehicles.load(peers.vehicle_file(folder, label)),
                         [read(path) for path in peers.baseline(folder, label)])
    drawn, true_name = peers.true_parameters(label), peers.truth(label)
    parameters = next((e.parameters for e in diagnosis.effects if e.name == true_name and is_same_rotor(e, drawn)), {})
    known = {k: {"value": q.value, "low": q.low, "high": q.high} for k, q in parameters.items()
             if k in drawn and q.low is not None and q.high is not None}
    named = "; ".join(f"{e.name} " + ", ".join(f"{k} {q.value:.3g}" for k, q in e.parameters.items()
                                               if q.low is not None) for e in diagnosis.effects)
    return PeerResult(
        label["file"], true_name, f"{float(label['strength']):.3g} {label['unit'].split(',')[0][:24]}",
        diagnosis.verdict, named, [r.name for r in diagnosis.ranking[:3]],
        None if diagnosis.shrink is None else diagnosis.shrink.value,
        None if diagnosis.control is None else diagnosis.control.closure.shrink.value, time.process_time() - began,
        drawn, known)


def is_same_rotor(effect: NamedEffect, drawn: Mapping[str, float]) -> bool:
    """Whether an effect that is named is of the rotor that was drawn, if the manifest has one."""
    return "rotor" not in drawn or effect.parameters["rotor"].value == drawn["rotor"]


def summary(results: Sequence[PeerResult]) -> str:
    """Lines with the counts of right answers, and with parameters and gap closed where the first answer is right."""
    first, three = (sum(r.within(n) for r in results) for n in (1, 3))
    n = len(results)
    text = f"first answer {share_text(first, n)}; first three {share_text(three, n)} (95 % intervals)"
    text += _parameters([r for r in results if r.within(1) and r.known])
    right = [r for r in results if r.within(1) and r.shrink is not None]
    if not right:
        return text
    shrinks = [r.shrink for r in right if r.shrink is not None]
    controls = [r.control for r in right if r.control is not None]
    return (f"{text}\ngap closed with the right effect: median {statistics.median(shrinks):.2f}, "
            f">= {GOAL:.2f} in {sum(s >= GOAL for s in shrinks)} of {len(shrinks)}"
            + (f"; with a wrong one at most {max(controls):.2f}" if controls else ""))


def _parameters(right: Sequence[PeerResult]) -> str:
    """A line on the parameters of right answers, as of a sealed set: median error, share within 90 % intervals."""
    scored = [(r, off) for r in right if (off := relative_error(r.truth, r.drawn, r.known)) is not None]
    if not scored:
        return ""
    within = [[q["low"] <= r.drawn[k] <= q["high"] for k, q in r.known.items()] for r, _ in scored]
    error, held = median(np.array([off for _, off in scored])), share_in_groups(within)
    return (f"\nparameters: median error {error['value']:.1%} [{error['low']:.1%}, {error['high']:.1%}] in "
            f"{error['n']} flights; in their 90 % interval {held['hits']} of {held['n']} [{held['low']:.0%}, "
            f"{held['high']:.0%}]")


def main() -> None:
    """Diagnose every labelled flight of the set and print a table with the counts of right answers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_folder(parser, "peers")
    add_keep_option(parser)
    options = parser.parse_args()
    folder: Path = options.folder
    check_data_set(folder)
    check_free(options.keep, force=True)

    def run(todo: list[peers.Row]) -> Iterator[Result]:
        """The results of some flights, with a bar of progress."""
        return (asdict(diagnose_flight(folder, label)) for label in with_bar(todo, "diagnosing"))

    labels = {label["file"]: label for label in peers.labelled(folder)}
    results = [PeerResult(**r) for r in complete(labels, run, lambda result: result["file"], options.keep)]
    print("| effect | strength | verdict | named | gap closed | with a wrong effect | CPU s "
          "|\n|---|---|---|---|---|---|---|")
    print("\n".join(result.row() for result in results))
    print(f"\n{summary(results)}")


if __name__ == "__main__":
    with in_one_line("gap_peers"):
        main()
