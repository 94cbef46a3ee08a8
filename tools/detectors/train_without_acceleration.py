"""Trains the detector for logs without acceleration: recorded flights, and simulated edges over shorter platforms.

    python tools/detectors/train_without_acceleration.py ../shared/flights/airtouch --twin twin012 --out without.npz
        [--free-air FOLDER] [--hold-out FOLD] [--least 0.3] [--seed 0] [--force]

The twin's edges are laid over the flights' free air as `airtouch adapt` does, but its platforms are 0.3 to 1 times as
long as the recorded ones: a detector of recorded passes alone misses shorter ones of another month. Acceleration is
left out of all flights; recorded and simulated flights have half of the crops each. --hold-out: not trained on the
flights of this fold of the manifest, for a cross-validation, whose figures are in host/docs/results.md.

One training of 2,500 steps (`adapt.STEPS`), after the twin's flights are simulated.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

from airtouch import vehicle
from airtouch.cli.shared.arguments import whole_number
from airtouch.cli.shared.progress import Bar
from airtouch.detector import best
from airtouch.detector.best import free_air
from airtouch.detector.best.fit_settings import Progress
from airtouch.detector.best.model import BestModel
from airtouch.detector.evaluation import crossval
from airtouch.detector.evaluation.data import dataset
from airtouch.detector.shared import sensors
from airtouch.errors import in_one_line
from airtouch.logs.files import check_free
from airtouch.logs.flight_log import FlightLog
from airtouch.simulation import scenario
from airtouch.twin import adapt, files
from airtouch.twin.recorded.missions import shorten

COMMAND = "tools/detectors/train_without_acceleration.py"  #: in the model's metadata
ABSENT = ("acceleration",)  #: sensors that the detector does without


def fit(flights: Sequence[adapt.LoadedFlight], twin: Path, air: Sequence[FlightLog], least: float,
        seed: int, progress: Progress | None = None) -> BestModel:
    """The detector; its lag is that of the recorded flights. air: flights of any vehicle without edges."""
    scene, craft = scenario.load(twin / files.SCENARIO), vehicle.load(str(twin / files.VEHICLE))
    twin_flights, _ = adapt.simulated_flights(flights, shorten(scene, least, seed), craft, seed, None)
    recorded, simulated = ([sensors.without(log, ABSENT) for log in logs]
                           for logs in ([f.log for f in flights], twin_flights.logs))
    own = [None] * len(recorded)
    weights = [len(simulated) / len(recorded)] * len(recorded) + [1.0] * len(simulated)
    return best.fit([*recorded, *simulated], seed, pseudo_labels=[*own, *twin_flights.edges], emphasis=weights,
                    free_air=air, decoder=adapt.DECODER, steps=adapt.STEPS["scratch"], command=COMMAND,
                    lag_of=(recorded, own), progress=progress)


def training_files(folders: Sequence[Path], hold_out: int | None) -> list[dataset.FlightFile]:
    """The flights of the folders without those of the fold `hold_out`; all of them for None, also flights of no fold.

    Raises as `dataset.collect` does.
    """
    return [f for f in dataset.collect(folders) if hold_out is None or f.condition.fold != hold_out]


def main() -> None:
    """Read, train, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", type=Path, nargs="+", help="of recorded flights with edges")
    parser.add_argument("--twin", type=Path, required=True, help="folder of `airtouch twin`")
    parser.add_argument("--free-air", type=Path, action="append", default=[], help="folder of flights without edges")
    parser.add_argument("--hold-out", type=whole_number(0), metavar="FOLD", help="train on no flight of this fold")
    parser.add_argument("--least", type=float, default=0.3, help="of a platform's length (default %(default)s)")
    parser.add_argument("--seed", type=whole_number(0), default=0, help="of the training (default %(default)s)")
    parser.add_argument("--out", type=Path, required=True, help="the model")
    parser.add_argument("--force", action="store_true", help="replace --out if it is there")
    options = parser.parse_args()
    if not 0.0 < options.least <= 1.0:
        parser.error("--least is a fraction: more than 0, at most 1")
    check_free(options.out, options.force)
    scenario.load(options.twin / files.SCENARIO)  # before the flights are read
    listed = training_files(options.folders, options.hold_out)
    readable = crossval.all_readable(listed, best.SPARE_SENSORS)
    air = free_air.read(options.free_air) if options.free_air else []
    flights = [adapt.LoadedFlight(f, readable[f.path]) for f in listed]
    with Bar("training") as bar:
        model = fit(flights, options.twin, air, options.least, options.seed, lambda _, *done: bar(*done))
    model.save(options.out, options.force)
    print(f"written: {options.out}")


if __name__ == "__main__":
    with in_one_line("train_without_acceleration"):
        main()
