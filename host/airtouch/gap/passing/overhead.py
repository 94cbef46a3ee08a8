"""When another vehicle was overhead, from its own log, and what the rest of the flight seems to have of its wake.

Where nobody tells when a wake acts, its seconds are looked for, and nominal flights gain much from such a search. Where
the other vehicle's path is known, nothing is looked for: a wake in the known seconds is compared with the rest of that
flight, which may be flown harder than others. Sizes scatter about that as they do in nominal flights.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.gap.evidence.data import Data
from airtouch.gap.flights.clock import row_times
from airtouch.gap.flights.flight import GROUND, PERIOD_S, Flight
from airtouch.gap.passing.gates import KNOWN_OVERHEAD, effect_within
from airtouch.gap.signatures.scatter import size_of
from airtouch.gap.signatures.signature import OVERHEAD
from airtouch.gap.study import Study
from airtouch.logs.flight_log import FlightLog
from airtouch.logs.segments import runs
from airtouch.simulation.effects.effect import Gate

POSITION = ("x_m", "y_m", "z_m")  #: columns of a log
UNUSED = "the log of the other vehicle was not used: without {} no wake is judged"
#: m, where the wake of a vehicle overhead is felt: Crazyflies under others, neural-swarm; from 0.15 m aside within 3 %.
#: Larger numbers count seconds in which hardly a wake acts
SIDEWAYS_M, ABOVE_M = 0.15, (0.1, 0.6)
# The rule by which known seconds are compared with the rest of a flight was chosen among seven, on recorded flights
# (host/docs/looks.md, 2026-11-25 04:11). The numbers below have no source of their own: all were chosen.
APART_S = 0.1  #: s, intervals with less between them are one; a larger number joins more of them
LEAST_S = 0.05  #: s, shorter intervals are none; a larger number leaves out short passes
#: s, and periods of a log, between two of its rows, from which on nothing is known of its path; larger numbers make up
#: more of it
HOLE_S, HOLE_PERIODS = 0.1, 3.0
#: parts of a flight, by each of which but the last the known seconds are shifted: SHIFTS - 1 other places. A larger
#: number takes more time, and the median is that of more places
SHIFTS = 8
#: s around the known seconds, in which a wake may already or still act; a larger number leaves less to compare with
MARGIN_S = 0.25
#: fraction of the known seconds that shifted ones must hold to count; a larger number leaves out more places
LEAST_FRACTION = 0.5


def above(own: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Samples (n,) at which a vehicle at `other` (n, 3) is over one at `own` (n, 3), m; False where NaN."""
    apart = other - own
    return (np.hypot(apart[:, 0], apart[:, 1]) < SIDEWAYS_M) & (apart[:, 2] > ABOVE_M[0]) & (apart[:, 2] < ABOVE_M[1])


def intervals_s(acts: np.ndarray) -> tuple[tuple[float, float], ...]:
    """Intervals, s from the first sample, of the samples (n,) that are True."""
    return tuple((first * PERIOD_S, last * PERIOD_S) for first, last in runs(acts))


def seconds_overhead(log: FlightLog, partners: Sequence[FlightLog]) -> tuple[tuple[float, float], ...]:
    """Intervals, s, in which one of the partners is overhead; a ready flight has a row of the log every PERIOD_S.

    All logs hold t_s of one clock and positions in one frame. Raises AirTouchError where one of them has no such.
    """
    for each in (log, *partners):
        if not each.has("t_s", *POSITION):
            raise AirTouchError(f"{each.source}: no {', '.join(('t_s', *POSITION))}; a partner is found by both paths")
    time = row_times(log, log.source)

    own = path_at(time, log)
    acts = np.logical_or.reduce([np.zeros(len(time), bool), *(above(own, path_at(time, p)) for p in partners)])
    out: list[tuple[float, float]] = []
    for first, last in intervals_s(acts):
        if out and first - out[-1][1] < APART_S:
            out[-1] = (out[-1][0], last)
        else:
            out.append((first, last))
    return tuple((a, b) for a, b in out if b - a >= LEAST_S)


def path_at(time: np.ndarray, log: FlightLog) -> np.ndarray:
    """Position (n, 3), m, at times (n,) of the log's clock, s; NaN outside of the log and in its holes.

    A hole is longer than HOLE_S and than HOLE_PERIODS of the log's own: a straight line across it would make up a path.
    Raises AirTouchError where the log's clock goes back.
    """
    place = log.stack(POSITION)
    known = np.isfinite(log["t_s"]) & np.isfinite(place).all(axis=1)
    at, place = log["t_s"][known], place[known]
    if len(at) < 2:
        return np.full((len(time), 3), np.nan)
    steps = np.diff(at)
    if steps.min() < 0.0:
        raise AirTouchError(f"{log.source}: its clock t_s goes back after {at[np.argmax(steps < 0.0)]:g} s; a path "
                            "needs times that rise: cut the log there")
    out = np.column_stack([np.interp(time, at, values, np.nan, np.nan) for values in place.T])
    step = steps[np.clip(np.searchsorted(at, time, "right") - 1, 0, len(steps) - 1)]
    out[step > max(HOLE_S, HOLE_PERIODS * float(np.median(steps)))] = np.nan
    return out


def note(study: Study, seconds: Sequence[tuple[float, float]]) -> str:
    """What a diagnosis says of another vehicle that was overhead in these seconds."""
    if not study.nominal_count:
        return UNUSED.format("baseline flights")
    if not seconds:
        return "the other vehicle was never overhead"
    return f"the other vehicle was overhead for {sum(end - begin for begin, end in seconds):.1f} s"


def with_overhead(study: Study, flight: Flight, seconds: Sequence[tuple[float, float]]) -> Study:
    """The study of a flight over which another vehicle was in these seconds.

    The nominal size of its wake is the median of what a wake seems to be in as many seconds of the rest of this flight
    in the air; the median, as a vehicle whose path is unknown may be over it as well. It scatters as sizes of wakes
    that are looked for do in nominal flights, and is theirs where the rest is too short. Without such seconds, and
    where no baseline flights say how sizes scatter, the study stays as it is.
    """
    if not seconds or study.scatter is None:
        return study
    data, duration = Data(study, [flight]), sum(b - a for a, b in _air_seconds(flight, seconds))
    rest = [_outside(gate, seconds) for gate in _shifted_gates(flight, seconds)]
    sizes = [_size(data, g) for g in rest if sum(b - a for _, a, b in g) > LEAST_FRACTION * duration]
    middle, spread = study.scatter.passing[OVERHEAD]
    passing = {**study.scatter.passing, KNOWN_OVERHEAD: (float(np.median(sizes)) if sizes else middle, spread)}
    return replace(study.with_scatter(replace(study.scatter, passing=passing)),
                   overhead=tuple((flight.name, a, b) for a, b in seconds))


def _size(data: Data, gate: Gate) -> float:
    """Size (`size_of`) that what acts overhead seems to have within a gate; its rate is of the seconds in the air."""
    wake = effect_within(data, OVERHEAD, gate)
    return size_of(wake.gain / data.air_seconds, wake.strength) if wake is not None else 0.0


def _outside(gate: Gate, seconds: Sequence[tuple[float, float]]) -> Gate:
    """The gate without what is within MARGIN_S of the seconds."""
    out = list(gate)
    for begin, end in seconds:
        out = [(name, a, b) for name, first, last in out
               for a, b in ((first, min(last, begin - MARGIN_S)), (max(first, end + MARGIN_S), last))
               if b - a >= LEAST_S]
    return tuple(out)


def _shifted_gates(flight: Flight, seconds: Sequence[tuple[float, float]]) -> list[Gate]:
    """Gates of the same seconds at SHIFTS - 1 places beside the known one, around a flight, cut at its end.

    Only seconds in the air count, as if the vehicle never stood: nothing on the ground can be compared with a wake.
    """
    in_air, stretches = _air_seconds(flight, seconds), _air_stretches(flight)
    length_s = sum(end - begin for begin, end, _ in stretches)
    out = []
    for shift in np.arange(1, SHIFTS) * length_s / SHIFTS:
        moved = [(begin := (a + shift) % length_s, min(begin + b - a, length_s)) for a, b in in_air]
        out.append(tuple((flight.name, max(a, since) + begin - since, min(b, since + end - begin) + begin - since)
                         for a, b in moved for begin, end, since in stretches if a < since + end - begin and b > since))
    return out


def _air_seconds(flight: Flight, seconds: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Intervals, s, of a flight in its time in the air, which stands still on the ground."""
    edges = [((begin, end), (since, since + end - begin)) for begin, end, since in _air_stretches(flight)]
    of_flight, in_air = (np.concatenate(times) for times in zip(*edges, strict=True))
    return [tuple(np.interp(interval, of_flight, in_air).tolist()) for interval in seconds]


def _air_stretches(flight: Flight) -> list[tuple[float, float, float]]:
    """Stretches of a flight in the air: from and to, s, and the time in the air before it, s."""
    intervals = intervals_s(flight.phase != GROUND)
    before = np.cumsum([0.0, *(end - begin for begin, end in intervals)])
    return [(begin, end, float(u)) for (begin, end), u in zip(intervals, before[:-1], strict=True)]
