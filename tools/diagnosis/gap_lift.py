"""Prints the lift near the ground in recorded flights, by regressions, and the strengths that channels show.

    python tools/diagnosis/gap_lift.py [FLIGHTS]    # neural-swarm's, 7 s
    python tools/diagnosis/gap_lift.py [FLIGHTS] --by-channel    # of days 19 and 20 alone, 30 s
    python tools/diagnosis/gap_lift.py [FLIGHTS] --passes    # the authors' over their platform, folds 0 to 2, 5 s

Prints, for each day and vehicle, in how many of neural-swarm's flights a regression is within a quarter of the measured
lift; the figures are in host/docs/gap-real.md. It takes the vertical force that the commanded thrust does not explain
(thrust after a motor's lag of 60 ms, at the voltage logged) as a constant and a curve: a multiple of the measured one,
or one of free values at FREE_M, which knows nothing of the measured one. 1 is the measured lift.

--by-channel: the strength of `ground_effect` (the preset's is 1) that the diagnosis's spectra show in one channel and
band alone, beside the vehicle that it calibrates.

--passes: the lift of each pass is the mean vertical force over the platform that the commanded thrust does not explain,
less that of free air before it. Beside it the lift that neural-swarm's 34 g vehicle has as high above standing as the
down range reads over what it reads at rest, and how far short the down range would have to read for both to be one.
"""

import argparse
import csv
import sys
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.signal import lfilter

from airtouch import vehicle as vehicles
from airtouch.cli.shared.flights import check_data_set
from airtouch.cli.shared.progress import with_bar
from airtouch.detector.evaluation.crossval import readable_flights
from airtouch.detector.evaluation.data.dataset import collect
from airtouch.detector.evaluation.data.folds import BUILD_DAYS, BUILD_FOLDS
from airtouch.errors import in_one_line
from airtouch.gap.evidence.cells import REPLAY_VIEW, cell_numbers
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.least_squares import weights_of
from airtouch.gap.evidence.problem import problem_of, whole_of
from airtouch.gap.flights.flight import GROUND, PERIOD_S, Flight, ready
from airtouch.gap.nominal.calibrate import calibrated
from airtouch.gap.signals.channels import COLUMN
from airtouch.gap.study import Study
from airtouch.logs import read
from airtouch.logs.flight_log import FlightLog
from airtouch.simulation import effects
from recordings.folder import add_folder
from recordings.passes import first_edges, in_still_air
from recordings.swarm_lift import CLOSE, CURVE, CURVE_M, HEIGHTS_M

#: z_m of each vehicle on the floor, m (the data's SOURCE.md)
STANDING_Z_M = {"cf50": 0.0495, "cf51": 0.0525, "cf52": 0.0555, "cf101": 0.055, "cf102": 0.060}
LAG_S = 0.06  #: s, first-order lag of the motors, as `reference.motion_channels`
SMOOTH = 20  #: samples, standard deviation of the voltage's smoothing; no source: round number
LOWEST_M = -0.005  #: m above standing, below which z_m is taken for wrong; no source: round number
#: m above standing, where the free curve has a value each, straight lines between them; it is 0 at the last. Chosen:
#: closer ones find more noise
FREE_M = (0.0, 0.02, 0.04, 0.06, 0.09, 0.15)
PRESETS = {"ns-34g": "crazyflie-34g", "ns-67g": "frame-67g"}  #: of `ground_effect`, by vehicle
#: channel and number of its band, as `blocks.BANDS_HZ` counts them: those that the effect's strength moves most
PLACES = (("force_z", 0), ("force_z", 1), ("torque_x", 1), ("torque_x", 2), ("torque_y", 1), ("torque_y", 2))


#: samples of free air before the entry, and of the platform between entry and exit that are clear of both; no source:
#: round numbers
BEFORE, CLEAR = slice(-150, -20), slice(20, -10)
ENTERING = slice(5, 15)  #: samples after the entry in which the down range reads too little; no source: round numbers
#: m, limits of the down range over the platform, over that at rest, by which passes are grouped; no source: about equal
#: numbers but in the last, where two flights were higher than the rest
READING_M = (0.0, 0.018, 0.022, 0.04, 0.15)


class Pass(NamedTuple):
    """A pass over a platform.

    resting_m, entering_m, over_m: median down range at rest, 0.05 to 0.15 s after the entry, and over the platform;
    lift: over the platform, as a fraction of the weight.
    """

    resting_m: float
    entering_m: float
    over_m: float
    lift: float

    @property
    def above_standing_m(self) -> float:
        """Down range over the platform, over that at rest."""
        return self.over_m - self.resting_m


class Unexplained(NamedTuple):
    """Height above standing (n,), m, and the vertical force there over the weight that the thrust does not explain."""

    height: np.ndarray
    force: np.ndarray


def unexplained(flight: Flight, vehicle: vehicles.Vehicle, standing_m: float) -> Unexplained:
    """The usable samples in the air."""
    voltage = gaussian_filter1d(np.nan_to_num(flight.log["vbat_V"], nan=float(np.nanmedian(flight.log["vbat_V"]))),
                                SMOOTH, mode="nearest")
    thrust = vehicle.thrust(flight.pwm).sum(axis=1) * (voltage / vehicle.nominal_voltage_v) ** vehicle.voltage_exponent
    lagged = _lagged(thrust)
    weight = vehicle.mass_kg * vehicle.gravity_mps2
    force = flight.acceleration[:, 2] * vehicle.mass_kg / weight - lagged / weight
    height = flight.log["z_m"] - standing_m
    usable = flight.usable & np.isfinite(height) & (flight.phase != GROUND) & (height > LOWEST_M)
    return Unexplained(height[usable], force[usable])


def _lagged(thrust: np.ndarray) -> np.ndarray:
    """A thrust (n,) after the motors' lag."""
    pole = 1.0 - PERIOD_S / LAG_S
    return lfilter([1.0 - pole], [1.0, -pole], thrust, zi=[pole * thrust[0]])[0]


def regressed_lift(flight: Flight, vehicle: vehicles.Vehicle, standing_m: float, curve: np.ndarray) -> float:
    """Lift of one flight over the measured curve (CURVE_M,), by least squares."""
    height, force = unexplained(flight, vehicle, standing_m)
    table = np.column_stack([np.ones(len(height)), np.interp(height, CURVE_M, curve)])
    return float(np.linalg.lstsq(table, force, rcond=None)[0][1])


def free_lift(flight: Flight, vehicle: vehicles.Vehicle, standing_m: float) -> np.ndarray:
    """Lift (2,) over the weight at HEIGHTS_M, by least squares with a free curve."""
    height, force = unexplained(flight, vehicle, standing_m)
    hats = [np.interp(height, FREE_M, one) for one in np.eye(len(FREE_M))[:-1]]
    values = np.linalg.lstsq(np.column_stack([np.ones(len(height)), *hats]), force, rcond=None)[0][1:]
    return np.interp(HEIGHTS_M, FREE_M, [*values, 0.0])


def first_pass(log: FlightLog, vehicle: vehicles.Vehicle) -> Pass | None:
    """The first pass of a flight over a platform; None without one, or where it is too short."""
    entry, leave = first_edges(log)
    if leave - entry < 2 * CLEAR.start or entry < -BEFORE.start:
        return None
    flight = ready(log, vehicle)
    thrust = _lagged(vehicle.thrust(flight.pwm).sum(axis=1))
    before, over = slice(entry + BEFORE.start, entry + BEFORE.stop), slice(entry + CLEAR.start, leave + CLEAR.stop)
    force = flight.acceleration[:, 2] / vehicle.gravity_mps2 - thrust / np.nanmean(thrust[before])
    entering = slice(entry + ENTERING.start, entry + ENTERING.stop)
    down = flight.log["zrange_m"]
    resting_m, entering_m, over_m = (float(np.nanmedian(down[part]))
                                     for part in (flight.phase == GROUND, entering, over))
    return Pass(resting_m, entering_m, over_m, float(np.nanmean(force[over]) - np.nanmean(force[before])))


def _print_passes(folder: Path) -> None:
    """The lift of the authors' low passes, by the down range."""
    vehicle, curve = vehicles.load(vehicles.DEFAULT_VEHICLE), CURVE["ns-34g"]
    falling = curve[:int(np.argmax(np.diff(curve, append=np.inf) >= 0.0)) + 1]  # a lift belongs to one height there
    low, _ = readable_flights([f for f in collect([folder]) if in_still_air(f)
                               and f.condition.fold in BUILD_FOLDS and f.condition.height == "low"])
    whole = [p for p in (first_pass(log, vehicle) for log in low.values()) if p is not None]
    passes = [p for p in whole if np.isfinite(p.above_standing_m)]
    if len(passes) < len(whole):
        print(f"left out: {len(whole) - len(passes)} of {len(whole)} passes, of flights without a down range at rest",
              file=sys.stderr)
    print("| down range over that at rest | passes | lift, % of the weight | neural-swarm's 34 g vehicle there | "
          "it has this lift higher by |")
    print("|---|---|---|---|---|")
    for least, most in pairwise(READING_M):
        group = [p for p in passes if least <= p.above_standing_m < most]
        if not group:
            continue
        lifts = [p.lift for p in group]
        height, lift = np.mean([p.above_standing_m for p in group]), np.mean(lifts)
        error = np.std(lifts, ddof=1) / np.sqrt(len(group)) if len(group) > 1 else np.nan
        same_lift = np.interp(-lift, -falling, CURVE_M[:len(falling)])
        print(f"| {100 * least:.1f} to {100 * most:.1f} cm, {100 * height:.1f} in the mean | {len(group)} | "
              f"{100 * lift:.1f} +- {100 * error:.1f} | {100 * np.interp(height, CURVE_M, curve):.1f} | "
              f"{100 * (same_lift - height):.1f} cm |")
    resting, entering = (100.0 * np.median([getattr(p, name) for p in passes]) for name in ("resting_m", "entering_m"))
    print(f"\ndown range, medians of {len(passes)} passes: {resting:.1f} cm at rest, {entering:.1f} cm at 0.1 s after "
          "the entry")


def strengths(study: Study, flight: Flight, preset: str) -> np.ndarray:
    """The strength over the preset's that each of PLACES shows alone, by weighted least squares; NaN without values.

    What a flight's own offset of the channel explains is left to it.
    """
    data = Data(study, [flight])
    problem = problem_of(data, whole_of(data))
    residual = problem.residual(())
    steady = {**effects.get("ground_effect").presets[preset], "turbulence": 0.0}
    column = residual - problem.residual(effects.activate({"ground_effect": steady}))
    weights = weights_of(problem, residual, 0.0)
    out = []
    for channel, band in PLACES:
        number = COLUMN[channel]
        here = np.flatnonzero(problem.flat.cells == cell_numbers(REPLAY_VIEW, np.array(band), np.array(number)))
        of_offset = [o.at(here) for o in problem.offsets if problem.elements.channel[o.indices[0]] == number]
        table = np.sqrt(weights[here])[:, None] * np.column_stack([column[here], *of_offset])
        right = np.sqrt(weights[here]) * residual[here]
        solved = np.linalg.lstsq(np.concatenate([table.real, table.imag]), np.concatenate([right.real, right.imag]),
                                 rcond=None)[0]
        out.append(solved[0] if len(here) else np.nan)
    return np.array(out)


def _rows(folder: Path) -> list[dict[str, str]]:
    """The rows of the flights with ground effect."""
    return [r for r in csv.DictReader((folder / "manifest.csv").open()) if r["truth"] == "ground_effect"]


def _by_channel(folder: Path) -> Iterator[tuple[str, np.ndarray]]:
    """Name and `strengths` of each flight of the days on which the diagnosis was built."""
    baselines: dict[str, list[str]] = {}
    for row in csv.DictReader((folder / "baselines.csv").open()):
        baselines.setdefault(row["group"], []).append(row["file"])
    studies: dict[str, Study] = {}
    for row in with_bar([r for r in _rows(folder) if r["day"] in BUILD_DAYS], "flights"):
        vehicle = vehicles.load(folder / f"{row['vehicle']}.toml")
        if row["group"] not in studies:
            nominal = [ready(read(folder / "flights" / file), vehicle) for file in baselines[row["group"]]]
            studies[row["group"]] = calibrated(vehicle, nominal, scatter=False)[0]
        flight = ready(read(folder / "flights" / row["file"]), vehicle)
        yield row["file"], strengths(studies[row["group"]], flight, PRESETS[row["vehicle"]])


def _print_by_channel(folder: Path) -> None:
    """A row a flight and one of medians, a column a channel and band."""
    names, by_flight = zip(*_by_channel(folder), strict=True)
    print("| flight | " + " | ".join(f"{channel}, band {band}" for channel, band in PLACES) + " |")
    print("|---" * (len(PLACES) + 1) + "|")
    median = (f"median of {len(by_flight)}", np.median(by_flight, axis=0))
    for name, row in (*zip(names, by_flight, strict=True), median):
        print(f"| {name} | " + " | ".join(f"{x:.2f}" for x in row) + " |")


def _share(ratios: np.ndarray) -> str:
    """In how many flights all ratios (flights, any) are within CLOSE of 1, and their median."""
    close = int(np.all(np.abs(ratios - 1.0) < CLOSE, axis=1).sum())
    return f"{close} of {len(ratios)}, median {np.median(ratios):.2f}"


def main() -> None:
    """Print the ratio of fitted to measured lift near the floor in recorded flights, by day and vehicle."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_folder(parser, name="flights")
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--by-channel", action="store_true", help="print the strength that each channel shows alone")
    what.add_argument("--passes", action="store_true", help="print the lift of the authors' low passes")
    options = parser.parse_args()
    if options.passes:
        check_data_set(options.flights / "airtouch")
        _print_passes(options.flights / "airtouch")
        return
    folder = options.flights / "neuralswarm"
    check_data_set(folder)
    if options.by_channel:
        _print_by_channel(folder)
        return
    by_curve: dict[str, list[float]] = {}
    by_free: dict[str, list[np.ndarray]] = {}
    for row in with_bar(_rows(folder), "flights"):
        vehicle, curve = vehicles.load(folder / f"{row['vehicle']}.toml"), CURVE[row["vehicle"]]
        flight, standing_m = ready(read(folder / "flights" / row["file"]), vehicle), STANDING_Z_M[row["cf"]]
        name = f"day {row['day']}, {row['vehicle']}"
        by_curve.setdefault(name, []).append(regressed_lift(flight, vehicle, standing_m, curve))
        measured = np.interp(HEIGHTS_M, CURVE_M, curve)
        by_free.setdefault(name, []).append(free_lift(flight, vehicle, standing_m) / measured)
    for name in sorted(by_curve):
        of_curve, of_free = np.array(by_curve[name])[:, None], np.array(by_free[name])
        print(f"{name}, within {CLOSE:.0%}: by the measured curve {_share(of_curve)}, standard deviation "
              f"{np.std(of_curve, ddof=1):.2f}; by a free curve, at 2 and 4 cm {_share(of_free)}")


if __name__ == "__main__":
    with in_one_line("gap_lift"):
        main()
