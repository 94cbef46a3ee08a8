"""Simulated edges added to recorded free air: training flights with the drone's own background.

A detector that is trained on simulated flights learns the simulator's free air too. The response to a platform is the
difference of two simulated flights with the same random numbers, one with the platform and one without. Added to
parts of recorded flights far from any edge, it gives flights with known edges in real air.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from airtouch import logs
from airtouch.detector.shared.channels import level_acceleration
from airtouch.errors import AirTouchError
from airtouch.logs.edges import Edge
from airtouch.logs.flight_log import ACC_WORLD, GYRO, PWM, FlightLog
from airtouch.reference.finite import PWM_MAX, hold_finite
from airtouch.simulation import flight, scenario
from airtouch.simulation.flight import Diverged
from airtouch.simulation.flight_plan.world import World
from airtouch.simulation.scenario import Scenario
from airtouch.twin.recorded.course import course
from airtouch.vehicle import Vehicle

#: columns of a response and of an added flight
COLUMNS = (*ACC_WORLD, *GYRO, *PWM)
RATE_HZ = 100  #: Hz, of the flights that go in and come out
SPARE = 3  #: most flights simulated for each one returned; the rest diverged
BEFORE_S, BEHIND_S, FADE_S = 0.4, 2.5, 0.5  #: s of a response: before the entry, after the exit, fade-out at its end
FREE_S, AWAY_S, AFTER_S = 1.5, 0.6, 1.5  #: s: shortest hover; recorded samples left out before an entry, after an exit
SETTLED_S = 1.0  #: s after the climb, and after a velocity step: start of level flight
QUIET_S = 0.6  #: s, shortest part of level flight that others are lengthened by
SPREAD = 0.15  #: fraction of the time from a velocity step to the entry, by which an added edge may be early or late
BEYOND_S = (0.5, 2.0)  #: s, shortest and longest level flight behind an added exit
BARE = 0.5  #: number of flights without a platform for each one with
JOIN_S = 0.3  #: s over which two parts are blended


@dataclass(frozen=True)
class Response:
    """The response to a platform: changes (m, 10) of COLUMNS, and the edges (samples from its first row)."""

    values: np.ndarray
    edges: tuple[Edge, Edge]


@dataclass(frozen=True)
class FreeAir:
    """The free air of a recorded flight, without its platform.

    start: (n, 10) with take-off and velocity step, the latter at row `step`; wait: rows from there to the platform.
    quiet: parts (k, 10) of level flight without a step: hover, and forward flight. end: (m, 10).
    """

    start: np.ndarray
    step: int
    wait: int
    quiet: tuple[np.ndarray, ...]
    end: np.ndarray


def responses(scene: Scenario, vehicle: Vehicle, count: int, seed: int = 0,
              progress: Callable[[int, int], None] = lambda *_: None) -> list[Response]:
    """The first `count` responses of a scenario's flights over one platform.

    Raises AirTouchError if too many flights diverge.
    """
    out: list[Response] = []
    for number in range(SPARE * count):
        if len(out) == count:
            break
        response = _response(scene, vehicle, seed, number)
        if response is not None:
            out.append(response)
            progress(len(out), count)
    if len(out) < count:
        raise AirTouchError(f"{scene.name}: only {len(out)} of {SPARE * count} flights ended well and crossed one "
                            "platform; choose another scenario")
    return out


def _response(scene: Scenario, vehicle: Vehicle, seed: int, number: int) -> Response | None:
    """The response of one flight; None if a flight diverges or does not cross just one platform."""
    plan = scenario.draw_flight(scene, seed, number)
    active = flight.choose(plan)
    ground = plan.world
    bare = World(ground.corners[:0], ground.first[:1], ground.surface[-1:], ground.box[:0])
    over = flight.fly_plan(plan, vehicle, seed, number, active, scene.name)
    if isinstance(over, Diverged):
        return None
    edges = logs.true_edges(over)
    if [e.kind for e in edges] != ["entry", "exit"]:
        return None
    beside = flight.fly_plan(replace(plan, world=bare), vehicle, seed, number, active, scene.name)
    if isinstance(beside, Diverged) or len(beside) != len(over):
        return None
    first = max(edges[0].sample - round(BEFORE_S * RATE_HZ), 0)
    last = min(edges[1].sample + round(BEHIND_S * RATE_HZ), len(over))
    values = (values_of(over) - values_of(beside))[first:last]
    fade = min(round(FADE_S * RATE_HZ), len(values))
    values[-fade:] *= np.linspace(1.0, 0.0, fade)[:, None]
    entry, leave = (replace(e, sample=e.sample - first) for e in edges)
    return Response(values, (entry, leave))


def free_air(flights: Sequence[FlightLog]) -> list[FreeAir]:
    """The free air of each flight whose down range shows a platform; other flights are left out."""
    out = []
    for log in flights:
        try:
            log.require(*GYRO, *PWM)
            of_log, values = course(log, 0.3), values_of(log)
        except AirTouchError:
            continue
        settled, before = round(SETTLED_S * RATE_HZ), of_log.entry - round(AWAY_S * RATE_HZ)
        first = max(of_log.start - RATE_HZ, 0)
        if before - of_log.level - settled >= FREE_S * RATE_HZ:
            hover = values[of_log.level + settled:min(of_log.step, before)]
            quiet = [values[of_log.step + settled:before], *([] if of_log.pulse_s else [hover])]
            out.append(FreeAir(values[first:before], of_log.step - first, of_log.entry - of_log.step,
                               tuple(x for x in quiet if len(x) >= QUIET_S * RATE_HZ),
                               values[of_log.exit + round(AFTER_S * RATE_HZ):]))
    return out


def flights(air: Sequence[FreeAir], laid: Sequence[Response],
            seed: int = 0) -> tuple[list[FlightLog], list[list[Edge]]]:
    """Flights with their edges: one for each response that fits, and BARE as many without a platform.

    The same arguments give the same flights.

    An edge comes as long after the velocity step as in one of the recorded flights, so that what a step does is learnt
    beside what a platform does; a flight without platform is made alike. Each has the free air of one recorded flight,
    lengthened by level flight of others that is shifted to its mean.
    """
    rng = np.random.default_rng([seed, 77])
    quiet = [part for flight_air in air for part in flight_air.quiet]
    bare = [laid[i] for i in rng.integers(len(laid), size=round(BARE * len(laid)))] if quiet else []
    out: list[FlightLog] = []
    labels: list[list[Edge]] = []
    for number, (response, has_platform) in enumerate([*((r, True) for r in laid), *((r, False) for r in bare)]):
        base, other = (air[int(i)] for i in rng.integers(len(air), size=2))
        entry, leave = (e.sample for e in response.edges)
        at = base.step + round(other.wait * rng.uniform(1.0 - SPREAD, 1.0 + SPREAD))
        values = _lengthened(base, quiet, at + leave - entry + round(RATE_HZ * rng.uniform(*BEYOND_S)), rng)
        if at < entry or at + leave - entry + round(SETTLED_S * RATE_HZ) > len(values):
            continue
        if has_platform:
            rows = slice(at - entry, min(at - entry + len(response.values), len(values)))
            values[rows] += response.values[:rows.stop - rows.start]
        values[:, -len(PWM):] = np.clip(values[:, -len(PWM):], 0.0, PWM_MAX)
        columns = dict(zip(COLUMNS, values.T, strict=True)) | {"time_s": np.arange(len(values)) / RATE_HZ}
        out.append(FlightLog(columns, {"source": f"overlay_{seed}_{number:06d}", "sample_period_s": 1.0 / RATE_HZ}))
        labels.append([replace(e, sample=at - entry + e.sample) for e in response.edges] if has_platform else [])
    return out, labels


def _lengthened(base: FreeAir, quiet: Sequence[np.ndarray], rows: int, rng: np.random.Generator) -> np.ndarray:
    """A flight's start, level flight to as many rows, and its end, (n, 10)."""
    behind = base.start[base.step + round(SETTLED_S * RATE_HZ):]
    middle = np.median(behind if len(behind) >= QUIET_S * RATE_HZ else base.start[-RATE_HZ:], axis=0)
    parts, length = [base.start], len(base.start)
    while quiet and length < rows:
        part = quiet[int(rng.integers(len(quiet)))]
        parts.append(part - np.median(part, axis=0) + middle)
        length += len(part) - round(JOIN_S * RATE_HZ)
    return _joined([_joined(parts)[:rows], base.end])


def values_of(log: FlightLog) -> np.ndarray:
    """Values (n, 10) of COLUMNS, with gaps held; AirTouchError where a column is missing."""
    return hold_finite(np.column_stack([level_acceleration(log), log.stack(GYRO), log.stack(PWM)]))[0]


def _joined(parts: Sequence[np.ndarray]) -> np.ndarray:
    """The parts in sequence, each blended into the next over JOIN_S. Parts that are too short are left out."""
    n = round(JOIN_S * RATE_HZ)
    share = np.linspace(0.0, 1.0, n)[:, None]
    out = parts[0].copy()
    for part in parts[1:]:
        if len(part) > 2 * n:
            out = np.vstack([out[:-n], out[-n:] * (1.0 - share) + part[:n] * share, part[n:]])
    return out
