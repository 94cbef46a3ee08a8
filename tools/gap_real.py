"""Diagnoses recorded and other people's simulated flights, each row of the table in host/docs/gap-real.md.

    python tools/gap_real.py [FLIGHTS] [--part build|view|all] [--rows authors swarm ...] [--jobs 2] [--keep x.jsonl]
    python tools/gap_real.py --quick    # a few flights of each row; fails where the diagnosis is broken

build: the flights on which settings may be chosen: the authors' folds 0 to 2, neural-swarm's days 19 and 20, three of
CrazyPAD's conditions in four. view: the rest, of which each look is a line of host/docs/looks.md, and the peers, on
which nothing is ever chosen. Each flight is diagnosed alone: the authors' against five others of the same day and
condition, neural-swarm's and CrazyPAD's against the nominal flights of the same drone. Labels are read afterwards.

    python tools/gap_real.py [FLIGHTS] --rows nominal    # false alarms on every nominal flight, 25 min

nominal: every nominal flight of a group against the others of it, the baseline flights of the other rows too. It runs
only where --rows names it.

    python tools/gap_real.py [FLIGHTS] --rows swarm --most-baseline 2    # what few baseline flights cost

--most-baseline: each flight against so many of its baseline flights at most, the first of them.

    python tools/gap_real.py [FLIGHTS] --rows swarm --leave-out    # flights whose effect no candidate explains

--leave-out: flights with an effect alone, each without its effect among the candidates. `unknown` is right.
"""

import argparse
import multiprocessing
import os
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from airtouch import vehicle as vehicles
from airtouch.cli.shared.flights import check_data_set
from airtouch.errors import AirTouchError, in_one_line
from airtouch.gap.diagnosis import diagnose
from airtouch.gap.result import Diagnosis
from airtouch.logs import json_lines, read
from airtouch.logs.files import check_free
from airtouch.logs.flight_log import FlightLog
from diagnosis.recordings.cases import DATA_SETS, DEFAULT_ROWS, ROWS, Case, with_partners, without_truths
from diagnosis.recordings.folder import add_folder
from diagnosis.recordings.table import answer, print_table

#: (row, truth) -> flights of --quick
QUICK = {("swarm", "ground_effect"): 1, ("crazypad", "normal"): 1, ("crazypad", "rotor damage"): 2,
         ("crazypad", "slung load"): 1, ("peers", "weak_motor"): 1}
QUICK_WRONG = 1  #: of the flights of --quick, at most: it tells a broken diagnosis, not a slightly worse one
#: (vehicle, baseline, effects left out) -> this process's last diagnosis, whose calibration serves the next such case
_LAST: dict[tuple[str, tuple[str, ...], tuple[str, ...]], Diagnosis] = {}


def _delay_clock(path: str, seconds: float) -> FlightLog:
    """A log whose clock begins later by so many seconds."""
    log = read(path)
    return FlightLog({**log.columns, "t_s": log["t_s"] + seconds}, log.meta)


def diagnose_case(case: Case) -> dict:
    """A case with its diagnosis."""
    started = time.perf_counter()
    out = {**identity(case), "truth": case.truth, "condition": case.condition, "effects": []}
    study = case.vehicle, case.baseline, case.left_out
    try:
        diagnosis = diagnose([read(case.flight)], vehicles.load(case.vehicle), [read(b) for b in case.baseline],
                             before=_LAST.get(study), without=case.left_out,
                             partner=[_delay_clock(*p) for p in case.partner])
    except AirTouchError as error:
        return {**out, "verdict": "refused", "why": str(error)}
    _LAST.clear()
    _LAST[study] = diagnosis
    return {**out, "verdict": diagnosis.verdict, "effects": diagnosis.plain()["effects"], "gap": diagnosis.gap,
            "ranking": {r.name: round(r.probability, 4) for r in diagnosis.ranking[:6]},
            "seconds": time.perf_counter() - started}


def quick(cases: list[Case]) -> list[Case]:
    """The first few of each row and truth that QUICK names, evenly chosen."""
    out = []
    for (row, truth), many in QUICK.items():
        alike = [c for c in cases if c.row == row and c.truth == truth]
        out += alike[::max(len(alike) // many, 1)][:many]
    return out


def diagnoses(cases: list[Case], store: Path | None, jobs: int) -> list[dict]:
    """Cases with their diagnoses, by `jobs` processes; those in the file `store` are read, others appended to it."""
    answer_of = {_key(c): c for c in json_lines.read(store)}
    todo = sorted((c for c in cases if _key(identity(c)) not in answer_of),
                  key=lambda c: (c.row, c.vehicle, c.baseline, c.left_out))
    with ProcessPoolExecutor(max(jobs, 1), multiprocessing.get_context("spawn")) as pool:  # with no memory of ours
        for i, case in enumerate(pool.map(diagnose_case, todo)):
            answer_of[_key(case)] = case
            json_lines.append(store, [case])
            print(f"{i + 1}/{len(todo)} {case['truth']}: {answer(case)} {case['flight']}", file=sys.stderr, flush=True)
    return [answer_of[_key(identity(c))] for c in cases]


def identity(case: Case) -> dict:
    """What tells the answer to a case from others: its flight, what it is held against, what is left out."""
    return {"row": case.row, "flight": Path(case.flight).name, "baseline": len(case.baseline),
            "partner": len(case.partner), "left_out": list(case.left_out),
            "against": [Path(file).name for file in (*case.baseline, *(p for p, _ in case.partner))]}


def _key(answer: dict) -> tuple:
    """The `identity` of an answer as a key. Files of before 2026-11-26 do not say what an answer was held against: such
    an answer fits only a case without a baseline.
    """
    return (answer["row"], answer["flight"], answer["baseline"], answer.get("partner", 0),
            tuple(answer.get("left_out", ())), tuple(answer.get("against", ())))


def main(arguments: list[str] | None = None) -> int:
    """Diagnose the cases that the options name, and print the table; 1 where --quick has too many wrong ones."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_folder(parser, name="flights")
    parser.add_argument("--part", choices=("build", "view", "all"), default="build",
                        help="flights on which settings may be chosen, the others, or both (default %(default)s)")
    parser.add_argument("--rows", nargs="+", choices=sorted(ROWS), default=DEFAULT_ROWS,
                        help="rows of the table (default: all but nominal)")
    parser.add_argument("--jobs", type=int, default=2, help="processes (default %(default)s)")
    parser.add_argument("--keep", type=Path, help="JSON lines; cases that it holds are not diagnosed again")
    parser.add_argument("--partner", action="store_true",
                        help="give neural-swarm's flights the paths of other vehicles that the data hold")
    parser.add_argument("--most-baseline", type=int, metavar="N",
                        help="most baseline flights of each, the first of them (default: all)")
    parser.add_argument("--leave-out", action="store_true",
                        help="flights with an effect alone, without that effect among the candidates")
    parser.add_argument("--quick", action="store_true",
                        help=f"fails where more than {QUICK_WRONG} of its flights are wrong")
    args = parser.parse_args(arguments)
    if args.most_baseline is not None and args.most_baseline < 0:
        parser.error("--most-baseline must be 0 or more")
    for data_set in {data_set for row in (DEFAULT_ROWS if args.quick else args.rows) for data_set in DATA_SETS[row]}:
        check_data_set(args.flights / data_set)
    check_free(args.keep, force=True)
    if args.quick:  # of the parts for building, and two peers
        cases = quick([c for row in DEFAULT_ROWS
                       for c in ROWS[row](args.flights, "view" if row == "peers" else "build")])
    else:
        cases = [c for row in args.rows for c in ROWS[row](args.flights, args.part)]
    if args.partner:
        cases = with_partners(cases, args.flights)
    if args.leave_out:
        cases = list(without_truths(cases))
    cases = [replace(c, baseline=c.baseline[:args.most_baseline]) for c in cases]
    if not cases:
        raise AirTouchError(f"no flight of {' '.join(args.rows)} in the part {args.part}")
    answers = diagnoses(cases, args.keep, args.jobs)
    print_table(answers, args.flights)
    wrong = [c["flight"] for c in answers if answer(c) != c["truth"]]
    if args.quick and len(wrong) > QUICK_WRONG:
        print(f"gap_real: {len(wrong)} of {len(answers)} wrong, more than {QUICK_WRONG}: {', '.join(wrong)}",
              file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    with in_one_line("gap_real"):
        sys.exit(main())
