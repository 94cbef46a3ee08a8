"""CrazyPAD: every flight diagnosed alone, calibrated on the other normal flights of its drone.

    python tools/gap_crazypad.py FOLDER [--json cases.jsonl] [--leave-one-out]
    python tools/gap_crazypad.py FOLDER --corrections

FOLDER holds the flights and their manifest.csv. The label is read after the diagnosis. With
--json, cases that the file holds already are not diagnosed again. What the diagnosis
believes beforehand (`hover_balance.Beliefs`) was chosen with these conditions in view;
--leave-one-out chooses it anew for each condition, from a grid, by the others alone.
--corrections fits how unsteadiness and heave follow the corrections of the estimated velocity
(`hover_balance.ANSWER`), on the building part: all but every fourth condition.
"""

import argparse
import csv
import itertools
import json
import os
import re
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import spearmanr

from airtouch import vehicle
from airtouch.gap.balance import hover_balance
from airtouch.gap.diagnose import diagnose
from airtouch.gap.flights.flight import ready
from airtouch.logs import read

FAMILIES = ("normal", "rotor damage", "added weight", "slung load")
FAMILY_OF = {"weak_motor": "rotor damage", "mass": "added weight", "com_offset": "added weight",
             "slung_load": "slung load"}
RESAMPLES = 2000
LEAST_MM = 1.5  #: cut off a rotor, both blades together; less may be called normal
_AS_DAMAGE: dict = {"verdict": "effect", "effects": [
    {"name": "weak_motor", "parameters": {"rotor": {"value": 0}, "thrust_loss": {"value": 0.0}}}]}
SAME: Any = hover_balance.STEADY  #: unsteadiness and heave that do not tell a damage
GRID = [hover_balance.Beliefs(own=own, worked_on=(*hover_balance.BELIEFS.worked_on[:3], yaw), hung=hung, **manner)
        for own, yaw, hung, manner in itertools.product(
            (0.5, 1.0, 3.0), (0.012, 0.02, 0.03), (0.01, 0.02, 0.04),
            ({}, {"damaged": SAME}))]


def manifest(folder: Path, part: str) -> list[dict[str, str]]:
    """Rows of the manifest, all of them or, of part "build", those of the building part."""
    rows = list(csv.DictReader((folder / "manifest.csv").open()))
    return [r for r, built in zip(rows, building(rows), strict=True) if built or part == "all"]


def folder_and_part(description: str | None) -> argparse.Namespace:
    """`folder` and `part` of the command line of a tool with this description."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=Path,
                        default=Path(os.environ.get("AIRTOUCH_FLIGHTS", "../shared/flights")) / "crazypad")
    parser.add_argument("--part", choices=("build", "all"), default="build")
    return parser.parse_args()


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
    return {int(r): sum(float(x) for x in re.findall(r"([\d.]+)mm", text) if float(x) < 20.0) for r, text in parts}


def large(condition: str) -> bool:
    """Whether at least LEAST_MM are gone of a rotor."""
    return max(millimetres(condition).values(), default=0.0) >= LEAST_MM


def answer(case: dict) -> tuple[str, list[int], float]:
    """The family, the rotors and the summed loss of thrust that a diagnosis names."""
    names = [e["name"] for e in case["effects"]]
    if case["verdict"] != "effect":
        return ("normal" if case["verdict"] == "none" else "unknown"), [], 0.0
    weak = [e["parameters"] for e in case["effects"] if e["name"] == "weak_motor"]
    return FAMILY_OF.get(names[0], "other"), sorted(round(p["rotor"]["value"]) for p in weak), \
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


def forgiven(table: list[dict]) -> float:
    """`balanced`, where a cut of less than LEAST_MM may be called normal."""
    def small(c: dict) -> bool:
        return bool(millimetres(c["condition"])) and not large(c["condition"]) and answer(c)[0] == "normal"

    return balanced([c for c in table if not small(c)]
                    + [{**c, **_AS_DAMAGE} for c in table if small(c)])


def named(table: list[dict]) -> float:
    """Share of rotor-damage flights for which exactly the damaged rotors are named."""
    hit = [answer(c)[1] == rotors(c["condition"]) for c in table if rotors(c["condition"])]
    return float(np.mean(hit)) if hit else float("nan")


def some_named(table: list[dict]) -> float:
    """Share of rotor-damage flights for which a damaged rotor and no sound one is named."""
    hit = [bool(answer(c)[1]) and set(answer(c)[1]) <= set(rotors(c["condition"]))
           for c in table if rotors(c["condition"])]
    return float(np.mean(hit)) if hit else float("nan")


def large_named(table: list[dict]) -> float:
    """`named` of the flights with at least LEAST_MM gone of a rotor."""
    return named([c for c in table if large(c["condition"])])


def some_large_named(table: list[dict]) -> float:
    """`some_named` of the flights with at least LEAST_MM gone of a rotor."""
    return some_named([c for c in table if large(c["condition"])])


def severity(table: list[dict]) -> float:
    """Spearman's rank correlation of thrust_loss (0 where none is named) with the millimetres cut."""
    cut = [(cut_mm(c["condition"]), answer(c)[2]) for c in table if np.isfinite(cut_mm(c["condition"]))]
    return float(spearmanr(*zip(*cut, strict=True)).statistic) if len(cut) > 2 else float("nan")


def left_out(folder: Path) -> list[dict]:
    """Every flight judged with beliefs that do best on the other conditions."""
    rows = list(csv.DictReader((folder / "manifest.csv").open()))
    flown = vehicle.load("crazyflie-2.1")
    seen = [hover_balance.pattern(ready(read(folder / r["file"]), flown), flown) for r in rows]
    made = [_judged(rows, seen, flown, beliefs) for beliefs in GRID]
    out = []
    for condition in sorted({r["condition"] for r in rows}):
        others = [[c for c in table if c["condition"] != condition] for table in made]
        best = max(range(len(GRID)), key=lambda i: balanced(others[i]) + 0.3 * named(others[i]))
        out += [c for c in made[best] if c["condition"] == condition]
    return out


def _judged(rows: list[dict], seen: list[np.ndarray], flown: vehicle.Vehicle,
            beliefs: hover_balance.Beliefs) -> list[dict]:
    every, out = hover_balance.hypotheses(flown, beliefs), []
    for row, pattern in zip(rows, seen, strict=True):
        base = np.array([p for r, p in zip(rows, seen, strict=True) if r["drone"] == row["drone"]
                         and family(r["condition"]) == "normal" and r["file"] != row["file"]])
        nominal = hover_balance.reference(base, beliefs)
        logs, weights = hover_balance.evidence(pattern, nominal, every, beliefs)
        chance = np.exp(logs - logs.max())
        total: dict[str, float] = {}
        for h, p in zip(every, chance, strict=True):
            name = "mass" if h.name == "com_offset" else h.name
            total[name] = total.get(name, 0.0) + p
        first = max(total, key=total.__getitem__)
        i = max((i for i, h in enumerate(every) if h.name == first), key=logs.__getitem__)
        effects = [{"name": n, "parameters": {k: {"value": float(weights[i] @ v)} for k, v in drawn.items()}}
                   for n, drawn in every[i].effects]
        verdict = first if first in ("none", "unknown") else "effect"
        out.append({**row, "verdict": verdict, "effects": effects})
    return out


def building(rows: list[dict]) -> list[bool]:
    """Whether numbers may be chosen on a flight: all normal ones, three conditions in four of the others."""
    defects = sorted({r["condition"] for r in rows if family(r["condition"]) != "normal"})
    return [family(r["condition"]) == "normal" or defects.index(r["condition"]) % 4 != 3 for r in rows]


def show_corrections(folder: Path) -> None:
    """The fit of `hover_balance.ANSWER` to both drones and to each, and what is left of the powers by family."""
    rows = list(csv.DictReader((folder / "manifest.csv").open()))
    rows = [r for r, built in zip(rows, building(rows), strict=True) if built]
    flown = vehicle.load("crazyflie-2.1")
    table = np.array([hover_balance.pattern(ready(read(folder / r["file"]), flown), flown) for r in rows])
    drone = np.array([r["drone"] for r in rows])
    for k, what in enumerate(hover_balance.NAMES[4:6]):
        for names in (sorted(set(drone)), *([d] for d in sorted(set(drone)))):
            own = [drone == d for d in names]
            power, caused = [table[m, 4 + k] for m in own], [10.0 ** table[m, 6 + k] for m in own]
            factor, before, left = corrections_fit(power, caused, float(np.log10(hover_balance.ANSWER[k])))
            print(f"{what}, {' and '.join(names)}: 10^{factor:.2f} for one (m/s)^2; deviation between flights "
                  f"{before.std():.2f}, left {left.std():.2f} ({len(before)} flights)")
    normal = np.array([family(r["condition"]) == "normal" for r in rows])
    bases = {d: hover_balance.reference(table[normal & (drone == d)]) for d in set(drone)}
    over = np.array([bases[d].difference(p)[4:] for d, p in zip(drone, table, strict=True)])
    for families in (["rotor damage"], ["added weight", "slung load"]):
        pairs = sorted({(r["condition"], r["drone"]) for r in rows if family(r["condition"]) in families})
        means = np.array([np.mean([a for a, r in zip(over, rows, strict=True)
                                   if (r["condition"], r["drone"]) == pair], axis=0) for pair in pairs])
        print(f"{' and '.join(families)}, left over the normal flights, {len(pairs)} conditions: " + ", ".join(
            f"{n} {m:.2f} +- {s:.2f}" for n, m, s in zip(hover_balance.NAMES[4:6], means.mean(axis=0),
                                                         means.std(axis=0, ddof=1), strict=True)))


def corrections_fit(power: list[np.ndarray], caused: list[np.ndarray], start: float,
                    ) -> tuple[float, np.ndarray, np.ndarray]:
    """log10 of the power for one (m/s)^2 of corrections, and the scatter (flights,) of log10 power before and after.

    power: log10, of each drone's flights; caused: their corrections, (m/s)^2. Each drone has a power of its own beside.
    """
    def left(x: np.ndarray) -> np.ndarray:
        return np.concatenate([y - np.log10(10.0 ** own + 10.0 ** x[-1] * c)
                               for y, own, c in zip(power, x[:-1], caused, strict=True)])

    found = least_squares(left, [*(y.min() for y in power), start])
    return float(found.x[-1]), np.concatenate([y - y.mean() for y in power]), left(found.x)


FIGURES = {"balanced accuracy of the family": balanced,
           f"the same, a cut under {LEAST_MM} mm may be normal": forgiven,
           "damaged rotors named exactly": named, "only damaged rotors named": some_named,
           f"exactly, of at least {LEAST_MM} mm off a rotor": large_named,
           f"only damaged, of at least {LEAST_MM} mm off a rotor": some_large_named,
           "severity, Spearman": severity}


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
    for text, figure in FIGURES.items():
        low, high = interval(table, figure)
        print(f"{text:48s} {figure(table):.3f} ({low:.3f} to {high:.3f})")
    for drone in sorted({c["drone"] for c in table}):
        for which in ("M1", "M3"):
            part = [c for c in table if c["drone"] == drone and c["condition"].startswith("cut")
                    and ("_M1_" in c["condition"]) == (which == "M1")]
            if len(part) > 5:
                cut = "M2 and M1" if which == "M1" else "M3"
                print(f"severity, {drone}, {cut} cut: {severity(part):.3f} ({len(part)} flights)")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--json", type=Path, help="cases already done are read from here, new ones appended")
    parser.add_argument("--leave-one-out", action="store_true", help="also with beliefs chosen by the others")
    parser.add_argument("--corrections", action="store_true", help="only fit the answer to corrections of the estimate")
    options = parser.parse_args()
    if options.corrections:
        show_corrections(options.folder)
        return
    start = time.time()
    show(cases(options.folder, options.json))
    if options.leave_one_out:
        print("\nBeliefs chosen without the condition judged:")
        show(left_out(options.folder))
    print(f"{time.time() - start:.0f} s")


if __name__ == "__main__":
    main()
