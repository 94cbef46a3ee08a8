"""The flights of `airtouch demo`, recorded or simulated, split by flight into training and test."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from airtouch import logs
from airtouch.detector.evaluation.crossval import readable_flights
from airtouch.detector.evaluation.data import dataset
from airtouch.detector.evaluation.data.dataset import FlightFile
from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import FlightLog

TRAIN, TEST = 52, 18  #: largest numbers of flights; with them the demo takes two minutes on two cores
FEWEST = 4  #: least number of flights, training and test together
HELD_OUT = 4  #: every fourth fold is held out, or every fourth flight if there are no folds
GENERATED, SCENARIO = 32, "paper-low"  #: number and scenario of the simulated flights


@dataclass(frozen=True)
class DemoFlights:
    """Training flights, held-out flights, and their origin in words, for the report."""

    train: list[FlightFile]
    test: list[FlightFile]
    origin: str


def choose(folder: Path | None, simulated: Path, speed_mps: float | None = None,
           tell: Callable[[str], None] = lambda _: None,
           progress: Callable[[int, int], None] = lambda *_: None) -> DemoFlights:
    """The recorded flights of `folder`, or for None simulated flights, which are written to the folder `simulated`.

    speed_mps: speed of flights whose manifest has none. tell: called with a line for each simulated flight that
    diverged. progress: called with the numbers of simulated flights and of all, first with 0.
    Raises AirTouchError for fewer than FEWEST flights, and where the folds leave none to train on or none to test.
    """
    if folder is not None:
        files, origin = dataset.collect([folder], speed_mps), f"recorded flights in {folder}"
    else:
        files, origin = simulate_flights(simulated, tell, progress), f"flights of the simulator ({simulated})"
    if len(files) < FEWEST:
        raise AirTouchError(f"{folder or simulated}: {len(files)} flights are too few to train and to test; "
                            f"at least {FEWEST} are needed")
    train, test = split(files)
    if not train or not test:
        raise AirTouchError(f"{folder or simulated}: no flight is left to {'test' if train else 'train'} on: the demo "
                            f"tests on every {HELD_OUT}th fold of the manifest (0, {HELD_OUT}, ...) and trains on the "
                            "others")
    return DemoFlights(spread(train, TRAIN), spread(test, TEST), origin)


def split(files: Sequence[FlightFile]) -> tuple[list[FlightFile], list[FlightFile]]:
    """(training flights, held-out flights). Folds stay whole; a flight without one counts by its index."""
    fold = [i if f.condition.fold is None else f.condition.fold for i, f in enumerate(files)]
    in_test = [k % HELD_OUT == 0 for k in fold]
    return ([f for f, out in zip(files, in_test, strict=True) if not out],
            [f for f, out in zip(files, in_test, strict=True) if out])


def simulate_flights(folder: Path, tell: Callable[[str], None] = lambda _: None,
                     progress: Callable[[int, int], None] = lambda *_: None) -> list[FlightFile]:
    """Simulate flights and write them with their manifest. The first call compiles the simulator."""
    from airtouch.simulation import batch, scenario
    from airtouch.simulation.flight import Diverged
    from airtouch.simulation.workers import store

    scene = scenario.load(SCENARIO)
    folder.mkdir(parents=True, exist_ok=True)
    store.check_manifest(folder)
    progress(0, GENERATED)
    for number, flight in enumerate(batch.flights(scene, GENERATED)):
        path = store.path_of(folder, scene.name, 0, number)
        path.unlink(missing_ok=True)
        if isinstance(flight, Diverged):
            tell(str(flight))
        else:
            logs.write(flight, path)
        progress(number + 1, GENERATED)
    store.write_manifest(folder, scene, 0)
    return dataset.collect([folder])


def spread(files: list[FlightFile], most: int) -> list[FlightFile]:
    """At most `most` files, taken evenly from the list, so that every condition is represented."""
    return files if len(files) <= most else [files[i * len(files) // most] for i in range(most)]


def readable(files: Sequence[FlightFile]) -> tuple[list[FlightLog], list[tuple[str, str]]]:
    """The readable logs, and (file, reason) for each other one. Raises AirTouchError if none is readable."""
    if not files:
        raise AirTouchError("no flight to train on")
    readable_by_path, left_out = readable_flights(files)
    if not readable_by_path:
        raise AirTouchError(f"no flight to train on; the first was left out because: {left_out[0][1]}")
    return list(readable_by_path.values()), left_out
