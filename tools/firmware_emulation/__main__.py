"""Runs the whole firmware with the app in QEMU: `make emulate CRAZYFLIE_BASE=...`.

    python -m tools.firmware_emulation ~/crazyflie-firmware             # two recorded flights, by the log variables
    python -m tools.firmware_emulation ~/crazyflie-firmware flight.csv --steps 2400
    python -m tools.firmware_emulation ~/crazyflie-firmware --fly       # its stabilizer flies the simulator's drone
    python -m tools.firmware_emulation ~/crazyflie-firmware --gap8      # with the network on the GAP8, and faults
    python -m tools.firmware_emulation ~/crazyflie-firmware --height    # with and without the height over a platform

It compiles for a minute; 24 s of a recorded flight then take 2 s.
"""

import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from airtouch import vehicle as vehicles
from airtouch.cli.shared.flights import data_folder
from airtouch.errors import AirTouchError, in_one_line
from airtouch.logs import read
from airtouch.logs.flight_log import FlightLog
from airtouch.simulation import scenario
from airtouch.simulation.flight import fly as simulated

from . import build, gap8, height
from .board import PER_US
from .compare import report
from .options import NO_BASE, flights_of, from_row, parser
from .replay import VEHICLES, Replay, replay

RECORDED = "airtouch/imu_data_02*h79*"  #: low and high entries of one day
#: step -> parameters: three that are taken over, one out of range, the other detector and back
CHANGES: dict[int, dict[str, float]] = {
    100: {"pFa": 1e-3}, 150: {"bandMid": 9.0}, 200: {"scoreIn": 99.0}, 250: {"detector": 0},
    300: {"detector": 1, "scoreIn": 2.3}}


def recorded_flights(count: int) -> list[FlightLog]:
    """So many recorded flights, or a simulated one where none are here."""
    logs = [read(path) for path in sorted(data_folder().glob(RECORDED))[:count]]
    if logs:
        return logs
    log = simulated(scenario.load("paper-4cm"), vehicles.load(), seed=3)
    return [log] if isinstance(log, FlightLog) else []


def print_replay(what: str, seconds: float, result: Replay) -> None:
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


def replay_and_print(elf: Path, logs: Sequence[FlightLog], steps: int) -> int:
    """Replay and print; parameters change in the last flight. Steps that differ."""
    different = 0
    for i, log in enumerate(logs):
        changes: dict[int, dict[str, float]] = CHANGES if i == len(logs) - 1 else {}
        start_s = time.monotonic()
        result = replay(elf, log, steps, changes, VEHICLES[build.platform()])
        name = Path(str(log.meta.get("source", "simulated"))).name + (", parameters changed in flight" if changes
                                                                      else "")
        print_replay(name, time.monotonic() - start_s, result)
        different += result.different
    return different


def main(arguments: list[str]) -> int:
    """Build, run, print. 1 where a step differs."""
    options = parser(__doc__).parse_intermixed_args(arguments)
    logs = flights_of(options)
    build.tools()
    if not options.built:
        config = "app-config-height" if options.height else "app-config-gap8" if options.gap8 else "app-config"
        build.compile_firmware(options.base.expanduser().resolve(), options.config or config, options.platform)
    elf = build.link(needs="height_port" if options.height else "gap8_port" if options.gap8 else "")
    if options.fly:
        return 0 if report(elf, build.platform(), options.seeds, options.traces, options.force) else 1
    if options.height:
        return 0 if height.report(elf, build.platform(), options.seeds, options.only, options.keep) else 1
    logs = logs or [from_row(log, options.begin) for log in recorded_flights(1 if options.gap8 else 2)]
    if options.gap8:
        return 0 if gap8.report(elf, logs[0], options.steps) else 1
    return 1 if replay_and_print(elf, logs, options.steps) else 0


if __name__ == "__main__":
    with in_one_line("make emulate"):
        if len(sys.argv) < 2 or not sys.argv[1]:
            raise AirTouchError(NO_BASE)
        sys.exit(main(sys.argv[1:]))
