"""Prints simulated seconds a wall second: 64 flights at 500 Hz, all effects on and none; the peers in the same run.

    python tools/bench_simulation.py [--flights 64] [--json out.json] [--crazyflow PYTHON]    # a minute

Every effect of the registry is on at a fifth of its default strength (all at full
strength at once is not flyable). The first, untimed flight pays for compilation.
RotorPy (extra `bench`) flies its Crazyflie in a closed loop with its own controller, on one core:
it has no batch of its own without PyTorch. crazyflow (JAX, 1.2 GB, not among AirTouch's packages)
flies 64 worlds on all cores, without sensors, log or effects: `--crazyflow` names the Python that has
it, made with `python -m venv crazyflow && crazyflow/bin/pip install crazyflow==0.4.0`. Three rounds in
turn, medians. host/docs/simulation-checks.md has the figures.
"""

import argparse
import importlib.util
import json
import shutil
import statistics
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from airtouch import vehicle as vehicles
from airtouch.cli.shared.arguments import whole_number
from airtouch.cli.shared.progress import with_bar
from airtouch.errors import AirTouchError, in_one_line
from airtouch.logs.files import check_free, write_bytes
from airtouch.simulation import batch, effects, scenario
from airtouch.simulation.flight import Diverged

STRENGTH = 0.2  #: of every effect, as a fraction of its default
ROUNDS = 3  #: rounds of timings
PEER_S = 4.0  #: simulated by the peer each time


def every_effect() -> list[effects.Active]:
    """All effects at a fifth of their default strength."""
    return [effects.Active(e, e.scaled(e.values(), STRENGTH)) for e in effects.EFFECTS.values()]


def measure(flights: int, workers: int, on: bool = True, name: str = "paper-mixed") -> dict[str, Any]:
    """Fly and time, every effect on or none; the result says what was flown."""
    scene, craft, active = scenario.load(name), vehicles.load(), every_effect() if on else []
    without = () if on else tuple(effects.EFFECTS)
    started = time.perf_counter()
    list(batch.flights(scene, 1, vehicle=craft, effects=active, without=without, workers=1))
    first = time.perf_counter() - started
    started, busy = time.perf_counter(), time.process_time()
    results = list(batch.flights(scene, flights, vehicle=craft, effects=active, without=without,
                                 workers=workers))
    wall, busy = time.perf_counter() - started, time.process_time() - busy
    good = [r for r in results if not isinstance(r, Diverged)]
    seconds = sum(r["t_s"][-1] for r in good)
    return {"scenario": name, "flights": flights, "diverged": len(results) - len(good), "effects": len(active),
            "physics_hz": 500, "workers": workers, "first_flight_s": round(first, 2), "simulated_s": round(seconds, 1),
            "wall_s": round(wall, 3), "simulated_s_per_wall_s": round(seconds / wall),
            "simulated_s_per_cpu_s": round(seconds / busy)}


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


def crazyflow_rates(python: str | None) -> dict[str, list[float]]:
    """Simulated seconds a wall second and a CPU second, by integrator; {} without crazyflow.

    python: one that has crazyflow. Raises AirTouchError where it has not.
    """
    if python is None and importlib.util.find_spec("crazyflow") is None:
        return {}
    command = [python or sys.executable, str(Path(__file__).parent / "benchmarks/bench_crazyflow.py"), "--rounds", "1"]
    run = subprocess.run(command, capture_output=True, text=True)
    if run.returncode:
        raise AirTouchError(f"crazyflow by {command[0]}: {run.stderr.strip().splitlines()[-1]}")
    return json.loads(run.stdout.splitlines()[-1])


def figures_of(own: list[dict[str, Any]], other: list[dict[str, Any]], rotorpy: list[float],
               crazyflow: list[dict[str, list[float]]]) -> dict[str, Any]:
    """Medians over rounds of the rates, and of their ratios to the peers' of the same round.

    own, other: of `measure` with every effect and with none; rotorpy, crazyflow: the peers' rates, empty without them.
    """
    figures = {**own[-1], "first_flight_s": own[0]["first_flight_s"]}
    for k, unit in enumerate(("wall_s", "cpu_s")):
        rate = f"simulated_s_per_{unit}"
        figures[rate] = statistics.median(r[rate] for r in own)
        figures[f"no_effects_s_per_{unit}"] = statistics.median(r[rate] for r in other)
        for name in crazyflow[0]:
            figures[f"crazyflow_{name}_s_per_{unit}"] = statistics.median(r[name][k] for r in crazyflow)
            for label, ours in (("", own), ("no_effects_", other)):
                figures[f"{label}times_crazyflow_{name}_{unit}"] = round(statistics.median(
                    r[rate] / c[name][k] for r, c in zip(ours, crazyflow, strict=True)), 2)
    if rotorpy:
        figures["rotorpy_s_per_wall_s"] = round(statistics.median(rotorpy), 2)
        figures["times_rotorpy"] = round(statistics.median(
            r["simulated_s_per_wall_s"] / peer for r, peer in zip(own, rotorpy, strict=True)))
    return figures


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flights", type=whole_number(1), default=64, help="of each round (default %(default)s)")
    parser.add_argument("--workers", type=whole_number(1), default=batch.available_cores(),
                        help="threads (default: one a core)")
    parser.add_argument("--json", type=Path, help="write the figures here")
    parser.add_argument("--force", action="store_true", help="replace --json if it is there")
    parser.add_argument("--crazyflow", metavar="PYTHON", help="a Python that has crazyflow")
    options = parser.parse_args()
    if options.crazyflow and shutil.which(options.crazyflow) is None:
        parser.error(f"--crazyflow {options.crazyflow}: no such program")
    check_free(options.json, options.force)
    own, other, rotorpy, crazyflow = [], [], [], []
    for _ in with_bar(range(ROUNDS), "rounds"):
        own.append(measure(options.flights, options.workers))
        other.append(measure(options.flights, options.workers, on=False))
        rotorpy.append(rotorpy_rate())
        crazyflow.append(crazyflow_rates(options.crazyflow))
    peers = [rate for rate in rotorpy if rate is not None]
    figures = figures_of(own, other, peers, crazyflow)
    print("\n".join(f"{key}: {value}" for key, value in figures.items()))
    if not peers:
        print("RotorPy is not installed (extra 'bench'), so it is not compared")
    if not crazyflow[0]:
        print("crazyflow is not installed, so it is not compared: python -m venv crazyflow && "
              "crazyflow/bin/pip install crazyflow==0.4.0, then --crazyflow crazyflow/bin/python")
    if options.json:
        write_bytes(json.dumps(figures, indent=1).encode(), options.json, options.force)


if __name__ == "__main__":
    with in_one_line("bench_simulation"):
        main()
