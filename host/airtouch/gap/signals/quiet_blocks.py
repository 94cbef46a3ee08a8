"""Blocks of a flight in which no set-point stepped, told by the power of the modelled torque there."""

from collections.abc import Sequence

import numpy as np

from airtouch.gap.loop.command_spectra import TINY

QUIET_BINS = slice(2, 31)  #: 0.8 to 12 Hz, in which a step of the set-point shows; chosen
#: power of the modelled torque over the nominal one, scaled to the flight (`are_quiet`), from which a set-point
#: stepped; chosen
STEPPED_TORQUE = 2.0
CALM = 0.25  #: fraction of a flight's blocks that hold no step; chosen
ROUNDS = 4  #: iterations of the search for quiet blocks; the last two agree


def of_nominal_flights(modelled: Sequence[np.ndarray], power: np.ndarray,
                       ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """`Response.nominal` (not smoothed), `Response.calm`, and the blocks without a step, bool (blocks, 3).

    modelled: torque (blocks, bins, 3) of each flight; power (blocks, bins, 3): of all blocks. In turn the nominal power
    is that of blocks without a step, and a step is what is stronger.
    """
    quiet = np.ones((len(power), 3), bool)
    for _ in range(ROUNDS):
        nominal = np.nanmedian(np.where(quiet[:, None], power, np.nan), axis=0) / np.log(2.0)  # mean of an exponential
        calm = np.median([np.quantile(_powers(m, nominal), CALM, axis=0) for m in modelled if len(m)], axis=0)
        quiet = np.concatenate([are_quiet(m, nominal, calm) for m in modelled])
    return nominal, calm, quiet


def are_quiet(modelled: np.ndarray, nominal: np.ndarray, calm: np.ndarray) -> np.ndarray:
    """Blocks without a step, bool (blocks, 3): their modelled torque is about as strong as in the quietest quarter.

    In nominal flights that quarter of a flight's blocks has a share calm (3,) of the nominal power. A lower gain makes
    both the noise and the steps weaker, so that a limit fixed by nominal flights would take steps for noise.
    """
    power = _powers(modelled, nominal)
    return power < STEPPED_TORQUE * np.quantile(power, CALM, axis=0) / calm if len(power) else np.zeros((0, 3), bool)


def _powers(modelled: np.ndarray, nominal: np.ndarray) -> np.ndarray:
    """Power (blocks, 3) of the modelled torque (blocks, bins, 3) over the nominal one, where a step shows."""
    return (np.abs(modelled) ** 2 / np.maximum(nominal, TINY))[:, QUIET_BINS].mean(axis=1)
