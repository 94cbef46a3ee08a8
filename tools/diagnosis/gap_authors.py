"""Diagnoses the authors' flights against the simulator: three questions of host/docs/gap-findings.md, one report each.

    python tools/diagnosis/gap_authors.py [FLIGHTS/airtouch] [OUT]    # 1 to 2 min a question

Writes all.html, close.html and wind.html (with .json) to OUT, out/gap-authors by default. Those that are there are
replaced with --force alone.
"""

import argparse
import itertools
import subprocess
import sys
from pathlib import Path

from airtouch.cli.shared.flights import check_data_set
from airtouch.errors import AirTouchError, in_one_line
from airtouch.logs.files import check_free
from airtouch.vehicle import DEFAULT_VEHICLE
from recordings.authors import questions
from recordings.folder import add_folder


def main() -> None:
    """Diagnose each of the questions and write JSON and report of each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_folder(parser, "airtouch")
    parser.add_argument("out", nargs="?", type=Path, default=Path("out/gap-authors"),
                        help="folder of the reports (default %(default)s)")
    parser.add_argument("--force", action="store_true", help="replace the reports that are there")
    options = parser.parse_args()
    check_data_set(options.folder)
    asked = questions(options.folder)
    for name, ending in itertools.product(asked, ("json", "html")):
        check_free(options.out / f"{name}.{ending}", options.force)
    for name, (flights, baseline) in asked.items():
        print(f"## {name}: {len(flights)} flights, {len(baseline)} nominal", flush=True)
        run = subprocess.run([str(Path(sys.executable).with_name("airtouch")), "gap", "diagnose", *flights,
                              "--vehicle", DEFAULT_VEHICLE, *(["--baseline", *baseline] if baseline else []),
                              "--json", str(options.out / f"{name}.json"),
                              "--report", str(options.out / f"{name}.html"), *["--force"] * options.force])
        if run.returncode:
            raise AirTouchError(f"{name}: the diagnosis failed, as the line above says")


if __name__ == "__main__":
    with in_one_line("gap_authors"):
        main()
