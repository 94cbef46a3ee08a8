"""Rotation per logged command, from noise and from steps of a set-point beside it."""

from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d

from airtouch.gap.flights.flight import PERIOD_S
from airtouch.gap.loop.axis_plant import AxisPlant
from airtouch.gap.loop.controller import Controller
from airtouch.gap.loop.loop_model import LOWEST_HZ, Parts, butterworth, fixed_of, loop_parts
from airtouch.gap.loop.noise_spectra import (
    FOLDS,
    WANDER_HZ,
    aliases_of,
    difference,
    kick_of,
    paths,
    transfers,
    with_aliases,
)

KICKS = np.linspace(1.0, 0.0, 21)  #: shares that are tried of a step's first sample; spacing chosen
STEP_HZ = (1.5, 14.0)  #: frequencies at which they are fitted; chosen
GYRO_FOLDS = tuple(k for k in range(-5, 5) if k)  #: multiples of the log's 100 Hz below half of the IMU's 1 kHz
UNCUT = 0.95  #: share of a kick from which the command's limits do not cut it: one step of KICKS below 1; chosen
#: Power of the gains with which the uncut share of a kick falls, from ten pairs of simulated flights each with attitude
#: gains of 0.5 to 1.5 and rate gains of 0.8 to 1.3.
CUT_POWER = 0.6


class Step(NamedTuple):
    """Steps of a velocity set-point in a block.

    power: of the steps, over that of noise of unit strength; kick: share of the derivative at the first sample that is
    left by the limits of the command, which are 16 bits and what the motors take.
    """

    power: float = 0.0
    kick: float = 1.0


NO_STEP = Step()


def turning_per_command(c: Controller, plant: AxisPlant, strengths: np.ndarray, f: np.ndarray,
                        width: float = 0.0, step: Step = NO_STEP) -> np.ndarray:
    """Expected angular acceleration (..., bins) per logged command, rad/s^2 per N: S_yu / S_uu of roll or pitch.

    strengths (..., sources): of the noise. width: of the Gaussian that smooths over neighbouring bins of f, standard
    deviation.
    """
    return turnings_per_command(c, plant, strengths, f, width, [step])[0]


def turnings_per_command(c: Controller, plant: AxisPlant, strengths: np.ndarray, f: np.ndarray, width: float,
                         steps: Sequence[Step]) -> list[np.ndarray]:
    """`turning_per_command` for each of several steps."""
    at = np.maximum(f, LOWEST_HZ)
    parts = loop_parts(c, plant, at)
    cross, power, _ = (strengths @ x for x in _spectra_of_turning(c, plant, f, parts))
    by_step = {NO_STEP: (cross, power)}
    moving = [s for s in dict.fromkeys(steps) if s.power]
    for s, stepped in zip(moving, _stepped(c, plant, at, parts, [s.kick for s in moving]), strict=True):
        by_step[s] = _with_steps(cross, power, s.power, *stepped)
    crosses, powers = (np.array(x) for x in zip(*by_step.values(), strict=True))
    if width > 0.0:
        crosses, powers = (gaussian_filter1d(x, width, axis=-1, mode="nearest") for x in (crosses, powers))
    ratios = dict(zip(by_step, crosses / powers, strict=True))
    return [ratios[s if s.power else NO_STEP] for s in steps]


def _with_steps(cross: np.ndarray, power: np.ndarray, amount: float, logged: np.ndarray, acceleration: np.ndarray,
                ) -> tuple[np.ndarray, np.ndarray]:
    """S_yu and S_uu of noise, `cross` and `power`, and of steps of a power `amount` beside it (`_stepped`)."""
    return cross + amount * acceleration * logged.conj(), power + amount * np.abs(logged) ** 2


def turning_beside_command(c: Controller, plant: AxisPlant, strengths: np.ndarray, f: np.ndarray,
                           width: float = 0.0) -> np.ndarray:
    """Power (bins,) of the angular acceleration that a logged command does not explain, rad^2/s^4/Hz.

    S_yy - |S_yu|^2 / S_uu of roll or pitch for noise of given strengths (sources,); width: as for
    `turning_per_command`. It is the noise of the gyro, and what the loop does of noise between two rows of the log.
    """
    parts = loop_parts(c, plant, np.maximum(f, LOWEST_HZ))
    smoothed = [strengths @ x for x in _spectra_of_turning(c, plant, f, parts)]
    if width > 0.0:
        smoothed = [gaussian_filter1d(x, width, axis=-1, mode="nearest") for x in smoothed]
    cross, power, total = smoothed
    return total - np.abs(cross) ** 2 / power


def _spectra_of_turning(c: Controller, plant: AxisPlant, f: np.ndarray, parts: Parts,
                        ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """S_yu, S_uu and S_yy (sources, bins) for noise of unit power.

    y: angular acceleration; u: logged command. parts: of the loop at f, no lower than LOWEST_HZ.
    """
    logged, acceleration = transfers(c, plant, np.maximum(f, LOWEST_HZ), parts)
    cross, aliases = acceleration * logged.conj(), aliases_of(c, plant, f)
    turning = np.abs(acceleration) ** 2
    if len(aliases):  # noise of the gyro folds into the log, and into the command alike
        sensed = _sensed(c.chip_hz, f.tobytes())
        for k in GYRO_FOLDS:
            turning[0] += np.abs(sensed[k]) ** 2
        for k, alias in zip(FOLDS[1:], aliases, strict=True):
            cross[0] += sensed[k] * np.where(f + k / PERIOD_S < 0.0, alias, alias.conj())
    return cross, with_aliases(np.abs(logged) ** 2, aliases), turning


@lru_cache(16)
def _sensed(chip_hz: float, frequencies: bytes) -> dict[int, np.ndarray]:
    """Angular acceleration (bins,) that the log shows at frequencies for noise k times the log's rate above, by k."""
    f, out = np.frombuffer(frequencies), {}
    for k in GYRO_FOLDS:
        folded_hz = f + k / PERIOD_S
        response = 1.0 / butterworth(2j * np.pi * np.abs(folded_hz), chip_hz)
        out[k] = difference(f) * np.where(folded_hz < 0.0, np.conj(response), response)
    return out


def step_of(c: Controller, plant: AxisPlant, strengths: np.ndarray, f: np.ndarray, over: np.ndarray,
            turning: np.ndarray) -> Step:
    """The steps that explain blocks of nominal flights best, by least squares.

    strengths (sources,): of the noise; over (bins,): power of their commands over that of blocks without a step;
    turning (bins,): measured S_yu / S_uu, 0 where it is not known.
    """
    known = (turning != 0.0) & (f > STEP_HZ[0]) & (f < STEP_HZ[1])
    if not known.any():
        return NO_STEP
    at = np.maximum(f, LOWEST_HZ)
    parts = loop_parts(c, plant, at)
    cross, noise, _ = (strengths @ x for x in _spectra_of_turning(c, plant, f, parts))
    best, least = NO_STEP, np.inf
    for kick, (logged, acceleration) in zip(KICKS, _stepped(c, plant, at, parts, KICKS), strict=True):
        step = Step(float(np.median(((over - 1.0) * noise / np.abs(logged) ** 2)[known])), float(kick))
        if step.power > 0.0:
            cross_power, power = _with_steps(cross, noise, step.power, logged, acceleration)
            ratio = cross_power / power
            misfit = float((np.abs(ratio[known] / turning[known] - 1.0) ** 2).sum())
            if misfit < least:
                best, least = step, misfit
    return best


def step_under(step: Step, c: Controller, before: AxisPlant, after: AxisPlant) -> Step:
    """Steps of the same set-point in the plant `after`; step: those in `before`.

    What the limits leave of the first sample of a large step has one size however high the gains; smaller steps are
    not cut: together it falls by CUT_POWER of the gains.
    """
    if step.kick >= UNCUT or not c.on_error:
        return step
    ahead = c.derivative / c.period_s
    gains = [p.rate_gain * p.attitude_gain * p.position_gain for p in (before, after)]
    kick = ((1.0 + ahead * step.kick) * (gains[0] / gains[1]) ** CUT_POWER - 1.0) / ahead
    return step._replace(kick=float(np.clip(kick, 0.0, 1.0)))


def _stepped(c: Controller, plant: AxisPlant, f: np.ndarray, parts: Parts, kicks: Iterable[float],
             ) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Transfers (bins,) of roll or pitch from steps of the velocity's set-point to logged command and acceleration.

    parts: of the loop at f. kicks: shares of the first sample's derivative that the command's limits leave, a pair
    for each; what follows is too small for them.
    """
    fixed = fixed_of(c, f)
    to_rate, rate, angle, velocity, whole = parts
    step = paths(c, plant, fixed)[1] / np.maximum(f, WANDER_HZ)
    per_step = to_rate / (1.0 + to_rate * whole)
    answer = rate + kick_of(c, fixed) * (angle + velocity)
    for kick in kicks:
        effective = (fixed.integral + kick * (fixed.whole - fixed.integral)) / fixed.whole if c.on_error else 1.0
        acceleration = per_step * effective * step
        yield kick_of(c, fixed, kick) * step - answer * acceleration, fixed.s * acceleration
