"""Prints the lift near the floor in neural-swarm's flights, by a regression that knows the measured curve.

    python tools/diagnosis/gap_lift.py [FLIGHTS]    # 7 s

Prints, for each day and vehicle, in how many of neural-swarm's flights the regression is within a quarter of the
measured lift; the figures are in host/docs/gap-real.md. The regression takes the vertical force that the commanded
thrust does not explain (thrust after a motor's lag of 60 ms, at the voltage logged) as a constant and a multiple of the
measured curve. 1 is the measured lift.
"""

import argparse
import csv

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.signal import lfilter

from airtouch import vehicle as vehicles
from airtouch.cli.shared.flights import check_data_set
from airtouch.cli.shared.progress import with_bar
from airtouch.errors import in_one_line
from airtouch.gap.flights.flight import GROUND, PERIOD_S, Flight, ready
from airtouch.logs import read
from recordings.folder import add_folder
from recordings.swarm_lift import CLOSE, CURVE, CURVE_M

#: z_m of each vehicle on the floor, m (the data's SOURCE.md)
STANDING_Z_M = {"cf50": 0.0495, "cf51": 0.0525, "cf52": 0.0555, "cf101": 0.055, "cf102": 0.060}
LAG_S = 0.06  #: s, first-order lag of the motors, as `reference.motion_channels`
SMOOTH = 20  #: samples, standard deviation of the voltage's smoothing; no source: round number
LOWEST_M = -0.005  #: m above standing, below which z_m is taken for wrong; no source: round number


def regressed_lift(flight: Flight, vehicle: vehicles.Vehicle, standing_m: float, curve: np.ndarray) -> float:
    """Lift of one flight over the measured curve (CURVE_M,), by least squares on all usable samples in the air."""
    voltage = gaussian_filter1d(np.nan_to_num(flight.log["vbat_V"], nan=float(np.nanmedian(flight.log["vbat_V"]))),
                                SMOOTH, mode="nearest")
    thrust = vehicle.thrust(flight.pwm).sum(axis=1) * (voltage / vehicle.nominal_voltage_v) ** vehicle.voltage_exponent
    pole = 1.0 - PERIOD_S / LAG_S
    lagged = lfilter([1.0 - pole], [1.0, -pole], thrust, zi=[pole * thrust[0]])[0]
    weight = vehicle.mass_kg * vehicle.gravity_mps2
    excess = flight.acceleration[:, 2] * vehicle.mass_kg / weight - lagged / weight
    height = flight.log["z_m"] - standing_m
    usable = flight.usable & np.isfinite(height) & (flight.phase != GROUND) & (height > LOWEST_M)
    table = np.column_stack([np.ones(usable.sum()), np.interp(height[usable], CURVE_M, curve)])
    return float(np.linalg.lstsq(table, excess[usable], rcond=None)[0][1])


def main() -> None:
    """Print the ratio of fitted to measured lift near the floor in recorded flights, by day and vehicle."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_folder(parser, name="flights")
    folder = parser.parse_args().flights / "neuralswarm"
    check_data_set(folder)
    ratios: dict[str, list[float]] = {}
    rows = [r for r in csv.DictReader((folder / "manifest.csv").open()) if r["truth"] == "ground_effect"]
    for row in with_bar(rows, "flights"):
        vehicle = vehicles.load(folder / f"{row['vehicle']}.toml")
        flight = ready(read(folder / "flights" / row["file"]), vehicle)
        ratios.setdefault(f"day {row['day']}, {row['vehicle']}", []).append(
            regressed_lift(flight, vehicle, STANDING_Z_M[row["cf"]], CURVE[row["vehicle"]]))
    for name, each in sorted(ratios.items()):
        print(f"{name}: within {CLOSE:.0%} in {sum(abs(x - 1.0) < CLOSE for x in each)} of {len(each)}, "
              f"median {np.median(each):.2f}, standard deviation {np.std(each, ddof=1):.2f}")


if __name__ == "__main__":
    with in_one_line("gap_lift"):
        main()
