"""From a flight to frames, from frames to lines, from lines to crossings in the score of the other detectors."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from airtouch.detector.trace import Detection
from airtouch.errors import AirTouchError
from airtouch.logs.edges import Edge, true_edges
from airtouch.logs.flight_log import FlightLog
from airtouch.logs.quaternion import rotation
from airtouch.parameters import SAMPLE_PERIOD_S
from airtouch.simulation import scenario
from airtouch.vision import scene as scenes
from airtouch.vision.camera import Camera, expose, exposure_s
from airtouch.vision.lines import Line

MARGIN_S = 0.8  #: s of film before the first edge and after the last; no source: a little more than GROUP_S
GROUP_S = 0.6  #: s, longest time between two frames of one edge; no source: round number, 0.18 m at 0.3 m/s


@dataclass(frozen=True)
class Sight:
    """The measurement of one frame: time of mid-exposure, strength of its line, distance of the line ahead, m."""

    time_s: float
    strength: float
    ahead_m: float


@dataclass(frozen=True)
class Film:
    """A flight and the surfaces below it. clearance_m, speed_mps: commanded. first_s, last_s: of the film."""

    log: FlightLog
    edges: tuple[Edge, ...]
    scene: scenes.Scene
    clearance_m: float
    speed_mps: float
    first_s: float
    last_s: float


def film(log: FlightLog, seed: int) -> Film:
    """A simulated flight over one platform, with textures drawn by seed: mean albedos 0.15 to 0.85, any contrast.

    Raises AirTouchError for a flight that crosses no edge.
    """
    rng = np.random.default_rng([seed, log.meta["flight"], 17])
    plan = scenario.draw_flight(scenario.load(log.meta["scenario"]), log.meta["seed"], log.meta["flight"])
    corners = plan.world.corners[plan.world.first[0]:plan.world.first[1]]
    edges = tuple(true_edges(log))
    if not edges:
        raise AirTouchError(f"{log.source}: crosses no edge, and a film begins and ends at one")
    floor, top = (draw_texture(rng) for _ in range(2))
    drawn = scenes.Scene(floor, top, corners, float(plan.world.surface[0, 0]))
    return Film(log, edges, drawn, plan.values["clearance"], plan.values["speed"],
                edges[0].sample * SAMPLE_PERIOD_S - MARGIN_S, edges[-1].sample * SAMPLE_PERIOD_S + MARGIN_S)


def draw_texture(rng: np.random.Generator) -> np.ndarray:
    """A texture of random brightness (albedo 0.15 to 0.85), contrast (rms 3 to 30 %) and coarseness."""
    return scenes.texture(rng, rng.uniform(0.15, 0.85), rng.uniform(0.03, 0.3), rng.uniform(0.7, 1.6))


def frames(camera: Camera, shot: Film, lux: float, seed: int) -> Iterator[tuple[float, np.ndarray]]:
    """(time of mid-exposure in s, image of 8 bits) of a film at a light; the first frame's time is drawn by seed."""
    rng = np.random.default_rng([seed, shot.log.meta["flight"], int(1000 * lux)])
    albedo = 0.5 * float(shot.scene.floor.mean() + shot.scene.top.mean())
    seconds = exposure_s(camera, lux, albedo)
    shares = scenes.subposes(camera, shot.speed_mps, seconds, shot.clearance_m)
    for time_s in np.arange(shot.first_s + rng.uniform(0.0, 1.0 / camera.frame_hz), shot.last_s, 1.0 / camera.frame_hz):
        inside = [pose(shot.log, time_s + share * seconds) for share in shares]
        yield float(time_s), expose(camera, scenes.blur(camera, inside, shot.scene), lux, seconds, rng)


def pose(log: FlightLog, time_s: float) -> scenes.Pose:
    """Where the drone truly is at a time, between the samples of its log."""
    place = time_s / SAMPLE_PERIOD_S
    at = {name: np.interp(place, np.arange(len(log)), log[name])
          for name in ("x_m", "y_m", "z_m", "roll_rad", "pitch_rad", "yaw_rad")}
    return scenes.Pose(np.array([at["x_m"], at["y_m"], at["z_m"]]),
                       np.squeeze(rotation(at["roll_rad"], at["pitch_rad"], at["yaw_rad"])))


def sight(camera: Camera, shot: Film, time_s: float, line: Line) -> Sight:
    """How far ahead a line is: the attitude is known to the drone, the height is the commanded one."""
    ray = pose(shot.log, time_s).attitude @ np.array([line.column - camera.centre[0], 0.0, -camera.focal_px])
    return Sight(time_s, line.strength, float(shot.clearance_m * ray[0] / -ray[2]) if ray[2] < 0.0 else np.inf)


def detections(sights: Sequence[Sight], threshold: float, speed_mps: float) -> list[Detection]:
    """Edges of unknown kind: of each group of frames with a line above the threshold, the mean of when each says that
    the line is, was or will be below the drone, weighted by strength."""
    strong = [s for s in sights if s.strength >= threshold and np.isfinite(s.ahead_m)]
    groups: list[list[Sight]] = []
    for s in strong:
        if groups and s.time_s - groups[-1][-1].time_s <= GROUP_S:
            groups[-1].append(s)
        else:
            groups.append([s])
    edges = []
    for group in groups:
        times = np.array([s.time_s + s.ahead_m / speed_mps for s in group])
        middle_s = float(np.average(times, weights=[s.strength for s in group]))
        edges.append(Detection(round(middle_s / SAMPLE_PERIOD_S), "edge"))
    return sorted(edges, key=lambda d: d.sample)
