"""Results of a long run, kept in a file of JSON lines: the next run does only what the file does not hold."""

import argparse
from collections.abc import Callable, Hashable, Iterable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from airtouch.logs import json_lines

K = TypeVar("K", bound=Hashable)
T = TypeVar("T")
Result = dict[str, Any]  #: JSON-ready
REFUSED = "refused"  #: verdict of a flight that the diagnosis refuses; such a result is not kept


def add_keep_option(parser: argparse.ArgumentParser, more: str = "", *other_names: str) -> None:
    """Add the option --keep. more: for its help text; other_names: under which it is known too."""
    parser.add_argument("--keep", *other_names, type=Path, metavar="FILE",
                        help=f"{more}JSON lines, made if not there; results that it holds are not computed again, new "
                             "ones are appended")


def complete(tasks: Mapping[K, T], run: Callable[[list[T]], Iterable[Result]], key: Callable[[Result], K],
             store: Path | None) -> list[Result]:
    """The result of each task, in their order: from the file `store` or, where it has none, by `run`.

    tasks: by their keys; run: the results of some tasks, in any order, each of which is appended as soon as it is
    there; key: of the task that a result is of.
    """
    result_of = {key(r): r for r in json_lines.read(store) if r.get("verdict") != REFUSED}
    for result in run([task for name, task in tasks.items() if name not in result_of]):
        result_of[key(result)] = result
        if result.get("verdict") != REFUSED:
            json_lines.append(store, [result])
    return [result_of[name] for name in tasks]
