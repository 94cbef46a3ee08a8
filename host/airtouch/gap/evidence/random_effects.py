"""Power spectra that random effects add to the gap of a flight.

White noise of the IMU, noise of the thrust and the rotors' lines in closed form; others by running the effect itself on
the flight's signals with several seeds.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.polynomial.polynomial import polyval

from airtouch.gap.evidence.data import Data, Spectra
from airtouch.gap.evidence.vibration_lines import lines
from airtouch.gap.flights.blocks import hann_window
from airtouch.gap.flights.flight import GROUND, PERIOD_S
from airtouch.gap.loop.axis_plant import axis_plant
from airtouch.gap.loop.controller import AXES
from airtouch.gap.loop.noise_spectra import noise_power
from airtouch.gap.signals.channels import COUNT, FORCE, RATE, TORQUE, inside, residual
from airtouch.gap.signals.spectra import (
    AIR,
    LEAKED,
    LEAST_POWER,
    LENGTH,
    difference_power,
    frequencies,
    short_time_spectra,
)
from airtouch.gap.signatures.signature import IMU_NOISE, ROTOR_LINES, THRUST_NOISE
from airtouch.gap.signatures.term import Term, neutral_of, parameter_of
from airtouch.gap.study import Study
from airtouch.simulation.body import rigid_body
from airtouch.simulation.effects.effect import Gate
from airtouch.simulation.flight import prepare
from airtouch.simulation.sensors import filters

SEEDS = 4  #: runs of a random effect from which its power is estimated; chosen for time. More estimate it better
LEAST_PASSED = 0.1  #: power that a mean of two samples keeps, below which it is not divided by; chosen
RATE_HZ = 1.0 / PERIOD_S  #: of the log: what is faster folds into its spectra
LIFT_AND_TORQUE = slice(FORCE.stop - 1, TORQUE.stop)  #: channels that four rotors move


def power(data: Data, term: Term) -> list[Spectra]:
    """PSD (blocks, bins, COUNT) that a random effect with its values adds, by flight and state."""
    unit = replace(term, gate=()).fitted(np.ones(len(term.free)))
    of_unit = data.workspace.cached("random", unit.active().key,
                                    lambda: [_unit_power(data, i, unit) for i in range(len(data.flights))])
    (name, *_) = term.free
    neutral = neutral_of(parameter_of(term.effect, name))
    scale = growth(term, (term.values[name] - neutral) / (unit.values[name] - neutral))
    if term.gate:
        return [{state: scale * v * _covered(data, i, state, term.gate) for state, v in f.items()}
                for i, f in enumerate(of_unit)]
    return [{state: scale * v for state, v in f.items()} for f in of_unit]


def _covered(data: Data, i: int, state: str, gate: Gate) -> np.ndarray:
    """Share (blocks, 1, 1) of the power of each block of a flight that lies within a gate, by the blocks' window."""
    acts = inside(gate, data.flights[i]).astype(float)
    length, first = LENGTH[state], data.first[i][state]
    weight = hann_window(length)[0][:, 0] ** 2
    windows = acts[first[:, None] + np.arange(length)] if len(first) else np.zeros((0, length))
    return (windows @ weight / weight.sum())[:, None, None]


def growth(term: Term, x: float) -> float:
    """Added power at scaled strength x over that at 1."""
    if not term.signature.factors:
        return x * x
    factor, of_one = (term.at(np.array([scaled]))[term.free[0]] for scaled in (x, 1.0))
    return max(factor ** 2 - 1.0, 0.0) / (of_one ** 2 - 1.0)


def _unit_power(data: Data, i: int, term: Term) -> Spectra:
    """PSD (blocks, bins, COUNT) by state that a random effect of unit strength adds to flight i."""
    closed_forms = {IMU_NOISE: _imu_noise, THRUST_NOISE: _thrust_noise, ROTOR_LINES: _rotor_lines}
    power_by_state = closed_forms.get(term.signature.spectrum, _by_running)(data, i, term)
    response = data.study.response
    if response is not None and data.flights[i].rates is not None:
        power_by_state[AIR][:, :, TORQUE] *= response.random_power(data.quiet[i], term.signature.sensed)
    return power_by_state


def _by_running(data: Data, i: int, term: Term) -> Spectra:
    """Power by state of an effect that is run on the flight's own signals with several seeds.

    A channel has one shape of the spectrum, at the strength of each block.
    """
    flight, study = data.flights[i], data.study
    runs = [residual(flight, study.vehicle, (*study.calibration, term.active()), seed=seed + 1)
            for seed in range(SEEDS)]
    mean, out = np.mean(runs, axis=0), _no_power(data, i)
    for state, first in data.first[i].items():
        changes = [np.where((flight.phase == GROUND)[:, None], 0.0, np.nan_to_num(run - mean)) for run in runs]
        total = np.sum([np.abs(short_time_spectra(change, first, state)) ** 2 / (SEEDS - 1) for change in changes],
                       axis=0)
        if not len(total):
            continue
        if state == AIR:
            total[:, :, TORQUE] *= _over_a_sample()[:, None]
        shape = total.mean(axis=0, keepdims=True)
        strength = total.mean(axis=1, keepdims=True) / np.maximum(shape.mean(axis=1, keepdims=True), LEAST_POWER)
        out[state] = shape * strength
    return out


def _over_a_sample() -> np.ndarray:
    """Power (bins,) of the gyro's differences over that of means of two samples, as `channels.residual` takes them.

    A difference is a mean over a sample. Near 50 Hz, where means of two samples pass nothing, LEAST_PASSED limits it.
    """
    turns = frequencies(AIR) * PERIOD_S
    return np.sinc(turns) ** 2 / np.maximum(np.cos(np.pi * turns) ** 2, LEAST_PASSED)


def _no_power(data: Data, i: int) -> Spectra:
    """Zeros (blocks, bins, COUNT) by state, of flight i."""
    return {state: np.zeros(gap.shape) for state, gap in data.base[i].items()}


def _imu_noise(data: Data, i: int, term: Term) -> Spectra:
    """White noise of gyro and accelerometer, the latter as its low-pass and the log's fold leave it."""
    row = prepare(data.study.vehicle, ())[0][0]
    extra = term.values["factor"] ** 2 - 1.0
    out = _no_power(data, i)
    for state, table in out.items():
        f = frequencies(state)
        white = np.zeros((len(f), COUNT))
        white[:, FORCE] = logged_noise(row, f)[:, None] * np.asarray(row["acc_noise"]) ** 2
        if data.flights[i].rates is not None:
            gyro = 2.0 * PERIOD_S * np.asarray(row["gyro_noise"]) ** 2
            white[:, TORQUE] = _torque_noise(data.study, state, _difference(state)[:, None] * gyro)
            white[:, RATE] = gyro
        table[:] = extra * white
    return out


def _torque_noise(study: Study, state: str, gyro: np.ndarray) -> np.ndarray:
    """PSD (bins, 3) of the torque from that of the gyro's differences, gyro (bins, 3).

    In the air the controller answers the gyro's noise, so that the commands predict part of it: at most the nominal
    floor is left in the residual. What the floor holds beyond comes from the commands, in part moved by the gyro too.
    """
    if state != AIR or state not in study.floor.power:
        return gyro
    floor = np.nan_to_num(study.floor.power[state][:, TORQUE])
    beyond = _gyro_share(study) * np.maximum(floor - gyro, 0.0)
    return np.minimum(gyro, floor) + beyond


def folded_frequencies(f: np.ndarray) -> np.ndarray:
    """Frequencies (5, bins), Hz, that a log at RATE_HZ folds to f (bins,): f itself first, up to two rates and f."""
    return np.array([f, RATE_HZ - f, RATE_HZ + f, 2.0 * RATE_HZ - f, 2.0 * RATE_HZ + f])


def logged_noise(row: Any, f: np.ndarray) -> np.ndarray:
    """PSD (bins,), 1/Hz, of the accelerometer's noise of rms 1 as logged: white, through its low-pass, folded."""
    whole = folded_frequencies(f).ravel()
    b = np.zeros(5)
    filters.lowpass_coefficients(float(row["acc_lowpass"]), float(row["step"]), b)
    late = np.exp(-2j * np.pi * whole * float(row["step"]))  # by one step
    passed = polyval(late, b[:3]) / polyval(late, [1.0, b[3], b[4]])
    total = (np.abs(passed) ** 2).reshape(5, -1).mean(axis=0)
    return 2.0 * PERIOD_S * total / filters.noise_gain(b) ** 2


def _gyro_share(study: Study) -> np.ndarray:
    """Share (bins, 3) of the gyro's noise in what moves the roll and pitch commands of nominal flights.

    The commands' noise is what the floor of the angular acceleration holds beyond the gyro's own.
    """
    f = frequencies(AIR)
    share = np.zeros((len(f), 3))
    loop = study.loop
    if loop is None:
        return share
    row = prepare(study.vehicle, study.calibration)[0][0]
    for i, axis in enumerate(AXES[1:]):
        strength, powers = loop.strengths[i + 1], noise_power(loop.controllers[i + 1], axis_plant(row, axis), f)
        share[:, i] = strength[0] * powers[0] / np.maximum(strength @ powers, LEAST_POWER)
    return share


def _difference(state: str) -> np.ndarray:
    """PSD (bins,) of differences over a sample, 1/s^2, of what is white; the lowest bin as its window leaks."""
    f = frequencies(state)
    return difference_power(np.maximum(f, LEAKED * f[1])) / PERIOD_S ** 2


def _thrust_noise(data: Data, i: int, term: Term) -> Spectra:
    """Each rotor's thrust times first-order noise: Lorentzian spectra through the mixing; at rest the rotors stand."""
    out, study, f = _no_power(data, i), data.study, frequencies(AIR)
    row = prepare(study.vehicle, study.calibration)[0][0]
    thrust = study.vehicle.thrust(data.flights[i].pwm)
    tau, rms = term.values["time"], term.values["rms"]
    mixing = np.stack([np.full(4, 1.0 / row["mass"]), row["rotor_y"] / row["inertia"][0],
                       -row["rotor_x"] / row["inertia"][1],
                       np.array(rigid_body.SPIN) * -row["yaw_torque_over_thrust"] / row["inertia"][2]])
    aliases = folded_frequencies(f)
    density = 4.0 * tau / (1.0 + (2.0 * np.pi * tau * aliases) ** 2)
    folded = np.repeat(density.sum(axis=0)[:, None], 4, axis=1)
    folded[:, 1:] = (density * np.sinc(aliases * PERIOD_S) ** 2).sum(axis=0)[:, None]  # the gyro's differences
    for b, first in enumerate(data.first[i][AIR]):
        size = (thrust[first:first + LENGTH[AIR]] ** 2).mean(axis=0)
        out[AIR][b, :, LIFT_AND_TORQUE] = folded * (rms ** 2 * (mixing ** 2 @ size))
    return out


def _rotor_lines(data: Data, i: int, term: Term) -> Spectra:
    """The rotors' lines: as strong on each axis of the accelerometer, and on the gyro's differences."""
    out = _no_power(data, i)
    if not len(data.base[i][AIR]):
        return out
    line = lines(data).power[i][:, :, None] * term.values["amplitude"] ** 2
    out[AIR][:, :, FORCE] = line
    if data.flights[i].rates is not None:
        out[AIR][:, :, TORQUE] = term.values["gyro"] ** 2 * _difference(AIR)[:, None] * line
    return out
