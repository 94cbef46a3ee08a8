"""The authors' flights against the simulator: the three questions of host/docs/gap-real.md, one report each.

    python tools/diagnosis/gap_authors.py [FLIGHTS/airtouch] [OUT]

Writes all.html, close.html and wind.html (with .json) to OUT, out/gap-authors by default.
"""

import argparse
import csv
import os
import subprocess
import sys
from pathlib import Path

VEHICLE = "crazyflie-2.1-flow"  #: the authors' vehicle
CLOSE = 10  #: low flights diagnosed against high ones; no source: round number, for a minute of time


def questions(folder: Path) -> dict[str, tuple[list[str], list[str]]]:
    """For each question its flights and its baseline, clean flights of the manifest flown straight."""
    rows = [r for r in csv.DictReader((folder / "manifest.csv").open()) if r["use"] == "clean"]

    def straight(height: str, wind: str = "none", day: str = "") -> list[str]:
        """Files of the flights straight over the edges, of a height ("" for any), wind and part of a day's name."""
        return [str(folder / r["file"]) for r in rows if r["wind"] == wind and r["angle_deg"] == "0"
                and height in ("", r["height"]) and day in r["file"]]

    low = straight("low")
    return {"all": (low, []), "close": (low[:CLOSE], straight("h80")),
            "wind": (straight("low", "wind"), straight("", day="_0103-"))}


def main(folder: Path, out: Path) -> None:
    """Diagnose each of the questions and write JSON and report of each."""
    out.mkdir(parents=True, exist_ok=True)
    for name, (flights, baseline) in questions(folder).items():
        print(f"## {name}: {len(flights)} flights, {len(baseline)} nominal", flush=True)
        subprocess.run([str(Path(sys.executable).with_name("airtouch")), "gap", "diagnose", *flights, "--vehicle",
                        VEHICLE, *(["--baseline", *baseline] if baseline else []), "--json", str(out / f"{name}.json"),
                        "--report", str(out / f"{name}.html"), "--force"], check=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=Path, help="of the authors' flights (FLIGHTS/airtouch)",
                        default=Path(os.environ.get("AIRTOUCH_FLIGHTS", "../shared/flights")) / "airtouch")
    parser.add_argument("out", nargs="?", type=Path, default=Path("out/gap-authors"), help="(out/gap-authors)")
    options = parser.parse_args()
    main(options.folder, options.out)
