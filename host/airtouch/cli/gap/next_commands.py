"""The commands that a diagnosis advises, with the names that the command line gave."""

import shlex
from collections.abc import Sequence
from dataclasses import replace

from airtouch.gap.result import Diagnosis
from airtouch.vehicle import FILE

MOST_NAMES = 4  #: names that are written out in place of REAL or NOMINAL...; no source: fits a line


def with_names(diagnosis: Diagnosis, vehicle: str | None, real: Sequence[str], baseline: Sequence[str]) -> Diagnosis:
    """The diagnosis with the vehicle, flights and baseline flights as given in its advised commands.

    Where there are none, or more than MOST_NAMES, the placeholder stays. Every other word stays.
    """
    names_of = {"REAL": list(real), "NOMINAL...": list(baseline), FILE: [vehicle] if vehicle else []}

    def command(line: str) -> str:
        words: list[str] = []
        for word in shlex.split(line):
            names = names_of.get(word, [])
            words += names if 0 < len(names) <= MOST_NAMES else [word]
        return shlex.join(words)

    return replace(diagnosis, next=tuple(replace(step, command=command(step.command)) for step in diagnosis.next))
