"""The features of the paper's detector: nine channels to fused features, disturbance force and FR-CFAR."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from airtouch import kernels, reference
from airtouch import vehicle as vehicles
from airtouch.detector.paper.normalisation import FixedScale
from airtouch.detector.shared.channels import level_acceleration, nine_channels, thrust_axis
from airtouch.logs.flight_log import GYRO, PWM, FlightLog
from airtouch.parameters import DEFAULT, Parameters
from airtouch.reference.edge_pipeline import EdgeEvents, EdgePipelineConfig
from airtouch.vehicle import Vehicle


@dataclass(frozen=True)
class Features:
    """Causal: row i uses samples up to i only. n samples of one flight.

    channels   (n, 9) m/s^2, rad/s, PWM (`channels.nine_channels`)
    band_power (n, 9) mean square within the band, unit of the channel squared; NaN at first
    fused      (n, 3) cascaded cross-spectrum of accelerations, rates, motors; NaN at first
    force      (n, 3) disturbance force f_w, newtons, level axes
    cfar_power (n,) squared deviation of f_w,z from its mean so far, newtons^2
    threshold  (n,) FR-CFAR threshold T for `cfar_power`; NaN at first
    alert      (n,) bool, cfar_power above T
    armed      (n,) bool, in the air for long enough that an edge would be reported
    """

    channels: np.ndarray
    band_power: np.ndarray
    fused: np.ndarray
    force: np.ndarray
    cfar_power: np.ndarray
    threshold: np.ndarray
    alert: np.ndarray
    armed: np.ndarray


def pipeline(log: FlightLog, parameters: Parameters = DEFAULT, probability: np.ndarray | None = None, *,
             vehicle: Vehicle | None = None, physical_filter: bool = True) -> EdgeEvents:
    """Features, force, alerts and edges of one flight of n samples, by the C pipeline.

    probability: (n,) P(over a platform) by the network; None before it ran, and then without edges.
    vehicle: mass and thrust curve for the disturbance force, and the PWM above which it is in the air, which is not
    taken from `parameters`; for None the one that the log names (`vehicle.of_log`).
    physical_filter: drop edges without an FR-CFAR alert.
    Raises AirTouchError that names the columns which the log lacks.
    """
    vehicle = vehicle or vehicles.of_log(log.meta)[0]
    parameters = replace(parameters, arm_pwm=vehicle.arm_pwm)
    return kernels.edge_pipeline(
        level_acceleration(log), log.stack(GYRO), log.stack(PWM), vehicle,
        vbat_v=log["vbat_V"] if log.has("vbat_V") else None, thrust_axis=thrust_axis(log),
        probability=probability, config=EdgePipelineConfig(parameters, physical_filter=physical_filter))


def flight_features(log: FlightLog, vehicle: Vehicle | None = None,
                    parameters: Parameters = DEFAULT) -> Features:
    """The features of one flight (the paper's sections 4 and 5.1). Arguments and errors as those of `pipeline`."""
    events = pipeline(log, parameters, vehicle=vehicle)
    return Features(nine_channels(log), events.band_power, events.features, events.force,
                    events.cfar_power, events.threshold, events.alert, events.armed)


def feature_windows(fused: np.ndarray, rows: int,
                    scale: FixedScale | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Normalised windows (k, rows, c) float32 of fused features (n, c), and the sample at which each ends, (k,).

    z-scored by themselves, or on the fixed scale given. Windows that hold a value that is not finite are left out.
    """
    if len(fused) < rows:
        return np.zeros((0, rows, fused.shape[1]), np.float32), np.zeros(0, int)
    raw = np.moveaxis(sliding_window_view(scale.apply(fused) if scale else fused, rows, axis=0), 2, 1)
    usable = np.isfinite(raw).all(axis=(1, 2))
    ends = np.arange(rows - 1, len(fused))[usable]
    if scale:
        return np.ascontiguousarray(raw[usable]), ends
    return reference.z_score_window(raw[usable]).astype(np.float32), ends
