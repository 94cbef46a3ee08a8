"""Free powers of the residual in every view, channel and band, fitted to one half of the data, judged on the other."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from airtouch.gap.evidence.cells import CELLS, above_means, band_cells, channel_cells, sensor_cells
from airtouch.gap.nameless.columns import LEAST_VARIANCE, NamelessFloor
from airtouch.gap.signals.spectra import OVERLAP_WEIGHT

#: nominal flights that the scatter pooled over a band's channels counts for, beside a channel's own flights; chosen. A
#: larger number draws the scatter of each channel nearer to that of its band
POOLED_WEIGHT = 2.0
#: least standard deviation of log power between flights, simulated and recorded, as no effect's spectrum, and no
#: recorded flight's air, is modelled any better; chosen. A larger number counts more of a change as nominal
LEAST_SCATTER, RECORDED_SCATTER = 0.05, 0.1
#: nats that a column, or a cell's power, must gain on the half that it is fitted to; chosen, chance gives about one. A
#: larger number leaves more to chance, and finds less of what is missing
LEAST_COLUMN_GAIN = 4.0
UPDATES = 8  #: Newton steps towards the power of highest posterior; chosen. A larger number takes more time
#: longest of these steps, of the natural logarithm of the power; chosen. A larger number needs fewer steps, and one may
#: overshoot
LONGEST_STEP = 1.5
NODES = 64  #: of Gauss-Laguerre quadrature: more change the moments of a score by less than 1e-8
SENSOR = sensor_cells()[channel_cells()]  #: (CELLS,) for each cell the number of the first cell of its view and sensor
ABOVE_MEANS = above_means()  #: (CELLS,) bool
NO_PRIOR = (np.zeros(CELLS), np.full(CELLS, 1e3))  #: mean and standard deviation of a prior that says nothing


class Powers(NamedTuple):
    """Power of each value (n,) of a residual over the expected one.

    over_expected: that ratio; freedom, tail_scale: of its law (`evidence.likelihood.Likelihood`); cell: number of its
    cell.
    """

    over_expected: np.ndarray
    freedom: np.ndarray
    tail_scale: np.ndarray
    cell: np.ndarray


def score_moments(freedom: np.ndarray, tail_scale: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Moments (n,) of the score psi of a value's log power: minus its expected slope, and the mean of its square.

    psi = (nu + 1) e / (a + e) - 1, with nu degrees of freedom and the tail's scale a, where the power e over the
    expected one is exponential, as that of a complex normal value. Both moments are 1 where nu and a are large. A sum
    of psi that is 0 gives the log power with the variance E[psi^2] / (n E[psi']^2) (White 1982, Maximum likelihood
    estimation of misspecified models, Econometrica 50, 1): at 12 degrees of freedom 1.02 / n, at 2 it is 1.21 / n.
    """
    laws, inverse = np.unique(freedom + 1j * tail_scale, return_inverse=True)  # pairs, as numbers that sort fast
    nu, scale = laws.real[:, None], laws.imag[:, None]
    e, weight = np.polynomial.laguerre.laggauss(NODES)  # of integrals over an exponential e
    slope = ((nu + 1.0) * scale * e / (scale + e) ** 2) @ weight
    square = (((nu + 1.0) * e / (scale + e) - 1.0) ** 2) @ weight
    return slope[inverse], square[inverse]


def gain_at_even_odds(gain: np.ndarray | float) -> np.ndarray:
    """Nats gained by what gains `gain` where it is there, and is there with probability one half.

    log((1 + exp(gain)) / 2), at least -log 2.
    """
    return np.logaddexp(gain, 0.0) - np.log(2.0)


def power_factors(powers: Powers, prior_mean: np.ndarray, prior_std: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Logarithm (CELLS,) of the factor on the power of highest posterior, and the posterior's logarithm (CELLS,).

    prior_mean, prior_std (CELLS,): of the normal prior of the logarithm. A cell without values has its prior's mean.
    """
    e, nu, tail_scale, cell = powers
    out = prior_mean.copy()
    count = np.bincount(cell, minlength=CELLS)
    precision = 1.0 / np.maximum(prior_std ** 2, LEAST_VARIANCE)
    known = np.bincount(cell, score_moments(nu, tail_scale)[0], CELLS)
    for _ in range(UPDATES):
        scaled = e * np.exp(-out[cell])
        push = np.bincount(cell, OVERLAP_WEIGHT * ((nu + 1.0) * scaled / (tail_scale + scaled) - 1.0), CELLS)
        step = (push - (out - prior_mean) * precision) / (OVERLAP_WEIGHT * known + precision)
        out += np.clip(step, -LONGEST_STEP, LONGEST_STEP)
    out[count == 0] = prior_mean[count == 0]
    scaled = e * np.exp(-out[cell])
    log_posterior = np.bincount(cell, -OVERLAP_WEIGHT * (out[cell] + (nu + 1.0) * np.log1p(scaled / tail_scale)), CELLS)
    return out, log_posterior - 0.5 * (out - prior_mean) ** 2 * precision


def power_gain(trained: Powers, held_out: Powers, floor: NamelessFloor, simulated: bool) -> float:
    """Log likelihood that free powers, fitted to the trained half, gain on the one held out.

    They are those of every cell, or of all the bands of a sensor together, where slightly stronger noise shows. In
    recorded flights, whose noise differs from day to day, cells alone count, and only those with more power.
    """
    nominal, scatter = floor.power
    scatter = scatter if simulated else np.maximum(scatter, RECORDED_SCATTER)
    before = tuple(power_factors(half, nominal, scatter)[1] for half in (trained, held_out))

    def gain(factors: np.ndarray, trained_std: np.ndarray, pool: np.ndarray) -> float:
        """Nats that these factors gain on the half held out.

        trained_std (CELLS,): of their prior on the trained half; pool (CELLS,): cells with one number gain together.
        """
        after = (power_factors(trained, factors, trained_std)[1], power_factors(held_out, factors, scatter)[1])
        gains = [np.bincount(pool, x - y, CELLS) for x, y in zip(after, before, strict=True)]
        return float(gain_at_even_odds(gains[1][_above_chance(gains[0], factors > nominal, pool, simulated)]).sum())

    of_cells = gain(power_factors(trained, nominal, NO_PRIOR[1])[0], NO_PRIOR[1], np.arange(CELLS))
    return max(of_cells, gain(_of_sensors(trained, nominal), scatter, SENSOR)) if simulated else of_cells


def _above_chance(gained: np.ndarray, stronger: np.ndarray, pool: np.ndarray, simulated: bool) -> np.ndarray:
    """Mask (CELLS,) of the pools that gain more than LEAST_COLUMN_GAIN on the half that they are fitted to.

    gained (CELLS,): nats, by pool; stronger (CELLS,): cells with more power than nominal flights have. In simulated
    flights less power counts as well, above the band of the means.
    """
    counts = stronger | ABOVE_MEANS if simulated else stronger
    return (gained > LEAST_COLUMN_GAIN) & (np.bincount(pool, counts, CELLS) > 0)


def _of_sensors(powers: Powers, nominal: np.ndarray) -> np.ndarray:
    """Logarithm (CELLS,) of the factors where all bands of a sensor above that of the means share one.

    nominal (CELLS,): that of nominal flights, from which the shared factor counts.
    """
    e, nu, tail_scale, cell = powers
    use = ABOVE_MEANS[cell]
    relative = Powers((e * np.exp(-nominal[cell]))[use], nu[use], tail_scale[use], SENSOR[cell][use])
    common, _ = power_factors(relative, *NO_PRIOR)
    return nominal + np.where(ABOVE_MEANS, common[SENSOR], 0.0)


def power_floor(flights: Sequence[Powers]) -> np.ndarray:
    """Mean and rms (2, CELLS) of log power in nominal flights, two or more, the rms beyond what chance alone gives."""
    log_power, chance = np.zeros((len(flights), CELLS)), np.full((len(flights), CELLS), np.nan)
    for i, powers in enumerate(flights):
        log_power[i] = power_factors(powers, *NO_PRIOR)[0]
        slope, square = (np.bincount(powers.cell, OVERLAP_WEIGHT * moment, CELLS)
                         for moment in score_moments(powers.freedom, powers.tail_scale))
        chance[i, slope > 0.0] = square[slope > 0.0] / slope[slope > 0.0] ** 2
    known = np.isfinite(chance)
    count = np.maximum(known.sum(axis=0), 1)
    mean = np.where(known, log_power, 0.0).sum(axis=0) / count
    in_deviations = (1.0 - 1.0 / count) * chance  # the mean of the same flights takes up the rest
    squares = np.where(known, (log_power - mean) ** 2 - in_deviations, 0.0).sum(axis=0)
    pooled = np.maximum(_of_band(squares) / np.maximum(_of_band(count - 1.0), 1.0), LEAST_SCATTER ** 2)
    own = (np.maximum(squares, 0.0) + POOLED_WEIGHT * pooled) / (count - 1 + POOLED_WEIGHT)
    return np.stack([mean, np.sqrt(own * (1.0 + 1.0 / count))])


def _of_band(values: np.ndarray) -> np.ndarray:
    """For each cell the sum of values (CELLS,) over the channels of its view and band."""
    band = band_cells()
    return np.bincount(band, values, CELLS)[band]
