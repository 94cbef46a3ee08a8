"""Diagnoses every flight of CrazyPAD alone, calibrated on the other normal flights of its drone.

    python tools/diagnosis/gap_crazypad.py [FOLDER] [--keep results.jsonl] [--leave-one-out]    # 20 s
    python tools/diagnosis/gap_crazypad.py [FOLDER] --corrections

The figures are in host/docs/gap-crazypad.md. FOLDER holds the flights and their manifest.csv. The label is read after
the diagnosis. With --keep, flights that the file holds already are not diagnosed again. The priors of the diagnosis
were chosen with these conditions in view; --leave-one-out chooses them anew for each condition, from a grid, by the
others alone. --corrections fits how unsteadiness and heave follow the corrections of the estimated velocity, on the
building part: all but every fourth condition.
"""

import argparse
import itertools
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from airtouch import vehicle as vehicles
from airtouch.cli.shared.flights import check_data_set
from airtouch.cli.shared.progress import with_bar
from airtouch.errors import in_one_line
from airtouch.gap.balance import hover_balance
from airtouch.gap.balance.hover_hypotheses import hypotheses
from airtouch.gap.balance.hover_pattern import HoverPattern
from airtouch.gap.balance.priors import PRIORS, STEADY, Priors
from airtouch.gap.diagnosis import diagnose
from airtouch.logs import read
from airtouch.logs.files import check_free
from recordings.crazypad.corrections import POWER_NAMES, HoverPowers
from recordings.crazypad.figures import balanced_accuracy, exact_rotors, print_figures
from recordings.crazypad.labels import VEHICLE, baseline, family, manifest
from recordings.crazypad.patterns import hover_patterns, likeliest
from recordings.folder import add_folder
from recordings.result_store import Result, add_keep_option, complete

SAME: Any = STEADY  #: unsteadiness and heave that do not tell a damage
#: priors to choose from, round numbers below and above those of `PRIORS`
GRID = [Priors(nominal_flights=n, maintenance=(*PRIORS.maintenance[:3], yaw), slung_mass=slung, **power)
        for n, yaw, slung, power in itertools.product(
            (0.5, 1.0, 3.0), (0.012, 0.02, 0.03), (0.01, 0.02, 0.04),
            ({}, {"damaged": SAME}))]
ROTOR_WEIGHT = 0.3  #: of the fraction of rotors named exactly beside the balanced accuracy; no source: round number


def diagnose_all(folder: Path, store: Path | None) -> list[Result]:
    """Each flight's result, in the manifest's order; those that the file `store` holds are taken from there."""
    rows = manifest(folder, "all")
    logs = {k: read(folder / r["file"]) for k, r in enumerate(rows) if family(r["condition"]) == "normal"}
    vehicle = vehicles.load(VEHICLE)

    def run(todo: list[int]) -> Iterator[Result]:
        """The results of some flights, by their place in the manifest."""
        for i in with_bar(todo, "diagnosing"):
            row = rows[i]
            diagnosis = diagnose([read(folder / row["file"])], vehicle, [logs[k] for k in baseline(rows, i)]).plain()
            yield {"file": row["file"], "drone": row["drone"], "condition": row["condition"],
                   "verdict": diagnosis["verdict"], "effects": diagnosis["effects"],
                   "ranking": {r["name"]: r["probability"] for r in diagnosis["ranking"]}}

    return complete({row["file"]: i for i, row in enumerate(rows)}, run, lambda result: result["file"], store)


def cross_validate(folder: Path) -> list[Result]:
    """Results of all flights, each condition with the priors of GRID that do best on the other conditions."""
    rows = manifest(folder, "all")
    vehicle = vehicles.load(VEHICLE)
    patterns = hover_patterns(folder, rows, vehicle)
    return best_of_others([results_with(rows, patterns, vehicle, priors) for priors in GRID])


def best_of_others(tables: list[list[Result]]) -> list[Result]:
    """Results of all conditions in turn, each from the table that scores best on the other conditions.

    tables: the results of all flights, once for each choice of priors.
    """
    out = []
    for condition in sorted({r["condition"] for r in tables[0]}):
        others = [[r for r in table if r["condition"] != condition] for table in tables]
        scores = [balanced_accuracy(results) + ROTOR_WEIGHT * exact_rotors(results) for results in others]
        out += [r for r in tables[scores.index(max(scores))] if r["condition"] == condition]
    return out


def results_with(rows: list[dict], patterns: list[HoverPattern], vehicle: vehicles.Vehicle,
                 priors: Priors) -> list[Result]:
    """Results of all flights with these priors, by `hover_balance` alone. patterns: of each flight."""
    candidates, out = hypotheses(vehicle, priors), []
    names = ["mass" if h.name == "com_offset" else h.name for h in candidates]
    for k, (row, pattern) in enumerate(zip(rows, patterns, strict=True)):
        nominal = hover_balance.reference([patterns[i] for i in baseline(rows, k)], priors)
        logs, weights = hover_balance.evidence(nominal.difference(pattern), nominal, candidates, priors)
        first = likeliest(logs, names)
        i = max((i for i, h in enumerate(candidates) if h.name == first), key=logs.__getitem__)
        effects = [{"name": n, "parameters": {k: {"value": float(weights[i] @ v)} for k, v in samples.items()}}
                   for n, samples in candidates[i].effects]
        verdict = first if first in ("none", "unknown") else "effect"
        out.append({**row, "verdict": verdict, "effects": effects})
    return out


def show_corrections(folder: Path) -> None:
    """Print the fit of `hover_balance.ANSWER` to both drones and to each, and what it leaves of the powers."""
    rows = manifest(folder, "build")
    powers = HoverPowers(rows, hover_patterns(folder, rows, vehicles.load(VEHICLE)))
    for power_name, drones, (factor, before, after) in powers.fits():
        print(f"{power_name}, {' and '.join(drones)}: 10^{factor:.2f} for one (m/s)^2; deviation between flights "
              f"{before.std():.2f}, left {after.std():.2f} ({len(before)} flights)")
    for families in (["rotor damage"], ["added weight", "slung load"]):
        means = powers.left_over(families)
        print(f"{' and '.join(families)}, left over the normal flights, {len(means)} conditions: " + ", ".join(
            f"{n} {m:.2f} +- {s:.2f}" for n, m, s in zip(POWER_NAMES, means.mean(axis=0), means.std(axis=0, ddof=1),
                                                         strict=True)))


def main() -> None:
    """Diagnose every flight, or fit how the powers follow the corrections, and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_folder(parser, "crazypad")
    add_keep_option(parser, "", "--json")
    parser.add_argument("--leave-one-out", action="store_true", help="also with priors chosen by the others")
    parser.add_argument("--corrections", action="store_true",
                        help="instead fit how unsteadiness and heave follow the corrections of the velocity")
    options = parser.parse_args()
    if options.corrections and (options.keep or options.leave_one_out):
        parser.error("--corrections diagnoses no flight: leave out --keep and --leave-one-out")
    check_data_set(options.folder)
    if options.corrections:
        show_corrections(options.folder)
        return
    check_free(options.keep, force=True)
    start = time.time()
    print_figures(diagnose_all(options.folder, options.keep))
    if options.leave_one_out:
        print("\nPriors chosen without the condition judged:")
        print_figures(cross_validate(options.folder))
    print(f"{time.time() - start:.0f} s")


if __name__ == "__main__":
    with in_one_line("gap_crazypad"):
        main()
