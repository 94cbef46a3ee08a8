"""Prints by how much the replay errs on strong effects, where chance is small: `estimates.REPLAY_ERROR`.

    python tools/simulation/replay_error.py    # a minute: eight simulated flights against five nominal ones

Weak motors of 5 to 16 % and masses of 5 to 20 % are switched on in the scenario `diagnosis`, one a flight, and fitted.
host/docs/looks.md has the figures.
"""

import argparse
from collections.abc import Sequence

import numpy as np

from airtouch import vehicle as vehicles
from airtouch.errors import in_one_line
from airtouch.gap.diagnosis import diagnose_with_study
from airtouch.gap.flights.flight import ready_flights
from airtouch.gap.result import Diagnosis
from airtouch.gap.sealed.make import SCENARIO, VEHICLE, calibrated_study, stripped
from airtouch.logs.flight_log import FlightLog
from airtouch.simulation import batch

NOMINAL_SEED, FIRST_SEED = 8801, 8900  #: of the nominal flights, and of the first flight with an effect; chosen
NOMINAL = 5  #: flights
#: effect, its parameters, and which of them is compared
CASES = [*(("weak_motor", {"rotor": r, "thrust_loss": x}, "thrust_loss")
           for r, x in ((1, 0.05), (2, 0.08), (3, 0.12), (4, 0.16), (1, 0.12))),
         *(("mass", {"fraction": x}, "fraction") for x in (0.05, 0.1, 0.2))]


def fitted_value(diagnosis: Diagnosis, name: str, parameter: str) -> float | None:
    """The value that a diagnosis gives a parameter of an effect; None where it does not name the effect."""
    named = next((e for e in diagnosis.effects if e.name == name), None)
    return None if named is None else named.parameters[parameter].value


def summary(errors: Sequence[float], flights: int) -> str:
    """The largest and the rms of relative errors, as text; flights: how many were flown for them."""
    return (f"{len(errors)} of {flights} flights: at most {np.abs(errors).max():.2%} off, "
            f"rms {np.sqrt(np.mean(np.square(errors))):.2%}")


def main() -> None:
    """Print each fitted value with its error, then the largest and the rms of the relative errors."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.parse_args()
    vehicle = vehicles.load(VEHICLE)
    logs = batch.flights(SCENARIO, NOMINAL, seed=NOMINAL_SEED, workers=1)
    study = calibrated_study(vehicle, [stripped(log) for log in logs if isinstance(log, FlightLog)])
    errors = []
    for seed, (name, values, parameter) in enumerate(CASES, FIRST_SEED):
        (log,) = batch.flights(SCENARIO, 1, effects=[(name, values)], seed=seed, workers=1)
        if not isinstance(log, FlightLog):
            print(f"{name} {values}: {log}")
            continue
        diagnosis = diagnose_with_study(study, list(ready_flights([stripped(log)], vehicle, [])))
        fitted = fitted_value(diagnosis, name, parameter)
        if fitted is None:
            print(f"{name} {values}: {diagnosis.verdict}")
            continue
        errors.append(fitted / values[parameter] - 1.0)
        print(f"{name} {parameter} {values[parameter]:g}: {fitted:.5f}, {errors[-1]:+.2%}", flush=True)
    if errors:
        print(summary(errors, len(CASES)))


if __name__ == "__main__":
    with in_one_line("replay_error"):
        main()
