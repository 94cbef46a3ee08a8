"""Free powers of the residual in every view, channel and band, fitted to one half of the data, judged on the other."""

from collections.abc import Sequence

import numpy as np

from airtouch.gap.evidence.cells import GROUPS
from airtouch.gap.signals.channels import COUNT
from airtouch.gap.signals.spectra import OVERLAP_WEIGHT
from airtouch.gap.unnamed.columns import NOTHING, UnnamedFloor

BELIEF = 2.0  #: nominal flights that the scatter of all channels together counts as in the band of one; chosen
#: Least standard deviation of the logarithm of power between flights, simulated and recorded: no effect's spectrum, and
#: no recorded flight's air, is modelled any better. Chosen.
LEAST_SCATTER, RECORDED_SCATTER = 0.05, 0.1
CHANCE = 4.0  #: nats that a band must gain on the half that it is fitted to; chosen, chance gives about one
UPDATES, LONGEST = 8, 1.5  #: Newton steps towards the power of highest posterior, and the longest of them, nepers
#: for each group the first of its view and sensor: force, torque, rate; commands, one axis each
SENSOR = np.arange(GROUPS) // 1000 * 1000 + np.arange(GROUPS) % 1000 % COUNT // 3 * 3
ABOVE_MEANS = np.arange(GROUPS) % 1000 >= COUNT  #: groups above the lowest band
LOOSE = (np.zeros(GROUPS), np.full(GROUPS, 1e3))  #: mean and scatter of powers of which nothing is believed

Powers = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]  #: see `regression.HalfResiduals.powers`


def gain_at_even_odds(gain: np.ndarray | float) -> np.ndarray:
    """Log likelihood gained by something that is there with probability one half."""
    return np.logaddexp(gain, 0.0) - np.log(2.0)


def power_factors(e: np.ndarray, nu: np.ndarray, tail: np.ndarray, groups: np.ndarray, middle: np.ndarray,
                  spread: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Logarithm (GROUPS,) of the power's factor of highest posterior, and the log posterior (GROUPS,) there.

    e, nu, tail, groups (n,): see `regression.HalfResiduals.powers`. middle, spread (GROUPS,): of the normal prior of
    the logarithm. In a group without values it is the prior's.
    """
    out = middle.copy()
    count = np.bincount(groups, minlength=GROUPS)
    precision = 1.0 / np.maximum(spread ** 2, NOTHING)
    information = np.bincount(groups, nu / (nu + 3.0), GROUPS)
    for _ in range(UPDATES):
        scaled = e * np.exp(-out[groups])
        push = np.bincount(groups, OVERLAP_WEIGHT * ((nu + 1.0) * scaled / (tail + scaled) - 1.0), GROUPS)
        out += np.clip((push - (out - middle) * precision) / (OVERLAP_WEIGHT * information + precision),
                       -LONGEST, LONGEST)
    out[count == 0] = middle[count == 0]
    scaled = e * np.exp(-out[groups])
    level = np.bincount(groups, -OVERLAP_WEIGHT * (out[groups] + (nu + 1.0) * np.log1p(scaled / tail)), GROUPS)
    return out, level - 0.5 * (out - middle) ** 2 * precision


def power_gain(one: Powers, two: Powers, floor: UnnamedFloor, simulated: bool) -> float:
    """Log likelihood that free powers, fitted to one half, gain on the other (`two`).

    They are those of every cell, or of all the bands of a sensor together, where slightly stronger noise shows.
    """
    middle, spread = floor.power
    spread = spread if simulated else np.maximum(spread, RECORDED_SCATTER)
    judged = ABOVE_MEANS if simulated else np.zeros(GROUPS, bool)  # with less power than usual as well
    trained_before, before = (power_factors(*half, middle, spread)[1] for half in (one, two))
    pools = [(power_factors(*one, middle, LOOSE[1])[0], np.arange(GROUPS))]
    if simulated:  # recorded flights' noise differs from day to day
        pools.append((_of_sensors(one, middle), SENSOR))
    gains = []
    for factors, pool in pools:
        free = spread if pool is SENSOR else LOOSE[1]
        trained, gained = (np.bincount(pool, x, GROUPS) for x in (
            power_factors(*one, factors, free)[1] - trained_before, power_factors(*two, factors, spread)[1] - before))
        above_chance = (trained > CHANCE) & (np.bincount(pool, (factors > middle) | judged, GROUPS) > 0)
        gains.append(float(gain_at_even_odds(gained[above_chance]).sum()))
    return max(gains)


def _of_sensors(powers: Powers, middle: np.ndarray) -> np.ndarray:
    """Logarithm (GROUPS,) of the powers' factors where all bands of a sensor but that of the means share one."""
    e, nu, tail, groups = powers
    above_means = ABOVE_MEANS[groups]
    relative = (e * np.exp(-middle[groups]))[above_means]
    common, _ = power_factors(relative, nu[above_means], tail[above_means], SENSOR[groups][above_means], *LOOSE)
    return middle + np.where(ABOVE_MEANS, common[SENSOR], 0.0)


def power_floor(flights: Sequence[Powers]) -> np.ndarray:
    """Log power's mean and rms (2, GROUPS) in nominal flights, two or more, beyond what chance alone gives."""
    log_power, chance = np.zeros((len(flights), GROUPS)), np.full((len(flights), GROUPS), np.nan)
    for i, (e, nu, tail, groups) in enumerate(flights):
        log_power[i] = power_factors(e, nu, tail, groups, *LOOSE)[0]
        count = np.bincount(groups, OVERLAP_WEIGHT * nu / (nu + 3.0), GROUPS)
        chance[i, count > 0.0] = 1.0 / count[count > 0.0]
    known = np.isfinite(chance)
    count = np.maximum(known.sum(axis=0), 1)
    middle = np.where(known, log_power, 0.0).sum(axis=0) / count
    squares = np.where(known, (log_power - middle) ** 2 - chance, 0.0).sum(axis=0)
    pooled = np.maximum(_of_band(squares) / np.maximum(_of_band(count - 1.0), 1.0), LEAST_SCATTER ** 2)
    own = (np.maximum(squares, 0.0) + BELIEF * pooled) / (count - 1 + BELIEF)
    return np.stack([middle, np.sqrt(own * (1.0 + 1.0 / count))])


def _of_band(values: np.ndarray) -> np.ndarray:
    """For each group the sum of values (GROUPS,) over the channels of its view and band."""
    cell = np.arange(GROUPS)
    band = cell - cell % 1000 % COUNT
    return np.bincount(band, values, GROUPS)[band]
