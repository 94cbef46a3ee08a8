"""Prints diagnoses of flights made with other people's simulators, each alone: top-1, top-3, shrink.

    python tools/diagnosis/gap_peers.py [FLIGHTS/peers]    # 8 to 28 s of one core for each flight

Each case is held against the two `cal` flights of its vehicle; the diagnosis never sees the label.
Names of one thing (`alike.ALIKE`) count as one. Its figures are in host/docs/gap-real.md.
"""

import argparse
import os
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
from airtouch import vehicle as vehicles
from airtouch.cli.shared.flights import check_data_set
from airtouch.errors import in_one_line
from airtouch.gap.diagnosis import diagnose
from airtouch.gap.result import Diagnosis
from airtouch.gap.sealed.intervals import share_text
from airtouch.gap.signatures.alike import interchangeable
from airtouch.logs import read
from recordings import peers
from recordings.folder import add_folder

GOAL = 0.8  #: fraction of the gap that the right effect should close (host/docs/gap-real.md)


@dataclass(frozen=True)
class Answer:
    """What a diagnosis says of a flight whose effect is `truth`.

    ranked: likeliest effects, the likeliest first, three at most; shrink, control: fraction of the gap that the named
    effects close, and a wrong one; None where the diagnosis has none.
    """

    truth: str
    ranked: tuple[str, ...]
    shrink: float | None
    control: float | None

    def within(self, n: int) -> bool:
        """Whether the truth is among the n likeliest."""
        return any(interchangeable(name, self.truth) for name in self.ranked[:n])


def answer_of(diagnosis: Diagnosis, truth: str) -> Answer:
    """The answer in a diagnosis."""
    return Answer(truth, tuple(r.name for r in diagnosis.ranking[:3]),
                  None if diagnosis.shrink is None else diagnosis.shrink.value,
                  None if diagnosis.control is None else diagnosis.control.closure.shrink.value)


def summary(answers: Sequence[Answer]) -> str:
    """Lines with the counts of right answers, and with the gap closed where the first answer is right."""
    top_1, top_3 = (sum(a.within(n) for a in answers) for n in (1, 3))
    text = f"top-1 {share_text(top_1, len(answers))}; top-3 {share_text(top_3, len(answers))} (95 % intervals)"
    right = [a for a in answers if a.within(1) and a.shrink is not None]
    if not right:
        return text
    shrinks = sorted(a.shrink for a in right if a.shrink is not None)
    controls = [a.control for a in right if a.control is not None]
    return (f"{text}\nshrink with the right effect: median {shrinks[len(shrinks) // 2]:.2f}, "
            f">= {GOAL:.2f} in {sum(s >= GOAL for s in shrinks)} of {len(shrinks)}"
            + (f"; with a wrong one at most {max(controls):.2f}" if controls else ""))


def row(label: peers.Row, diagnosis: Diagnosis, answer: Answer, seconds: float) -> str:
    """A flight's line of the table."""
    effects = "; ".join(f"{e.name} " + ", ".join(f"{k} {q.value:.3g}" for k, q in e.parameters.items()
                                                 if q.low is not None) for e in diagnosis.effects)
    shrink, control = ("" if x is None else f"{x:.2f}" for x in (answer.shrink, answer.control))
    return (f"| {answer.truth} | {float(label['strength']):.3g} {label['unit'].split(',')[0][:24]} | "
            f"{diagnosis.verdict} | {effects} | {shrink} | {control} | {seconds:.0f} |")


def main() -> None:
    """Diagnose every labelled flight of the set and print a table with the counts of right answers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_folder(parser, "peers")
    folder: Path = parser.parse_args().folder
    check_data_set(folder)
    print("| effect | strength | verdict | named | shrink | with a wrong effect | CPU s "
          "|\n|---|---|---|---|---|---|---|")
    answers = []
    for label in peers.labelled(folder):
        began = time.process_time()
        diagnosis = diagnose([read(folder / label["file"])], vehicles.load(peers.vehicle_file(folder, label)),
                             [read(path) for path in peers.baseline(folder, label)])
        answers.append(answer_of(diagnosis, peers.truth(label)))
        print(row(label, diagnosis, answers[-1], time.process_time() - began), flush=True)
    print(f"\n{summary(answers)}")


if __name__ == "__main__":
    with in_one_line("gap_peers"):
        main()
