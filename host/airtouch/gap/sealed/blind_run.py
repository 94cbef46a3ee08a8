"""The whole check: a sealed set made, every flight diagnosed, the key opened, unknown effects tried, all scored.

One JSON for each case under OUT/answers: what is there is not done again.
"""

import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from pathlib import Path
from typing import Any

from airtouch.errors import AirTouchError
from airtouch.gap.diagnosis import diagnose_with_study
from airtouch.gap.flights.flight import ready_flights
from airtouch.gap.sealed import blind, blind_score
from airtouch.gap.sealed.blind import Say
from airtouch.gap.sealed.blind_key import SEALED, answers_sha256, open_key
from airtouch.gap.signals.study import Study
from airtouch.gap.signatures.alike import names_alike
from airtouch.logs.files import read, write_bytes
from airtouch.logs.flight_log import FlightLog
from airtouch.simulation.workers.in_order import in_order
from airtouch.vehicle import load

Mapper = Callable[[Callable, Iterable], Iterable]
Task = tuple[str, tuple[str, ...], FlightLog]  #: name of a flight, effects left out, its log
TaskFile = tuple[str, tuple[str, ...], Path]  #: the same with the log's file
Answer = tuple[str, tuple[str, ...], str]  #: name of a flight, effects left out, the diagnosis as JSON
AHEAD = 4  #: flights sent to each process and not yet back; chosen
#: fields of a diagnosis that an answer has
ANSWERED = ("flights", "without", "verdict", "effects", "ranking", "indistinguishable", "gap", "shrink", "control")
DEATHS = 3  #: of local processes, after which the work goes on; chosen
#: of a local process, which `_begin` sets once: a task then carries the name of a file, and not the study
_study: Study | None = None


def run(out: Path, flights: int = 480, seed: int = 0, *, workers: int = 2, unknown: int | None = None,
        mapper: Mapper | None = None, progress: Say = lambda _: None) -> dict[str, Any]:
    """Make the set in `out` (unless it is there), diagnose it, score it: `blind_score.figures`.

    unknown: how many single flights are diagnosed once more without their effect, all by default. mapper: what
    stands in for `map` (`on_cluster.mapper`) instead of local processes; the set is made here. Takes about 4 s of
    one core for each flight, once more for each single one.
    """
    out = Path(out)
    if not (out / SEALED).exists():
        blind.make(out, flights, seed, progress=progress)
    answers = out / "answers"
    names = sorted(p.name.removesuffix(".csv.gz") for p in out.glob("flight_*.csv.gz"))
    study = study_in(out)
    answer(out, answers, [(n, ()) for n in names], workers, progress, study, mapper)
    # the key is opened for these answers; effects can be withheld only when they are known
    first = [json.loads(_place(answers, n, ()).read_text()) for n in names]
    key = open_key(out, answers_sha256(first))["answers"]
    single = [(n, key[n]["effects"][0]["name"]) for n in names if len(key[n]["effects"]) == 1]
    cases = [(n, tuple(sorted(group[0])) if (group := names_alike(e)) else (e,)) for n, e in single[:unknown]]
    answer(out, answers, cases, workers, progress, study, mapper)
    return blind_score.score(out, answers)


def answer(folder: Path, answers: Path, cases: Iterable[tuple[str, tuple[str, ...]]], workers: int = 2,
           progress: Say = lambda _: None, study: Study | None = None, mapper: Mapper | None = None) -> None:
    """Diagnose flights of a set, one JSON each in `answers`; each case is a flight and effects to leave out.

    study: of the set, where it is there already; mapper: as for `run`. A local process that dies takes nothing along
    but the flights that it was at, which are done again. Raises AirTouchError where processes die again and again.
    """
    answers.mkdir(parents=True, exist_ok=True)
    cases = list(cases)
    for left in range(DEATHS, -1, -1):
        todo = [(name, without) for name, without in cases if not _place(answers, name, without).exists()]
        if not todo:
            return
        study = study or study_in(folder)
        files = [(name, without, folder / f"{name}.csv.gz") for name, without in todo]
        try:
            for name, without, text in _answers(study, files, min(workers, len(todo)), mapper):
                write_bytes(text.encode(), _place(answers, name, without), True)
                progress(name)
        except BrokenProcessPool:
            progress(f"a process died; {left} more may")
    raise AirTouchError(f"{folder}: {DEATHS + 1} processes died; is the memory full? The same command goes on")


def _answers(study: Study, files: Sequence[TaskFile], workers: int, mapper: Mapper | None) -> Iterator[Answer]:
    """Answers as they come, in the order of the flights.

    Local processes read the logs themselves: if a process dies while a log is written to its pipe, Python 3.11 waits
    for ever (CPython issue 94777). A file's name fits into the pipe.
    """
    if mapper is not None or workers == 1:
        logs = ((name, without, read(path)) for name, without, path in files)
        yield from (mapper or map)(partial(_diagnosed, study), logs)
        return
    with ProcessPoolExecutor(workers, initializer=_begin, initargs=(study,)) as pool:
        yield from in_order(lambda case: pool.submit(with_study, case), files, AHEAD * workers)


def _place(answers: Path, name: str, without: tuple[str, ...]) -> Path:
    """File of the answer to one case."""
    return answers / ".".join([name, *(["without", *without] if without else []), "json"])


def study_in(folder: Path) -> Study:
    """The study that a sealed set's own vehicle and nominal flights give."""
    return blind.study_of(load(folder / "vehicle.toml"), [read(p) for p in sorted(folder.glob("cal_*.csv.gz"))])


def _begin(study: Study | None) -> None:
    """One study for every process: it is calibrated once."""
    global _study
    _study = study


def with_study(case: TaskFile) -> Answer:
    """The answer to one case, in a process that `_begin` has given the study."""
    assert _study is not None
    name, without, path = case
    return _diagnosed(_study, (name, without, read(path)))


def _diagnosed(study: Study, case: Task) -> Answer:
    """Name, effects left out, and the diagnosis as JSON."""
    name, without, log = case
    diagnosis = diagnose_with_study(study, list(ready_flights([log], study.vehicle, [])), without).plain()
    diagnosis |= {"flights": [name], "without": list(without)}
    content = {k: diagnosis[k] for k in ANSWERED}
    return name, without, json.dumps(content) + "\n"
