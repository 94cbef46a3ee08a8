"""Flights filmed by the rendered camera: crossings of camera, AirTouch and both, for the figures of the camera."""

import json
from typing import Any

from airtouch import extras
from airtouch.detector.evaluation.score import FlightScore
from airtouch.logs.files import write_bytes
from airtouch.paper_figures import simulated
from airtouch.paper_figures.figure import Job, Missing
from airtouch.vision import weights
from airtouch.vision.camera import Camera

SCENE = "paper-4cm"  #: scenario: 4 cm over the platform, straight on, as in the paper's comparison
LUX, QUICK_LUX = (500.0, 100.0, 50.0, 20.0, 5.0), (100.0, 20.0)
SIZE_LUX = 100.0  #: lux at which the smaller networks run too
FILMS, QUICK_FILMS = (12, 24), (2, 4)  #: flights to choose thresholds and fusion on, flights to score; the paper has 20
SEED = 31
FELT = ("best", "paper")


def everything(job: Job) -> tuple[list[Any], dict[tuple[str, float], list], dict[str, list]]:
    """The films to score, (method, lux) -> crossings of each film, and detector -> crossings of each.

    Results are stored in the work folder.
    """
    lacking = extras.lacking("vision")
    if lacking:
        raise Missing(f"the camera needs {', '.join(lacking)}: pip install 'airtouch[vision]'")
    from airtouch.vision import compare
    from airtouch.vision.crossings import film

    training_count, scored_count = films_of(job)
    made_of = weights.digest(repr((SCENE, SEED, simulated.SEED, Camera())))
    job.tell(f"{training_count + scored_count} simulated flights, {SCENE}")
    films = [film(log, SEED) for log in simulated.flown(SCENE, training_count + scored_count)]
    trained, scored = films[:training_count], films[training_count:]
    felt = {name: compare.felt(films, name) for name in FELT}
    seen: dict[tuple[str, float], list] = {}
    for lux in lux_of(job):
        found = _crossings(job, films, training_count, lux, f"{training_count}_{scored_count}_{lux:g}_{made_of}")
        for way, some in found.items():
            seen[way, lux] = compare.without_lag(some, compare.lag(trained, some[:training_count]))
        how = compare.choose_fusion(trained, seen["teed", lux][:training_count], felt["best"][:training_count])
        seen["fusion", lux] = [compare.fused(a, b, how) for a, b in zip(seen["teed", lux], felt["best"], strict=True)]
    return (scored, {key: some[training_count:] for key, some in seen.items()},
            {name: some[training_count:] for name, some in felt.items()})


def _crossings(job: Job, films: list[Any], training_count: int, lux: float, name: str) -> dict[str, list]:
    """Method -> crossings of each film at one illuminance, from the work folder if they are there.

    Each method has a threshold for each illuminance, because a camera knows its exposure.
    """
    from airtouch.detector.trace import Detection
    from airtouch.vision import compare, lines

    path = job.work / f"vision_{name}.json"
    try:
        stored = json.loads(path.read_text())
    except (OSError, ValueError):
        sizes = weights.SIZES if lux == SIZE_LUX else ("teed",)
        mappers = {"classical": lines.classical, **{n: lines.learned(weights.load(n)[0]) for n in sizes}}
        stored = {}
        for way, sights in compare.filmed(films, lux, mappers, SEED, job.tell).items():
            least = compare.threshold(films[:training_count], sights[:training_count])
            stored[way] = [[d.sample for d in detections] for detections in compare.crossings(films, sights, least)]
        path.parent.mkdir(parents=True, exist_ok=True)
        write_bytes(json.dumps(stored).encode(), path, force=True)
    return {way: [[Detection(s, "edge") for s in detections] for detections in some] for way, some in stored.items()}


def film_scores(films: list[Any], detections: list[Any]) -> list[FlightScore]:
    """A score a film, of the crossings found in each."""
    from airtouch.vision import compare

    return compare.scored(films, detections)


def lux_of(job: Job) -> tuple[float, ...]:
    """The illuminances, lux, from bright to dark."""
    return QUICK_LUX if job.quick else LUX


def films_of(job: Job) -> tuple[int, int]:
    """Flights to choose thresholds and fusion on, and flights to score."""
    return QUICK_FILMS if job.quick else FILMS
