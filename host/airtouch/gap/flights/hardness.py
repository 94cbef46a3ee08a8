"""Like with like: a floor that rises with how hard the vehicle is flown.

What a model leaves of a nominal flight grows with the manoeuvres: motors that are late or
saturated, air that flows through the rotors. A block's hardness is the logarithm of how much
its tilt varies. The power of the gap in a channel and band (`blocks.BANDS_HZ`) goes with a power of that,
E[power] = exp(a + slope * hardness), found by gamma regression over the blocks of nominal
flights (McCullagh and Nelder, Generalized Linear Models, 2nd ed., chapter 8).
"""

from dataclasses import dataclass

import numpy as np

from airtouch.gap.flights.blocks import BANDS_HZ
from airtouch.gap.flights.flight import Flight

STILL_RAD = np.radians(1.0)  #: variation of tilt below which a vehicle is not flown calmer; chosen
#: mean and standard deviation of slopes before any flight; both chosen: half way between 0, of errors that do not go
#: with what is flown, and 2, of errors that are a share of it, whose power goes with its square
PRIOR = (1.0, 1.0)
STEEPEST = 3.0  #: largest slope; chosen
#: hardness below the calmest and over the hardest nominal block, to which the slopes are trusted; chosen
CALMER, HARDER = 0.5, 1.5
LEAST_BLOCKS = 4  #: blocks of nominal flights from which a slope is fitted; chosen
LEAST_DISPERSION = 1e-3  #: variance over the squared mean that powers have at least; chosen
NEWTON_STEPS = 8  #: of the gamma regression; chosen
LARGEST_STEP = 1.0  #: of the regression, in log power and in slope; chosen


@dataclass(frozen=True)
class Slopes:
    """How the power of the gap rises with hardness, and the nominal range of hardness.

    slope (bins, COUNT): of log power against hardness; nominal flights lie between calmest and hardest, about
    mean.
    """

    slope: np.ndarray
    calmest: float
    mean: float
    hardest: float

    def relative_power(self, hardness: np.ndarray) -> np.ndarray:
        """Power (blocks, bins, COUNT) relative to that at the mean hardness of nominal flights.

        A flight calmer or harder than every nominal one has a floor as far beyond theirs as the slopes are trusted.
        """
        x = np.clip(hardness, self.calmest - CALMER, self.hardest + HARDER)
        return np.exp((x - self.mean)[:, None, None] * self.slope)


def hardness_of(flight: Flight, first: np.ndarray, length: int) -> np.ndarray:
    """Logarithm (blocks,) of the standard deviation of tilt, over STILL_RAD, in blocks of `length` samples."""
    if not len(first):
        return np.zeros(0)
    tilt = flight.body_to_world[:, 2, :2]  # the vertical in body axes: sines of pitch and roll
    cut = tilt[first[:, None] + np.arange(length)]
    return 0.5 * np.log1p(cut.var(axis=1).sum(axis=1) / STILL_RAD ** 2)


def tilt_degrees(hardness: float) -> float:
    """Standard deviation of tilt, degrees, of a block of this hardness; undoes `hardness_of`."""
    return float(np.degrees(STILL_RAD * np.sqrt(np.expm1(2.0 * max(hardness, 0.0)))))


def slopes_of(power: np.ndarray, hardness: np.ndarray, frequency: np.ndarray,
              flat: np.ndarray | bool = False) -> Slopes:
    """Slopes from the power (blocks, bins, COUNT) of nominal flights' residuals; NaN where it is not known.

    flat (bins, COUNT): where power does not go with hardness, whatever these flights say.
    """
    slope = np.zeros(power.shape[1:])
    if len(power) < LEAST_BLOCKS:
        return Slopes(slope, 0.0, 0.0, 0.0)
    band = np.digitize(frequency, BANDS_HZ) - 1
    for c in range(power.shape[2]):
        for b in np.unique(band):
            here = power[:, band == b, c]
            known = np.isfinite(here).any(axis=1) & (np.nan_to_num(here).sum(axis=1) > 0.0)
            if known.sum() >= LEAST_BLOCKS:
                slope[band == b, c] = _slope(np.nanmean(here[known], axis=1), hardness[known])
    return Slopes(np.where(flat, 0.0, slope), float(hardness.min()), float(hardness.mean()), float(hardness.max()))


def _slope(y: np.ndarray, x: np.ndarray) -> float:
    """Slope of log mean against x of gamma distributed y (n,), of highest posterior under PRIOR."""
    table = np.stack([np.ones(len(x)), x - x.mean()], axis=1)
    mean, spread = PRIOR
    start = np.array([np.log(y.mean()), 0.0])
    line = start.copy()  # level and slope
    for _ in range(NEWTON_STEPS):
        ratio = y / np.exp(table @ line)
        dispersion = max(float(((ratio - 1.0) ** 2).sum()) / (len(y) - 2), LEAST_DISPERSION)
        information = table.T @ table / dispersion + np.diag([0.0, 1.0 / spread ** 2])
        push = table.T @ (ratio - 1.0) / dispersion - np.array([0.0, (line[1] - mean) / spread ** 2])
        step = np.linalg.solve(information, push)
        line = line + np.clip(step, -LARGEST_STEP, LARGEST_STEP)
    return float(np.clip(line[1], 0.0, STEEPEST))
