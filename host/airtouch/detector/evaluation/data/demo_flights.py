"""The flights of `airtouch demo`: recorded ones or the simulator's, split by flight."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from airtouch import logs
from airtouch.detector.evaluation.crossval import readable_flights
from airtouch.detector.evaluation.data import dataset
from airtouch.detector.evaluation.data.dataset import FlightFile
from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import FlightLog

TRAIN, TEST = 52, 18  #: flights at most: as many as fit in two minutes on two cores
FEWEST = 4  #: flights to train and to test with
HELD_OUT = 4  #: every fourth fold, or flight where there are no folds, is held out
GENERATED, SCENARIO = 32, "paper-low"  #: simulated flights, where none are recorded


@dataclass(frozen=True)
class Chosen:
    """Flights to train on, flights held out, and in words what they are."""

    train: list[FlightFile]
    test: list[FlightFile]
    where: str


def choose(folder: Path | None, simulated: Path, speed_mps: float | None = None,
           tell: Callable[[str], None] = lambda _: None) -> Chosen:
    """The flights of a folder, or without one flights of the simulator, which are written to `simulated`.

    speed_mps: of flights whose manifest does not say. tell: is given a line on a simulated flight that diverged.
    Raises AirTouchError for fewer than FEWEST flights.
    """
    if folder is not None:
        files, where = dataset.collect([folder], speed_mps), f"recorded flights in {folder}"
    else:
        files, where = generated(simulated, tell), f"flights of the simulator ({simulated})"
    if len(files) < FEWEST:
        raise AirTouchError(f"{folder or simulated}: {len(files)} flights are too few to train and to test; "
                            f"at least {FEWEST} are needed")
    train, test = split(files)
    return Chosen(spread(train, TRAIN), spread(test, TEST), where)


def split(files: Sequence[FlightFile]) -> tuple[list[FlightFile], list[FlightFile]]:
    """(to train on, held out): whole folds of the manifest; by place in the list for a flight without one."""
    fold = [i if f.condition.fold is None else f.condition.fold for i, f in enumerate(files)]
    held = [k % HELD_OUT == 0 for k in fold]
    return ([f for f, out in zip(files, held, strict=True) if not out],
            [f for f, out in zip(files, held, strict=True) if out])


def generated(folder: Path, tell: Callable[[str], None] = lambda _: None) -> list[FlightFile]:
    """Simulated flights, written with their manifest; compiles the simulator on the first call."""
    from airtouch.simulation import batch, scenario
    from airtouch.simulation.flight import Diverged
    from airtouch.simulation.workers import store

    scene = scenario.load(SCENARIO)
    folder.mkdir(parents=True, exist_ok=True)
    for number, flown in enumerate(batch.flights(scene, GENERATED)):
        path = store.path_of(folder, scene.name, 0, number)
        path.unlink(missing_ok=True)
        if isinstance(flown, Diverged):
            tell(str(flown))
        else:
            logs.write(flown, path)
    store.write_manifest(folder, scene, 0, GENERATED)
    return dataset.collect([folder])


def spread(files: list[FlightFile], most: int) -> list[FlightFile]:
    """At most `most` of them, evenly over the list, so that every condition stays in."""
    return files if len(files) <= most else [files[i * len(files) // most] for i in range(most)]


def readable(files: Sequence[FlightFile]) -> tuple[list[FlightLog], list[tuple[str, str]]]:
    """Logs to train on, and what cannot be used with the reason. Raises AirTouchError where none can."""
    readable_by_path, left_out = readable_flights(files)
    if not readable_by_path:
        raise AirTouchError(f"no flight to train on; the first was left out because: {left_out[0][1]}")
    return list(readable_by_path.values()), left_out
