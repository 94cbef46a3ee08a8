"""Prints what the down range reads at platform edges, and what the firmware's height control makes of it.

    python tools/detectors/edge_readings.py FOLDER --fold 0 --fold 1 --fold 2 [--twin FOLDER]    # 15 s without --twin

For recorded flights, and with --twin for the same courses flown by that twin:
- the one reading in which an edge passes: where between the two distances it lies;
- the height over the floor less the reading, before exits: the platform's height where the reading is right;
- flights that pass 6.5 cm or more over the platform: median over flights of what the range module passes on, of the
  mean motor command, and of the command that the firmware's height states and loops give for the logged range and
  vertical acceleration alone (optical flow left out). Where the last two agree, estimator and controller are right,
  and what differs between drone and twin is what they are fed.
The figures are in host/docs/twin-findings.md.
"""

import argparse
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from airtouch import vehicle
from airtouch.cli.shared.arguments import whole_number
from airtouch.errors import AirTouchError, in_one_line
from airtouch.parameters import SAMPLE_RATE_HZ
from airtouch.simulation import scenario
from airtouch.simulation.firmware import range_module, settings
from airtouch.simulation.flight import Diverged, fly
from airtouch.twin import files
from airtouch.twin.fitting import fly as twin_fly
from airtouch.twin.recorded import channels as ch
from airtouch.twin.recorded import flights, near_range
from airtouch.twin.recorded.course import Course

FIRMWARE = "authors-2024-01"  #: name of the simulated firmware
#: limits of the bins of the histogram of fractions; no source: chosen by eye, a bin for each kind
FRACTIONS = np.array([-0.05, 0.05, 0.5, 0.6, 0.9, 1.05, 1.6])
#: limits of the bins of readings, cm; between the heights that the authors flew
READINGS_CM = (0.0, 0.5, 1.5, 2.5, 3.5, 6.5, 8.0, 9.0, 13.0)
HIGH_M = 0.065  #: m over the platform from which on a flight is high, as in `features.CLASSES`
ROWS = 10  #: samples of a bin: 0.1 s
BINS = 13  #: bins around an edge, from 0.3 s before it
PASSING = slice(-12, 22)  #: samples around an edge in which the down range passes from one distance to the other
CLEAR = 0.05  #: fraction of the step by which the reading in passing differs from both distances; no source
LAST = 27  #: samples before an exit whose median is taken: 0.3 s, less 3 of the edge itself
READING_ROWS = 3  #: rows, at most, of one reading: one each 25 ms, a row each 10 ms
PWM_OF_COMMAND = 0.7  #: battery compensation around hover at 3.5 V: 65535 / 3.5 (0.088 - 2 6.239e-4 38 g) 60 / 65536

#: course and channels (n, 12) of flights over one platform
Passes = Sequence[tuple[Course, np.ndarray]]


def mixed_fractions(passes: Passes, kind: str) -> np.ndarray:
    """(edges,) where the reading in passing lies, 0 at the old distance and 1 at the new; NaN where none stands out."""
    out = np.full(len(passes), np.nan)
    for i, (course, x) in enumerate(passes):
        edge = getattr(course, kind)
        down = x[edge + PASSING.start:edge + PASSING.stop, ch.DOWN]
        old, new = np.median(down[:4]), np.median(down[-8:])
        fraction = (down - old) / (new - old)
        between = fraction[(np.abs(fraction) > CLEAR) & (np.abs(fraction - 1.0) > CLEAR)]
        if len(between):
            out[i] = between[np.argmin(np.abs(between - 0.5))]
    return out


def steps_before_exits(passes: Passes) -> np.ndarray:
    """(flights, 2) reading, and height over the floor less reading, cm: medians over the last 0.3 s before the exit."""
    out = []
    for course, x in passes:
        edges = near_range.around(course, x)
        if len(edges) == 2:
            height, down = edges[1].height[-LAST:], edges[1].reading[-LAST:]
            out.append((100.0 * np.median(down), 100.0 * np.median(height - down)))
    return np.array(out)


def height_loop(down: np.ndarray, az: np.ndarray, set_height: float) -> tuple[np.ndarray, np.ndarray]:
    """(n,) command of the height loops, and (n,) what the range module passed on, m.

    The estimator's two height states (z, its velocity), predicted with az (m/s², without gravity), corrected by each
    new reading; position and velocity loop. down: m at 100 Hz. set_height: m.
    """
    firmware = settings.load(FIRMWARE).view(np.recarray)[0]
    noise, std = 1e-3 * firmware.kalman.noise_acc_z_mps2, firmware.range.std_m
    outer, inner = (firmware.loops[k] for k in (settings.POSITION_Z, settings.VELOCITY_Z))
    module = np.zeros(1, range_module.STATE).view(np.recarray)[0]
    module.held = module.reference = last = down[0]
    z, p, dt = np.array([down[0], 0.0]), np.diag([1e-4, 1e-3]), 1.0 / SAMPLE_RATE_HZ
    turn = np.array([[1.0, dt], [0.0, 1.0]])
    outer_sum = inner_sum = 0.0
    command, passed = np.empty(len(down)), np.empty(len(down))
    since = 0
    for i in range(len(down)):
        z = turn @ z + az[i] * np.array([0.5 * dt * dt, dt])
        p = turn @ p @ turn.T
        p[1, 1] += 10 * noise**2
        since += 1
        if down[i] != last or since == READING_ROWS:
            since, last = 0, down[i]
            reading = range_module.platform.py_func(firmware, module, down[i])
            gain = p[:, 0] / (p[0, 0] + std**2)
            z, p = z + gain * (reading - z[0]), p - np.outer(gain, p[0])
        error = set_height - z[0]
        outer_sum += error * dt
        climb = np.clip(outer["p"] * error + outer["i"] * outer_sum, -outer["output_limit"], outer["output_limit"])
        inner_sum += (climb - z[1]) * dt
        command[i] = firmware.controller.thrust_scale * (inner["p"] * (climb - z[1]) + inner["i"] * inner_sum)
        passed[i] = module.held
    return command, passed


def high_edges(passes: Passes, kind: str) -> dict[str, np.ndarray]:
    """Medians (13,) over high flights, bins of 0.1 s from 0.3 s before the edge on, less their first: cm and PWM."""
    out: dict[str, list[np.ndarray]] = {"passed on, cm": [], "motor mean, PWM": [], "replayed, PWM": []}
    for course, x in passes:
        if not HIGH_M <= course.clearance_m < 0.2:
            continue
        edge, first = getattr(course, kind), max(course.entry - 150, course.level)
        part = x[first:edge + 100]
        command, passed = height_loop(0.01 * part[:, ch.DOWN], part[:, ch.AZ] - np.median(x[course.free, ch.AZ]),
                                      0.01 * np.median(x[course.free, ch.DOWN]))
        for values, name in zip((100.0 * passed, part[:, ch.MEAN], PWM_OF_COMMAND * command), out, strict=True):
            bins = values[-BINS * ROWS:].reshape(BINS, ROWS).mean(axis=1)
            out[name].append(bins - bins[0])
    return {name: np.median(rows, axis=0) for name, rows in out.items() if rows}


def simulated_passes(scene: scenario.Scenario, craft: vehicle.Vehicle,
                     courses: Sequence[Course]) -> Iterable[tuple[Course, np.ndarray]]:
    """Flights of a twin, its scenario and vehicle, that cross one platform; as many as courses at most."""
    for number in range(len(courses)):
        log = fly(scene, craft, 0, number)
        if isinstance(log, Diverged):
            continue
        try:
            yield twin_fly.simulated_course(log, courses[0]), ch.channels(log)
        except AirTouchError:
            continue


def print_tables(name: str, passes: Passes) -> None:
    """Print the three tables of some flights."""
    print(f"\n## {name}: {len(passes)} flights")
    for kind in ("entry", "exit"):
        fractions = mixed_fractions(passes, kind)
        counts = np.histogram(fractions[np.isfinite(fractions)], FRACTIONS)[0]
        cells = ", ".join(f"{a:g} to {b:g}: {n}" for a, b, n in zip(FRACTIONS, FRACTIONS[1:], counts, strict=False))
        print(f"{kind}: reading in passing, fraction of the step: none {np.isnan(fractions).sum()}; {cells}")
    steps = steps_before_exits(passes)
    for low, high in zip(READINGS_CM, READINGS_CM[1:], strict=False):
        group = steps[(steps[:, 0] >= low) & (steps[:, 0] < high)]
        if len(group):
            error = group[:, 1].std() / max(len(group) - 1, 1)**0.5
            print(f"before exits, reading {np.median(group[:, 0]):.1f} cm: height less reading "
                  f"{np.median(group[:, 1]):.2f} cm, standard error {error:.2f}, n {len(group)}")
    for kind in ("entry", "exit"):
        for what, bins in high_edges(passes, kind).items():
            digits = 1 if "cm" in what else 0
            print(f"high {kind:5} {what:16}" + " ".join(f"{v:7.{digits}f}" for v in bins))


def main() -> None:
    """Recorded flights, then the twin's."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="of recorded flights, with a manifest.csv")
    parser.add_argument("--fold", type=whole_number(0), action="append", default=[],
                        help="only flights of this fold; may be repeated")
    parser.add_argument("--twin", type=Path, help="folder of `airtouch twin`")
    options = parser.parse_args()
    twin = options.twin and (scenario.load(options.twin / files.SCENARIO),
                             vehicle.load(str(options.twin / files.VEHICLE)))
    recorded = flights.read([options.folder], folds=options.fold)
    print_tables("recorded", list(zip(recorded.courses, recorded.channels, strict=True)))
    if twin:
        print_tables("twin", list(simulated_passes(*twin, recorded.courses)))


if __name__ == "__main__":
    with in_one_line("edge_readings"):
        main()
