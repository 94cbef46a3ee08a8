"""Simulated edges added to recorded free air: training flights with the drone's own background.

A detector that is trained on simulated flights learns the simulator's free air too. The response to a platform is the
difference of two simulated flights with the same random numbers, one with the platform and one without. Added to
parts of recorded flights far from any edge, it gives flights with known edges in real air.
"""

import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from airtouch import logs
from airtouch.detector.shared.channels import level_acceleration
from airtouch.errors import AirTouchError
from airtouch.logs.edges import Edge
from airtouch.logs.files import make_folder, write_bytes
from airtouch.logs.flight_log import ACC_WORLD, GYRO, PWM, FlightLog
from airtouch.parameters import SAMPLE_RATE_HZ
from airtouch.reference.finite import PWM_MAX, hold_finite
from airtouch.simulation import flight, scenario
from airtouch.simulation.flight import Diverged
from airtouch.simulation.flight_plan.world import World
from airtouch.simulation.scenario import Scenario
from airtouch.twin.recorded.course import course
from airtouch.vehicle import Vehicle

#: columns of a response and of an added flight
COLUMNS = (*ACC_WORLD, *GYRO, *PWM)
RATE_HZ = round(SAMPLE_RATE_HZ)  #: Hz, of the flights that go in and come out
MAX_TRIES = 3  #: flights simulated for each one returned, at most; the others diverged. No source: round number
#: s of a response: before the entry, after the exit, fade-out at its end; no source: round numbers, past the 0.1 s by
#: which the down range sees an edge early and the swing of the height loop after it
BEFORE_S, AFTER_S, FADE_S = 0.4, 2.5, 0.5
MIN_HOVER_S = 1.5  #: s, shortest recorded hover that is used; no source: round number
#: s of recorded air that do not count as free: before an entry, after an exit; no source: round numbers
GUARD_S = (0.6, 1.5)
SETTLED_S = 1.0  #: s after the climb, and after a velocity step: start of level flight, as in `recorded.course`
MIN_LEVEL_S = 0.6  #: s, shortest part of level flight that others are lengthened by: two blends
#: fraction of the time from a velocity step to the entry, by which an added edge may be early or late; no source: round
#: number
SPREAD = 0.15
LEVEL_AFTER_S = (0.5, 2.0)  #: s, shortest and longest level flight behind an added exit; no source: round numbers
#: flights without a platform for each one with; chosen with two other changes on folds 0 to 2
#: (host/docs/twin-findings.md, where simulated edges lie)
EMPTY_RATIO = 0.5
BLEND_S = 0.3  #: s over which two parts are blended; no source: round number
SPEED_MPS = 0.3  #: m/s, speed of a course where only its samples are used; no effect on them


@dataclass(frozen=True)
class Response:
    """The response to a platform: changes (m, 10) of COLUMNS, and the edges (samples from its first row)."""

    values: np.ndarray
    edges: tuple[Edge, Edge]


@dataclass(frozen=True)
class FreeAir:
    """The free air of a recorded flight, without its platform.

    start: (n, 10) with take-off and velocity step, the latter at row `step`; approach: rows from there to the platform.
    level: parts (k, 10) of level flight without a step: hover, and forward flight. end: (m, 10). Columns as COLUMNS.
    """

    start: np.ndarray
    step: int
    approach: int
    level: tuple[np.ndarray, ...]
    end: np.ndarray


def simulate_responses(scene: Scenario, vehicle: Vehicle, count: int, seed: int = 0,
                       progress: Callable[[int, int], None] = lambda *_: None,
                       folder: Path | None = None) -> list[Response]:
    """The first `count` responses of a scenario's flights over one platform.

    progress: as progress(done, total). folder: where each is stored, so that the same call continues after a stop; it
    is for this scenario, vehicle and seed only. Raises AirTouchError if too many flights diverge.
    """
    out: list[Response] = []
    for number in range(MAX_TRIES * count):
        if len(out) == count:
            break
        path = folder / f"{number:04d}.npz" if folder else None
        if path and path.is_file():
            response = _load(path)
        else:
            response = _response(scene, vehicle, seed, number)
            if path:
                _save(path, response)
        if response is not None:
            out.append(response)
            progress(len(out), count)
    if len(out) < count:
        raise AirTouchError(f"{scene.name}: only {len(out)} of {MAX_TRIES * count} flights ended well and crossed one "
                            "platform; choose another scenario")
    return out


def _response(scene: Scenario, vehicle: Vehicle, seed: int, number: int) -> Response | None:
    """The response of one flight; None if a flight diverges or does not cross just one platform."""
    plan = scenario.draw_flight(scene, seed, number)
    active = flight.choose(plan)
    ground = plan.world
    floor = World(ground.corners[:0], ground.first[:1], ground.surface[-1:], ground.box[:0])
    with_platform = flight.fly_plan(plan, vehicle, seed, number, active, scene.name)
    if isinstance(with_platform, Diverged):
        return None
    edges = logs.true_edges(with_platform)
    if [e.kind for e in edges] != ["entry", "exit"]:
        return None
    without = flight.fly_plan(replace(plan, world=floor), vehicle, seed, number, active, scene.name)
    if isinstance(without, Diverged) or len(without) != len(with_platform):
        return None
    first = max(edges[0].sample - round(BEFORE_S * RATE_HZ), 0)
    last = min(edges[1].sample + round(AFTER_S * RATE_HZ), len(with_platform))
    values = (values_of(with_platform) - values_of(without))[first:last]
    fade = min(round(FADE_S * RATE_HZ), len(values))
    values[-fade:] *= np.linspace(1.0, 0.0, fade)[:, None]
    entry, leave = (replace(e, sample=e.sample - first) for e in edges)
    return Response(values, (entry, leave))


def _save(path: Path, response: Response | None) -> None:
    """Write what one flight gave to a file (.npz), also where that is nothing."""
    data = io.BytesIO()
    if response is None:
        np.savez_compressed(data)
    else:
        np.savez_compressed(data, values=response.values, edges=[
            (e.sample, e.height_before_m, e.height_after_m) for e in response.edges])
    make_folder(path.parent)
    write_bytes(data.getvalue(), path, force=True)


def _load(path: Path) -> Response | None:
    """What `_save` wrote, bit for bit."""
    with np.load(path) as stored:
        if "values" not in stored:
            return None
        entry, leave = (Edge(int(sample), kind, float(before), float(after))
                        for kind, (sample, before, after) in zip(("entry", "exit"), stored["edges"], strict=True))
        return Response(stored["values"], (entry, leave))


def free_air(flights: Sequence[FlightLog]) -> list[FreeAir]:
    """The free air of each flight whose down range shows a platform; other flights are left out."""
    out = []
    for log in flights:
        try:
            log.require(*GYRO, *PWM)
            path, values = course(log, SPEED_MPS), values_of(log)
        except AirTouchError:
            continue
        settled, before = round(SETTLED_S * RATE_HZ), path.entry - round(GUARD_S[0] * RATE_HZ)
        first = max(path.start - RATE_HZ, 0)
        if before - path.level - settled >= MIN_HOVER_S * RATE_HZ:
            hover = values[path.level + settled:min(path.step, before)]
            level = [values[path.step + settled:before], *([] if path.pulse_s else [hover])]
            out.append(FreeAir(values[first:before], path.step - first, path.entry - path.step,
                               tuple(part for part in level if len(part) >= MIN_LEVEL_S * RATE_HZ),
                               values[path.exit + round(GUARD_S[1] * RATE_HZ):]))
    return out


def flights(air: Sequence[FreeAir], responses: Sequence[Response],
            seed: int = 0) -> tuple[list[FlightLog], list[list[Edge]]]:
    """Flights with their edges: one for each response that fits, and EMPTY_RATIO as many without a platform.

    The same arguments give the same flights.

    An edge comes as long after the velocity step as in one of the recorded flights, so that what a step does is learnt
    beside what a platform does; a flight without platform is made alike. Each has the free air of one recorded flight,
    lengthened by level flight of others that is shifted to its median.
    """
    rng = np.random.default_rng([seed, 77])
    level = [part for flight_air in air for part in flight_air.level]
    empty = rng.integers(len(responses), size=round(EMPTY_RATIO * len(responses))) if level else []
    out: list[FlightLog] = []
    labels: list[list[Edge]] = []
    for number, (response, has_platform) in enumerate(
            [*((r, True) for r in responses), *((responses[i], False) for i in empty)]):
        base, other = (air[int(i)] for i in rng.integers(len(air), size=2))
        entry, leave = (e.sample for e in response.edges)
        place = base.step + round(other.approach * rng.uniform(1.0 - SPREAD, 1.0 + SPREAD))  # row of the entry
        values = _lengthen(base, level, place + leave - entry + round(RATE_HZ * rng.uniform(*LEVEL_AFTER_S)), rng)
        if place < entry or place + leave - entry + round(SETTLED_S * RATE_HZ) > len(values):
            continue
        if has_platform:
            rows = slice(place - entry, min(place - entry + len(response.values), len(values)))
            values[rows] += response.values[:rows.stop - rows.start]
        values[:, -len(PWM):] = np.clip(values[:, -len(PWM):], 0.0, PWM_MAX)
        columns = dict(zip(COLUMNS, values.T, strict=True)) | {"t_s": np.arange(len(values)) / RATE_HZ}
        out.append(FlightLog(columns, {"source": f"overlay_{seed}_{number:06d}", "sample_period_s": 1.0 / RATE_HZ}))
        labels.append([replace(e, sample=place - entry + e.sample) for e in response.edges] if has_platform else [])
    return out, labels


def _lengthen(base: FreeAir, level: Sequence[np.ndarray], rows: int, rng: np.random.Generator) -> np.ndarray:
    """A flight's start, parts of level flight up to as many rows, and its end, (n, 10)."""
    cruise = base.start[base.step + round(SETTLED_S * RATE_HZ):]
    median = np.median(cruise if len(cruise) >= MIN_LEVEL_S * RATE_HZ else base.start[-RATE_HZ:], axis=0)
    parts, length = [base.start], len(base.start)
    while level and length < rows:
        part = level[int(rng.integers(len(level)))]
        parts.append(part - np.median(part, axis=0) + median)
        length += len(part) - round(BLEND_S * RATE_HZ)
    return _join([_join(parts)[:rows], base.end])


def values_of(log: FlightLog) -> np.ndarray:
    """Values (n, 10) of COLUMNS, m/s^2, rad/s and PWM, with gaps held. Raises AirTouchError for a missing column."""
    return hold_finite(np.column_stack([level_acceleration(log), log.stack(GYRO), log.stack(PWM)]))[0]


def _join(parts: Sequence[np.ndarray]) -> np.ndarray:
    """The parts in sequence, (n, 10), blended over BLEND_S; parts that are shorter than two blends are skipped."""
    n = round(BLEND_S * RATE_HZ)
    share = np.linspace(0.0, 1.0, n)[:, None]
    out = parts[0].copy()
    for part in parts[1:]:
        if len(part) > 2 * n:
            out = np.vstack([out[:-n], out[-n:] * (1.0 - share) + part[:n] * share, part[n:]])
    return out
