"""Prints whether closing the gap closes the error: named effects added one by one, a detector trained on each.

    python tools/diagnosis/gap_training.py --out out/gap-training    # 40 min on a busy machine

On the authors' flights, in AIRTOUCH_FLIGHTS or ../shared/flights; the table is in host/docs/gap-findings.md.

1. Diagnosis. The folds of the authors' clean flights are divided in two groups (--groups). Those of a group are
   diagnosed twice: whole flights against the simulator, without a baseline (what every flight has that it lacks);
   then low passes over the platform, from 5 s before it, with free air earlier in the same flights as baseline
   (what is there only close to a surface, which the rest of the flight would drown; same day, propellers and
   battery). Kept in OUT/diagnosis_*.json until --force; --diagnose stops there.
2. Training. `best` on flights simulated without any effect, then with the effects that were named added one after
   another at their fitted values, those of the low passes first, then with the vehicle as calibrated in free air,
   and for reference with the scenario's own effects, set by hand. The same missions in every row. Models are kept in
   OUT/models; one is made anew only when the flights that it was trained on come out differently.
3. Test. What was found in one group is tested on real flights of the other: every flight is tested, and never by
   what saw it. Prints a Markdown table: errors with 95 % intervals by bootstrap over flights, and how far the
   simulated flights are from those tested (mean difference of the spectra of nine channels in dB, before and
   over the platform).
"""

import argparse
import hashlib
import json
from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from airtouch import logs, vehicle
from airtouch.cli.shared.arguments import whole_number
from airtouch.cli.shared.flights import need_flights
from airtouch.detector import best
from airtouch.detector.evaluation import crossval, evaluate
from airtouch.detector.evaluation.data import dataset, simulated
from airtouch.detector.evaluation.score import FlightScore
from airtouch.detector.evaluation.summary import one_a_flight, summarise
from airtouch.errors import AirTouchError, in_one_line
from airtouch.extras import need
from airtouch.gap.diagnosis import diagnose
from airtouch.gap.flights.evenly import evenly_spaced
from airtouch.logs.files import make_folder, write_bytes
from airtouch.logs.flight_log import FlightLog
from airtouch.simulation import scenario
from recordings.passes import apart_db, in_still_air, pieces

MOST, MOST_PASSES = 7, 8  #: flights and passes that are diagnosed, evenly spaced: the diagnosis judges on 210 s at most
#: names and parameters of effects
Effects = list[tuple[str, dict[str, float]]]
Flights = Mapping[dataset.FlightFile, FlightLog]


def cut(flights: Flights, groups: Sequence[str]) -> list[Flights]:
    """The flights of each group of folds ("012", "34"); AirTouchError for a fold in two groups or in none."""
    all_folds = "".join(groups)
    odd = [f for f in map(str, {f.condition.fold for f in flights}) if all_folds.count(f) != 1]
    if odd:
        raise AirTouchError(f"--groups {','.join(groups)}: fold {odd[0]} must be in one group, and in one only")
    return [{f: log for f, log in flights.items() if str(f.condition.fold) in folds} for folds in groups]


def diagnoses(flights: Flights, store: Path, force: bool = False) -> dict[str, Any]:
    """Both diagnoses of some flights and the calibration, JSON-ready; read from the file `store` if it exists.

    force: they are made anew, and the file is replaced when they are there.
    """
    if force or not store.is_file():
        calm = {f: log for f, log in flights.items() if in_still_air(f)}
        close = [log for f, log in calm.items() if f.condition.height == "low"]
        cuts = [pair for pair in map(pieces, evenly_spaced(close, MOST_PASSES)) if pair is not None]
        if not cuts:
            raise AirTouchError(f"{len(close)} flights have the height `low` in the manifest, none with a platform and "
                                "the free air before it: give other folds with --groups")
        over, before = zip(*cuts, strict=True)
        craft = vehicle.load(vehicle.DEFAULT_VEHICLE)
        whole, near = diagnose(evenly_spaced(list(calm.values()), MOST), craft), diagnose(over, craft, before)
        calibration = near.calibrated[1] if near.calibrated else None
        write_bytes(json.dumps({"all": whole.plain(), "close": near.plain(), "calibration": [
            [a.effect.name, dict(a.values)] for a in (calibration.active if calibration else ())]}, indent=1).encode(),
            store, force=True)
    return json.loads(store.read_text())


def chain(diagnosis: Mapping[str, Any]) -> list[tuple[str, Effects]]:
    """(what is added, all effects then on): nothing, what is close by, what all flights share, calibration.

    diagnosis: as `diagnoses` gives it.

    An effect that is named twice keeps its first values; a calibrated one gives way to one that was named.
    """
    rows: list[tuple[str, Effects]] = [("nothing", [])]
    on: dict[tuple[str, float | None], tuple[str, dict[str, float]]] = {}
    for effect in [e for part in ("close", "all") for e in diagnosis[part]["effects"]]:
        values = {k: q["value"] for k, q in effect["parameters"].items()}
        if on.setdefault((effect["name"], values.get("rotor")), (effect["name"], values))[1] is values:
            rows.append((f"+ `{effect['name']}`", list(on.values())))
    for name, values in diagnosis["calibration"]:
        on.setdefault((name, values.get("rotor")), (name, values))
    return [*rows, ("+ vehicle as calibrated", list(on.values()))]


def closure_text(diagnosis: Mapping[str, Any]) -> str:
    """The verdict of a diagnosis with the gap and the fraction closed, JSON-ready as `Diagnosis.plain` gives it."""
    names = " and ".join(e["name"] for e in diagnosis["effects"]) or diagnosis["verdict"]
    gap, shrink = diagnosis["gap"], diagnosis["shrink"]
    closed = f", closed {shrink['value']:.0%} [{shrink['low']:.0%}, {shrink['high']:.0%}]" if shrink else ""
    return f"{names}, gap {gap['before']:.2f} -> {gap['after']:.2f} floors{closed}"


def scene_text(effects: Effects) -> str:
    """TOML of the training scenario with these effects, and no others."""
    path = Path(scenario.__file__).parent / "scenarios" / f"{simulated.SCENARIO}.toml"
    lines = [path.read_text(encoding="utf-8").split("\n[effects]\n")[0], "\n[effects]"]
    for name in dict.fromkeys(n for n, _ in effects):
        tables = ["{ " + ", ".join(f"{k} = {float(x)!r}" for k, x in v.items()) + " }"
                  for n, v in effects if n == name]
        lines.append(f"{name} = [{', '.join(tables)}]")
    return "\n".join(lines) + "\n"


@lru_cache(maxsize=4)
def training_flights(text: str, count: int, seed: int, folder: Path) -> list[FlightLog]:
    """Simulated flights of a scenario's text, kept in `folder`; a built-in one by its name."""
    name = text
    if "\n" in text:
        name = str(folder / f"{hashlib.sha256(text.encode()).hexdigest()[:12]}.toml")
        write_bytes(text.encode(), Path(name), force=True)
    return simulated.training_flights(count, name, seed=seed)[0]


def train(text: str, seed: int, options: argparse.Namespace) -> Any:
    """`best` trained on flights of that scenario: from OUT/models where these very flights were trained on."""
    flights = training_flights(text, options.flights, seed, options.out)
    key = hashlib.sha256(f"{seed} {options.steps}".encode())
    for log in flights:
        key.update(log.stack(log.columns).tobytes())
    path = options.out / "models" / f"{key.hexdigest()[:16]}.npz"
    if not path.is_file():
        path.parent.mkdir(parents=True, exist_ok=True)
        model = best.fit(flights, seed=seed, steps=options.steps, command="tools/diagnosis/gap_training.py")
        model.save(path, force=True)
    return best.load(path)


def row(texts: Sequence[str], tested: Sequence[Flights], options: argparse.Namespace) -> str:
    """Cells of one row: scenario texts, one a group of flights tested with it, all seeds."""
    runs, differences = [], []
    for seed in range(options.seeds):
        run: list[FlightScore] = []
        for text, flights in zip(texts, tested, strict=True):
            model = train(text, seed, options)
            run += [evaluate.evaluate_flight(f, log, best, model).score for f, log in flights.items()]
            differences.append(apart_db(training_flights(text, options.flights, seed, options.out),
                                        list(flights.values())))
        runs.append(run)
    figures = summarise(one_a_flight(score for run in runs for score in run))
    each = [summarise(r, replicates=2)["mean_abs_error_m"] for r in runs]
    seeds = ", ".join("-" if x is None else f"{x:.3f}" for x in each)

    def cell(name: str, scale: float, digits: int) -> str:
        """A figure times `scale` with its interval."""
        numbers = (figures[name], *(figures["intervals"][name] or ()))
        value, *ends = ("-" if x is None else f"{scale * x:.{digits}f}" for x in numbers)
        return value + (f" ({' to '.join(ends)})" if ends else "")

    off = "{:.1f}, {:.1f}".format(*np.average(differences, axis=0, weights=[len(t) for t in tested] * options.seeds))
    return " | ".join((cell("mean_abs_error_m", 1, 3), seeds, cell("missed", 100, 1),
                       cell("false_per_minute", 1, 1), cell("balanced_accuracy", 100, 0), off))


def print_table(chains: Sequence[Sequence[tuple[str, Effects]]], group_names: Sequence[str], groups: Sequence[Flights],
                options: argparse.Namespace) -> None:
    """Print a row for each effect added, then one for the scenario's own.

    chains: of each group, as `chain` gives it; a group's effects are tested on the next group's flights.
    """
    tested = [groups[(i + 1) % len(groups)] for i in range(len(groups))]
    edges = sum(len(logs.true_edges(log)) for group in groups for log in group.values())
    print(f"{sum(map(len, groups))} recorded flights, {edges} edges; {options.seeds} trainings a row, "
          f"{options.steps} steps on {options.flights} flights\n\n| added to the simulator, found in folds "
          f"{' / '.join(group_names)} | error, m | each training | missed, % | false/min | "
          "balanced, % | spectra off, dB: before, over |\n|---|---|---|---|---|---|---|", flush=True)
    for i in range(max(map(len, chains))):
        names = [c[i][0] if i < len(c) else "-" for c in chains]
        texts = [scene_text(c[min(i, len(c) - 1)][1]) for c in chains]
        try:
            cells = row(texts, tested, options)
        except AirTouchError as error:
            cells = f"not flown: {error} | | | | |"
        print(f"| {names[0] if len(set(names)) == 1 else ' / '.join(names)} | {cells} |", flush=True)
    print(f"| the scenario's own, set by hand | {row([simulated.SCENARIO] * len(tested), tested, options)} |")


def main() -> None:
    """Diagnose, train, test, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/gap-training"), help="diagnoses and models")
    parser.add_argument("--groups", default="012,34", help="folds of each group (default 012,34)")
    parser.add_argument("--flights", type=whole_number(1), default=90,
                        help="simulated flights to train on (default 90)")
    parser.add_argument("--steps", type=whole_number(1), default=800, help="training steps (default 800)")
    parser.add_argument("--seeds", type=whole_number(1), default=2, help="trainings a row (default 2)")
    parser.add_argument("--force", action="store_true", help="begin anew")
    parser.add_argument("--diagnose", action="store_true", help="only diagnose")
    options = parser.parse_args()
    group_names = options.groups.split(",")
    if not all(map(str.isdecimal, group_names)) or len(set(options.groups) - {","}) < sum(map(len, group_names)):
        parser.error(f"--groups {options.groups}: give folds as digits, each in one group only, as 012,34")
    if len(group_names) < 2 and not options.diagnose:
        parser.error(f"--groups {options.groups}: what is found in one group is tested on another: give two or more")
    if not options.diagnose:
        need("train", "training")
    make_folder(options.out)
    read, _ = crossval.readable_flights(files := dataset.collect([need_flights()]))
    groups = cut({f: read[f.path] for f in files if f.path in read}, group_names)
    chains = []
    for name, group in zip(group_names, groups, strict=True):
        both = diagnoses(group, options.out / f"diagnosis_{name}.json", options.force)
        chains.append(chain(both))
        print(f"folds {name}: {' '.join(what for what, _ in chains[-1])}", flush=True)
        print(f"folds {name}, low passes: {closure_text(both['close'])}", flush=True)
    if not options.diagnose:
        print_table(chains, group_names, groups, options)


if __name__ == "__main__":
    with in_one_line("gap_training"):
        main()
