"""Simulated seconds per wall second: 64 flights, every effect on, physics at 500 Hz; RotorPy in the same run.

    .venv/bin/python tools/bench_simulation.py [--flights 64] [--workers 2] [--json out.json]

Every effect of the registry is on at a fifth of its default strength (all at full
strength at once is not flyable). The first, untimed flight pays for compilation.
RotorPy (extra `bench`) flies its Crazyflie in a closed loop with its own controller, on one core:
it has no batch of its own without PyTorch. Three pairs in turn, medians.
"""

import argparse
import json
import statistics
import time

from airtouch import vehicle as vehicles
from airtouch.simulation import batch, effects, scenario
from airtouch.simulation.flight import Diverged

STRENGTH = 0.2
PAIRS = 3
PEER_S = 4.0  #: simulated by the peer each time


def every_effect() -> list[effects.Active]:
    """All effects at a fifth of their default strength."""
    return [effects.Active(e, e.scaled(e.values(), STRENGTH)) for e in effects.EFFECTS.values()]


def measure(flights: int, workers: int, name: str = "paper-mixed") -> dict[str, float | int | str]:
    """Fly and time; the result says what was flown."""
    scene, craft, active = scenario.load(name), vehicles.load(), every_effect()
    started = time.perf_counter()
    list(batch.flights(scene, 1, vehicle=craft, effects=active, workers=1))
    first = time.perf_counter() - started
    started = time.perf_counter()
    results = list(batch.flights(scene, flights, vehicle=craft, effects=active, workers=workers))
    wall = time.perf_counter() - started
    good = [r for r in results if not isinstance(r, Diverged)]
    seconds = sum(r["t_s"][-1] for r in good)
    return {"scenario": name, "flights": flights, "diverged": len(results) - len(good), "effects": len(active),
            "physics_hz": 500, "workers": workers, "first_flight_s": round(first, 2), "simulated_s": round(seconds, 1),
            "wall_s": round(wall, 3), "simulated_s_per_wall_s": round(seconds / wall)}


def rotorpy_rate(seconds: float = PEER_S) -> float | None:
    """Simulated seconds a wall second of RotorPy's Crazyflie on a circle at 500 Hz; None without RotorPy."""
    try:
        from rotorpy.controllers.quadrotor_control import SE3Control
        from rotorpy.trajectories.circular_traj import ThreeDCircularTraj
        from rotorpy.vehicles.crazyflie_params import quad_params
        from rotorpy.vehicles.multirotor import Multirotor
    except ImportError:
        return None
    craft, pilot, path = Multirotor(quad_params), SE3Control(quad_params), ThreeDCircularTraj()
    state = craft.initial_state
    started = time.perf_counter()
    for step in range(int(seconds / 0.002)):
        t = step * 0.002
        state = craft.step(state, pilot.update(t, state, path.update(t)), 0.002)
    return seconds / (time.perf_counter() - started)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flights", type=int, default=64)
    parser.add_argument("--workers", type=int, default=batch.available_cores())
    parser.add_argument("--json", help="write the figures here")
    options = parser.parse_args()
    pairs = [(measure(options.flights, options.workers), rotorpy_rate()) for _ in range(PAIRS)]
    figures = {**pairs[-1][0], "first_flight_s": pairs[0][0]["first_flight_s"],
               "simulated_s_per_wall_s": statistics.median(ours["simulated_s_per_wall_s"] for ours, _ in pairs)}
    peers = [peer for _, peer in pairs if peer is not None]
    if peers:
        figures["rotorpy_s_per_wall_s"] = round(statistics.median(peers), 2)
        figures["times_rotorpy"] = round(statistics.median(
            ours["simulated_s_per_wall_s"] / peer for ours, peer in pairs))
    print("\n".join(f"{key}: {value}" for key, value in figures.items()))
    if not peers:
        print("RotorPy is not installed (extra 'bench'), so it is not compared")
    if options.json:
        with open(options.json, "w", encoding="utf-8") as file:
            json.dump(figures, file, indent=1)


if __name__ == "__main__":
    main()
