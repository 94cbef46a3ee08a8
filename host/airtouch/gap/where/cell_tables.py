"""The cells of the gap map, made from block sums: their rms with its interval, and their floors."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import gammaincinv

from airtouch.gap.flights.flight import GROUND, PERIOD_S
from airtouch.gap.signatures.term import WITHIN_90
from airtouch.gap.where.band_sums import Sums
from airtouch.gap.where.filter_bank import MAP_BANDS_HZ
from airtouch.gap.where.regimes import REGIMES
from airtouch.logs.segments import KINDS

DRAWS = 400  #: bootstrap samples of each phase: 20 lie beyond each end of a 90 % interval; chosen
LEAST_FLIGHTS = 5  #: flights from which on the bootstrap draws flights; of fewer it draws blocks; chosen
LEAST_SCATTER = 2  #: flights between which there is a scatter
LEAST_SECONDS = 0.3  #: seconds that a cell needs; one with less is left out; chosen
INTERVAL = (5.0, 95.0)  #: percentiles between which the 90 % intervals lie
#: degrees of freedom of a block at most, as blocks differ by more than chance; chosen. With it the intervals hold the
#: true rms in 85 of 100 cells or more (test_map.py)
BLOCK_FREEDOM = 4.0
FLOOR_SEED = 100  #: of the floors' bootstrap, no phase's number, which is that of a phase's own
ANY_AIR = "air"  #: key of the floor of all phases in the air together, for those in which no nominal flight was
AIRBORNE = 1  #: number that stands for every phase in the air where they are put together; GROUND is another

#: phase, or ANY_AIR: floor and its upper end, (regimes, bands, COUNT) each
Floors = dict[int | str, tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Table:
    """The cells of one phase.

    All (regimes, bands, COUNT). rms, low, high: root mean square and the ends of its 90 % interval, in the channels'
    units, NaN where no flight has the channel; seconds, blocks, flights: how many of those that have it they are of.
    """

    rms: np.ndarray
    low: np.ndarray
    high: np.ndarray
    seconds: np.ndarray
    blocks: np.ndarray
    flights: np.ndarray


def table_of(all_sums: Sums, phase: int, seed: int) -> Table | None:
    """The cells of one phase from all sums, None where no flight has it; seed: of the bootstrap.

    The interval is that of the bootstrap, and never narrower than that of a mean square of noise with the cell's
    degrees of freedom.
    """
    part = all_sums.of_phase(phase)
    if not len(part.phase):
        return None
    weight = part.known_weight()
    blocks = (weight > 0).sum(axis=0)
    flights = _flights_with(part.flight, weight, 1.0)
    if len(np.unique(part.flight)) >= LEAST_FLIGHTS:
        part = part.by_phase()
    mean_square, mean = part.mean_square(), part.offset()
    low, high = _bootstrap(part.weight, part.power, seed)
    seconds = weight.sum(axis=0) * PERIOD_S
    freedom = _freedom(seconds, blocks)
    least, most = (mean_square * freedom / chi_square(p / 100.0, freedom) for p in INTERVAL[::-1])
    least[:, 0], most[:, 0] = _offset(mean, mean_square[:, 0], freedom[:, 0])
    return Table(rms=np.sqrt(mean_square), low=np.sqrt(np.minimum(low, least)), high=np.sqrt(np.maximum(high, most)),
                 seconds=seconds, blocks=blocks, flights=flights)


def _freedom(seconds: np.ndarray, blocks: np.ndarray) -> np.ndarray:
    """Degrees of freedom (regimes, bands, COUNT) of a mean square of noise: 2 x time x bandwidth.

    A block has BLOCK_FREEDOM at most (Bendat and Piersol, Random Data, 4th ed., section 8.3). seconds, blocks: each
    (regimes, bands, COUNT).
    """
    width = np.array([b - a for a, b in MAP_BANDS_HZ])[:, None]
    return np.clip(2.0 * seconds * width, 1.0, np.maximum(BLOCK_FREEDOM * blocks, 1.0))


def chi_square(share: float, freedom: np.ndarray) -> np.ndarray:
    """Values below which this share of chi-square distributions lies; scipy.stats takes a second to import."""
    return 2.0 * gammaincinv(0.5 * freedom, share)


def _offset(mean: np.ndarray, square: np.ndarray, freedom: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Interval of a mean square that is a constant and something that varies around it."""
    variance = np.maximum(square - mean ** 2, 0.0)
    error = WITHIN_90 * np.sqrt(variance / freedom)
    below, above = (freedom / chi_square(p / 100.0, freedom) for p in INTERVAL[::-1])
    size = np.abs(mean)
    return np.maximum(size - error, 0.0) ** 2 + variance * below, (size + error) ** 2 + variance * above


def _bootstrap(weight: np.ndarray, power: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """The two percentiles of INTERVAL of the mean square (regimes, bands, COUNT), by a bootstrap over the rows.

    Of a channel in some rows the draws count that hold one of these rows.
    """
    n = len(weight)
    draws = np.random.default_rng(seed).multinomial(n, np.full(n, 1.0 / n), DRAWS).astype(np.float64)
    low, high = (np.zeros((weight.shape[1], power[0, 0].size)) for _ in range(2))
    for r in range(weight.shape[1]):
        values = power[:, r].reshape(n, -1)
        sums = draws @ np.nan_to_num(values)
        patterns, of = np.unique(np.isfinite(values), axis=1, return_inverse=True)
        for i, known in enumerate(patterns.T):
            samples, columns = draws @ (weight[:, r] * known), of.ravel() == i
            usable = samples > 0
            if usable.any():
                means = sums[np.ix_(usable, columns)] / samples[usable, None]
                low[r, columns], high[r, columns] = np.percentile(means, INTERVAL, axis=0)
    return low.reshape(power.shape[1:]), high.reshape(power.shape[1:])


def floors_of(nominal: Sums, sensor: np.ndarray) -> Floors:
    """The floors by phase, of nominal flights; that of ANY_AIR serves phases in which none was.

    sensor: `sensor_rms`, below which no floor lies. In the air NaN for channels that no nominal flight has.
    """
    shape = (len(REGIMES), *sensor.shape)
    least = np.broadcast_to(sensor, shape)
    floors: Floors = {GROUND: (least, least), ANY_AIR: (least, least)}
    air = Sums(np.where(nominal.phase == GROUND, GROUND, AIRBORNE), nominal.flight, nominal.weight, nominal.power,
               nominal.mean)
    sources: list[tuple[int | str, Sums, int]] = [(ANY_AIR, air, AIRBORNE),
                                                  *((k, nominal, k) for k in range(len(KINDS)))]
    for key, source, phase in sources:
        spread = _without_common(source, phase)
        table = table_of(spread, phase, seed=FLOOR_SEED) if spread is not None else None
        if table is None:
            continue
        whole = table.rms[:1], table.high[:1]  # of the phase, for regimes in which too few nominal flights were
        enough = table.seconds >= LEAST_SECONDS
        enough[:, 0] &= _long_flights(source.of_phase(phase)) >= LEAST_SCATTER
        own = table.rms, table.high
        level, top = (np.where(enough, *pair) for pair in zip(own, whole, strict=True))
        if phase == GROUND:  # where a channel without a nominal flight may be held against the sensor
            level, top = (np.where(np.isfinite(v), v, least) for v in (level, top))
        floors[key] = np.maximum(level, least), np.maximum(top, least)
    return floors


def phase_floor(floors: Floors, phase: int) -> tuple[np.ndarray, np.ndarray]:
    """The floor of a phase and its upper end; where no nominal flight has it, that of ANY_AIR or the ground."""
    return floors[phase] if phase in floors else floors[GROUND if phase == GROUND else ANY_AIR]


def spreads_of(sums: Sums, sensor: np.ndarray) -> Floors:
    """The floors by phase without a baseline: sensor noise, and the spread between flights (of one: its blocks)."""
    spreads: dict[int | str, np.ndarray] = {}
    for k in range(len(KINDS)):
        part = sums.of_phase(k)
        if len(np.unique(part.flight)) > 1:
            part = part.by_phase()
        long = part.weight[:, 0] >= LEAST_SECONDS / PERIOD_S
        if long.sum() > 1:
            weight = part.weight[long, 0][:, None]
            values = np.sqrt(part.power[long, 0] / weight[:, None])
            values[:, 0] = part.mean[long, 0] / weight
            several = np.isfinite(values).sum(axis=0) >= LEAST_SCATTER
            spreads[k] = np.zeros(sensor.shape)
            spreads[k][several] = np.nanstd(values[:, several], axis=0, ddof=1)
    air = [v for k, v in spreads.items() if k != GROUND]
    spreads[ANY_AIR] = np.mean(air, axis=0) if air else np.zeros(sensor.shape)
    spreads.setdefault(GROUND, np.zeros(sensor.shape))
    shape = (len(REGIMES), *sensor.shape)
    return {k: (np.broadcast_to(np.hypot(sensor, v), shape),) * 2 for k, v in spreads.items()}


def _without_common(nominal: Sums, phase: int) -> Sums | None:
    """The sums of one phase of the baseline without the mean that all its flights share in the lowest band.

    None where no flight has the phase. The mean is that of each regime, and the variance between flights is unbiased:
    over one flight less than have the regime. What varies within a flight about its own mean counts once. Of a regime
    that one flight has, nothing else is left.
    """
    part = nominal.of_phase(phase)
    if not len(part.phase):
        return None
    weight, power, common, own = part.weight[:, :, None], part.power.copy(), part.offset(), np.empty_like(part.mean)
    for flight in np.unique(part.flight):
        own[part.flight == flight] = part.of_flight(flight).offset()
    within = power[:, :, 0] - 2.0 * own * part.mean + weight * own ** 2
    count = _long_flights(part)
    unbiased = np.where(count > 1, count / np.maximum(count - 1.0, 1.0), 1.0)
    power[:, :, 0] = np.maximum(within, 0.0) + weight * (own - common) ** 2 * unbiased
    return replace(part, power=power, mean=part.mean - weight * common)


def _long_flights(sums: Sums) -> np.ndarray:
    """Number (regimes, COUNT) of flights with LEAST_SECONDS or more of each regime, of those that have the channel."""
    return _flights_with(sums.flight, sums.known_weight()[:, :, 0], LEAST_SECONDS / PERIOD_S)


def _flights_with(flight: np.ndarray, weight: np.ndarray, least: float) -> np.ndarray:
    """Number (...) of flights in which a weight (b, ...) of blocks adds up to `least` samples or more."""
    numbers, row = np.unique(flight, return_inverse=True)
    total = np.zeros((len(numbers), *weight.shape[1:]))
    np.add.at(total, row.ravel(), weight)
    return (total >= least).sum(axis=0)
