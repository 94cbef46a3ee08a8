"""What the floor of the commands is off by in one flight, under a hypothesis.

The floor may be wrong (few nominal flights, other air on other days). Its logarithm is off by a few smooth shapes
(SHAPES, bins), each with a normal prior, whose amounts (SHAPES, AXES) are fitted anew for every flight. They are
integrated out by Laplace's method (MacKay, Information Theory, Inference, and Learning Algorithms, 2003, chapter 27);
the cost of a correction is what that takes from the likelihood at its best amounts.
"""

from functools import cache
from typing import NamedTuple

import numpy as np

from airtouch.gap.loop.command_spectra import command_frequencies, log_likelihood_slope
from airtouch.gap.loop.controller import AXES
from airtouch.gap.signals.spectra import OVERLAP_WEIGHT

SHAPES = 5  #: smooth shapes by which the floor's logarithm may differ from flight to flight; chosen
#: nepers of power, standard deviation of the amount of the first shape, of each other; chosen, not measured. Larger
#: ones leave less evidence in the commands, as the floor takes up more of what effects make; with smaller ones a floor
#: of few nominal flights, or other air, looks like an effect
SPREAD = (0.10, 0.04)
NEWTON_STEPS = 4  #: Newton steps to the correction; chosen
#: factor on SPREAD where random effects shake the loop in ways that no log holds; chosen, not measured. With a larger
#: one commands say less of any effect beside a random one, with a smaller one what shakes the loop looks like an effect
UNCERTAIN_FACTOR = 6.0
#: error of the loop model, as a share of the logarithm of `ClosedLoop.ratio` (rms over bins and axes); chosen, not
#: measured. The floor of a hypothesis is as much less certain: with a larger error the commands speak less for and
#: against strong effects, with a smaller one errors of the loop model speak against right ones
COMMAND_DOUBT = 0.1


class Correction(NamedTuple):
    """What the floor is off by in one flight, under a hypothesis.

    power (bins, AXES): expected in the flight, floor x ratio x correction; log_power (bins, AXES): logarithm of the
    correction; cost: nats; weight: of all blocks together, OVERLAP_WEIGHT each; covariance (SHAPES, SHAPES): of the
    amounts of the shapes, the same for every axis.
    """

    power: np.ndarray
    log_power: np.ndarray
    cost: float
    weight: float
    covariance: np.ndarray


def correction_of(power: np.ndarray, floor: np.ndarray, ratio: np.ndarray, uncertain_floor: bool) -> Correction:
    """The floor's likeliest correction for the power (blocks, bins, AXES) of a flight, by Newton's method.

    floor (bins, AXES): power of nominal flights; ratio (bins, AXES): what the hypothesis multiplies it by;
    uncertain_floor: it is as uncertain as random effects make it (UNCERTAIN_FACTOR). The information is that of
    exponential laws: 1 for each bin of a block, times the block's weight.
    """
    over_floor, shapes = power / (floor * ratio), smooth_shapes()
    spread = np.array([SPREAD[0]] + [SPREAD[1]] * (SHAPES - 1)) * (UNCERTAIN_FACTOR if uncertain_floor else 1.0)
    spread = np.hypot(spread, COMMAND_DOUBT * np.sqrt(np.mean(np.log(ratio) ** 2)))
    weight = OVERLAP_WEIGHT * len(power)
    normal = weight * shapes @ shapes.T + np.diag(1.0 / spread ** 2)
    covariance = np.linalg.inv(normal)
    amount = np.zeros((SHAPES, len(AXES)))
    for _ in range(NEWTON_STEPS):
        slope = OVERLAP_WEIGHT * log_likelihood_slope(over_floor, np.exp(-shapes.T @ amount))
        amount += covariance @ (shapes @ slope - amount / spread[:, None] ** 2)
    cost = 0.5 * float(((amount / spread[:, None]) ** 2).sum())
    cost += 0.5 * len(AXES) * float(np.linalg.slogdet(normal)[1] + 2.0 * np.log(spread).sum())
    log_power = shapes.T @ amount
    return Correction(floor * ratio * np.exp(log_power), log_power, cost, weight, covariance)


@cache
def smooth_shapes() -> np.ndarray:
    """Smooth shapes (SHAPES, bins) over the logarithm of frequency: level, slope, slow waves. Not to be changed."""
    x = np.log(command_frequencies())
    x = (x - x[0]) / (x[-1] - x[0])
    return np.array([np.cos(np.pi * k * x) for k in range(SHAPES)])
