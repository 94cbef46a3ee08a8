"""The whole check: a sealed set made, every flight diagnosed, the key opened, unknown effects tried, all scored.

One JSON for each case under OUT/answers: what is there is not done again.
"""

import hashlib
import json
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

from airtouch.gap import blind, blind_score, measure
from airtouch.gap.blind_draw import KINDS
from airtouch.gap.candidates import twins_of
from airtouch.gap.data import Study
from airtouch.gap.diagnose import brief
from airtouch.logs.files import read, write_bytes
from airtouch.vehicle import load

Say = Callable[[str], None]
_study: Study | None = None


def run(out: Path, flights: int = 480, seed: int = 0, *, workers: int = 2, unknown: int | None = None,
        kinds: Iterable[str] | None = None, progress: Say = lambda _: None) -> dict[str, Any]:
    """Make the set in `out` (unless it is there), diagnose it, score it: `blind_score.figures`.

    unknown: how many single flights are diagnosed once more without their effect, all by
    default. Takes about 2 s of one core for each flight, once more for each single one.
    """
    out = Path(out)
    if not (out / "sealed.json").exists():
        blind.make(out, flights, seed, kinds=list(kinds) if kinds else None, progress=progress)
    answers = out / "answers"
    names = sorted(p.name[:-7] for p in out.glob("flight_*.csv.gz"))
    study = _study_in(out)
    answer(out, answers, [(n, ()) for n in names], workers, progress, study)
    first = sorted(answers.glob("flight_????.json"))
    # the key is opened for the answers above; effects can be withheld only when they are known
    sealed = hashlib.sha256(json.dumps([json.loads(p.read_text()) for p in first], sort_keys=True).encode()).hexdigest()
    key = blind.open_key(out, sealed)["answers"]
    single = [(n, key[n]["effects"][0]["name"]) for n in names if len(key[n]["effects"]) == 1]
    cases = [(n, tuple(sorted(group[0])) if (group := twins_of(e)) else (e,)) for n, e in single[:unknown]]
    answer(out, answers, cases, workers, progress, study)
    return blind.score(out, answers)


def answer(folder: Path, answers: Path, cases: Iterable[tuple[str, tuple[str, ...]]], workers: int = 2,
           progress: Say = lambda _: None, study: Study | None = None) -> None:
    """Diagnose flights of a set, one JSON each in `answers`; each case is a flight and effects to leave out.

    study: of the set, where it is there already.
    """
    answers.mkdir(parents=True, exist_ok=True)
    todo = [(folder, answers, name, without) for name, without in cases if not _place(answers, name, without).exists()]
    study = study or (_study_in(folder) if todo else None)
    if workers == 1 or len(todo) < 3:
        _begin(study)
        for case in todo:
            progress(_diagnose(case))
        return
    with ProcessPoolExecutor(workers, initializer=_begin, initargs=(study,)) as pool:
        for name in pool.map(_diagnose, todo, chunksize=2):
            progress(name)


def _place(answers: Path, name: str, without: tuple[str, ...]) -> Path:
    return answers / ".".join([name, *(["without", *without] if without else []), "json"])


def _study_in(folder: Path) -> Study:
    return blind.study_of(load(folder / "vehicle.toml"), [read(p) for p in sorted(folder.glob("cal_*.csv.gz"))])


def _begin(study: Study | None) -> None:
    """One study for every process: it is calibrated once."""
    global _study
    _study = study


def _diagnose(case: tuple[Path, Path, str, tuple[str, ...]]) -> str:
    folder, answers, name, without = case
    flights = list(measure.usable([read(folder / f"{name}.csv.gz")], _study.vehicle, []))
    found = brief(_study, flights, without).plain() | {"flights": [name], "without": list(without)}
    content = {k: found[k] for k in ("flights", "without", "verdict", "effects", "ranking", "indistinguishable",
                                     "gap", "shrink", "control")}
    write_bytes((json.dumps(content) + "\n").encode(), _place(answers, name, without), True)
    return name


__all__ = ["KINDS", "answer", "blind_score", "run"]
