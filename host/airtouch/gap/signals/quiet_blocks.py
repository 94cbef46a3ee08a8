"""Blocks of a flight in which no set-point stepped, told by the power of the modelled torque there.

A step kicks the command, so that the torque modelled from it is stronger than the noise of the other blocks.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from airtouch.gap.loop.command_spectra import VANISHING_POWER

QUIET_BINS = slice(2, 31)  #: bins of 0.8 to 12 Hz, in which a step of the set-point shows; chosen
#: a set-point stepped where the modelled torque has more than this multiple of the power of the calm blocks of its
#: flight, which nominal flights give (`are_quiet`); chosen
STEPPED_TORQUE = 2.0
#: fraction of a flight's blocks, the quietest ones and one at least, that are taken to hold no step; chosen, small, as
#: most blocks of a short flight over an edge hold one
CALM = 0.1
MOST_ROUNDS = 4  #: of the search for quiet blocks; chosen


class QuietPower(NamedTuple):
    """Power of the modelled torque in those blocks of nominal flights that hold no step.

    mean (bins, 3): its mean, (rad/s^2)^2/Hz; calm (3,): power in QUIET_BINS, as a multiple of that mean, of a
    flight's calm blocks (`_calm_power`): the median of the flights.
    """

    mean: np.ndarray
    calm: np.ndarray


def estimate_quiet_power(modelled: Sequence[np.ndarray], power: np.ndarray) -> tuple[QuietPower, np.ndarray]:
    """The power of quiet blocks in nominal flights, and which of all their blocks are quiet, bool (blocks, 3).

    modelled: torque (blocks, bins, 3) of each flight; power (blocks, bins, 3): of all blocks. In turn the power is
    measured on quiet blocks, and blocks are quiet that are not much stronger, until the same ones are quiet twice, for
    MOST_ROUNDS at most. The fourth round changes at most 6 % of the entries (with CALM a quarter: host/docs/looks.md,
    2026-11-26 07:29). Where flights differ so much that an axis has no quiet block, there is no power to measure, and
    the search ends.
    """
    quiet = np.ones((len(power), 3), bool)
    for _ in range(MOST_ROUNDS):
        before = quiet
        median = np.nanmedian(np.where(quiet[:, None], power, np.nan), axis=0)
        mean = median / np.log(2.0)  # of an exponential law
        calm = np.median([_calm_power(_over(mean, m)) for m in modelled if len(m)], axis=0)
        nominal = QuietPower(mean, calm)
        quiet = np.concatenate([are_quiet(m, nominal) for m in modelled])
        if np.array_equal(quiet, before) or not quiet.any(axis=0).all():
            break
    return nominal, quiet


def are_quiet(modelled: np.ndarray, nominal: QuietPower) -> np.ndarray:
    """Whether no set-point stepped, bool (blocks, 3), from the modelled torque (blocks, bins, 3) of a flight.

    The limit goes with the flight's own calm blocks: a lower gain makes both the noise and the steps weaker, so that a
    limit fixed by nominal flights would take steps for noise.
    """
    if not len(modelled):
        return np.zeros((0, 3), bool)
    power = _over(nominal.mean, modelled)
    return power < STEPPED_TORQUE * _calm_power(power) / nominal.calm


def _over(mean: np.ndarray, modelled: np.ndarray) -> np.ndarray:
    """Power (blocks, 3) of the modelled torque (blocks, bins, 3) over the mean one (bins, 3), in QUIET_BINS."""
    return (np.abs(modelled) ** 2 / np.maximum(mean, VANISHING_POWER))[:, QUIET_BINS].mean(axis=1)


def _calm_power(power: np.ndarray) -> np.ndarray:
    """Power (3,) that the quietest blocks of a flight (CALM of them) do not exceed. power: (blocks, 3), not empty."""
    return np.quantile(power, CALM, axis=0, method="lower")
