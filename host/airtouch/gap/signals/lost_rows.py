"""Power that straight lines across lost rows add to the spectra of the gap.

A row that never reached the log takes a command with it that the motors have followed, so the replay is off until their
thrust has settled. The same flight says how far: where its rows did arrive, some are taken out in the same pattern, and
its residuals change by so much.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import gaussian_filter1d

from airtouch.gap.flights.flight import GROUND, Flight
from airtouch.gap.flights.missing import interpolate_missing
from airtouch.gap.signals.channels import COUNT, TORQUE, ReplayedFlight, angular_acceleration
from airtouch.gap.signals.response import Response, TorqueSpectra
from airtouch.gap.signals.spectra import AIR, LENGTH, SMOOTH, short_time_spectra, squared
from airtouch.simulation.effects import Active
from airtouch.vehicle import Vehicle

SHIFTS = 12  #: places along the flight to which the pattern of lost rows is shifted; chosen


def bridging_power(flight: Flight, vehicle: Vehicle, calibration: Sequence[Active], first: np.ndarray,
                   quiet: np.ndarray | None = None, response: Response | None = None) -> np.ndarray:
    """Power (blocks, bins, COUNT), unit^2/Hz, that lost rows add to the blocks in the air that begin at `first`.

    It is zero where no row was lost or unmeasured, and for blocks whose pattern has no room elsewhere in the flight.
    quiet (blocks, 3), response: as `Response.with_torque_gap` takes them; without, the torque is that of the logged
    commands.
    """
    total, count = np.zeros((len(first), LENGTH[AIR] // 2 + 1, COUNT)), np.zeros(len(first))  # of the shifts with room
    if not flight.not_logged.any() or not len(first):
        return total
    gap = bridged_residual(ReplayedFlight(flight, vehicle), calibration)
    turning = angular_acceleration(flight)
    for k in range(1, SHIFTS + 1):
        offset = k * len(flight) // (SHIFTS + 1)
        poorer = _without(flight, np.roll(flight.not_logged, offset))
        change = np.nan_to_num(bridged_residual(ReplayedFlight(poorer, vehicle), calibration) - gap)
        begin = (first + offset) % len(flight)
        room = _in_flight(flight, begin)
        spectrum = short_time_spectra(change, begin[room], AIR)
        if response is not None and quiet is not None and flight.rates is not None and room.any():
            turned = short_time_spectra(angular_acceleration(poorer) - turning, begin[room], AIR)
            torque = TorqueSpectra(turned, turned - spectrum[:, :, TORQUE])
            spectrum = response.with_torque_gap(spectrum, quiet[room], torque)
        total[room] += np.nan_to_num(squared(spectrum))
        count[room] += 1
    return gaussian_filter1d(total / np.maximum(count, 1)[:, None, None], SMOOTH, axis=1, mode="nearest")


def _in_flight(flight: Flight, begin: np.ndarray) -> np.ndarray:
    """Whether blocks that begin at samples (blocks,) end before the flight does, of usable or bridged samples, bool."""
    bad = (flight.phase == GROUND) | ~(flight.usable | flight.bridged)
    before = np.cumsum(np.concatenate([[0], bad]))
    room = begin + LENGTH[AIR] <= len(flight)
    room[room] = before[begin[room] + LENGTH[AIR]] == before[begin[room]]
    return room


def bridged_residual(replayed: ReplayedFlight, active: Sequence[Active]) -> np.ndarray:
    """Measured minus modelled (n, COUNT), straight lines where rows were lost or the legs touched the floor."""
    out = replayed.residual(active)
    out[replayed.flight.bridged] = np.nan
    return interpolate_missing(out)


def _without(flight: Flight, rows: np.ndarray) -> Flight:
    """The flight as if some rows, bool (n,), had been lost as well."""
    def bridged(values: np.ndarray) -> np.ndarray:
        """Values (n, c) with straight lines over the rows."""
        return interpolate_missing(np.where(rows[:, None], np.nan, values))

    rates = None if flight.rates is None else bridged(flight.rates)
    return replace(flight, pwm=bridged(flight.pwm), acceleration=bridged(flight.acceleration), rates=rates,
                   lost=flight.lost | rows)
