"""The whole check: a sealed set made, every flight diagnosed, the key opened, unknown effects tried, all scored.

One JSON for each case under OUT/answers: what is there is not done again.
"""

import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from airtouch.errors import AirTouchError
from airtouch.gap.diagnosis import diagnose_with_study
from airtouch.gap.flights.flight import ready_flights
from airtouch.gap.sealed import make, score
from airtouch.gap.sealed.answers import flights_in
from airtouch.gap.sealed.key import ANSWERS, SEALED, answers_sha256, open_key, sealed_in, sealed_key
from airtouch.gap.sealed.make import Say
from airtouch.gap.signatures.alike import names_alike
from airtouch.gap.study import Study
from airtouch.logs.files import read, write_bytes
from airtouch.logs.flight_log import FlightLog
from airtouch.simulation.workers.in_order import in_order
from airtouch.vehicle import load

Mapper = Callable[[Callable, Iterable], Iterable]
FLIGHTS, SEED = 480, 0  #: of a set by default
AHEAD = 4  #: flights sent to each process and not yet back; chosen
#: fields of a diagnosis that an answer has
ANSWERED = ("flights", "without", "verdict", "effects", "ranking", "indistinguishable", "gap", "shrink", "control")
DEATHS = 3  #: of local processes, after which the work goes on; chosen
#: of a local process, which `_begin` sets once: a task then carries the name of a file, and not the study
_study: Study | None = None


class Task(NamedTuple):
    """A flight to be diagnosed: its name, effects left out, and its log, or the file of that to be read where it is."""

    flight: str
    without: tuple[str, ...]
    log: FlightLog | Path


class Answer(NamedTuple):
    """The diagnosis of a flight, with effects left out, as JSON."""

    flight: str
    without: tuple[str, ...]
    text: str


def run(out: Path, flights: int | None = None, seed: int | None = None, *, workers: int = 2, unknown: int | None = None,
        mapper: Mapper | None = None, key: Path | None = None, progress: Say = lambda _: None) -> dict[str, Any]:
    """Make the set in `out` (unless it is there), diagnose it, score it: `score.figures`.

    flights, seed: of the set, FLIGHTS and SEED by default; AirTouchError is raised where a set that is there has others
    than are given. unknown: how many single flights are diagnosed once more without their effect, all by default.
    mapper: what stands in for `map` (`on_cluster.mapper`) instead of local processes; the set is made here. key: its
    path, beside the folder by default; one that cannot be read is told before any flight is diagnosed. How long it
    takes: host/docs/gap-blind.md, "Run it".
    """
    out = Path(out)
    if not (out / SEALED).exists():
        make.make(out, FLIGHTS if flights is None else flights, SEED if seed is None else seed, key=key,
                  progress=progress)
    answers = out / ANSWERS
    names = flights_in(out)
    sealed, made_with = sealed_in(out)["flights"], json.loads(sealed_key(out, key)).get("seed")
    for what, asked, there in (("flights", flights, sealed), ("seed", seed, made_with)):
        if None not in (asked, there) and asked != there:
            raise AirTouchError(f"{out}: a sealed set with {what} {there} is there, not {asked}; leave the option out, "
                                "or choose another folder")
    if len(names) != sealed:
        raise AirTouchError(f"{out}: {len(names)} flights, but {sealed} were sealed; make the set anew with "
                            "`airtouch gap blind make --force`")
    study = study_in(out)
    answer(out, answers, [(n, ()) for n in names], workers, progress, study, mapper)
    # the key is opened for these answers; effects can be withheld only when they are known
    first = [json.loads(_place(answers, n, ()).read_text()) for n in names]
    drawn = open_key(out, answers_sha256(first), key).flights
    single = [(n, drawn[n].effects[0].name) for n in names if len(drawn[n].effects) == 1]
    cases = [(n, tuple(sorted(group[0])) if (group := names_alike(e)) else (e,)) for n, e in single[:unknown]]
    answer(out, answers, cases, workers, progress, study, mapper)
    return score.score(out, answers, key)


def answer(folder: Path, answers: Path, cases: Iterable[tuple[str, tuple[str, ...]]], workers: int = 2,
           progress: Say = lambda _: None, study: Study | None = None, mapper: Mapper | None = None) -> None:
    """Diagnose flights of a set, one JSON each in `answers`; each case is a flight and effects to leave out.

    study: of the set, where it is there already; mapper: as for `run`. A local process that dies takes nothing along
    but the flights that it was at, which are done again. Raises AirTouchError where processes die again and again.
    """
    answers.mkdir(parents=True, exist_ok=True)
    cases = list(cases)
    for left in range(DEATHS, -1, -1):
        todo = _unanswered(answers, cases)
        if not todo:
            return
        study = study or study_in(folder)
        tasks = [Task(name, without, folder / f"{name}.csv.gz") for name, without in todo]
        try:
            for name, without, text in _answers(study, tasks, min(workers, len(todo)), mapper):
                write_bytes(text.encode(), _place(answers, name, without), True)
                progress(name)
        except BrokenProcessPool:
            progress(f"a process died; {left} more may")
    if _unanswered(answers, cases):
        raise AirTouchError(f"{folder}: {DEATHS + 1} processes died; is the memory full? The same command goes on")


def _unanswered(answers: Path, cases: Iterable[tuple[str, tuple[str, ...]]]) -> list[tuple[str, tuple[str, ...]]]:
    """The cases that have no file in the folder of the answers."""
    return [(name, without) for name, without in cases if not _place(answers, name, without).exists()]


def _answers(study: Study, tasks: Sequence[Task], workers: int, mapper: Mapper | None) -> Iterator[Answer]:
    """Answers as they come, in the order of the tasks, each with the file of its log.

    Local processes read the logs themselves: if a process dies while a log is written to its pipe, Python 3.11 waits
    for ever (CPython issue 94777). A file's name fits into the pipe.
    """
    if mapper is not None or workers == 1:
        yield from (mapper or map)(partial(_diagnosed, study), map(_with_log, tasks))
        return
    with ProcessPoolExecutor(workers, initializer=_begin, initargs=(study,)) as pool:
        yield from in_order(lambda task: pool.submit(with_study, task), tasks, AHEAD * workers)


def _place(answers: Path, name: str, without: tuple[str, ...]) -> Path:
    """File of the answer to one case."""
    return answers / ".".join([name, *(["without", *without] if without else []), "json"])


def study_in(folder: Path) -> Study:
    """The study of a sealed set's own vehicle and nominal flights; its scatter is measured before it is shared."""
    cal = [read(p) for p in sorted(folder.glob("cal_*.csv.gz"))]
    study = make.calibrated_study(load(folder / "vehicle.toml"), cal)
    return study if study.scatter is None else study.with_scatter(study.scatter)


def _begin(study: Study | None) -> None:
    """One study for every process: it is calibrated once."""
    global _study
    _study = study


def with_study(task: Task) -> Answer:
    """The answer to one task, in a process that `_begin` has given the study."""
    assert _study is not None
    return _diagnosed(_study, _with_log(task))


def _with_log(task: Task) -> Task:
    """The task with its log, read where it has a file."""
    return task._replace(log=read(task.log)) if isinstance(task.log, Path) else task


def _diagnosed(study: Study, task: Task) -> Answer:
    """The answer to one task, whose log is read."""
    assert isinstance(task.log, FlightLog)
    flights = list(ready_flights([task.log], study.vehicle, []))
    diagnosis = diagnose_with_study(study, flights, task.without, rank_all=False).plain()
    diagnosis |= {"flights": [task.flight], "without": list(task.without)}
    content = {k: diagnosis[k] for k in ANSWERED}
    return Answer(task.flight, task.without, json.dumps(content) + "\n")
