"""Free powers of the residual in every view, channel and band, fitted to one half of the data, judged on the other."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from airtouch.gap.evidence.cells import CELLS, above_means, band_cells, channel_cells, sensor_cells
from airtouch.gap.nameless.columns import NOTHING, NamelessFloor
from airtouch.gap.signals.spectra import OVERLAP_WEIGHT

BELIEF = 2.0  #: nominal flights that the scatter of all channels together counts as in the band of one; chosen
#: Least standard deviation of the logarithm of power between flights, simulated and recorded: no effect's spectrum, and
#: no recorded flight's air, is modelled any better. Chosen.
LEAST_SCATTER, RECORDED_SCATTER = 0.05, 0.1
CHANCE = 4.0  #: nats that a band must gain on the half that it is fitted to; chosen, chance gives about one
UPDATES = 8  #: Newton steps towards the power of highest posterior; chosen
LONGEST = 1.5  #: nepers, the longest of these steps; chosen
SENSOR = sensor_cells()[channel_cells()]  #: (CELLS,) number of each cell's view and sensor, all bands together
ABOVE_MEANS = above_means()
NO_PRIOR = (np.zeros(CELLS), np.full(CELLS, 1e3))  #: mean and scatter (nepers) of a prior that says nothing


class Powers(NamedTuple):
    """Residuals of a part of the flights, value by value (n,).

    over_expected: power over the expected power; freedom, tail_scale: of the law (`evidence.likelihood.Likelihood`);
    cell: number of the cell.
    """

    over_expected: np.ndarray
    freedom: np.ndarray
    tail_scale: np.ndarray
    cell: np.ndarray


def information(freedom: np.ndarray) -> np.ndarray:
    """Fisher information of the log variance that a value under Student's law holds, over that under a normal law.

    nu / (nu + 3), with nu degrees of freedom (n,), is that of a real value (Lange, Little and Taylor 1989, Robust
    statistical modeling using the t distribution, J. Am. Stat. Assoc. 84, 881). A complex value whose density falls
    with the power nu + 1 holds nu / (nu + 2), at 12 degrees of freedom 7 % more.
    """
    return freedom / (freedom + 3.0)


def gain_at_even_odds(gain: np.ndarray | float) -> np.ndarray:
    """Log likelihood gained by something that is there with probability one half."""
    return np.logaddexp(gain, 0.0) - np.log(2.0)


def power_factors(powers: Powers, middle: np.ndarray, spread: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Logarithm (CELLS,) of the power's factor of highest posterior, and the log posterior (CELLS,) there.

    middle, spread (CELLS,): of the normal prior of the logarithm. In a cell without values the factor is the prior's.
    """
    e, nu, tail_scale, cell = powers
    out = middle.copy()
    count = np.bincount(cell, minlength=CELLS)
    precision = 1.0 / np.maximum(spread ** 2, NOTHING)
    known = np.bincount(cell, information(nu), CELLS)
    for _ in range(UPDATES):
        scaled = e * np.exp(-out[cell])
        push = np.bincount(cell, OVERLAP_WEIGHT * ((nu + 1.0) * scaled / (tail_scale + scaled) - 1.0), CELLS)
        out += np.clip((push - (out - middle) * precision) / (OVERLAP_WEIGHT * known + precision), -LONGEST, LONGEST)
    out[count == 0] = middle[count == 0]
    scaled = e * np.exp(-out[cell])
    level = np.bincount(cell, -OVERLAP_WEIGHT * (out[cell] + (nu + 1.0) * np.log1p(scaled / tail_scale)), CELLS)
    return out, level - 0.5 * (out - middle) ** 2 * precision


def power_gain(trained: Powers, held_out: Powers, floor: NamelessFloor, simulated: bool) -> float:
    """Log likelihood that free powers, fitted to the trained half, gain on the one held out.

    They are those of every cell, or of all the bands of a sensor together, where slightly stronger noise shows. In
    recorded flights, whose noise differs from day to day, cells alone count, and only those with more power.
    """
    middle, spread = floor.power
    spread = spread if simulated else np.maximum(spread, RECORDED_SCATTER)
    before = tuple(power_factors(half, middle, spread)[1] for half in (trained, held_out))

    def gain(factors: np.ndarray, trained_spread: np.ndarray, pool: np.ndarray) -> float:
        """What these factors gain on the half held out; pool (CELLS,): cells that are judged together."""
        after = (power_factors(trained, factors, trained_spread)[1], power_factors(held_out, factors, spread)[1])
        gains = [np.bincount(pool, x - y, CELLS) for x, y in zip(after, before, strict=True)]
        return float(gain_at_even_odds(gains[1][_above_chance(gains[0], factors > middle, pool, simulated)]).sum())

    of_cells = gain(power_factors(trained, middle, NO_PRIOR[1])[0], NO_PRIOR[1], np.arange(CELLS))
    return max(of_cells, gain(_of_sensors(trained, middle), spread, SENSOR)) if simulated else of_cells


def _above_chance(gained: np.ndarray, stronger: np.ndarray, pool: np.ndarray, simulated: bool) -> np.ndarray:
    """Mask (CELLS,) of the pools that gain more than CHANCE on the half that they are fitted to.

    gained (CELLS,): nats, by pool; stronger (CELLS,): cells with more power than nominal flights have. In simulated
    flights less power counts as well, above the band of the means.
    """
    counts = stronger | ABOVE_MEANS if simulated else stronger
    return (gained > CHANCE) & (np.bincount(pool, counts, CELLS) > 0)


def _of_sensors(powers: Powers, middle: np.ndarray) -> np.ndarray:
    """Logarithm (CELLS,) of the powers' factors where all bands of a sensor but that of the means share one."""
    e, nu, tail_scale, cell = powers
    use = ABOVE_MEANS[cell]
    relative = Powers((e * np.exp(-middle[cell]))[use], nu[use], tail_scale[use], SENSOR[cell][use])
    common, _ = power_factors(relative, *NO_PRIOR)
    return middle + np.where(ABOVE_MEANS, common[SENSOR], 0.0)


def power_floor(flights: Sequence[Powers]) -> np.ndarray:
    """Log power's mean and rms (2, CELLS) in nominal flights, two or more, beyond what chance alone gives."""
    log_power, chance = np.zeros((len(flights), CELLS)), np.full((len(flights), CELLS), np.nan)
    for i, powers in enumerate(flights):
        log_power[i] = power_factors(powers, *NO_PRIOR)[0]
        own = np.bincount(powers.cell, OVERLAP_WEIGHT * information(powers.freedom), CELLS)
        chance[i, own > 0.0] = 1.0 / own[own > 0.0]
    known = np.isfinite(chance)
    count = np.maximum(known.sum(axis=0), 1)
    middle = np.where(known, log_power, 0.0).sum(axis=0) / count
    squares = np.where(known, (log_power - middle) ** 2 - chance, 0.0).sum(axis=0)
    pooled = np.maximum(_of_band(squares) / np.maximum(_of_band(count - 1.0), 1.0), LEAST_SCATTER ** 2)
    own = (np.maximum(squares, 0.0) + BELIEF * pooled) / (count - 1 + BELIEF)
    return np.stack([middle, np.sqrt(own * (1.0 + 1.0 / count))])


def _of_band(values: np.ndarray) -> np.ndarray:
    """For each cell the sum of values (CELLS,) over the channels of its view and band."""
    band = band_cells()
    return np.bincount(band, values, CELLS)[band]
