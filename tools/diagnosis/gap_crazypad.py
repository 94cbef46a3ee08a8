"""CrazyPAD: every flight diagnosed alone, calibrated on the other normal flights of its drone.

    python tools/diagnosis/gap_crazypad.py [FOLDER] [--json cases.jsonl] [--leave-one-out]
    python tools/diagnosis/gap_crazypad.py [FOLDER] --corrections

FOLDER holds the flights and their manifest.csv. The label is read after the diagnosis. With
--json, cases that the file holds already are not diagnosed again. What the diagnosis
takes as known beforehand (`priors.Priors`) was chosen with these conditions in view;
--leave-one-out chooses it anew for each condition, from a grid, by the others alone.
--corrections fits how unsteadiness and heave follow the corrections of the estimated velocity
(`hover_balance.ANSWER`), on the building part: all but every fourth condition.
"""

import argparse
import itertools
import json
import os
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from airtouch import vehicle as vehicles
from airtouch.gap.balance import hover_balance
from airtouch.gap.balance.hover_hypotheses import hypotheses
from airtouch.gap.balance.hover_pattern import HoverPattern, hover_pattern
from airtouch.gap.balance.priors import PRIORS, STEADY, Priors
from airtouch.gap.diagnosis import diagnose
from airtouch.gap.flights.flight import ready
from airtouch.logs import read
from crazypad.corrections import show_corrections
from crazypad.figures import balanced_accuracy, exact_rotors, print_answers
from crazypad.labels import VEHICLE, family, manifest

SAME: Any = STEADY  #: unsteadiness and heave that do not tell a damage
#: priors to choose from, round numbers below and above those of `PRIORS`
GRID = [Priors(nominal_flights=n, maintenance=(*PRIORS.maintenance[:3], yaw), slung_mass=slung, **power)
        for n, yaw, slung, power in itertools.product(
            (0.5, 1.0, 3.0), (0.012, 0.02, 0.03), (0.01, 0.02, 0.04),
            ({}, {"damaged": SAME}))]
ROTOR_WEIGHT = 0.3  #: of the share of rotors named exactly beside the balanced accuracy; no source: round number


def cases(folder: Path, store: Path | None) -> list[dict]:
    """Each flight's diagnosis, in the manifest's order; those that the file `store` holds are taken from there."""
    rows = manifest(folder, "all")
    case_of = {}
    if store and store.exists():
        case_of = {c["file"]: c for c in map(json.loads, store.read_text().splitlines())}
    logs = {r["file"]: read(folder / r["file"]) for r in rows if family(r["condition"]) == "normal"}
    drone = {r["file"]: r["drone"] for r in rows}
    vehicle = vehicles.load(VEHICLE)
    out = []
    for i, row in enumerate(rows):
        name = row["file"]
        if name not in case_of:
            base = [log for other, log in logs.items() if other != name and drone[other] == row["drone"]]
            diagnosis = diagnose([read(folder / name)], vehicle, base).plain()
            case_of[name] = {"file": name, "drone": row["drone"], "condition": row["condition"],
                             "verdict": diagnosis["verdict"], "effects": diagnosis["effects"],
                             "ranking": {r["name"]: r["probability"] for r in diagnosis["ranking"]}}
            if store:
                with store.open("a") as file:
                    file.write(json.dumps(case_of[name]) + "\n")
        out.append(case_of[name])
        print(f"\r{i + 1}/{len(rows)}", end="", file=sys.stderr)
    print(file=sys.stderr)
    return out


def cross_validate(folder: Path) -> list[dict]:
    """Cases of all flights, each condition with the priors of GRID that do best on the other conditions."""
    rows = manifest(folder, "all")
    vehicle = vehicles.load(VEHICLE)
    patterns = [hover_pattern(ready(read(folder / r["file"]), vehicle), vehicle) for r in rows]
    tables = [_diagnose(rows, patterns, vehicle, priors) for priors in GRID]
    out = []
    for condition in sorted({r["condition"] for r in rows}):
        others = [[c for c in table if c["condition"] != condition] for table in tables]
        scores = [balanced_accuracy(cases) + ROTOR_WEIGHT * exact_rotors(cases) for cases in others]
        best = scores.index(max(scores))
        out += [c for c in tables[best] if c["condition"] == condition]
    return out


def _diagnose(rows: list[dict], patterns: list[HoverPattern], vehicle: vehicles.Vehicle,
              priors: Priors) -> list[dict]:
    """Cases of all flights with these priors, by `hover_balance` alone. patterns: of each flight."""
    candidates, out = hypotheses(vehicle, priors), []
    for row, pattern in zip(rows, patterns, strict=True):
        base = [p for r, p in zip(rows, patterns, strict=True) if r["drone"] == row["drone"]
                and family(r["condition"]) == "normal" and r["file"] != row["file"]]
        nominal = hover_balance.reference(base, priors)
        logs, weights = hover_balance.evidence(pattern, nominal, candidates, priors)
        likelihoods = np.exp(logs - logs.max())
        total: dict[str, float] = {}
        for h, p in zip(candidates, likelihoods, strict=True):
            name = "mass" if h.name == "com_offset" else h.name
            total[name] = total.get(name, 0.0) + p
        first = max(total, key=total.__getitem__)
        i = max((i for i, h in enumerate(candidates) if h.name == first), key=logs.__getitem__)
        effects = [{"name": n, "parameters": {k: {"value": float(weights[i] @ v)} for k, v in samples.items()}}
                   for n, samples in candidates[i].effects]
        verdict = first if first in ("none", "unknown") else "effect"
        out.append({**row, "verdict": verdict, "effects": effects})
    return out


def main() -> None:
    """Diagnose every flight, or fit the answer to corrections, and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?", type=Path, help="with a manifest.csv (FLIGHTS/crazypad)",
                        default=Path(os.environ.get("AIRTOUCH_FLIGHTS", "../shared/flights")) / "crazypad")
    parser.add_argument("--json", type=Path, help="cases already done are read from here, new ones appended")
    parser.add_argument("--leave-one-out", action="store_true", help="also with priors chosen by the others")
    parser.add_argument("--corrections", action="store_true", help="only fit the answer to corrections of the estimate")
    options = parser.parse_args()
    if not (options.folder / "manifest.csv").is_file():
        parser.error(f"{options.folder} has no manifest.csv: give CrazyPAD's folder, or set AIRTOUCH_FLIGHTS")
    if options.corrections:
        show_corrections(options.folder)
        return
    start = time.time()
    print_answers(cases(options.folder, options.json))
    if options.leave_one_out:
        print("\nPriors chosen without the condition judged:")
        print_answers(cross_validate(options.folder))
    print(f"{time.time() - start:.0f} s")


if __name__ == "__main__":
    main()
