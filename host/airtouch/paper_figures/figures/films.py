"""Flights filmed by the rendered camera: crossings of camera, AirTouch and both, for the figures of the camera."""

import hashlib
import json
from dataclasses import dataclass
from typing import Any

import numpy as np

from airtouch import __version__, extras
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
AIRTOUCH = ("best", "paper")  #: detectors beside the camera


@dataclass(frozen=True)
class Crossings:
    """The films to score, and the crossings that each sense detects in each of them, film by film."""

    films: list[Any]
    camera: dict[tuple[str, float], list]  #: (method, lux); "fusion" is of TEED's structure and `best`
    airtouch: dict[str, list]  #: detector


def crossings(job: Job) -> Crossings:
    """All crossings of the figures of the camera. Those of the camera are stored in the work folder."""
    lacking = extras.lacking("vision")
    if lacking:
        raise Missing(f"the camera needs {', '.join(lacking)}: pip install 'airtouch[vision]'")
    from airtouch.vision import compare
    from airtouch.vision.crossings import film

    training_count, scored_count = films_of(job)
    job.tell(f"{training_count + scored_count} simulated flights, {SCENE}")
    films = [film(log, SEED) for log in simulated.flights(SCENE, training_count + scored_count)]
    settings = weights.digest(repr((__version__, SEED, Camera(), [film_digest(shot) for shot in films])))
    training, scored = films[:training_count], films[training_count:]
    airtouch = {name: compare.airtouch_crossings(films, name, training_count) for name in AIRTOUCH}
    camera: dict[tuple[str, float], list] = {}
    for lux in lux_of(job):
        by_method = _camera(job, films, training_count, lux, f"{training_count}_{scored_count}_{lux:g}_{settings}")
        for method, by_film in by_method.items():
            camera[method, lux] = compare.without_lag(by_film, compare.lag(training, by_film[:training_count]))
        rule = compare.choose_fusion(training, camera["teed", lux][:training_count], airtouch["best"][:training_count])
        camera["fusion", lux] = [compare.fuse(a, b, rule)
                                 for a, b in zip(camera["teed", lux], airtouch["best"], strict=True)]
    return Crossings(scored, {key: by_film[training_count:] for key, by_film in camera.items()},
                     {name: by_film[training_count:] for name, by_film in airtouch.items()})


def _camera(job: Job, films: list[Any], training_count: int, lux: float, name: str) -> dict[str, list]:
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
        mappers = {"classical": lines.classical, **{n: lines.learned_mapper(weights.load(n)[0]) for n in sizes}}
        stored = {}
        for method, sights in compare.sights_of_films(films, lux, mappers, SEED, job.tell).items():
            least = compare.threshold(films[:training_count], sights[:training_count])
            stored[method] = [[d.sample for d in detections] for detections in compare.crossings(films, sights, least)]
        path.parent.mkdir(parents=True, exist_ok=True)
        write_bytes(json.dumps(stored).encode(), path, force=True)
    return {method: [[Detection(s, "edge") for s in samples] for samples in by_film]
            for method, by_film in stored.items()}


def film_digest(film: Any) -> str:
    """Hexadecimal digits that change with a film's flight, edges, scene and length."""
    total = hashlib.sha256(repr((film.edges, film.scene.top_m, film.first_s, film.last_s)).encode())
    for values in (film.scene.floor, film.scene.top, film.scene.corners_m, *film.log.columns.values()):
        total.update(np.ascontiguousarray(values).tobytes())
    return total.hexdigest()


def film_scores(films: list[Any], detections: list[Any]) -> list[FlightScore]:
    """A score a film, of the crossings found in each."""
    from airtouch.vision import compare

    return compare.flight_scores(films, detections)


def lux_of(job: Job) -> tuple[float, ...]:
    """The illuminances, lux, from bright to dark."""
    return QUICK_LUX if job.quick else LUX


def films_of(job: Job) -> tuple[int, int]:
    """Flights to choose thresholds and fusion on, and flights to score."""
    return QUICK_FILMS if job.quick else FILMS
