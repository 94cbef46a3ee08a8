"""The study of a vehicle: its control loop, its floor and how the gyro follows commands, from flights declared nominal.

`calibrate` fits the vehicle; here its parameters are given.
"""

from collections.abc import Sequence

import numpy as np

from airtouch.gap.flights.flight import Flight
from airtouch.gap.loop import closed_loop, identify
from airtouch.gap.loop.disturbed import disturbed
from airtouch.gap.signals.channels import COMMAND, COUNT, RATE, TORQUE, angular_acceleration, residual
from airtouch.gap.signals.lost_rows import bridging_power
from airtouch.gap.signals.response import Response, TorqueSpectra, response_of
from airtouch.gap.signals.spectra import AIR, REST, Floor, blocks, floor_of, frequencies, sensor_power, starts
from airtouch.gap.signals.study import Study
from airtouch.simulation.effects import Active
from airtouch.simulation.flight import prepare
from airtouch.vehicle import Vehicle

#: floor without baseline flights, unit^2/Hz, of a channel that then says nothing: above any gap. A command's and a
#: rate's nominal power is known from nominal flights alone; chosen
NO_COMMAND, NO_RATE = 1e12, 1e6
#: power of the floor without baseline flights over that of the declared sensor noise; chosen
SENSOR_MARGIN = 2.0
#: blocks of each regime that the floor without baseline flights is as sure as; chosen
DECLARED_BLOCKS = 8


def declared_study(vehicle: Vehicle, flights: Sequence[Flight]) -> Study:
    """The study with the vehicle as its file declares it. flights: declared nominal; none: `study_without_flights`."""
    return study_of(vehicle, (), flights)


def study_of(vehicle: Vehicle, calibration: tuple[Active, ...], flights: Sequence[Flight]) -> Study:
    """The study of a vehicle with calibrated parameters. flights: declared nominal; none: `study_without_flights`."""
    if not flights:
        return study_without_flights(vehicle, calibration)
    loop = identify.identify(flights, vehicle, calibration)
    residuals = [np.nan_to_num(residual(f, vehicle, calibration)) for f in flights]
    first = [{r: starts(f, r) for r in (AIR, REST)} for f in flights]
    spectra = [{r: blocks(x, begin[r], r) for r in begin} for x, begin in zip(residuals, first, strict=True)]
    response, quiet = _response(vehicle, calibration, loop, flights, first, spectra)
    bridging = [bridging_power(f, vehicle, calibration, begin[AIR], q, response)
                for f, begin, q in zip(flights, first, quiet, strict=True)]
    floor = floor_of(flights, residuals, first, spectra, sensor_noise(vehicle), bridging)
    if loop is not None and response is not None and response.stepped_law is not None:
        over = response.stepped_law.power / np.maximum(response.quiet_law.power, 1e-30)
        loop = loop.with_steps(response.stepped_law.coherent, over, frequencies(AIR))
    return Study(vehicle, calibration, loop, floor, response, nominal=len(flights))


def study_without_flights(vehicle: Vehicle, calibration: tuple[Active, ...] = ()) -> Study:
    """The study of a vehicle of which no flight is declared nominal: its floor is the declared noise of its sensors."""
    power = {r: SENSOR_MARGIN * sensor_power(sensor_noise(vehicle), r) for r in (AIR, REST)}
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


def _response(vehicle: Vehicle, calibration: tuple[Active, ...], loop: closed_loop.ClosedLoop | None,
              flights: Sequence[Flight], first: Sequence[dict[str, np.ndarray]],
              spectra: Sequence[dict[str, np.ndarray]]) -> tuple[Response | None, Sequence[np.ndarray | None]]:
    """How the gyro follows the commands, and by flight the blocks (blocks, 3) in which no set-point stepped.

    first, spectra: of each flight's blocks by regime the first samples and the spectra of the residual, whose torque in
    the air is put in place as the response explains it. Without gyro or loop model None, and None for every flight.
    """
    nothing = [None] * len(flights)
    if loop is None or any(f.rates is None for f in flights):
        return None, nothing
    outside = disturbed(loop.controllers, prepare(vehicle, calibration)[0][0], frequencies(AIR))
    measured = [blocks(angular_acceleration(f), begin[AIR], AIR) for f, begin in zip(flights, first, strict=True)]
    response = response_of(measured, [s[AIR][:, :, TORQUE] for s in spectra], outside)
    if response is None:
        return None, nothing
    quiet = [response.quiet(m - s[AIR][:, :, TORQUE]) for m, s in zip(measured, spectra, strict=True)]
    for q, m, s in zip(quiet, measured, spectra, strict=True):
        s[AIR] = response.with_residual(s[AIR], q, TorqueSpectra(m, s[AIR][:, :, TORQUE]))
    return response, quiet
