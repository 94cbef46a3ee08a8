"""Prints torques of the authors' flight past a fan and its blocks far above the floor, beside its day's calm flights.

    python tools/diagnosis/gap_fan.py [FLIGHTS/airtouch]    # 20 s

For each flight: mean roll and yaw torque of the commands, and how many blocks of 2.56 s have
more than 5 times the floor's power of roll or yaw torque between 0.6 and 12 Hz. Its figures are in
host/docs/gap-findings.md.
"""

import argparse
import os
import sys
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
import numpy as np

from airtouch import vehicle as vehicles
from airtouch.cli.shared.flights import check_data_set
from airtouch.errors import in_one_line
from airtouch.gap.evidence.data import Data
from airtouch.gap.flights.flight import GROUND, PERIOD_S, Flight, ready_flights
from airtouch.gap.nominal import calibrate
from airtouch.gap.signals.spectra import AIR, frequencies
from airtouch.gap.study import Study
from airtouch.logs import read
from airtouch.simulation.body import rigid_body
from recordings.authors import questions
from recordings.folder import add_folder

BAND_HZ = (0.6, 12.0)  #: Hz, band whose power is compared; no source: round numbers
FAR = 5.0  #: power over the floor's from which a block is far above it; no source: round number
ROLL, YAW = 0, 2  #: of the three torques


def angular_accelerations(thrust: np.ndarray, vehicle: vehicles.Vehicle) -> tuple[float, float]:
    """Roll and yaw angular acceleration, rad/s², of the four rotors' thrust (4,), N."""
    arm = vehicle.arm_m / np.sqrt(2.0)
    roll = arm * (thrust[2] + thrust[3] - thrust[0] - thrust[1]) / vehicle.inertia_kg_m2[0]
    yaw = -vehicle.yaw_torque_over_thrust_m * (thrust @ np.array(rigid_body.SPIN))
    return float(roll), float(yaw / vehicle.inertia_kg_m2[2])


def row(flight: Flight, study: Study, vehicle: vehicles.Vehicle) -> str:
    """A flight's line of the table: its mean torques, and its blocks far above the floor."""
    f = frequencies(AIR)
    inside = (f >= BAND_HZ[0]) & (f < BAND_HZ[1])
    data = Data(study, [flight])
    power = np.abs(data.residual[0][AIR][:, inside, 3:6]) ** 2 / study.floor.power[AIR][inside, 3:6]
    ratio = np.nanmean(power, axis=1)
    far = (ratio[:, [ROLL, YAW]] > FAR).any(axis=1)
    when = ", ".join(f"{s:.0f}" for s in data.block_starts[0][AIR][far] * PERIOD_S)
    roll, yaw = angular_accelerations(vehicle.thrust(flight.pwm[flight.phase != GROUND]).mean(axis=0), vehicle)
    return (f"| {Path(flight.name).name} | {roll:.1f}, {yaw:.1f} | {far.sum()} of {len(far)} | {when} | "
            f"{ratio[:, ROLL].max():.0f}, {ratio[:, YAW].max():.0f} |")


def main() -> None:
    """Print a line for each flight, the calm ones first calibrated on."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_folder(parser, "airtouch")
    folder = parser.parse_args().folder
    check_data_set(folder)
    vehicle = vehicles.load(vehicles.DEFAULT_VEHICLE)
    fan, calm = (list(ready_flights([read(Path(p)) for p in group], vehicle, []))
                 for group in questions(folder)["wind"])
    print(f"calibrating on {len(calm)} calm flights", file=sys.stderr, flush=True)
    study, _ = calibrate.calibrated(vehicle, calm, scatter=False)
    print("| flight | roll, yaw torque of the commands, rad/s^2 | far blocks | from, s | highest power over floor |")
    print("|---|---|---|---|---|")
    for flight in sorted((*calm, *fan), key=lambda one: Path(one.name).name):
        print(row(flight, study, vehicle), flush=True)


if __name__ == "__main__":
    with in_one_line("gap_fan"):
        main()
