"""The same flight twice: in emulation with the app and without, and in the simulator's own loop."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from airtouch import vehicle as vehicles
from airtouch.simulation import scenario
from airtouch.simulation.flight_plan.world import top_at
from airtouch.simulation.scenario import Scenario, draw_flight
from airtouch.vehicle import Vehicle

from . import side_by_side
from .flight import BOOT_S, TRUE_X, EmulatedFlight, T, fly
from .plant import STEP_S
from .replay import VEHICLES

DRAWS = 3  #: seeds of the own loop whose flights are held against each other
AIRBORNE_S = 2.5  #: of there-and-back: the take-off has ended
#: of there-and-back: end of the take-off's swing, seconds of the landing at the end
SETTLED_S, LAND_S = 4.5, 3.5
#: the mission there and back
SCENARIO = Path(__file__).with_name("there-and-back.toml")


def vehicle(platform: str = "cf2") -> Vehicle:
    """The drone of a platform with the firmware as shipped: no range module."""
    return replace(vehicles.load(VEHICLES[platform]), range_module="firmware")


def crossings(plan: Scenario, seed: int, flight: int, table: np.ndarray) -> list[tuple[float, str]]:
    """(s, kind) at which the drone crossed the platform's edges in truth."""
    ground = draw_flight(plan, seed, flight).world
    over = np.array([top_at(ground, x, y) > 0.01 for x, y in table[:, 1:3]])
    at = np.flatnonzero(np.diff(over.astype(int)))
    return [(float(table[i + 1, 0]), "entry" if over[i + 1] else "exit") for i in at]


def first_edge(plan: Scenario, seed: int, table: np.ndarray) -> float:
    """Second at which the drone crossed its first edge in truth; infinite where it crossed none."""
    edges = crossings(plan, seed, 0, table)
    return edges[0][0] if edges else np.inf


def cruise(one: EmulatedFlight) -> np.ndarray:
    """Rows between take-off and landing; to the end where it did not end well."""
    t = one.table[:, T]
    return one.table[(t >= SETTLED_S) & (t < (t[-1] - LAND_S if one.ending == "ok" else np.inf))]


def height_range(one: EmulatedFlight) -> tuple[float, float]:
    """Least and greatest true height over the floor between take-off and landing, m."""
    heights = cruise(one)[:, TRUE_X + 2]
    return (float(heights.min()), float(heights.max())) if len(heights) else (np.nan, np.nan)


def words(edges: Sequence[tuple[float, str]]) -> str:
    """Edges (s, kind) as text."""
    return " ".join(f"{kind}@{t:.2f}" for t, kind in edges) or "none"


def differing(one: EmulatedFlight, other: EmulatedFlight) -> tuple[int, int, int, int]:
    """Motor commands that differ, of how many, the first, and the most by which that one does."""
    n = min(len(one.pwm), len(other.pwm))
    gap = np.abs(one.pwm[:n].astype(int) - other.pwm[:n]).max(axis=1)
    at = np.flatnonzero(gap)
    return len(at), n, int(at[0]) if len(at) else -1, int(gap[at[0]]) if len(at) else 0


@dataclass(frozen=True)
class Mission:
    """There-and-back of one seed: with the app and without, then both with a clock of whole milliseconds."""

    seed: int
    on: EmulatedFlight
    off: EmulatedFlight
    coarse_on: EmulatedFlight
    coarse_off: EmulatedFlight
    own: np.ndarray  #: side_by_side.own_loop

    def same(self) -> bool:
        """Whether the app changed no motor command where the clock goes in whole milliseconds."""
        return (differing(self.coarse_on, self.coarse_off)[0] == 0
                and len(self.coarse_on.pwm) == len(self.coarse_off.pwm))


def fly_mission(elf: Path, drone: Vehicle, seed: int) -> Mission:
    """Fly there and back."""
    plan = scenario.load(SCENARIO)
    on, off, coarse_on, coarse_off = (fly(elf, plan, drone, seed, app=app, whole_milliseconds=coarse)
                                      for coarse in (False, True) for app in (True, False))
    return Mission(seed, on, off, coarse_on, coarse_off, side_by_side.own_loop(plan, drone, seed))


def print_mission(one: Mission) -> None:
    """Print what one mission shows."""
    plan = scenario.load(SCENARIO)
    other, n, first, by = differing(one.on, one.off)
    print(f"there-and-back, seed {one.seed}: with the app {one.on.ending}, without {one.off.ending}")
    print(f"motors: {other} of {n} commands differ"
          + (f", the first at {first * STEP_S - BOOT_S:.2f} s by {by} of 65535" if other else ""))
    same, n, _, _ = differing(one.coarse_on, one.coarse_off)
    print(f"with a clock of whole milliseconds: {same} of {n} commands differ")
    print(f"stabilizer, sensor to motors: worst {one.on.latency_us} us with the app, {one.off.latency_us} us without, "
          f"median {np.median(one.on.latencies_us):.0f} us; app: late {one.on.late}, longest step {one.on.load_us} us")
    for what, two in (("with the app", one.on), ("the same, whole milliseconds", one.coarse_on)):
        low, high = height_range(two)
        true = crossings(plan, one.seed, 0, two.table)
        print(f"{what}: {low:.2f} to {high:.2f} m over the floor; edges crossed {words(true)}, detected "
              f"{words([(t, kind) for t, kind, _ in two.edges])} (s)", flush=True)


def show_side_by_side(missions: Sequence[Mission], drone: Vehicle) -> None:
    """Print how far the simulator's own loop is from the emulated firmware, before the first edge.

    Beside it how far that loop's own flights are apart, of DRAWS seeds at least.
    """
    plan = scenario.load(SCENARIO)
    pairs = [side_by_side.together(one.on, one.own, AIRBORNE_S,
                                   min(first_edge(plan, one.seed, one.on.table),
                                       first_edge(plan, one.seed, side_by_side.places(one.own)))) for one in missions]
    seconds = sum(len(a) for a, _ in pairs) / side_by_side.ROWS_S
    others = []
    for seed in range(len(missions) + 1, DRAWS + 1):
        own = side_by_side.own_loop(plan, drone, seed)
        until_s = first_edge(plan, seed, side_by_side.places(own))
        others.append(side_by_side.together(EmulatedFlight(table=missions[0].on.table), own, AIRBORNE_S, until_s)[1])
    print(f"beside the simulator's own loop, {seconds:.1f} s of {len(pairs)} flights from {AIRBORNE_S} s to the first "
          f"edge, rms:\n  channel             between the loops, same noise"
          "   own loop, other noise   scatter: emulated   own")
    for row in side_by_side.differences(pairs, others):
        print(f"  {row.channel:20}{row.loops:12.3g}{row.draws:36.3g}{row.emulated:20.3g}{row.own:12.3g}")


def report(elf: Path, platform: str = "cf2", seeds: int = 1, traces: Path | None = None, force: bool = False) -> bool:
    """Fly, print; whether the app changed no motor command where the clock goes in whole milliseconds.

    traces: CSV that the first flight is written to, beside the simulator's own.
    """
    missions = []
    for seed in range(1, seeds + 1):
        missions.append(fly_mission(elf, vehicle(platform), seed))
        print_mission(missions[-1])
    show_side_by_side(missions, vehicle(platform))
    if traces:
        side_by_side.write_traces(traces, missions[0].on, missions[0].own, force)
    return all(one.same() for one in missions)
