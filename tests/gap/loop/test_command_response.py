"""What the vehicle does with a command's torque: closed forms of the loop, and simulated flights with late sensors."""

import numpy as np

from airtouch import vehicle as vehicles
from airtouch.gap.flights.flight import ready_flights
from airtouch.gap.loop import controller, loop_model
from airtouch.gap.loop.axis_plant import axis_plant
from airtouch.gap.loop.command_response import acceleration_per_command
from airtouch.gap.loop.set_point_steps import NO_STEP
from airtouch.gap.signals.channels import TORQUE, angular_acceleration, residual
from airtouch.gap.signals.spectra import AIR, frequencies, short_time_spectra, starts
from airtouch.logs.flight_log import FlightLog
from airtouch.simulation import batch
from airtouch.simulation.effects import Active, get
from airtouch.simulation.flight import prepare


def test_turning_under_an_outside_torque_is_the_closed_loop_s():
    """No gyro noise, no steps, no folds: u = -(K / s) d / (1 + P K), the vehicle turns by d / (1 + P K)."""
    row = prepare(vehicles.load("crazyflie-2.1-flow"), ())[0][0]
    c = controller.Controller(0.01, 6.0, 0.4)
    f = np.geomspace(0.8, 20.0, 12)
    s = 2j * np.pi * f
    roll = axis_plant(row, "roll")
    strengths = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    (expected,) = acceleration_per_command(c, roll, strengths, f, 0.0, [NO_STEP]).expected
    np.testing.assert_allclose(expected, -s / loop_model.loop_parts(c, roll, f).controller, rtol=1e-9)


def empirical(active: list[Active]) -> np.ndarray:
    """Angular acceleration for the torque of logged commands in simulated flights, S_yw / S_ww of roll, (bins,)."""
    vehicle, cross, power = vehicles.load("crazyflie-2.1-flow"), 0.0, 0.0
    outcomes = batch.flights("diagnosis", range(8), vehicle=vehicle, effects=active, workers=1)
    logs = [log for log in outcomes if isinstance(log, FlightLog)]
    for flight in ready_flights(logs, vehicle, []):
        first = starts(flight, AIR)
        turns = short_time_spectra(angular_acceleration(flight), first, AIR)[:, :, 0]
        modelled = turns - short_time_spectra(np.nan_to_num(residual(flight, vehicle)), first, AIR)[:, :, TORQUE.start]
        cross, power = cross + (turns * modelled.conj()).sum(axis=0), power + (np.abs(modelled) ** 2).sum(axis=0)
    return np.asarray(cross / power)


def test_a_late_gyro_changes_the_response_as_in_simulated_flights():
    """Noise of the gyro folds into log and command alike, through the gyro chip's own low-pass."""
    vehicle, f = vehicles.load("crazyflie-2.1-flow"), frequencies(AIR)
    late = Active(get("sensor_latency"), {"delay": 0.003})
    simulated = empirical([late]) / empirical([])
    noise_alone = np.eye(5)[0]
    predicted = []
    for active in ((), (late,)):
        row = prepare(vehicle, active)[0][0]
        predicted += acceleration_per_command(
            controller.firmware(row, "roll"), axis_plant(row, "roll"), noise_alone, f, 0.0, [NO_STEP]).expected
    band = (f > 15.0) & (f < 40.0)  # where it is noise of the gyro
    ratio = (simulated / (predicted[1] / predicted[0]))[band].reshape(-1, 8).mean(axis=1)
    np.testing.assert_allclose(np.angle(ratio), 0.0, atol=0.3)
    np.testing.assert_allclose(np.abs(ratio), 1.0, atol=0.25)
