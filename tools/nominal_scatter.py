"""How strong every effect seems to be in recorded flights that have none: makes gap/nominal_scatter.toml.

    python tools/nominal_scatter.py [FLIGHTS] [--out nominal_scatter.toml] [--keep cases.jsonl]

Every nominal flight is held against up to five others of its vehicle, day and condition, on which the vehicle is
calibrated. Authors' flights of folds 0 to 2; neural-swarm's days 19 and 20; simulated flights of this project.
With --keep, flights that the file holds already are not worked on again.
"""

import argparse
import csv
import json
import os
import sys
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from airtouch import vehicle as vehicles
from airtouch.gap import blind, calibrate, measure, nominal_scatter
from airtouch.gap.data import Data
from airtouch.gap.nominal_scatter import Apparent, Scatter, measured
from airtouch.gap.select import apparent
from airtouch.logs import read
from airtouch.logs.flight_log import FlightLog
from airtouch.vehicle import Vehicle

MOST = 5  #: flights that one is held against
LEAST = 4  #: flights of a group
SIMULATED = 4  #: groups of simulated flights
Log = tuple[str, Callable[[], FlightLog]]


def groups(folder: Path) -> Iterator[tuple[str, str, Vehicle, list[Log]]]:
    """Class, group, vehicle and nominal flights, each a name and a way to its log, that belong together."""
    made = defaultdict(list)
    for r in csv.DictReader((folder / "airtouch" / "manifest.csv").open()):
        if r["use"] == "clean" and r["wind"] == "none" and r["fold"] in ("0", "1", "2"):
            made[r["file"].split("_")[2][:4], r["height"], r["angle_deg"]].append(_read(folder / "airtouch" / r["file"]))
    flown = vehicles.load("crazyflie-2.1-flow")
    for key, files in made.items():
        yield "crazyflie, flow deck, radio log", " ".join(key), flown, files
    swarm = folder / "neuralswarm"
    made = defaultdict(list)
    for name in ("baselines.csv", "manifest.csv"):
        for r in csv.DictReader((swarm / name).open()):
            if r["day"] in ("19", "20") and r.get("truth", "none") == "none":
                made[r["group"], r["vehicle"]].append(_read(swarm / "flights" / r["file"]))
    for (group, of), files in made.items():
        yield f"motion capture, uSD log, {of}", group, vehicles.load(swarm / f"{of}.toml"), files
    flown = vehicles.load(blind.VEHICLE)
    for seed in range(SIMULATED):
        logs = blind.nominal(flown, blind.CAL_FIRST, blind.CAL, seed)
        yield nominal_scatter.SIMULATED, f"seed {seed}", flown, [(f"simulated {seed} {i}", lambda log=log: log)
                                                   for i, log in enumerate(logs)]


def _read(path: Path) -> Log:
    return path.name, lambda: read(path)


def held_out(logs: list[Log], flown: Vehicle) -> Iterator[tuple[str, Apparent]]:
    """Each flight against others of its group."""
    ready = list(zip([name for name, _ in logs], measure.usable([log() for _, log in logs], flown, []), strict=True))
    for i, (name, flight) in enumerate(ready):
        others = [f for k, (_, f) in enumerate(ready) if k != i]
        chosen = [others[k] for k in np.unique(np.linspace(0, len(others) - 1, MOST).astype(int))]
        study, _ = calibrate.calibrated(flown, chosen, scatter=False)
        yield name, apparent(Data(study, [flight]))


def text_of(classes: dict[str, Scatter], counts: dict[str, str]) -> str:
    """The table as TOML."""
    lines = ["# Root mean square of the apparent strength of every effect, in its natural steps (candidates.Term), in",
             "# nominal flights held against others; made by tools/nominal_scatter.py.", ""]
    for name, s in classes.items():
        lines += [f'["{name}"]  # {counts[name]}', *([f'vehicle = "{s.vehicle}"'] if s.vehicle else []),
                  f"freedom = {s.freedom:g}", f"root_rate = [{s.rate[0]:.3f}, {s.rate[1]:.3f}]",
                  f"root_passing_rate = [{s.passing_rate[0]:.3f}, {s.passing_rate[1]:.3f}]", f'["{name}".rms]']
        lines += [f"{k} = [{', '.join(f'{x:.4g}' for x in v)}]" for k, v in s.rms.items()]
        lines.append("")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("flights", nargs="?", type=Path,
                        default=Path(os.environ.get("AIRTOUCH_FLIGHTS", "../shared/flights")))
    parser.add_argument("--out", type=Path, default=Path("nominal_scatter.toml"))
    parser.add_argument("--keep", type=Path)
    args = parser.parse_args()
    done = {}
    if args.keep and args.keep.exists():
        done = {r["file"]: r for r in map(json.loads, args.keep.read_text().splitlines())}
    cases, groups_of, flown_by = defaultdict(list), defaultdict(set), {}
    for of, group, flown, files in groups(args.flights):
        if len(files) < LEAST:
            continue
        groups_of[of].add(group)
        flown_by[of] = "" if of == nominal_scatter.SIMULATED else flown.name
        if any(name not in done for name, _ in files):
            for name, one in held_out(files, flown):
                done[name] = {"file": name, "rate": one.rate, "passing_rate": one.passing_rate,
                                   "strengths": {k: v.tolist() for k, v in one.strengths.items()},
                              "errors": {k: v.tolist() for k, v in one.errors.items()}}
                if args.keep:
                    with args.keep.open("a") as out:
                        out.write(json.dumps(done[name]) + "\n")
                print(f"{of}: {name}: {one.rate:.2f} nats a second", file=sys.stderr, flush=True)
        for row in (done[name] for name, _ in files):
            cases[of].append(Apparent(*({k: np.array(v) for k, v in row[part].items()} for part in ("strengths", "errors")),
                                      row["rate"], row["passing_rate"]))
    classes = {of: replace(measured(flights), vehicle=flown_by[of]) for of, flights in cases.items()}
    counts = {of: f"{len(flights)} flights in {len(groups_of[of])} groups" for of, flights in cases.items()}
    new = args.out.with_suffix(".new")
    new.write_text(text_of(classes, counts))
    new.rename(args.out)
    print(text_of(classes, counts))


if __name__ == "__main__":
    main()
