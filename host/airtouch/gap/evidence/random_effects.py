"""Power spectra that random effects add to the residual of a flight.

White noise of the IMU, noise of the thrust and the rotors' lines in closed form; others by running the effect itself on
the flight's signals with several seeds. Two residuals have them: the one that hypotheses are judged by, whose torque is
that of `signals.response` (`extra_power`), and measured minus replayed, which the map shows (`replayed_power`).
"""

from collections.abc import Callable
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
from airtouch.gap.loop.disturbed import disturbed, gyro_noise_replayed
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
LEAST_PASSED = 0.1  #: least fraction of the power that a mean of two samples passes, to divide by; chosen
RATE_HZ = 1.0 / PERIOD_S  #: of the log: what is faster than half of it folds into its spectra
LIFT_AND_TORQUE = slice(FORCE.stop - 1, TORQUE.stop)  #: channels that the rotors' thrust acts on


def extra_power(data: Data, term: Term) -> list[Spectra]:
    """PSD (blocks, bins, COUNT) that a random effect with its values adds, by flight and state, unit^2/Hz.

    It is that of `Data.residual`, whose torque in the air is held against the response of nominal flights.
    """
    return _at_strength(data, term, "random", _judged_power)


def replayed_power(data: Data, term: Term) -> list[Spectra]:
    """PSD (blocks, bins, COUNT) that a random effect adds to measured minus replayed, by flight and state, unit^2/Hz.

    That is the residual of `Study.residual`, in which all that the logged commands answer to an effect counts as
    modelled torque.
    """
    return _at_strength(data, term, "random, replayed", _replayed_power)


def _at_strength(data: Data, term: Term, name: str, of_strength_1: Callable[[Data, int, Term], Spectra],
                 ) -> list[Spectra]:
    """Power of a term by flight, from that of a flight at scaled strength 1, which is cached under a name."""
    weak = replace(term, gate=()).fitted(np.ones(len(term.free)))
    by_flight = data.workspace.cached(
        name, weak.active().key, lambda: [of_strength_1(data, i, weak) for i in range(len(data.flights))])
    (free, *_) = term.free
    neutral = neutral_of(parameter_of(term.effect, free))
    scale = growth(term, (term.values[free] - neutral) / (weak.values[free] - neutral))
    if term.gate:
        return [{state: scale * v * _covered(data, i, state, term.gate) for state, v in f.items()}
                for i, f in enumerate(by_flight)]
    return [{state: scale * v for state, v in f.items()} for f in by_flight]


def _covered(data: Data, i: int, state: str, gate: Gate) -> np.ndarray:
    """Fraction (blocks, 1, 1) of the power of each block of a flight that lies within a gate, by the blocks' window."""
    acts = inside(gate, data.flights[i]).astype(float)
    length, first = LENGTH[state], data.block_starts[i][state]
    weight = hann_window(length)[0][:, 0] ** 2
    windows = acts[first[:, None] + np.arange(length)] if len(first) else np.zeros((0, length))
    return (windows @ weight / weight.sum())[:, None, None]


def growth(term: Term, x: float) -> float:
    """Extra power at scaled strength x over that at strength 1."""
    if not term.signature.factors:
        return x * x
    factor, of_one = (term.at(np.array([scaled]))[term.free[0]] for scaled in (x, 1.0))
    return max(factor ** 2 - 1.0, 0.0) / (of_one ** 2 - 1.0)


def _judged_power(data: Data, i: int, term: Term) -> Spectra:
    """PSD by state that a term with its values adds to `Data.residual` of flight i."""
    power_by_state, study = _power_at_source(data, i, term), data.study
    if data.flights[i].rates is None:
        return power_by_state
    torque = power_by_state[AIR][:, :, TORQUE]
    if term.signature.spectrum == IMU_NOISE:
        torque[:] = _beyond_declared(term) * _torque_noise(study, _gyro_differences(study, AIR))
    if study.response is not None:
        torque *= study.response.random_power(data.quiet[i], term.signature.sensed)
    return power_by_state


def _replayed_power(data: Data, i: int, term: Term) -> Spectra:
    """PSD by state that a term with its values adds to measured minus replayed of flight i.

    The replay takes what the loop commands against a torque, or makes of the gyro's noise, for torque. Of the rotors'
    lines the loop makes little, as they turn faster than its low-pass.
    """
    power_by_state, study = _power_at_source(data, i, term), data.study
    if study.loop is None or data.flights[i].rates is None:
        return power_by_state
    f, row = frequencies(AIR), prepare(study.vehicle, study.calibration)[0][0]
    if term.signature.spectrum == IMU_NOISE:
        above = np.maximum(f, LEAKED * f[1])  # as `_difference`
        power_by_state[AIR][:, :, TORQUE] *= gyro_noise_replayed(study.loop.controllers, row, above)
    elif not term.signature.sensed:
        power_by_state[AIR][:, :, TORQUE] *= disturbed(study.loop.controllers, row, f).power_beyond()
    return power_by_state


def _power_at_source(data: Data, i: int, term: Term) -> Spectra:
    """PSD (blocks, bins, COUNT) by state of a random term with its values in flight i, before the loop answers it."""
    closed_forms = {IMU_NOISE: _imu_noise, THRUST_NOISE: _thrust_noise, ROTOR_LINES: _rotor_lines}
    return closed_forms.get(term.signature.spectrum, _by_running)(data, i, term)


def _by_running(data: Data, i: int, term: Term) -> Spectra:
    """PSD by state of an effect, estimated by runs with several seeds on the flight's own signals.

    A channel has one shape of the spectrum, scaled by the power of each block. At rest it is 0 whatever the effect is,
    as the residual has a vehicle at rest as its model there (`channels.residual`): only noise of the IMU is judged at
    rest, by its closed form.
    """
    flight, study = data.flights[i], data.study
    runs = [residual(flight, study.vehicle, (*study.calibration, term.active()), seed=seed + 1)
            for seed in range(SEEDS)]
    mean, out = np.mean(runs, axis=0), _no_power(data, i)
    for state, first in data.block_starts[i].items():
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
    """Zeros in the shape of the residual of flight i, (blocks, bins, COUNT) by state."""
    return {state: np.zeros(of_state.shape) for state, of_state in data.residual[i].items()}


def _imu_noise(data: Data, i: int, term: Term) -> Spectra:
    """PSD of white noise of gyro and accelerometer, the latter through its low-pass and folded by the log."""
    row = prepare(data.study.vehicle, ())[0][0]
    out = _no_power(data, i)
    for state, table in out.items():
        f = frequencies(state)
        white = np.zeros((len(f), COUNT))
        white[:, FORCE] = logged_noise(row, f)[:, None] * np.asarray(row["acc_noise"]) ** 2
        if data.flights[i].rates is not None:
            white[:, TORQUE] = _gyro_differences(data.study, state)
            white[:, RATE] = 2.0 * PERIOD_S * np.asarray(row["gyro_noise"]) ** 2
        table[:] = _beyond_declared(term) * white
    return out


def _beyond_declared(term: Term) -> float:
    """Power that a term of noise of the IMU adds, over that of the declared noise."""
    return term.values["factor"] ** 2 - 1.0


def _gyro_differences(study: Study, state: str) -> np.ndarray:
    """PSD (bins, 3) of the differences of the gyro's declared noise, (rad/s^2)^2/Hz."""
    row = prepare(study.vehicle, ())[0][0]
    return _difference(state)[:, None] * (2.0 * PERIOD_S * np.asarray(row["gyro_noise"]) ** 2)


def _torque_noise(study: Study, gyro: np.ndarray) -> np.ndarray:
    """PSD (bins, 3) of the torque in the air from that of the gyro's differences, gyro (bins, 3).

    The controller answers the gyro's noise, so that the commands predict part of it: at most the nominal floor is left
    in the residual. What the floor holds beyond comes from the commands, in part moved by the gyro too.
    """
    if AIR not in study.floor.power:
        return gyro
    floor = np.nan_to_num(study.floor.power[AIR][:, TORQUE])
    beyond = _gyro_share(study) * np.maximum(floor - gyro, 0.0)
    return np.minimum(gyro, floor) + beyond


def folded_frequencies(f: np.ndarray, step_s: float) -> np.ndarray:
    """Frequencies (aliases, bins), Hz, that a log at RATE_HZ folds to f (bins,), f itself first.

    They are those up to half the rate of a control loop with a step of step_s: of a 500 Hz loop five.
    """
    aliases = round(PERIOD_S / step_s)
    folds = [(k * RATE_HZ - f, k * RATE_HZ + f) for k in range(1, aliases // 2 + 1)]
    return np.array([f, *(alias for fold in folds for alias in fold)][:aliases])


def logged_noise(row: Any, f: np.ndarray) -> np.ndarray:
    """PSD (bins,), 1/Hz, of the accelerometer's noise of rms 1 as logged: white, through its low-pass, folded.

    row: parameters of the plant (`simulation.flight.prepare`).
    """
    step_s = float(row["step"])
    aliases = folded_frequencies(f, step_s)
    b = np.zeros(5)  # of a filter of second order: b0, b1, b2, a1, a2
    filters.lowpass_coefficients(float(row["acc_lowpass"]), step_s, b)
    late = np.exp(-2j * np.pi * aliases.ravel() * step_s)  # by one step
    passed = polyval(late, b[:3]) / polyval(late, [1.0, b[3], b[4]])
    total = (np.abs(passed) ** 2).reshape(len(aliases), -1).mean(axis=0)
    return 2.0 * PERIOD_S * total / filters.noise_gain(b) ** 2


def _gyro_share(study: Study) -> np.ndarray:
    """Fraction (bins, 3) of the noise of nominal flights' roll and pitch commands that is the gyro's; of yaw 0.

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
    """PSD (bins,) of white noise differentiated by samples over its own, 1/s^2; the window leaks into bin 0."""
    f = frequencies(state)
    return difference_power(np.maximum(f, LEAKED * f[1])) / PERIOD_S ** 2


def _thrust_noise(data: Data, i: int, term: Term) -> Spectra:
    """PSD of first-order noise on each rotor's thrust: Lorentzian, through the mixing; at rest the rotors stand."""
    out, study, f = _no_power(data, i), data.study, frequencies(AIR)
    row = prepare(study.vehicle, study.calibration)[0][0]
    thrust = study.vehicle.thrust(data.flights[i].pwm)
    tau, rms = term.values["time"], term.values["rms"]
    mixing = np.stack([np.full(4, 1.0 / row["mass"]), row["rotor_y"] / row["inertia"][0],
                       -row["rotor_x"] / row["inertia"][1],
                       np.array(rigid_body.SPIN) * -row["yaw_torque_over_thrust"] / row["inertia"][2]])
    aliases = folded_frequencies(f, float(row["step"]))
    density = 4.0 * tau / (1.0 + (2.0 * np.pi * tau * aliases) ** 2)
    folded = np.repeat(density.sum(axis=0)[:, None], 4, axis=1)
    folded[:, 1:] = (density * np.sinc(aliases * PERIOD_S) ** 2).sum(axis=0)[:, None]  # the gyro's differences
    for b, first in enumerate(data.block_starts[i][AIR]):
        size = (thrust[first:first + LENGTH[AIR]] ** 2).mean(axis=0)
        out[AIR][b, :, LIFT_AND_TORQUE] = folded * (rms ** 2 * (mixing ** 2 @ size))
    return out


def _rotor_lines(data: Data, i: int, term: Term) -> Spectra:
    """PSD of the rotors' lines: equal on each axis of the accelerometer, and of the gyro's differences."""
    out = _no_power(data, i)
    if not len(data.residual[i][AIR]):
        return out
    line = lines(data).power[i][:, :, None] * term.values["amplitude"] ** 2
    out[AIR][:, :, FORCE] = line
    if data.flights[i].rates is not None:
        out[AIR][:, :, TORQUE] = term.values["gyro"] ** 2 * _difference(AIR)[:, None] * line
    return out
