"""The controller as an input-output law, identified on nominal flights.

Its gains are not declared and other firmwares have other structures, so the twin view
does not presume them: commands (collective, roll, pitch, yaw) are regressed on the
recent gyro samples, angles and velocities of flights declared nominal. Delays and
changed gains then show as commands that this law does not give.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.ndimage import shift as shifted
from scipy.signal import butter, sosfiltfilt

from airtouch.gap import motion
from airtouch.gap.flight import GROUND, PERIOD_S, Flight
from airtouch.logs.flight_log import POSITION, VELOCITY

LAGS = 10
HIGHPASS_HZ = 0.6  #: below it set-points, which no log holds, move the commands
RIDGE = 1e-4
MIX = 0.25 * np.array([[1, 1, 1, 1], [-1, -1, 1, 1], [-1, 1, 1, -1], [-1, 1, -1, 1]], dtype=np.float64)
LOOPS = ("rate_gain", "attitude_gain", "position_gain", "height_gain")
INNER, ANGLE, OUTER = "inner", "angle", "outer"  #: rate loop, attitude loop, velocity and position loops


@dataclass(frozen=True)
class Controller:
    """weights: one vector for each command; noise of the fit is the floor's business."""

    weights: tuple[np.ndarray, ...]

    def surprise(self, flight: Flight, plant: Any) -> np.ndarray:
        """Commands minus what the law gives, (n, 4) PWM, above HIGHPASS_HZ.

        plant: row with sensor_delay and the loops' gains; what its effects changed is in the law.
        """
        late = float(plant["sensor_delay"]) / PERIOD_S
        gains = tuple(float(plant[g]) for g in LOOPS)
        kept = flight.memory.setdefault(id(self), {})
        if (late, gains) in kept:
            return kept[late, gains]
        if "told" not in kept:
            kept["told"], kept["inputs"] = highpassed(flight.pwm @ MIX.T), _inputs(flight, 0.0)
        inputs = kept["inputs"] if late == 0.0 else _inputs(flight, late)
        out = kept["told"].copy()
        for i, (table, parts) in enumerate(inputs):
            gain = np.array([_gain(part, plant, i) for part in parts])
            out[:, i] -= table @ (self.weights[i] * gain)
        if late == 0.0 and gains == (1.0, 1.0, 1.0, 1.0):
            kept[late, gains] = out
        return out


def identify(flights: Sequence[Flight]) -> Controller | None:
    """The law of flights declared nominal; None without any that has a gyro."""
    flights = [f for f in flights if f.rates is not None]
    if not flights:
        return None
    weights = []
    told = [highpassed(f.pwm @ MIX.T) for f in flights]
    inputs = [_inputs(f, 0.0) for f in flights]
    for i in range(4):
        a = np.concatenate([x[i][0][_flying(f)] for x, f in zip(inputs, flights, strict=True)])
        b = np.concatenate([t[_flying(f), i] for t, f in zip(told, flights, strict=True)])
        scale = np.maximum(a.std(axis=0), 1e-9)
        a = a / scale
        normal = a.T @ a + RIDGE * len(a) * np.eye(a.shape[1])
        weights.append(np.linalg.solve(normal, a.T @ b) / scale)
    return Controller(tuple(weights))


def _flying(flight: Flight) -> np.ndarray:
    return (flight.phase != GROUND) & flight.usable


def _gain(part: str, plant: Any, command: int) -> float:
    if command == 0:
        return float(plant["height_gain"])
    rate = float(plant["rate_gain"])
    if part == INNER:
        return rate
    return rate * float(plant["attitude_gain"]) * (float(plant["position_gain"]) if part == OUTER else 1.0)


def _inputs(flight: Flight, late: float) -> list[tuple[np.ndarray, list[str]]]:
    """For each command its regressors (n, k), high-passed, and the loop that each belongs to."""
    angles = motion.attitude(flight.log, PERIOD_S)
    n = len(flight)
    speed = np.einsum("nji,nj->ni", flight.turn, motion.held(flight.log.stack(VELOCITY))) \
        if flight.log.has(*VELOCITY) else np.zeros((n, 3))
    height = motion.held(flight.log[POSITION[2]]) if flight.log.has(POSITION[2]) else (
        _unstepped(motion.held(flight.log["zrange_m"])) if flight.log.has("zrange_m") else np.zeros(n))
    lift = flight.acceleration[:, 2]
    groups = (
        [(height, 1, OUTER), (speed[:, 2], 3, OUTER), (lift, 2, OUTER)],
        [(flight.rates[:, 0], LAGS, INNER), (angles[:, 0], 2, ANGLE), (speed[:, 1], 2, OUTER)],
        [(flight.rates[:, 1], LAGS, INNER), (angles[:, 1], 2, ANGLE), (speed[:, 0], 2, OUTER)],
        [(flight.rates[:, 2], LAGS, INNER), (angles[:, 2], 1, ANGLE)],
    )
    result = []
    for group in groups:
        columns, parts = [], []
        for values, lags, part in group:
            if late > 0.0:
                values = shifted(values, late, order=3, mode="nearest")
            values = highpassed(values)
            for lag in range(lags):
                columns.append(values if lag == 0 else np.concatenate([np.full(lag, values[0]), values[:-lag]]))
                parts.append(part)
        result.append((np.column_stack(columns), parts))
    return result


def highpassed(values: np.ndarray) -> np.ndarray:
    """What changes faster than HIGHPASS_HZ, (n,) or (n, c)."""
    low = butter(2, HIGHPASS_HZ * 2.0 * PERIOD_S, output="sos")
    return values - sosfiltfilt(low, values, axis=0, padlen=min(60, len(values) - 2))


def _unstepped(height: np.ndarray) -> np.ndarray:
    change = np.diff(height, prepend=height[0])
    change[np.abs(change) > 0.06] = 0.0
    return height[0] + np.cumsum(change)
