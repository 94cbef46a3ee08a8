"""Measures how strong every effect seems to be in nominal flights, for gap/signatures/nominal_scatter.toml.

    python tools/calibration/nominal_scatter.py [FLIGHTS] [--out nominal_scatter.toml] [--keep x.jsonl]   # hours

Every nominal flight is compared twice with up to five others of its vehicle, on which the vehicle is calibrated: with
flights of its own group (drone, day and condition), and with flights of other groups of the same drone. Strengths of
both comparisons count, rates of the first alone. Authors' flights of folds 0 to 2; neural-swarm's days 19 and 20;
simulated flights of this project. host/docs/gap-floor.md explains the table.

    python tools/calibration/nominal_scatter.py [FLIGHTS] --passing [--keep x.jsonl]    # 5 min

measures nothing but passing effects, in the same flights of the same groups. It writes the table that is shipped with
these figures in place of the old ones.

    python tools/calibration/nominal_scatter.py [FLIGHTS] --only blade_flapping [--keep x.jsonl]    # 5 min

measures nothing but the effects of these names, and does the same. All write --out; to ship a table, give it the path
of the shipped one, and --force.
"""

import argparse
import os
from importlib import resources
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
from airtouch.cli.shared.arguments import whole_number
from airtouch.cli.shared.flights import check_data_set, data_folder
from airtouch.errors import in_one_line
from airtouch.logs.files import check_free, write_bytes
from airtouch.simulation import effects
from nominal.comparisons import Task, compare_all, tasks_of
from nominal.groups import nominal_groups
from nominal.scatter_table import counts_of, scatter_of_classes, text_of, with_effects, with_passing

LEAST = 4  #: flights of a group; no source: three baseline flights for each


def main() -> None:
    """Measure the nominal scatter of every class and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("flights", nargs="?", type=Path, default=data_folder(),
                        help="of the data sets (default: AIRTOUCH_FLIGHTS or ../shared/flights)")
    parser.add_argument("--out", type=Path, default=Path("nominal_scatter.toml"),
                        help="the table (default %(default)s)")
    parser.add_argument("--force", action="store_true", help="replace --out if it is there")
    parser.add_argument("--keep", type=Path, metavar="FILE",
                        help="JSON lines, made if not there; comparisons that it holds are not made again")
    parser.add_argument("--jobs", type=whole_number(1), default=2, help="processes (default %(default)s)")
    alone = parser.add_mutually_exclusive_group()
    alone.add_argument("--passing", action="store_true", help="measure passing effects alone")
    alone.add_argument("--only", nargs="+", default=[], choices=effects.NAMES, metavar="EFFECT",
                       help="measure these effects alone")
    args = parser.parse_args()
    check_free(args.out, args.force)
    check_free(args.keep, force=True)  # new comparisons are added to it
    check_data_set(args.flights / "airtouch")
    check_data_set(args.flights / "neuralswarm", "baselines.csv")
    large_enough = [g for g in nominal_groups(args.flights) if len(g.logs) >= LEAST]
    shipped = resources.files("airtouch") / "gap" / "signatures" / "nominal_scatter.toml"
    counts, only = counts_of(shipped.read_text(encoding="utf-8")), tuple(args.only)
    if args.passing:
        tasks = [Task(group, passing=True) for group in large_enough]
        text = text_of(with_passing(tasks, compare_all(tasks, args.keep, args.jobs)), counts)
    else:
        row_of = compare_all(tasks_of(large_enough, only), args.keep, args.jobs)
        measured, new_counts = scatter_of_classes(large_enough, row_of, only)
        text = text_of(with_effects(measured), counts) if only else text_of(measured, new_counts)
    write_bytes(text.encode(), args.out, args.force)
    print(text)


if __name__ == "__main__":
    with in_one_line("nominal_scatter"):
        main()
