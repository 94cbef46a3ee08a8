"""The whole firmware with the app, in QEMU: `make emulate CRAZYFLIE_BASE=...`.

    python -m tools.emulate ~/crazyflie-firmware                    # two recorded flights through the log variables
    python -m tools.emulate ~/crazyflie-firmware flight.csv --steps 2400
    python -m tools.emulate ~/crazyflie-firmware --fly              # its stabilizer flies the simulator's drone
    python -m tools.emulate ~/crazyflie-firmware --gap8             # with the network on the GAP8, and faults
    python -m tools.emulate ~/crazyflie-firmware --height           # with and without the height over a platform
"""

import argparse
import os
import sys
import time
from pathlib import Path

import numpy as np

from airtouch import vehicle as vehicles
from airtouch.errors import AirTouchError
from airtouch.logs import read
from airtouch.logs.flight_log import FlightLog
from airtouch.simulation import scenario
from airtouch.simulation.flight import fly as simulated
from tools.emulate import build, gap8, height
from tools.emulate.board import PER_US
from tools.emulate.compare import report
from tools.emulate.replay import VEHICLES, Replay, replay

RECORDED = "airtouch/imu_data_02*h79*"  #: low and high entries of one day
CLONE = "git clone --recursive --branch 2026.08 https://github.com/bitcraze/crazyflie-firmware ~/crazyflie-firmware"
#: step -> parameters: three that are taken over, one out of range, the other detector and back
CHANGES: dict[int, dict[str, float]] = {
    100: {"pFa": 1e-3}, 150: {"bandMid": 9.0}, 200: {"scoreIn": 99.0}, 250: {"detector": 0},
    300: {"detector": 1, "scoreIn": 2.3}}


def recorded(count: int) -> list[FlightLog]:
    """So many recorded flights, or a simulated one where none are here."""
    folder = Path(os.environ.get("AIRTOUCH_FLIGHTS", build.ROOT.parent / "shared" / "flights"))
    logs = [read(path) for path in sorted(folder.glob(RECORDED))[:count]]
    if logs:
        return logs
    log = simulated(scenario.load("paper-4cm"), vehicles.load(), seed=3)
    return [log] if isinstance(log, FlightLog) else []


def later(log: FlightLog, begin: int) -> FlightLog:
    """The log from this row on."""
    return FlightLog({name: values[begin:] for name, values in log.columns.items()}, log.meta)


def show(what: str, seconds: float, result: Replay) -> None:
    """A line of the table, and what differed."""
    task, words = result.least_left
    print(f"{what}: {result.steps} steps, {result.different} differ, prob within {result.prob_off:.1g}; edges "
          f"{' '.join(f'{kind}@{step}' for step, kind in result.edges) or 'none'}\n  late {result.late}, longest step "
          f"{result.longest_us} us; app's stack {result.stack_bytes} of 1600 bytes, least left of any task {4 * words} "
          f"({task});\n  instructions of a step, with what preempted it: mean "
          f"{PER_US * int(np.mean(result.loads_us)):,}, longest {PER_US * max(result.loads_us):,}, to {PER_US};\n  "
          f"{result.steps / 100:.1f} s of flight in {seconds:.0f} s", flush=True)
    if result.first:
        print(f"  first difference: {result.first}")


def main(arguments: list[str]) -> int:
    """Build, run, print. 1 where a step differs."""
    parser = argparse.ArgumentParser(prog="python -m tools.emulate", description=__doc__.splitlines()[0])
    parser.add_argument("base", type=Path, help="checkout of bitcraze/crazyflie-firmware")
    parser.add_argument("flights", nargs="*", type=Path, help="flight logs; recorded ones if left out")
    parser.add_argument("--steps", type=int, default=2400, help="of each flight (2400)")
    parser.add_argument("--begin", type=int, default=0, help="first row of each flight (0)")
    parser.add_argument("--built", action="store_true", help="take what `make firmware` built last")
    parser.add_argument("--fly", action="store_true", help="closed loop with the simulator instead: the app on and off")
    parser.add_argument("--height", action="store_true",
                        help="closed loop over edges of every kind: the height kept or not")
    parser.add_argument("--seeds", type=int, default=1, help="of --height: draws of the noise (1)")
    parser.add_argument("--only", default="", help="of --height: cases whose names begin so")
    parser.add_argument("--gap8", action="store_true",
                        help="a recorded flight with the AI-deck's driver, the network on the GAP8, and faults")
    parser.add_argument("--config", help="of firmware/app: app-config-tap and the like")
    parser.add_argument("--platform", default="cf2", choices=VEHICLES, help="of the firmware (cf2)")
    options = parser.parse_args(arguments)
    build.tools()
    if not options.built:
        config = "app-config-height" if options.height else "app-config-gap8" if options.gap8 else "app-config"
        build.compile_firmware(options.base.expanduser().resolve(), options.config or config, options.platform)
    elf = build.link()
    if options.fly:
        return 0 if report(elf) else 1
    if options.height:
        return 0 if height.report(elf, options.seeds, options.only) else 1
    if options.gap8:
        log = read(options.flights[0]) if options.flights else recorded(1)[0]
        return 0 if gap8.report(elf, later(log, options.begin), options.steps) else 1
    logs = [read(path) for path in options.flights] or recorded(2)
    different = 0
    for i, log in enumerate(logs):
        changes: dict[int, dict[str, float]] = CHANGES if i == len(logs) - 1 else {}
        begun = time.monotonic()
        found = replay(elf, later(log, options.begin), options.steps, changes, VEHICLES[build.platform()])
        name = Path(str(log.meta.get("source", "simulated"))).name + (", parameters changed in flight" if changes
                                                                      else "")
        show(name, time.monotonic() - begun, found)
        different += found.different
    return 1 if different else 0


if __name__ == "__main__":
    try:
        if len(sys.argv) < 2 or not sys.argv[1]:
            raise AirTouchError(f"say where the firmware's sources are: make emulate "
                                f"CRAZYFLIE_BASE=~/crazyflie-firmware; {CLONE}")
        sys.exit(main(sys.argv[1:]))
    except AirTouchError as error:
        sys.exit(f"make emulate: {error}")
