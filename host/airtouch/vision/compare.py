"""Camera, AirTouch and both together on the same simulated flights, scored alike."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from airtouch.detector import registry
from airtouch.detector.evaluation import tuning
from airtouch.detector.evaluation.data.dataset import Condition
from airtouch.detector.evaluation.score import TOLERANCE_S, FlightScore, match, score_flight
from airtouch.detector.trace import Detection, Trace
from airtouch.parameters import SAMPLE_PERIOD_S
from airtouch.vision import lines
from airtouch.vision.camera import Camera
from airtouch.vision.crossings import GROUP_S, Film, Sight, detections, frames, sight

#: candidates for the threshold: quantiles of the strengths in the training frames; no source: round number
THRESHOLDS = 30
TOGETHER_S = GROUP_S  #: s, largest time between crossings of camera and AirTouch at one edge
ROUNDING = 1.0 / 12.0  #: variance of rounding to a sample, samples squared
Sights = Sequence[Sequence[Sight]]  #: one sequence a film


@dataclass(frozen=True)
class Fusion:
    """Rule that joins the crossings of camera and AirTouch at one illuminance.

    share: weight (0 to 1) of the camera in the time of an edge that both detect. camera_alone, airtouch_alone: True if
    an edge that only this sense detects counts.
    """

    share: float
    camera_alone: bool
    airtouch_alone: bool


def sights_of_films(films: Sequence[Film], lux: float, mappers: Mapping[str, lines.Mapper], seed: int,
                    tell: Callable[[str], None] = lambda _: None) -> dict[str, list[list[Sight]]]:
    """Mapper's name -> sights in each film at one illuminance. Every frame is rendered once for all mappers."""
    camera = Camera()
    sights: dict[str, list[list[Sight]]] = {name: [] for name in mappers}
    for number, shot in enumerate(films, start=1):
        of_film: dict[str, list[Sight]] = {name: [] for name in mappers}
        for time_s, image in frames(camera, shot, lux, seed):
            small = lines.shrink(image)
            for name, mapper in mappers.items():
                of_film[name].append(sight(camera, shot, time_s, lines.strongest(mapper(small), camera)))
        for name, of_mapper in of_film.items():
            sights[name].append(of_mapper)
        tell(f"{lux:g} lux: {number} of {len(films)} flights")
    return sights


def threshold(films: Sequence[Film], sights: Sights) -> float:
    """The least strength of a line that counts: that of the best timed F1 over the training films."""
    strengths = np.array([s.strength for of_film in sights for s in of_film])
    candidates = np.unique(np.quantile(strengths, np.linspace(0.3, 0.99, THRESHOLDS)))
    chosen, _, _ = tuning.choose([float(c) for c in candidates], [f.edges for f in films],
                                 lambda c, i: detections(sights[i], c, films[i].speed_mps))
    return chosen


def crossings(films: Sequence[Film], sights: Sights, least: float) -> list[list[Detection]]:
    """The camera's crossings of each film."""
    return [detections(of_film, least, shot.speed_mps) for shot, of_film in zip(films, sights, strict=True)]


def lag(films: Sequence[Film], by_film: Sequence[Sequence[Detection]]) -> float:
    """The median lag of crossings behind the true edges, in samples.

    It is negative: the down range, from which the true edges come, is some hundredths of a second late.
    """
    return tuning.lag((shot.edges, detected) for shot, detected in zip(films, by_film, strict=True)) / SAMPLE_PERIOD_S


def without_lag(by_film: Sequence[Sequence[Detection]], samples: float) -> list[list[Detection]]:
    """Crossings less a constant lag, as for every detector."""
    return [[replace(d, sample=round(d.sample - samples)) for d in of_film] for of_film in by_film]


def airtouch_crossings(films: Sequence[Film], name: str, training: int) -> list[list[Detection]]:
    """Crossings of each film by the shipped model of a detector, within the film, less its lag.

    The lag is that on the first `training` films, as for the camera, or without an edge there the model's own.
    """
    detector = registry.get(name)
    model = detector.load(None)
    reported = [detector.run(shot.log, model).edges for shot in films]
    late = tuning.lag(((shot.edges, detected) for shot, detected in
                       zip(films[:training], reported[:training], strict=True)), detector.lag_s(model))
    return [[d for d in moved if shot.first_s <= d.sample * SAMPLE_PERIOD_S <= shot.last_s]
            for shot, moved in zip(films, without_lag(reported, late / SAMPLE_PERIOD_S), strict=True)]


def flight_scores(films: Sequence[Film], by_film: Sequence[Sequence[Detection]]) -> list[FlightScore]:
    """One score for each film: errors and misses at its edges, and false crossings a minute."""
    scores = []
    for shot, detected in zip(films, by_film, strict=True):
        filming = np.zeros(len(shot.log), bool)
        filming[int(shot.first_s / SAMPLE_PERIOD_S):int(shot.last_s / SAMPLE_PERIOD_S)] = True
        inside = [replace(d, sample=int(np.clip(d.sample, 0, len(shot.log) - 1))) for d in detected]
        scores.append(score_flight(Path(shot.log.source).name, Condition(speed_mps=shot.speed_mps), shot.edges, filming,
                                   Trace(np.full(len(shot.log), np.nan), inside)))
    return scores


def fuse(by_camera: Sequence[Detection], by_airtouch: Sequence[Detection], fusion: Fusion) -> list[Detection]:
    """Crossings by a fusion rule: pairs at their weighted mean time, and the single ones that the rule accepts."""
    pairs = match([d.sample for d in by_camera], [d.sample for d in by_airtouch], TOGETHER_S / SAMPLE_PERIOD_S)
    joined = [Detection(round(fusion.share * by_camera[i].sample + (1.0 - fusion.share) * by_airtouch[j].sample),
                        by_airtouch[j].kind) for i, j in pairs]
    if fusion.camera_alone:
        joined += [d for i, d in enumerate(by_camera) if i not in {i for i, _ in pairs}]
    if fusion.airtouch_alone:
        joined += [d for j, d in enumerate(by_airtouch) if j not in {j for _, j in pairs}]
    return sorted(joined, key=lambda d: d.sample)


def choose_fusion(films: Sequence[Film], by_camera: Sequence[Sequence[Detection]],
                  by_airtouch: Sequence[Sequence[Detection]]) -> Fusion:
    """The fusion rule for training films: weights by inverse squared error, single crossings by the best timed F1.

    An edge that both detect is always joined. The timed F1 does not choose the weight, because with few films single
    edges would decide it.
    """
    camera, airtouch = (_squared_error(films, by_film) for by_film in (by_camera, by_airtouch))
    choices = [Fusion(airtouch / (camera + airtouch), camera_alone, airtouch_alone)
               for camera_alone in (True, False) for airtouch_alone in (True, False)]
    return max(choices, key=lambda f: tuning.timed_f1(
        [(shot.edges, fuse(a, b, f)) for shot, a, b in zip(films, by_camera, by_airtouch, strict=True)]))


def _squared_error(films: Sequence[Film], by_film: Sequence[Sequence[Detection]]) -> float:
    """Mean squared error of the detected edges, samples squared, rounding included; the tolerance's where none is."""
    tolerance = TOLERANCE_S / SAMPLE_PERIOD_S
    errors = [detected[j].sample - shot.edges[i].sample for shot, detected in zip(films, by_film, strict=True)
              for i, j in match([e.sample for e in shot.edges], [d.sample for d in detected], tolerance)]
    return float(np.mean(np.square(errors))) + ROUNDING if errors else tolerance ** 2
