"""Spectra that random effects add to the gap, for a flight as it was flown.

White noise and lines of the IMU in closed form; random forces by running the effect
itself on the flight's signals with several seeds.
"""

from typing import Any

import numpy as np
from scipy.ndimage import median_filter

from airtouch.gap.channels import COUNT, residual
from airtouch.gap.flight import GROUND, PERIOD_S, Flight
from airtouch.gap.spectra import blocks, frequencies
from airtouch.simulation import rigid_body
from airtouch.simulation.flight import prepare

SEEDS = 4
GROUP = 3  #: blocks, as in the two halves of the data: a line must stand out in both
LOWEST_LINE = 8  #: bins of 0.39 Hz
NEIGHBOURS = 41  #: bins among whose median a line stands out
PEAK = 3.0  #: times that median


def growth(term: Any, x: float) -> float:
    """Added power at scaled strength x over that at 1."""
    if term.name == "imu_noise":
        values = term.at(np.array([x])), term.at(np.array([1.0]))
        return max(values[0]["factor"] ** 2 - 1.0, 0.0) / (values[1]["factor"] ** 2 - 1.0)
    return x * x


def power(data: Any, term: Any) -> list[dict[str, np.ndarray]]:
    """PSD (blocks, bins, COUNT) that a random effect with its values adds, by flight and regime."""
    cache = data.__dict__.setdefault("_random", {})
    unit = term.fitted(np.ones(len(term.free)))
    key = (term.name, tuple(sorted(unit.values.items())))
    if key not in cache:
        cache[key] = [_unit_power(data, i, unit) for i in range(len(data.flights))]
    p = next(q for q in term.effect.parameters if q.name == term.free[0])
    neutral = p.neutral or 0.0
    step = unit.values[term.free[0]] - neutral
    scale = growth(term, (term.values[term.free[0]] - neutral) / step)
    return [{r: scale * v for r, v in f.items()} for f in cache[key]]


def _unit_power(data: Any, i: int, term: Any) -> dict[str, np.ndarray]:
    shape = {r: (len(v), *data.base[i][r].shape[1:]) for r, v in data.first[i].items()}
    maker = {"imu_noise": _imu_noise, "motor_noise": _motor_noise, "vibration": _vibration}.get(term.name)
    if maker is None:
        return _by_running(data, i, term)
    return maker(data, i, term, shape)


def _imu_noise(data: Any, i: int, term: Any, shape: dict) -> dict[str, np.ndarray]:
    row = prepare(data.study.vehicle, ())[0][0]
    extra = term.values["factor"] ** 2 - 1.0
    out = {}
    for r in shape:
        f = frequencies(r)
        made = np.zeros((len(f), COUNT))
        made[:, 0:3] = extra * 2.0 * PERIOD_S * np.asarray(row["acc_noise"]) ** 2
        difference = 4.0 * np.sin(np.pi * np.maximum(f, 0.5 * f[1]) * PERIOD_S) ** 2 / PERIOD_S ** 2
        gyro = extra * 2.0 * PERIOD_S * np.asarray(row["gyro_noise"]) ** 2
        made[:, 3:6] = difference[:, None] * gyro
        made[:, 6:9] = gyro
        if data.flights[i].rates is None:
            made[:, 3:9] = 0.0
        out[r] = np.broadcast_to(made, shape[r]).copy()
    return out


def _motor_noise(data: Any, i: int, term: Any, shape: dict) -> dict[str, np.ndarray]:
    """Each rotor's thrust times first-order noise: Lorentzian spectra through the mixing."""
    flight, study = data.flights[i], data.study
    row = prepare(study.vehicle, study.calibration)[0][0]
    thrust = study.vehicle.thrust(flight.pwm)
    tau, rms = term.values["time"], term.values["rms"]
    arms = np.stack([np.full(4, 1.0 / row["mass"]), row["rotor_y"] / row["inertia"][0],
                     -row["rotor_x"] / row["inertia"][1],
                     np.array(rigid_body.SPIN) * -row["yaw_torque_over_thrust"] / row["inertia"][2]])
    out = {}
    for r in shape:
        f = frequencies(r)
        folded = sum((4.0 * tau / (1.0 + (2.0 * np.pi * tau * g) ** 2))
                     for g in (f, 100.0 - f, 100.0 + f, 200.0 - f, 200.0 + f))
        made = np.zeros(shape[r])
        for b, first in enumerate(data.first[i][r]):
            size = (thrust[first:first + 256] ** 2).mean(axis=0)
            strength = rms ** 2 * (arms ** 2 @ size)
            made[b, :, 2:6] = folded[:, None] * strength
        if r != "air":
            made[:] = 0.0
        out[r] = made
    return out


def _vibration(data: Any, i: int, term: Any, shape: dict) -> dict[str, np.ndarray]:
    """Narrow lines where this flight's own spectrum stands out of its neighbourhood, if anywhere."""
    out = {}
    for r in shape:
        made = np.zeros(shape[r])
        if r == "air" and len(data.base[i][r]):
            made[:] = line_shape(data, i, term)
        out[r] = made
    return out


def line_shape(data: Any, i: int, term: Any) -> np.ndarray:
    """(bins, COUNT): power of lines of unit amplitude, at the bins where they are."""
    every = np.abs(data.base[i]["air"][:, :, :6]) ** 2
    spectrum = every.mean(axis=0)
    made = np.zeros((len(spectrum), COUNT))
    floor = data.study.floor.power["air"][:, :6]
    halves = [every[(np.arange(len(every)) // GROUP) % 2 == k] for k in (0, 1)]
    if min(len(h) for h in halves) == 0:
        return made
    with np.errstate(invalid="ignore", divide="ignore"):
        over = np.min([np.nan_to_num(h.mean(axis=0) / floor)[:, :3].sum(axis=1) for h in halves], axis=0)
    over = np.maximum(over - 3.0, 0.0)
    over[:LOWEST_LINE] = 0.0
    around = median_filter(over, NEIGHBOURS, mode="nearest")
    shape = np.where(over > PEAK * around + 0.5, over - around, 0.0)
    shape[shape < 0.05 * shape.max(initial=0.0)] = 0.0
    if shape.sum() <= 0.0:
        return made
    shape /= max(shape.sum(), 1e-12)
    f = frequencies("air")
    width = f[1]
    amplitude = term.values["amplitude"]
    each = np.nan_to_num((spectrum * (shape > 0)[:, None])[:, :3].sum(axis=0))
    split = each / max(each.sum(), 1e-12)
    made[:, :3] = shape[:, None] * split * 3.0 * amplitude ** 2 / 2.0 / width
    gyro = np.nan_to_num((spectrum * (shape > 0)[:, None])[:, 3:6].sum(axis=0))
    if data.flights[i].rates is not None and gyro.sum() > 0:
        rate = term.values["gyro"] ** 2 * 4.0 * np.sin(np.pi * f * PERIOD_S) ** 2 / PERIOD_S ** 2
        made[:, 3:6] = (shape * rate)[:, None] * split * 3.0 * amplitude ** 2 / 2.0 / width
    return made


def _by_running(data: Any, i: int, term: Any) -> dict[str, np.ndarray]:
    """The effect run on the flight's own signals with several seeds: one shape of the spectrum a channel,

    at the strength that it has in each block.
    """
    flight: Flight = data.flights[i]
    study = data.study
    runs = [residual(flight, study.vehicle, (*study.calibration, term.active()), seed=seed + 1)
            for seed in range(SEEDS)]
    middle = np.mean(runs, axis=0)
    out = {}
    for r, first in data.first[i].items():
        total = 0.0
        for run in runs:
            change = np.nan_to_num(run - middle)
            change[flight.phase == GROUND] = 0.0
            total = total + np.abs(blocks(change, first, r)) ** 2 / (SEEDS - 1)
        if not np.ndim(total) or not len(total):
            out[r] = np.zeros(data.base[i][r].shape)
            continue
        shape = total.mean(axis=0, keepdims=True)
        strength = total.mean(axis=1, keepdims=True) / np.maximum(shape.mean(axis=1, keepdims=True), 1e-300)
        out[r] = shape * strength
    return out
