"""Flights whose gap is known: what the model says plus what a test injects."""

from dataclasses import replace

import numpy as np

from airtouch import vehicle as vehicles
from airtouch.gap.flights.flight import GROUND, PERIOD_S, Flight, ready
from airtouch.gap.nominal import calibrate
from airtouch.gap.nominal.apparent import is_recorded
from airtouch.gap.signals.channels import residual
from airtouch.gap.signals.floor import Floor
from airtouch.gap.signatures.scatter import ApparentStrengths, table
from airtouch.gap.signatures.scatter_estimates import scatter_of
from airtouch.gap.study import Study
from airtouch.logs.flight_log import FlightLog
from airtouch.logs.segments import KINDS
from airtouch.simulation import batch, replay, scenario

VEHICLE = vehicles.load("crazyflie-2.1-flow")
#: effects of the loop, which take half of a diagnosis' time: left out where they are no rivals
LOOP = ("actuator_delay", "controller_gain", "inertia", "motor_lag", "sensor_latency")
HOVER, TAKE_OFF = KINDS.index("hover"), KINDS.index("take-off")


def study(vehicle=VEHICLE):
    """A study without calibration, controller or floor."""
    return Study(vehicle, (), None, Floor({}, {}, np.zeros(13), 0.0, 0.0))


def flight(seconds, force=0.0, gyro=0.0, phase=HOVER, name="synthetic", lost=None, resting_s=0.0):
    """A hover whose gap is `force` (n, 3) m/s^2; gyro: (n, 3) rad/s on top of none; resting_s: on the ground before."""
    n = round(seconds / PERIOD_S)
    resting = np.arange(n) * PERIOD_S < resting_s
    pwm = np.where(resting[:, None], 0.0, np.full((n, 4), 40000.0))
    log = FlightLog({"t_s": np.arange(n) * PERIOD_S, **{f"m{i}_pwm": pwm[:, i - 1] for i in range(1, 5)}},
                    {"source": name})
    hover = Flight(
        name, log, replay.signals_of(log, VEHICLE), np.zeros((n, 3)), np.zeros((n, 3)) + gyro, pwm,
        np.tile(np.eye(3), (n, 1, 1)), np.where(resting, GROUND, phase).astype(np.int8), np.ones(n, bool),
        np.zeros(n), np.zeros(n, bool) if lost is None else lost, np.zeros(n, bool), np.zeros(n, bool))
    return replace(hover, acceleration=force - residual(hover, VEHICLE)[:, :3])


def without_fits(monkeypatch):
    """Flights in which no effect seems to act: none has to be fitted to them, which takes most of a calibration."""
    still = {k: 0.0 * v for k, v in table()["simulated"].rms.items()}

    def scatter(study, flights, without=()):
        return scatter_of([ApparentStrengths(still, still, 0.0)] * len(flights), any(is_recorded(f) for f in flights))

    monkeypatch.setattr(calibrate, "baseline_scatter", scatter)


def fly(count, seed, chosen=()):
    """Flights of the diagnosis' scenario, ready for it, with the chosen effects alone."""
    left_out = [e for e in scenario.load("diagnosis").table.get("effects", {}) if e not in dict(chosen)]
    logs = batch.flights("diagnosis", count, vehicle=VEHICLE, effects=chosen, without=left_out, seed=seed, workers=1)
    return [ready(log, VEHICLE) for log in logs]


def noise(seconds, rms, seed):
    """White noise (n, 3)."""
    return np.random.default_rng(seed).normal(0.0, rms, (round(seconds / PERIOD_S), 3))
