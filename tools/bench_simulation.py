"""Simulated seconds per wall second: 64 flights, every effect on, physics at 500 Hz.

    .venv/bin/python tools/bench_simulation.py [--flights 64] [--workers 2] [--json out.json]

Every effect of the registry is on at a fifth of its default strength (all at full
strength at once is not flyable). The first, untimed flight pays for compilation.
"""

import argparse
import json
import time

from airtouch import vehicle as vehicles
from airtouch.simulation import batch, effects, scenario
from airtouch.simulation.flight import Diverged

STRENGTH = 0.2


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


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flights", type=int, default=64)
    parser.add_argument("--workers", type=int, default=batch.available_cores())
    parser.add_argument("--json", help="write the figures here")
    options = parser.parse_args()
    figures = measure(options.flights, options.workers)
    print("\n".join(f"{key}: {value}" for key, value in figures.items()))
    if options.json:
        with open(options.json, "w", encoding="utf-8") as file:
            json.dump(figures, file, indent=1)
