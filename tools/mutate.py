"""Changes the product in small ways, one at a time, and counts the changes that the tests notice (mutmut).

    make mutate [GROUP=score] [SAMPLE=60]     # or: python tools/mutate.py score --sample 60
    python tools/mutate.py score --show       # the changes that no test noticed, as they stand in build/mutate

A group is a few modules and the tests that are there for them. mutmut works on a copy in build/mutate, where what is
done is not done again; `--force` begins anew. A sample is drawn by a seed from all mutants; without one each is
run. Each mutant runs those of its group's tests that reach it, until one fails: a sample of 60 does so
sixty times. Needs `pip install '.[mutate]'`.
"""

import argparse
import json
import os
import random
import shutil
import subprocess
import sys
from collections import Counter
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from airtouch.cli.shared.flights import data_folder
from airtouch.gap.sealed.intervals import wilson

ROOT = Path(__file__).parents[1]  #: of the checkout
BUILD = ROOT / "build" / "mutate"  #: where mutated copies lie
LEAST = 0.85  #: fraction of the mutants that tests must notice; no source: round number


@dataclass(frozen=True)
class Group:
    """Modules below host/airtouch, and tests below tests."""

    modules: tuple[str, ...]
    tests: tuple[str, ...]


#: name -> modules and their tests
GROUPS = {
    "reference": Group(tuple(f"reference/{name}.py" for name in (
        "band_power", "cross_spectrum", "disturbance_force", "edge_decoder", "edge_pipeline", "feature_window",
        "finite", "floor_height", "fr_cfar", "motion_channels")), ("reference",)),
    "int8": Group(tuple(f"reference/networks/{name}.py" for name in ("int8_network", "stream_graph", "stream_int8")), (
        "reference/networks", "kernels/test_network.py", "kernels/test_stream.py")),
    "score": Group(("detector/evaluation/score.py",), ("detector/evaluation/test_score.py",)),
    "selection": Group(("gap/evidence/cells.py", *(f"gap/naming/{name}.py" for name in (
        "forward", "judging", "leave_one_out", "over_prediction", "passing_effect", "policy", "rounds",
        "screening/screen", "select", "thresholds"))), tuple(f"gap/naming/{name}.py" for name in (
            "test_forward", "test_judging", "test_leave_one_out", "test_loop_effects", "test_policy", "test_rounds",
            "screening/test_screen", "screening/test_first_order", "test_select", "test_thresholds"))),
}
#: mutmut's exit codes, by what they say
KILLED, SURVIVED, NOT_REACHED, TIMED_OUT = (1, 3), (0,), (5, 33), (24, 36, 152, 255, -24)
#: what is added to pyproject.toml in a copy
CONFIG = """
[tool.mutmut]
source_paths = ["src"]
only_mutate = {modules}
also_copy = ["tests", "tools", "firmware", "gap8", "host"]
pytest_add_cli_args = ["-p", "no:cacheprovider", "-k", "not real_windows"]
track_dependencies = false
pytest_add_cli_args_test_selection = {tests}
"""


def stage(name: str, force: bool) -> Path:
    """The copy of the project in which a group is mutated; the one that is there, unless `force`."""
    place, group = BUILD / name, GROUPS[name]
    if force and place.exists():
        shutil.rmtree(place)
    shutil.copytree(ROOT / "host" / "airtouch", place / "src" / "airtouch", dirs_exist_ok=True,
                    ignore=shutil.ignore_patterns("__pycache__"))
    for folder in ("tests", "tools", "firmware", "gap8", "host/docs"):
        shutil.copytree(ROOT / folder, place / folder, dirs_exist_ok=True, ignore=shutil.ignore_patterns("__pycache__"))
    config = CONFIG.format(modules=json.dumps([f"src/airtouch/{m}" for m in group.modules]),
                           tests=json.dumps([f"tests/{t}" for t in group.tests]))
    (place / "pyproject.toml").write_text((ROOT / "pyproject.toml").read_text() + config)
    return place


def run_mutmut(place: Path, *mutants: str) -> int:
    """Run the named mutants, or all; those that are done are not run again. Returns mutmut's exit code."""
    return subprocess.run([sys.executable, "-m", "mutmut", "run", "--max-children", "1", *mutants], cwd=place,
                          env=os.environ | {"AIRTOUCH_FLIGHTS": str(data_folder().resolve())}).returncode


def results(place: Path) -> dict[str, int | None]:
    """Exit code of each mutant, None where it was not run."""
    exit_codes: dict[str, int | None] = {}
    for path in sorted((place / "mutants").rglob("*.py.meta")):
        exit_codes |= json.loads(path.read_text())["exit_code_by_key"]
    return exit_codes


def run_group(place: Path, sample: int | None, seed: int) -> tuple[int, list[str]]:
    """Run the mutants of a copy, or a sample of them. Returns mutmut's exit code, and the mutants that it was to run.

    There are none where mutmut does not come as far as to make them.
    """
    if not sample:
        code = run_mutmut(place)
        return code, sorted(results(place))
    code = 0
    if not results(place):
        code = run_mutmut(place, "airtouch.no-such-mutant")  # makes the mutants; ends with 1, as none is called so
    if not (names := sorted(results(place))):
        return code, []
    names = random.Random(seed).sample(names, min(sample, len(names)))
    return run_mutmut(place, *names), names


def print_table(codes: dict[str, int | None]) -> float:
    """Print a line for each module and one for all. Returns the fraction of all that is noticed."""
    by_module: dict[str, Counter] = {}
    for mutant, code in codes.items():
        if code is not None:
            module = mutant.rsplit(".", 1)[0].removeprefix("airtouch.")
            outcome = "noticed" if code in KILLED + TIMED_OUT else "unnoticed" if code in SURVIVED else \
                "reached by no test" if code in NOT_REACHED else f"exit code {code}"
            by_module.setdefault(module, Counter())[outcome] += 1
    total = Counter()
    for count in by_module.values():
        total += count
    fraction = 0.0
    for module, count in [*sorted(by_module.items()), ("all", total)]:
        n, hits = sum(count.values()), count["noticed"]
        if not n:
            continue
        between = wilson(hits, n)
        fraction = hits / n
        rest = ", ".join(f"{k} {v}" for k, v in sorted(count.items()) if k != "noticed")
        print(f"{module}: noticed {hits} of {n}, {fraction:.1%} [{between['low']:.0%}, {between['high']:.0%}]"
              + (f"; {rest}" if rest else ""))
    return fraction


def print_mutants(place: Path, codes: dict[str, int | None]) -> None:
    """Print the mutants that no test noticed."""
    for mutant, code in codes.items():
        if code in SURVIVED + NOT_REACHED:
            subprocess.run([sys.executable, "-m", "mutmut", "show", mutant], cwd=place)


def main(arguments: list[str] | None = None) -> int:
    """Run or show the mutants of the groups; 1 where mutmut fails, or the fraction noticed of one is below LEAST."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("groups", nargs="*", help=f"of {', '.join(GROUPS)}; all by default")
    parser.add_argument("--sample", type=int, help="mutants of each group")
    parser.add_argument("--seed", type=int, default=0, help="of the sample (default %(default)s)")
    parser.add_argument("--show", action="store_true", help="print those that no test noticed, and run nothing")
    parser.add_argument("--force", action="store_true", help="begin anew")
    args = parser.parse_args(arguments)
    if args.sample is not None and args.sample < 1:
        parser.error("--sample must be at least 1")
    if args.show and (args.sample or args.force):
        parser.error("--show runs nothing: leave out --sample and --force")
    if unknown := set(args.groups) - set(GROUPS):
        parser.error(f"no group {', '.join(sorted(unknown))}; there are {', '.join(GROUPS)}")
    if not args.show and find_spec("mutmut") is None:
        parser.error("mutmut is not installed: pip install '.[mutate]', or run it by make mutate")
    worst = 1.0
    for name in args.groups or GROUPS:
        if args.show:
            if not (codes := results(BUILD / name)):
                parser.error(f"no mutants of {name} yet: leave out --show first")
            print_mutants(BUILD / name, codes)
            continue
        place = stage(name, args.force)
        code, names = run_group(place, args.sample, args.seed)
        if code or not names:
            print(f"mutate: mutmut failed on {name} with exit code {code}; what it printed is above", file=sys.stderr)
            return 1
        print(f"{name}, {len(names)} of {len(results(place))} mutants:")
        worst = min(worst, print_table({n: c for n, c in results(place).items() if n in set(names)}))
    return 0 if worst >= LEAST else 1


if __name__ == "__main__":
    sys.exit(main())
