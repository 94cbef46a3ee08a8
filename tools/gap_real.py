"""Diagnoses recorded and other people's simulated flights, each row of the table in host/docs/gap-real.md.

    python tools/gap_real.py [FLIGHTS] [--rows authors swarm ...] [--jobs 2] [--keep x.jsonl]    # 9 min on two cores
    python tools/gap_real.py [FLIGHTS] --part view    # or build (default), all; view: about 12 min
    python tools/gap_real.py --quick    # a few flights of each row, 30 s; fails where the diagnosis is broken

build: the flights on which settings may be chosen: the authors' folds 0 to 2, neural-swarm's days 19 and 20, three of
CrazyPAD's conditions in four. view: the rest, of which each look is a line of host/docs/looks.md, and the peers, on
which nothing is ever chosen. Each flight is diagnosed alone: the authors' against five others of the same day and
condition, neural-swarm's and CrazyPAD's against the nominal flights of the same drone. Labels are read afterwards.

    python tools/gap_real.py [FLIGHTS] --rows nominal    # false alarms on every nominal flight, 25 min

nominal: every nominal flight of a group against the others of it, the baseline flights of the other rows too. It runs
only where --rows names it.

    python tools/gap_real.py [FLIGHTS] --rows swarm --most-baseline 2    # what few baseline flights cost

--most-baseline: each flight against so many of its baseline flights at most, the first of them.

    python tools/gap_real.py [FLIGHTS] --rows swarm nominal --other-day    # what baseline flights of another day cost

--other-day: each flight against nominal flights of another day on which the same drone was flown, or over a platform of
the same height at the same angle; those that have none are left out.

    python tools/gap_real.py [FLIGHTS] --rows swarm --leave-out    # flights whose effect no candidate explains

--leave-out: flights with an effect alone, each without its effect among the candidates. `unknown` is right.

A flight that the diagnosis refuses is counted as `refused` and not kept: the next run tries it again. What --keep holds
of another version of the package is not used: those flights are diagnosed anew, and the new results appended.
"""

import argparse
import multiprocessing
import os
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from airtouch import vehicle as vehicles
from airtouch.cli.shared.arguments import whole_number
from airtouch.cli.shared.flights import check_data_set
from airtouch.errors import AirTouchError, in_one_line
from airtouch.gap.diagnosis import diagnose
from airtouch.gap.nominal.kept_scatter import code_digest
from airtouch.gap.result import Diagnosis
from airtouch.gap.signatures.signature import OVERHEAD
from airtouch.logs import read
from airtouch.logs.files import check_free
from airtouch.logs.flight_log import FlightLog
from diagnosis.recordings import cases as recorded
from diagnosis.recordings.cases import DATA_SETS, DEFAULT_ROWS, ROWS, Case
from diagnosis.recordings.folder import add_folder
from diagnosis.recordings.result_store import REFUSED, Result, add_keep_option, complete
from diagnosis.recordings.table import answer, print_table

#: (row, truth) -> flights of --quick; `unknown`: a wake that is no candidate
QUICK = {("swarm", "ground_effect"): 1, ("swarm", "unknown"): 1, ("crazypad", "normal"): 1,
         ("crazypad", "rotor damage"): 2, ("crazypad", "slung load"): 1, ("peers", "weak_motor"): 1}
QUICK_WRONG = 1  #: of the flights of --quick, at most: it tells a broken diagnosis, not a slightly worse one
#: (vehicle, baseline, effects left out) -> this process's last diagnosis, whose calibration serves the next such case
_LAST: dict[tuple[str, tuple[str, ...], tuple[str, ...]], Diagnosis] = {}


def _delay_clock(path: str, seconds: float) -> FlightLog:
    """A log whose clock begins later by so many seconds."""
    log = read(path)
    return FlightLog({**log.columns, "t_s": log["t_s"] + seconds}, log.meta)


def diagnose_case(case: Case) -> Result:
    """The result of a case: its diagnosis, with what was asked and the labels."""
    started = time.perf_counter()
    result = {**identity(case), "truth": case.truth, "condition": case.condition, "effects": []}
    study = case.vehicle, case.baseline, case.left_out
    try:
        diagnosis = diagnose([read(case.flight)], vehicles.load(case.vehicle), [read(b) for b in case.baseline],
                             before=_LAST.get(study), without=case.left_out,
                             partner=[_delay_clock(*p) for p in case.partner])
    except AirTouchError as error:
        return {**result, "verdict": REFUSED, "why": str(error)}
    _LAST.clear()
    _LAST[study] = diagnosis
    return {**result, "verdict": diagnosis.verdict, "effects": diagnosis.plain()["effects"], "gap": diagnosis.gap,
            "ranking": {r.name: round(r.probability, 4) for r in diagnosis.ranking[:6]},
            "seconds": time.perf_counter() - started}


def quick(cases: list[Case]) -> list[Case]:
    """The first few of each row and truth that QUICK names, evenly chosen.

    Raises AirTouchError where there are fewer.
    """
    out = []
    for (row, truth), many in QUICK.items():
        alike = [c for c in cases if c.row == row and c.truth == truth]
        if len(alike) < many:
            raise AirTouchError(f"{row}: {len(alike)} flights of {truth}, and --quick needs {many}")
        out += alike[::max(len(alike) // many, 1)][:many]
    return out


def diagnose_cases(cases: list[Case], store: Path | None, jobs: int) -> list[Result]:
    """The results of the cases, by `jobs` processes; those in the file `store` are read, others appended to it."""
    def run(todo: list[Case]) -> Iterator[Result]:
        """Results as they come, those of the same study one after another; each with a line of progress."""
        todo = sorted(todo, key=lambda c: (c.row, c.vehicle, c.baseline, c.left_out))
        with ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn")) as pool:  # with no memory of ours
            for i, result in enumerate(pool.map(diagnose_case, todo), 1):
                print(f"{i}/{len(todo)} {result['truth']}: {result.get('why') or answer(result)} {result['flight']}",
                      file=sys.stderr, flush=True)
                yield result

    return complete({_key(identity(c)): c for c in cases}, run, _key, store)


def identity(case: Case) -> Result:
    """What tells the result of a case from others: its flight, what it is held against, what is left out, the code."""
    return {"code": code_digest().hex()[:16], "row": case.row, "flight": Path(case.flight).name,
            "baseline": len(case.baseline), "partner": len(case.partner), "left_out": list(case.left_out),
            "against": [Path(file).name for file in (*case.baseline, *(p for p, _ in case.partner))]}


def _key(result: Result) -> tuple:
    """The `identity` of a result as a key; files of before 2026-11-27 do not say of which code, and fit no case."""
    return (result.get("code"), result["row"], result["flight"], result["baseline"], result.get("partner", 0),
            tuple(result.get("left_out", ())), tuple(result.get("against", ())))


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """The command line, whose options fit each other."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_folder(parser, name="flights")
    parser.add_argument("--part", choices=("build", "view", "all"),
                        help="build: flights on which settings may be chosen, 9 min on two cores; view: the others, "
                             "about 12 min (default: build)")
    parser.add_argument("--rows", nargs="+", choices=sorted(ROWS), help="rows of the table (default: all but nominal)")
    parser.add_argument("--jobs", type=whole_number(1), default=2, help="processes (default %(default)s)")
    add_keep_option(parser)
    parser.add_argument("--partner", action="store_true",
                        help="give neural-swarm's flights the paths of other vehicles that the data hold")
    parser.add_argument("--most-baseline", type=whole_number(0), metavar="N",
                        help="most baseline flights of each, the first of them (default: all)")
    parser.add_argument("--other-day", action="store_true", help="nominal flights of another day as a baseline")
    parser.add_argument("--leave-out", action="store_true",
                        help="flights with an effect alone, without that effect among the candidates")
    parser.add_argument("--quick", action="store_true",
                        help=f"a few flights of each row, 30 s; fails where more than {QUICK_WRONG} of them are wrong")
    options = parser.parse_args(arguments)
    changes = {"--part": options.part, "--rows": options.rows, "--partner": options.partner,
               "--leave-out": options.leave_out, "--other-day": options.other_day,
               "--most-baseline": options.most_baseline is not None}
    if options.quick and any(changes.values()):
        parser.error("--quick has its own flights and baselines: leave out "
                     + ", ".join(name for name, is_set in changes.items() if is_set))
    options.rows, options.part = options.rows or DEFAULT_ROWS, options.part or "build"
    if options.partner and not any("neuralswarm" in DATA_SETS[row] for row in options.rows):
        parser.error("--partner is of neural-swarm's flights: add swarm or nominal to --rows, or leave it out")
    return options


def cases_of(options: argparse.Namespace) -> list[Case]:
    """The cases that the options name. Raises AirTouchError where there are none."""
    if options.quick:  # of the parts for building, and two peers
        cases = [c for row in options.rows for c in ROWS[row](options.flights, "view" if row == "peers" else "build")]
        cases = quick([*cases, *recorded.without_truths(c for c in cases if c.truth == OVERHEAD)])
    else:
        cases = [c for row in options.rows for c in ROWS[row](options.flights, options.part)]
    if options.partner:
        cases = recorded.with_partners(cases, options.flights)
    if options.other_day:
        cases = list(recorded.of_another_day(cases))
    if options.leave_out:
        cases = list(recorded.without_truths(cases))
    if not cases:
        raise AirTouchError(f"no flight of {' '.join(options.rows)} in the part {options.part}"
                            + " was flown on two days" * options.other_day
                            + " has an effect to leave out" * options.leave_out)
    return [replace(c, baseline=c.baseline[:options.most_baseline]) for c in cases]


def main(arguments: list[str] | None = None) -> int:
    """Diagnose the cases that the options name, and print the table; 1 where --quick has too many wrong ones."""
    options = parse(arguments)
    for data_set in sorted({data_set for row in options.rows for data_set in DATA_SETS[row]}):
        check_data_set(options.flights / data_set)
    check_free(options.keep, force=True)
    results = diagnose_cases(cases_of(options), options.keep, options.jobs)
    print_table(results, options.flights)
    wrong = [r["flight"] for r in results if answer(r) != r["truth"]]
    if options.quick and len(wrong) > QUICK_WRONG:
        print(f"gap_real: {len(wrong)} of {len(results)} wrong, more than {QUICK_WRONG}: {', '.join(wrong)}",
              file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    with in_one_line("gap_real"):
        sys.exit(main())
