"""What the paper's detector sees of a flight: fused features, disturbance force and FR-CFAR."""

from dataclasses import dataclass

import numpy as np

from airtouch import kernels
from airtouch import vehicle as vehicles
from airtouch.detector.channels import level_acceleration, nine_channels, thrust_axis
from airtouch.logs.flight_log import PWM, FlightLog
from airtouch.parameters import DEFAULT, Parameters
from airtouch.vehicle import Vehicle


@dataclass(frozen=True)
class Features:
    """Causal: row i uses samples up to i only. n samples of one flight.

    channels   (n, 9) m/s^2, rad/s, PWM (`channels.nine_channels`)
    band_power (n, 9) mean square within the band, unit of the channel squared; NaN at first
    fused      (n, 3) cascaded cross-spectrum of accelerations, rates, motors; NaN at first
    force      (n, 3) disturbance force f_w, newtons, level axes
    cfar_power (n,) square of the change of f_w,z, newtons^2 (`force_change_power`)
    threshold  (n,) FR-CFAR threshold T for `cfar_power`; NaN at first
    alert      (n,) bool, cfar_power >= T
    """

    channels: np.ndarray
    band_power: np.ndarray
    fused: np.ndarray
    force: np.ndarray
    cfar_power: np.ndarray
    threshold: np.ndarray
    alert: np.ndarray


def flight_features(log: FlightLog, vehicle: Vehicle | None = None,
                    parameters: Parameters = DEFAULT) -> Features:
    """Every signal of the paper's sections 4 and 5.1 for one flight, through the C kernels.

    vehicle: mass and thrust curve for the disturbance force, the flow-deck Crazyflie by default.
    Raises AirTouchError that names the columns which the log lacks.
    """
    channels = nine_channels(log)
    power = kernels.band_power(channels, sample_rate_hz=parameters.sample_rate_hz,
                               window=parameters.band_window, hop=parameters.band_hop,
                               band_hz=(parameters.band_low_hz, parameters.band_high_hz))
    fused = kernels.cascaded_cross_spectrum(power)
    force = kernels.disturbance_force(
        level_acceleration(log), log.stack(PWM), vehicle or vehicles.load(),
        vbat_v=log["vbat_V"] if log.has("vbat_V") else None, thrust_axis=thrust_axis(log))
    cfar_power = force_change_power(force[:, 2], parameters)
    threshold, alert = kernels.fr_cfar(cfar_power, guard_cells=parameters.guard_cells,
                                       leading_window=parameters.leading_window, p_fa=parameters.p_fa)
    return Features(channels, power, fused, force, cfar_power, threshold, alert)


def force_change_power(force_z: np.ndarray, parameters: Parameters = DEFAULT) -> np.ndarray:
    """(n,) squared change of the vertical disturbance force, newtons^2.

    The thrust curve is never exact, so f_w has an offset of several per cent of the
    weight, against which no edge would stand out. The change is taken against the
    mean over the leading window, which ends where the guard cells begin; 0 before
    that window is full.
    """
    force_z = np.nan_to_num(np.asarray(force_z, dtype=np.float64))
    first = parameters.guard_cells + parameters.leading_window
    power = np.zeros(len(force_z))
    if len(force_z) > first:
        total = np.concatenate([[0.0], np.cumsum(force_z)])
        leading = (total[parameters.leading_window:] - total[:-parameters.leading_window])
        mean = leading[:len(force_z) - first] / parameters.leading_window
        power[first:] = (force_z[first:] - mean) ** 2
    return power.astype(np.float32)
