"""Prints instructions, flash, RAM and stack of every kernel of the STM32, counted in the emulator.

    python -m tools.instruction_counts.count                        the table, beside its budget; 16 s
    python -m tools.instruction_counts.count --flights FOLDER       over recorded flights too; 2 min
    python -m tools.instruction_counts.count --optimise=-Os         as the Crazyflie firmware compiles by default
    python -m tools.instruction_counts.count --toml                 limits for budget.toml beside this file, 3 % above

Run from the checkout's root. The mean is over the steps that give an output, the worst over all.
"""

import argparse
import csv
from dataclasses import asdict
from pathlib import Path

import numpy as np

from airtouch.cli.shared.flights import check_data_set
from airtouch.detector import best
from airtouch.detector.shared.channels import level_acceleration, thrust_axis
from airtouch.errors import in_one_line
from airtouch.logs import read
from airtouch.logs.flight_log import GYRO, PWM
from airtouch.reference.networks.int8_network import quantise

from . import budget
from .build import compilers
from .flight_code import KERNELS, Cost, FlightCode, compile_flight_code, made_flight, samples

#: programs that are also counted over recorded flights
WHOLE = ("edge_pipeline", "stream_detector")
MARGIN = 1.03  #: a new budget over the measured cost


def kernel_inputs(code: FlightCode, flight: np.ndarray) -> dict[str, np.ndarray]:
    """Input of each kernel in a flight (n,) of edgeSample_t."""
    events = code.fly("edge_pipeline", flight)
    channels = code.fly("motion_channels", flight).output
    first = best.load(None).int8.layers[0]
    clean = np.nan_to_num(np.column_stack([flight["acc"], flight["gyro"], flight["pwm"]]), posinf=0.0, neginf=0.0)
    nine = np.column_stack([clean[:, :6], clean[:, 7:] - clean[:, 6:7]])
    return {
        "band_power": nine, "cross_spectrum": events.output["bandPower"][events.ready],
        "disturbance_force": flight, "fr_cfar": events.output["cfarPower"], "edge_pipeline": flight,
        "motion_channels": flight, "stream_int8": quantise(channels, first.input_scale, first.input_zero_point),
        "edge_decoder": made_logits(), "stream_detector": flight,
    }


def made_logits(n: int = 1500) -> np.ndarray:
    """(n, 3): over a platform and off it again every six seconds of steps, entry and exit peaking between."""
    over = 6.0 * np.sin(np.arange(n) / 50.0)
    slope = np.gradient(over) * 50.0
    return np.column_stack([over, slope - 2.0, -slope - 2.0]).astype(np.float32)


def measure(code: FlightCode, flight: np.ndarray | None = None) -> dict[str, Cost]:
    """Kernel -> cost over one flight, the made-up one by default."""
    inputs = kernel_inputs(code, made_flight() if flight is None else flight)
    return {name: code.cost(name, code.fly(name, inputs[name])) for name in KERNELS}


def flight_samples(path: Path) -> np.ndarray:
    """A recorded flight as (n,) of edgeSample_t, in float32 as the kernels are fed."""
    log = read(path)
    return samples(level_acceleration(log), log.stack(GYRO), log.stack(PWM), thrust_axis=thrust_axis(log))


def clean_flights(folder: Path) -> list[Path]:
    """The clean flights of a manifest."""
    with open(folder / "manifest.csv", newline="") as file:
        return [folder / row["file"] for row in csv.DictReader(file) if row["use"] == "clean"]


def _table(costs: dict[str, Cost], limits: dict[str, Cost]) -> None:
    """Print the costs of each kernel beside its budget."""
    print(f"{'kernel':20}{'mean':>9}{'worst':>9}{'flash B':>9}{'RAM B':>9}{'stack B':>9}   budget (mean, worst, ...)")
    for name, cost in costs.items():
        numbers = "".join(f"{value:9,.0f}" for value in asdict(cost).values())
        may = ", ".join(f"{value:,.0f}" for value in asdict(limits[name]).values()) if name in limits else "-"
        print(f"{name:20}{numbers}   {may}")


def _toml(core: str, costs: dict[str, Cost]) -> None:
    """Print the costs with MARGIN as a new budget, rounded up to eight."""
    for name, cost in costs.items():
        print(f"\n[{core}.{name}]")
        for key, value in asdict(cost).items():
            exact = key == "ram_bytes"
            print(f"{key} = {int(value) if exact else 8 * int(np.ceil(value * MARGIN / 8))}")


def _flights(code: FlightCode, folder: Path) -> None:
    """Print the instructions of each step over recorded flights."""
    paths = clean_flights(folder)
    for name in WHOLE:
        steps = [code.fly(name, flight_samples(path)) for path in paths]
        ready = np.concatenate([s.instructions[s.ready] for s in steps])
        total = np.concatenate([s.instructions for s in steps])
        print(f"{name}: {len(paths)} flights, {total.size:,} steps: mean {ready.mean():,.0f} instructions a step with "
              f"an output, {total.mean():,.0f} over all, worst {total.max():,}")


def main() -> None:
    """Count the instructions and memory of every kernel on one core."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--core", default="cortex-m4", choices=["cortex-m4", "rv32imc"],
                        help="(default %(default)s)")
    parser.add_argument("--optimise", default="-O2", help="the compiler's option (default %(default)s)")
    parser.add_argument("--compiler", choices=["zig", "gcc"], help="(default: the first that is here)")
    parser.add_argument("--flights", type=Path, metavar="FOLDER", help="count over its clean flights too")
    parser.add_argument("--toml", action="store_true", help="print limits for budget.toml instead of the table")
    options = parser.parse_args()
    if options.flights:
        check_data_set(options.flights)
    code = FlightCode(compile_flight_code(options.core, optimise=options.optimise, compiler=options.compiler))
    costs = measure(code)
    if options.toml:
        _toml(options.core, costs)
        return
    chosen = options.compiler or compilers(options.core)[0]
    print(f"{options.core}, {chosen}, {options.optimise}: instructions a step, over a synthetic flight of 15 s")
    _table(costs, budget.load(options.core) if options.core == "cortex-m4" and options.optimise == "-O2" else {})
    if options.flights:
        _flights(code, options.flights)


if __name__ == "__main__":
    with in_one_line("count"):
        main()
