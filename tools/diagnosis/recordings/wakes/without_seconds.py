"""How well each measure by which the diagnosis knows a wake tells wakes from nominal flights, without their seconds."""

import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from airtouch import vehicle as vehicles
from airtouch.detector.evaluation.bootstrap import resampled
from airtouch.gap.evidence.data import Data
from airtouch.gap.flights.flight import ready
from airtouch.gap.nominal import calibrate
from airtouch.gap.nominal.apparent import passing_sizes
from airtouch.gap.passing.one_sided import DOWNWARD
from airtouch.gap.sealed.intervals import auroc
from airtouch.gap.signatures.scatter import UNSTEADY_LIFT, UNSTEADY_TORQUE
from airtouch.gap.signatures.signature import OVERHEAD
from airtouch.gap.study import Study
from airtouch.logs import read

from .. import cases

DRAWS = 2000  #: bootstrap samples of flights, for an interval; no source: round number


def wakes_and_nominal(flights: Path, part: str = "build") -> Iterator[tuple[cases.Case, Data]]:
    """The wakes and the nominal flights of a part with their data, each against the baseline of its group.

    part: "build", days 19 and 20, or "all".
    """
    studies: dict[tuple[str, ...], Study] = {}
    nominal = [c for c in cases.nominal(flights, part) if "neuralswarm" in Path(c.flight).parts]
    for case in [*cases.swarm(flights, part), *nominal]:
        if case.truth == "ground_effect":
            continue
        vehicle = vehicles.load(case.vehicle)
        if case.baseline not in studies:
            base = [ready(read(b), vehicle) for b in case.baseline]
            studies[case.baseline] = calibrate.calibrated(vehicle, base, scatter=False)[0]
        yield case, Data(studies[case.baseline], [ready(read(case.flight), vehicle)])
        print(f"{Path(case.flight).name}", file=sys.stderr, flush=True)


def show_without_seconds(flights: Path) -> None:
    """Print how well each measure of a wake tells wakes from nominal flights, by vehicle."""
    of_truth: dict[tuple[str, str], list[dict[str, float]]] = defaultdict(list)
    for case, data in wakes_and_nominal(flights):
        of_truth[vehicles.load(case.vehicle).name, case.truth].append(passing_sizes(data))
    print("| vehicle | measure | AUROC, 95 % interval | wakes beyond every nominal flight |\n|---|---|---|---|")
    for vehicle_name in sorted({name for name, _ in of_truth}):
        for measure in (OVERHEAD, UNSTEADY_TORQUE, UNSTEADY_LIFT, DOWNWARD):
            wakes, calm = (np.array([sizes[measure] for sizes in of_truth[vehicle_name, truth]])
                           for truth in ("downwash", "none"))
            area, (low, high) = auroc(wakes.tolist(), calm.tolist()), auroc_interval(wakes, calm)
            print(f"| {vehicle_name} | {measure} | {area:.2f} [{low:.2f}, {high:.2f}] | "
                  f"{(wakes > calm.max()).sum()} of {len(wakes)}, of {len(calm)} |")


def auroc_interval(wakes: np.ndarray, calm: np.ndarray) -> np.ndarray:
    """95 % interval (2,) of the AUROC by a bootstrap over flights."""
    return resampled(lambda i, k: auroc(wakes[i].tolist(), calm[k].tolist()), len(wakes), len(calm),
                     replicates=DRAWS, level=0.95)
