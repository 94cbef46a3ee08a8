"""Prints diagnoses of simulated flights of scenes that nothing was learned from: false alarms and first answers.

    python tools/simulation/gap_scenes.py --flights 2 --seed 200    # 7 min

In every scene so many flights without an effect, and one with each effect of EFFECTS, are held against four others of
the scene; an effect with which three flights end badly is left out, and a line says so. Prints for each scene how
many of the former are `none` and of the latter have the effect as first answer, with intervals of 95 % (Wilson). Seed
0 gave the scatter of flights with a trim of their own (tools/calibration/nominal_scatter.py). The table is in
host/docs/gap-blind.md.
"""

import argparse
import multiprocessing
import os
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from airtouch import vehicle as vehicles
from airtouch.cli.shared.arguments import whole_number
from airtouch.errors import AirTouchError, in_one_line
from airtouch.gap.diagnosis import diagnose
from airtouch.gap.sealed.intervals import share_text
from airtouch.gap.sealed.make import VEHICLE, ending_well
from airtouch.gap.signatures.alike import interchangeable
from airtouch.logs.flight_log import FlightLog
from airtouch.simulation import batch, effects, scenario

SCENES = ("paper-low", "paper-9cm", "paper-12cm", "steps", "zigzag", "hover")  #: no source: few of each kind
BASELINE = 4  #: flights; as `gap demo` has them
#: strengths that a pilot may notice, of effects that these scenes do not draw or draw weakly; no source
EFFECTS = ("mass:fraction=0.12", "com_offset:x=0.002m", "wind:x=0.4m/s", "motor_noise:rms=0.05",
           "imu_noise:factor=2", "controller_gain:attitude=0.7", "motor_lag:factor=2")


def flown(scene: str, count: int, seed: int, effect: str = "") -> list[FlightLog]:
    """So many flights that end well, without what the simulator alone knows; AirTouchError where there are fewer."""
    pairs = [effects.parse(effect)] if effect else []
    flights = batch.flights(scene, range(3 * count), vehicle=VEHICLE, effects=pairs, seed=seed, workers=1)
    return ending_well(flights, count, f"{scene} {effect}: of {3 * count} flights")


def answers(task: tuple[str, int, int]) -> list[tuple[str, str, float]]:
    """The effect that acts (or `none`), the first answer and its probability, of every flight of a scene."""
    scene, flights, seed = task
    vehicle = vehicles.load(VEHICLE)
    baseline = flown(scene, BASELINE, seed)
    out, before = [], None
    for truth, log in _cases(scene, flights, seed):
        before = diagnose([log], vehicle, baseline, before=before)
        first = before.ranking[0]
        out.append((truth, first.name, first.probability))
        print(f"{scene}: {truth}: {first.name} {first.probability:.2f}", file=sys.stderr, flush=True)
    return out


def _cases(scene: str, flights: int, seed: int) -> Iterator[tuple[str, FlightLog]]:
    """Names of effects and flights with them, each of a seed of its own, of effects with which a flight ends well."""
    yield from (("none", log) for log in flown(scene, flights, seed + 1))
    for i, effect in enumerate(EFFECTS):
        try:
            (log,) = flown(scene, 1, seed + 2 + i, effect)
        except AirTouchError as error:
            print(f"left out: {error}", file=sys.stderr, flush=True)
        else:
            yield effect.split(":")[0], log


def right(rows: list[tuple[str, str, float]]) -> str:
    """How many first answers are right, and the interval of their fraction."""
    hits = sum(interchangeable(truth, first) for truth, first, _ in rows)
    return share_text(hits, len(rows))


def main() -> None:
    """Diagnose the flights of the scenes and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", nargs="+", default=SCENES, help=f"scenarios (default: {', '.join(SCENES)})")
    parser.add_argument("--flights", type=whole_number(1), default=8,
                        help="without an effect, in each scene (default %(default)s)")
    parser.add_argument("--seed", type=whole_number(0), default=100, help="of the flights (default %(default)s)")
    parser.add_argument("--jobs", type=whole_number(1), default=2, help="processes (default %(default)s)")
    args = parser.parse_args()
    for scene in args.scenes:
        scenario.load(scene)  # raises AirTouchError for one that there is not
    with ProcessPoolExecutor(args.jobs, multiprocessing.get_context("spawn")) as pool:
        rows_of = dict(zip(args.scenes, pool.map(answers, [(s, args.flights, args.seed) for s in args.scenes]),
                           strict=True))
    print("| scene | without an effect: `none` | with one: first answer right | other answers |\n|---|---|---|---|")
    for scene, rows in {**rows_of, "together": [r for table in rows_of.values() for r in table]}.items():
        nominal, with_one = ([r for r in rows if (r[0] == "none") is none] for none in (True, False))
        wrong = ", ".join(f"{truth}: {first}" for truth, first, _ in rows
                          if not interchangeable(truth, first)) if scene in rows_of else ""
        print(f"| {scene} | {right(nominal)} | {right(with_one)} | {wrong} |")


if __name__ == "__main__":
    with in_one_line("gap_scenes"):
        main()
