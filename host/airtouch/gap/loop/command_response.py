"""Angular acceleration per logged command, S_yu / S_uu, of noise and of steps of a set-point beside it.

y is the angular acceleration about roll or pitch that the gyro measures, rad/s^2; u the command in the log, N per
motor. A source with transfers y_i and u_i, `noise_spectra.transfers`, has S_yu = strength_i y_i u_i*, and
S_uu = strength_i |u_i|^2. The part of y that is incoherent with u has the power S_yy - |S_yu|^2 / S_uu (noise output
spectrum: Bendat and Piersol, Random Data, 4th ed., section 6.2).
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d

from airtouch.gap.flights.flight import PERIOD_S
from airtouch.gap.loop.axis_plant import AxisPlant
from airtouch.gap.loop.controller import Controller
from airtouch.gap.loop.loop_model import LOWEST_HZ, LoopParts, butterworth, loop_parts
from airtouch.gap.loop.noise_spectra import FOLDS, aliases_of, difference, transfers, with_aliases
from airtouch.gap.loop.set_point_steps import NO_STEP, Step, step_transfers

KICKS = np.linspace(1.0, 0.0, 21)  #: shares that are tried of a step's first sample; spacing chosen
STEP_HZ = (1.5, 14.0)  #: frequencies at which they are fitted; chosen
GYRO_FOLDS = tuple(k for k in range(-5, 5) if k)  #: multiples of the log's 100 Hz below half of the IMU's 1 kHz


class Spectra(NamedTuple):
    """Spectra (..., bins) of angular acceleration y and logged command u: S_yu (complex), S_uu and S_yy."""

    cross: np.ndarray
    command: np.ndarray
    acceleration: np.ndarray

    def of_strengths(self, strengths: np.ndarray) -> "Spectra":
        """The sum over sources of given strengths (sources,), of spectra (sources, bins) of sources of unit power."""
        return Spectra(*(strengths @ x for x in self))

    def with_steps(self, power: float, command: np.ndarray, acceleration: np.ndarray) -> "Spectra":
        """The same with steps of a power beside it, whose transfers (bins,) are `step_transfers`; S_yy as it is."""
        return self._replace(cross=self.cross + power * acceleration * command.conj(),
                             command=self.command + power * np.abs(command) ** 2)

    def smoothed(self, width: float) -> "Spectra":
        """The same smoothed over neighbouring bins by a Gaussian of this standard deviation in bins; 0 leaves it."""
        return Spectra(*(gaussian_filter1d(x, width, axis=-1, mode="nearest") for x in self)) if width > 0.0 else self


class PerCommand(NamedTuple):
    """What a logged command tells of the angular acceleration.

    expected: rad/s^2 per N, complex (bins,), for each of several steps; incoherent (bins,): power that is incoherent
    with the command without a step, rad^2/s^4/Hz: the noise of the gyro, and what the loop does of noise between two
    rows of the log.
    """

    expected: list[np.ndarray]
    incoherent: np.ndarray


def acceleration_per_command(c: Controller, plant: AxisPlant, strengths: np.ndarray, f: np.ndarray, width: float,
                             steps: Sequence[Step]) -> PerCommand:
    """Angular acceleration that a logged command tells at frequencies f (bins,), Hz, in blocks with these steps.

    strengths (sources,): of the noise; width: as for `Spectra.smoothed`.
    """
    at = np.maximum(f, LOWEST_HZ)
    parts = loop_parts(c, plant, at)
    noise = source_spectra(c, plant, f, parts).of_strengths(strengths)
    by_step = {NO_STEP: noise}
    moving = [s for s in dict.fromkeys(steps) if s.power]
    for s, stepped in zip(moving, step_transfers(c, plant, at, parts, [s.kick for s in moving]), strict=True):
        by_step[s] = noise.with_steps(s.power, *stepped)
    together = Spectra(*(np.array(x) for x in zip(*by_step.values(), strict=True))).smoothed(width)
    ratios = dict(zip(by_step, together.cross / together.command, strict=True))
    level = Spectra(*(x[0] for x in together))
    return PerCommand([ratios[s if s.power else NO_STEP] for s in steps],
                      level.acceleration - np.abs(level.cross) ** 2 / level.command)


def source_spectra(c: Controller, plant: AxisPlant, f: np.ndarray, parts: LoopParts) -> Spectra:
    """Spectra (sources, bins) for noise of unit power. parts: of the loop at f, no lower than LOWEST_HZ."""
    logged, acceleration = transfers(c, plant, np.maximum(f, LOWEST_HZ), parts)
    cross, aliases = acceleration * logged.conj(), aliases_of(c, plant, f)
    power = np.abs(acceleration) ** 2
    if len(aliases):  # noise of the gyro folds into the log, and into the command alike
        sensed = _sensed(c.chip_hz, f.tobytes())
        for k in GYRO_FOLDS:
            power[0] += np.abs(sensed[k]) ** 2
        for k, alias in zip(FOLDS[1:], aliases, strict=True):
            cross[0] += sensed[k] * np.where(f + k / PERIOD_S < 0.0, alias, alias.conj())
    return Spectra(cross, with_aliases(np.abs(logged) ** 2, aliases), power)


@lru_cache(16)
def _sensed(chip_hz: float, frequencies: bytes) -> dict[int, np.ndarray]:
    """Angular acceleration (bins,) that the log shows at frequencies for noise k times the log's rate above, by k."""
    f, out = np.frombuffer(frequencies), {}
    for k in GYRO_FOLDS:
        folded_hz = f + k / PERIOD_S
        response = 1.0 / butterworth(2j * np.pi * np.abs(folded_hz), chip_hz)
        out[k] = difference(f) * np.where(folded_hz < 0.0, np.conj(response), response)
    return out


def fitted_step(c: Controller, plant: AxisPlant, strengths: np.ndarray, f: np.ndarray, over: np.ndarray,
                measured: np.ndarray) -> Step:
    """The steps that explain blocks of nominal flights best, by least squares over KICKS.

    strengths (sources,): of the noise; over (bins,): power of their commands over that of blocks without a step;
    measured (bins,): S_yu / S_uu, 0 where it is not known.
    """
    known = (measured != 0.0) & (f > STEP_HZ[0]) & (f < STEP_HZ[1])
    if not known.any():
        return NO_STEP
    at = np.maximum(f, LOWEST_HZ)
    parts = loop_parts(c, plant, at)
    noise = source_spectra(c, plant, f, parts).of_strengths(strengths)
    best, least = NO_STEP, np.inf
    for kick, stepped in zip(KICKS, step_transfers(c, plant, at, parts, KICKS), strict=True):
        power = float(np.median(((over - 1.0) * noise.command / np.abs(stepped[0]) ** 2)[known]))
        if power > 0.0:
            spectra = noise.with_steps(power, *stepped)
            ratio = spectra.cross / spectra.command
            misfit = float((np.abs(ratio[known] / measured[known] - 1.0) ** 2).sum())
            if misfit < least:
                best, least = Step(power, float(kick)), misfit
    return best
