"""Prints simulated seconds a wall second of crazyflow (JAX) on the CPU: 64 worlds under state control at 500 Hz.

    python tools/benchmarks/bench_crazyflow.py [--seconds 10] [--rounds 3]

Prints one JSON object: by integrator, the rate a wall second and a second of CPU time. Runs where
`pip install crazyflow==0.4.0` was done (1.2 GB, so not among AirTouch's packages);
`tools/bench_simulation.py` calls it. The first round of each integrator, not counted, pays for compilation. Four
rounds of 640 simulated seconds with each of two integrators: 3 s and the compilation, at the rates in
host/docs/simulation-checks.md.
"""

import argparse
import json
import statistics
import time

WORLDS, HZ = 64, 500  #: drones that are simulated at once, and steps a simulated second


def rates(integrator: str, seconds: float, rounds: int) -> list[tuple[float, float]]:
    """Simulated seconds of all worlds a wall second and a CPU second, round by round."""
    import jax
    import numpy as np
    from crazyflow.control import Control
    from crazyflow.sim import Sim

    sim = Sim(n_worlds=WORLDS, n_drones=1, control=Control.state, freq=HZ, state_freq=100, attitude_freq=HZ,
              device="cpu", integrator=integrator)
    sim.reset()
    command = np.zeros((WORLDS, 1, 16))
    command[..., 2] = 0.8
    out = []
    for _ in range(rounds + 1):
        started, busy = time.perf_counter(), time.process_time()
        sim.state_control(command)
        sim.step(int(seconds * HZ))
        jax.block_until_ready(sim.data)
        out.append((WORLDS * seconds / (time.perf_counter() - started),
                      WORLDS * seconds / (time.process_time() - busy)))
    return out[1:]


def main() -> None:
    """Time both integrators and print the rates."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=10.0, help="simulated, of each round (default %(default)s)")
    parser.add_argument("--rounds", type=int, default=3, help="timed after the one that compiles (default %(default)s)")
    options = parser.parse_args()
    if options.seconds <= 0.0 or options.rounds < 1:
        parser.error("--seconds must be more than 0, --rounds at least 1")
    print(json.dumps({name: [round(statistics.median(column))
                             for column in zip(*rates(name, options.seconds, options.rounds), strict=True)]
                      for name in ("euler", "rk4")}))


if __name__ == "__main__":
    main()
