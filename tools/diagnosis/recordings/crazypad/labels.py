"""What the manifest of CrazyPAD says of its flights: family, damaged rotors, millimetres cut, building part.

A condition is the dataset's name of what was done to a vehicle: "cut_M2_3.5mm_3.0mm_40.5mm", "normal_flight",
"add_weight_W1_near_M3".
"""

import argparse
import csv
import re
from pathlib import Path

from airtouch.cli.shared.flights import check_data_set

from ..folder import add_folder

VEHICLE = "crazyflie-2.1"  #: vehicle file of both drones
#: families of conditions, in the order of the tables
FAMILIES = ("normal", "rotor damage", "added weight", "slung load")
#: mm cut off a rotor, both blades together, from which its flights must not be called normal; a goal of
#: host/docs/gap-crazypad.md
LEAST_MM = 1.5
BLADE_MM = 20.0  #: mm; a longer length in a condition's name is that of the blade, 40 mm and more, not of a cut
BUILDING = 4  #: each fourth condition with a defect is kept for looking, the other three are to build on


def manifest(folder: Path, part: str) -> list[dict[str, str]]:
    """Rows of the manifest, all of them or, of part "build", those of the building part."""
    rows = list(csv.DictReader((folder / "manifest.csv").open()))
    return [r for r, on_it in zip(rows, building(rows), strict=True) if on_it or part == "all"]


def building(rows: list[dict]) -> list[bool]:
    """Whether numbers may be chosen on each flight: all normal ones, three conditions in four of the others."""
    defects = sorted({r["condition"] for r in rows if family(r["condition"]) != "normal"})
    viewed = set(defects[BUILDING - 1::BUILDING])
    return [r["condition"] not in viewed for r in rows]


def baseline(rows: list[dict], i: int) -> list[int]:
    """Indices of the nominal flights that flight i is held against: the normal ones of its drone but itself."""
    return [k for k, r in enumerate(rows) if k != i and r["drone"] == rows[i]["drone"]
            and family(r["condition"]) == "normal"]


def folder_and_part(description: str | None) -> argparse.Namespace:
    """`folder` and `part` of the command line of a script with this description."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_folder(parser, "crazypad")
    parser.add_argument("--part", choices=("build", "all"), default="build",
                        help="all but every fourth condition with a defect, or all (default %(default)s)")
    options = parser.parse_args()
    check_data_set(options.folder)
    return options


def family(condition: str) -> str:
    """The family of a condition's name."""
    if condition.startswith("normal"):
        return "normal"
    if condition.startswith(("cut", "tape")):
        return "rotor damage"
    return "slung load" if "string" in condition else "added weight"


def rotors(condition: str) -> list[int]:
    """The rotors that a condition's name says are damaged."""
    if family(condition) != "rotor damage":
        return []
    return sorted({int(x) for x in re.findall(r"M(\d)", condition)})


def cut_mm(condition: str) -> float:
    """Millimetres cut off each blade, summed over blades and rotors; NaN where nothing is cut."""
    if not condition.startswith("cut"):
        return float("nan")
    return sum(millimetres(condition).values())


def millimetres(condition: str) -> dict[int, float]:
    """Rotor to millimetres cut off it, both blades together; empty where nothing is cut."""
    parts = re.findall(r"M(\d)((?:_[\d.]+mm)+)", condition) if condition.startswith("cut") else []
    return {int(r): sum(float(x) for x in re.findall(r"([\d.]+)mm", text) if float(x) < BLADE_MM) for r, text in parts}


def large(condition: str) -> bool:
    """Whether at least LEAST_MM are gone of a rotor."""
    return max(millimetres(condition).values(), default=0.0) >= LEAST_MM
