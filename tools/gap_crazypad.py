"""CrazyPAD: every flight diagnosed alone, calibrated on the other normal flights of its drone.

    python tools/gap_crazypad.py FOLDER [--json cases.jsonl]

FOLDER holds the flights and their manifest.csv. The label is read after the diagnosis. With
--json, cases that the file holds already are not diagnosed again. Nothing is fitted to
labels, so that every condition is one that was never seen.
"""

import argparse
import csv
import json
import re
import sys
import time
from pathlib import Path

import numpy as np
from scipy.stats import spearmanr

from airtouch import vehicle
from airtouch.gap.diagnose import diagnose
from airtouch.logs import read

FAMILIES = ("normal", "rotor damage", "added weight", "slung load")
FAMILY_OF = {"weak_motor": "rotor damage", "mass": "added weight", "com_offset": "added weight",
             "slung_load": "slung load"}
RESAMPLES = 2000


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
    return sum(float(x) for x in re.findall(r"([\d.]+)mm", condition) if float(x) < 20.0)


def answer(case: dict) -> tuple[str, list[int], float]:
    """The family, the rotors and the summed loss of thrust that a diagnosis names."""
    names = [e["name"] for e in case["effects"]]
    if case["verdict"] != "effect":
        return ("normal" if case["verdict"] == "none" else "unknown"), [], 0.0
    weak = [e["parameters"] for e in case["effects"] if e["name"] == "weak_motor"]
    return FAMILY_OF.get(names[0], "other"), sorted(int(p["rotor"]["value"]) for p in weak), \
        sum(p["thrust_loss"]["value"] for p in weak)


def cases(folder: Path, kept: Path | None) -> list[dict]:
    """Each flight's diagnosis, in the manifest's order."""
    rows = list(csv.DictReader((folder / "manifest.csv").open()))
    done = {}
    if kept and kept.exists():
        done = {c["file"]: c for c in map(json.loads, kept.read_text().splitlines())}
    logs = {r["file"]: read(folder / r["file"]) for r in rows if family(r["condition"]) == "normal"}
    drone = {r["file"]: r["drone"] for r in rows}
    flown = vehicle.load("crazyflie-2.1")
    out = []
    for i, row in enumerate(rows):
        name = row["file"]
        if name not in done:
            base = [log for other, log in logs.items() if other != name and drone[other] == row["drone"]]
            found = diagnose([read(folder / name)], flown, base).plain()
            done[name] = {"file": name, "drone": row["drone"], "condition": row["condition"],
                          "verdict": found["verdict"], "effects": found["effects"],
                          "ranking": {r["name"]: r["probability"] for r in found["ranking"]}}
            if kept:
                with kept.open("a") as file:
                    file.write(json.dumps(done[name]) + "\n")
        out.append(done[name])
        print(f"\r{i + 1}/{len(rows)}", end="", file=sys.stderr)
    print(file=sys.stderr)
    return out


def balanced(table: list[dict]) -> float:
    """Mean over families of the share named right; families without flights are left out."""
    found = []
    for f in FAMILIES:
        right = [answer(c)[0] == f for c in table if family(c["condition"]) == f]
        found += [np.mean(right)] if right else []
    return float(np.mean(found)) if found else float("nan")


def interval(table: list[dict], figure) -> tuple[float, float]:
    """90 % interval of a figure, resampling conditions (of a drone) within families."""
    rng = np.random.default_rng(0)
    groups: dict[str, dict[str, list[dict]]] = {}
    for c in table:
        groups.setdefault(family(c["condition"]), {}).setdefault(c["drone"] + c["condition"], []).append(c)
    values = []
    for _ in range(RESAMPLES):
        drawn = []
        for conditions in groups.values():
            every = list(conditions.values())
            for k in rng.integers(0, len(every), len(every)):
                drawn += every[k]
        values.append(figure(drawn))
    return tuple(np.nanpercentile(values, (5, 95)))


def named(table: list[dict]) -> float:
    """Share of rotor-damage flights for which exactly the damaged rotors are named."""
    hit = [answer(c)[1] == rotors(c["condition"]) for c in table if rotors(c["condition"])]
    return float(np.mean(hit)) if hit else float("nan")


def some_named(table: list[dict]) -> float:
    """Share of rotor-damage flights for which a damaged rotor and no sound one is named."""
    hit = [bool(answer(c)[1]) and set(answer(c)[1]) <= set(rotors(c["condition"]))
           for c in table if rotors(c["condition"])]
    return float(np.mean(hit)) if hit else float("nan")


def severity(table: list[dict]) -> float:
    """Spearman's rank correlation of thrust_loss (0 where none is named) with the millimetres cut."""
    cut = [(cut_mm(c["condition"]), answer(c)[2]) for c in table if np.isfinite(cut_mm(c["condition"]))]
    return float(spearmanr(*zip(*cut, strict=True)).statistic) if len(cut) > 2 else float("nan")


def show(table: list[dict]) -> None:
    """The figures, in plain text."""
    columns = (*FAMILIES, "unknown", "other")
    print(f"\n{'true family':14s} " + " ".join(f"{c:>13s}" for c in columns))
    for f in FAMILIES:
        told = [answer(c)[0] for c in table if family(c["condition"]) == f]
        print(f"{f:14s} " + " ".join(f"{told.count(c):13d}" for c in columns))
    print("\ncondition, drone: family named; rotors; summed thrust loss")
    for key in sorted({(c["condition"], c["drone"]) for c in table}):
        group = [answer(c) for c in table if (c["condition"], c["drone"]) == key]
        print(f"  {key[0]:52s} {key[1]} " + "; ".join(
            g[0] + (f" {g[1]} {g[2]:.2f}" if g[1] else "") for g in group))
    print(f"\n{len(table)} flights; 90 % intervals, conditions resampled")
    for text, figure in (("balanced accuracy of the family", balanced), ("damaged rotors named exactly", named),
                         ("only damaged rotors named", some_named), ("severity, Spearman", severity)):
        low, high = interval(table, figure)
        print(f"{text:34s} {figure(table):.3f} ({low:.3f} to {high:.3f})")
    for drone in sorted({c["drone"] for c in table}):
        for which in ("M1", "M3"):
            part = [c for c in table if c["drone"] == drone and c["condition"].startswith("cut")
                    and ("_M1_" in c["condition"]) == (which == "M1")]
            if len(part) > 5:
                print(f"severity, {drone}, {'M2 and M1' if which == 'M1' else 'M3'} cut: {severity(part):.3f} "
                      f"({len(part)} flights)")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--json", type=Path, help="cases already done are read from here, new ones appended")
    options = parser.parse_args()
    start = time.time()
    table = cases(options.folder, options.json)
    show(table)
    print(f"{time.time() - start:.0f} s")


if __name__ == "__main__":
    main()
