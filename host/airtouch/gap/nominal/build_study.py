"""The study of a vehicle: its control loop, its floor and how the gyro follows commands, from flights declared nominal.

`calibrate` fits the vehicle; here its parameters are given.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from airtouch.gap.flights.flight import Flight
from airtouch.gap.loop import closed_loop, identify
from airtouch.gap.loop.command_spectra import VANISHING_POWER
from airtouch.gap.loop.disturbed import disturbed
from airtouch.gap.loop.noise_echo import nominal_echo
from airtouch.gap.signals.channels import COMMAND, COUNT, RATE, TORQUE, angular_acceleration, residual
from airtouch.gap.signals.floor import UNKNOWN_FLOOR, Floor, NominalBlocks, floor_of, sensor_power
from airtouch.gap.signals.lost_rows import bridging_power
from airtouch.gap.signals.response import Response, TorqueSpectra, response_of
from airtouch.gap.signals.spectra import AIR, REST, frequencies, short_time_spectra, starts
from airtouch.gap.study import Study
from airtouch.simulation.effects import Active
from airtouch.simulation.flight import prepare
from airtouch.vehicle import Vehicle

#: floor without baseline flights, unit^2/Hz, of a channel that then says nothing: above any gap. A command's and a
#: rate's nominal power is known from nominal flights alone; chosen
NO_COMMAND, NO_RATE = 1e12, 1e6
#: blocks of each state that the floor without baseline flights is as sure as; chosen
DECLARED_BLOCKS = 8


def declared_study(vehicle: Vehicle, flights: Sequence[Flight]) -> Study:
    """The study with the vehicle as its file declares it. flights: declared nominal; none: `study_without_flights`."""
    return study_of(vehicle, (), flights)


def study_of(vehicle: Vehicle, calibration: tuple[Active, ...], flights: Sequence[Flight],
             identified: bool = True) -> Study:
    """The study of a vehicle with calibrated parameters.

    flights: declared nominal; none: `study_without_flights`; identified: with the loop and the response that they show,
    which a fit of the vehicle does not need.
    """
    if not flights:
        return study_without_flights(vehicle, calibration)
    loop = identify.identify(flights, vehicle, calibration) if identified else None
    replayed = [_replayed_blocks(f, vehicle, calibration) for f in flights]
    response = _response(vehicle, calibration, loop, replayed)
    nominal = [_under_response(n, vehicle, calibration, response) for n in replayed]
    floor = floor_of(nominal, sensor_noise(vehicle))
    if loop is not None and response is not None and response.stepped_law is not None:
        over = response.stepped_law.power / np.maximum(response.quiet_law.power, VANISHING_POWER)
        loop = loop.with_steps(response.stepped_law.coherent, over, frequencies(AIR))
    return Study(vehicle, calibration, loop, floor, response, nominal_echo(flights, vehicle) if identified else None,
                 nominal_count=len(flights))


def study_without_flights(vehicle: Vehicle, calibration: tuple[Active, ...] = ()) -> Study:
    """The study of a vehicle of which no flight is declared nominal: its floor is the declared noise of its sensors."""
    power = {r: UNKNOWN_FLOOR * sensor_power(sensor_noise(vehicle), r) for r in (AIR, REST)}
    for table in power.values():
        table[:, COMMAND] = NO_COMMAND
        table[:, RATE] = NO_RATE
    return Study(vehicle, calibration, None,
                 Floor(power, {AIR: DECLARED_BLOCKS, REST: DECLARED_BLOCKS}, np.zeros(COUNT), 0.0, 0.0))


def sensor_noise(vehicle: Vehicle) -> np.ndarray:
    """White noise (COUNT,) that the vehicle's sensors are declared to have, rms at 100 Hz: m/s^2, and rad/s twice."""
    acc = vehicle.acc_noise_rms_mps2 * np.array(vehicle.acc_noise_ratio)
    gyro = vehicle.gyro_noise_rms_radps * np.array(vehicle.gyro_noise_ratio)
    return np.concatenate([acc, gyro, gyro, np.zeros(COUNT - COMMAND.start)])


def _replayed_blocks(flight: Flight, vehicle: Vehicle, calibration: tuple[Active, ...]) -> NominalBlocks:
    """A flight's blocks as the replay leaves them, without what lost rows add."""
    first = {r: starts(flight, r) for r in (AIR, REST)}
    gap = np.nan_to_num(residual(flight, vehicle, calibration))
    spectra = {r: short_time_spectra(gap, begin, r) for r, begin in first.items()}
    return NominalBlocks(flight, gap, first, spectra, bridging=np.zeros(spectra[AIR].shape))


def _torque(nominal: NominalBlocks) -> TorqueSpectra:
    """Torque of a flight's blocks in the air, measured and modelled."""
    measured = short_time_spectra(angular_acceleration(nominal.flight), nominal.first[AIR], AIR)
    return TorqueSpectra(measured, measured - nominal.spectra[AIR][:, :, TORQUE])


def _response(vehicle: Vehicle, calibration: tuple[Active, ...], loop: closed_loop.ClosedLoop | None,
              replayed: Sequence[NominalBlocks]) -> Response | None:
    """How the gyro follows the commands; None without gyro or loop model, and for too few blocks."""
    if loop is None or any(n.flight.rates is None for n in replayed):
        return None
    outside = disturbed(loop.controllers, prepare(vehicle, calibration)[0][0], frequencies(AIR))
    gyro_power = sensor_power(sensor_noise(vehicle), AIR)[:, TORQUE]
    return response_of([_torque(n) for n in replayed], outside, gyro_power)


def _under_response(replayed: NominalBlocks, vehicle: Vehicle, calibration: tuple[Active, ...],
                    response: Response | None) -> NominalBlocks:
    """A flight's blocks, their torque in the air as the response explains it, with what lost rows add."""
    spectra, quiet = replayed.spectra, None
    if response is not None:
        torque = _torque(replayed)
        quiet = response.quiet(torque.modelled)
        spectra = {**spectra, AIR: response.with_torque_gap(spectra[AIR], quiet, torque)}
    bridging = bridging_power(replayed.flight, vehicle, calibration, replayed.first[AIR], quiet, response)
    return replace(replayed, spectra=spectra, bridging=bridging)
