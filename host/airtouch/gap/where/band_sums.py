"""The gap cut into bands and summed over short blocks of each phase: what the gap map is made of."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from airtouch.gap.flights.flight import GROUND, Flight
from airtouch.gap.flights.missing import interpolate_over
from airtouch.gap.signals.channels import COUNT, TORQUE
from airtouch.gap.where.filter_bank import MAP_BANDS_HZ, filtered
from airtouch.gap.where.regimes import REGIMES, regimes
from airtouch.vehicle import Vehicle

BLOCK = 256  #: samples (2.56 s) that a block has about: a phase is cut into equal blocks of nearly this length; chosen


@dataclass(frozen=True)
class Sums:
    """Blocks of one flight, or whole phases of it, with their sums over samples.

    phase (b,): place in `segments.KINDS`; flight (b,): number of the flight; weight (b, r):
    samples in each of REGIMES; power (b, r, bands, COUNT): sum of squares; mean
    (b, r, COUNT): sum of the lowest band. NaN where a channel is missing, as it may be in some of the flights: means
    are over those that have it.
    """

    phase: np.ndarray
    flight: np.ndarray
    weight: np.ndarray
    power: np.ndarray
    mean: np.ndarray

    def of_phase(self, phase: int) -> "Sums":
        """The rows of one phase."""
        return self._of(self.phase == phase)

    def of_flight(self, flight: int) -> "Sums":
        """The rows of one flight."""
        return self._of(self.flight == flight)

    def _of(self, rows: np.ndarray) -> "Sums":
        """Some of the rows (b,)."""
        return Sums(self.phase[rows], self.flight[rows], self.weight[rows], self.power[rows], self.mean[rows])

    def by_phase(self) -> "Sums":
        """One row for each phase of each flight."""
        keys, row = np.unique(np.column_stack([self.flight, self.phase]), axis=0, return_inverse=True)
        row = row.ravel()

        def total(values: np.ndarray) -> np.ndarray:
            """Sums (phases of flights, ...) of values (b, ...)."""
            out = np.zeros((len(keys), *values.shape[1:]))
            np.add.at(out, row, values)
            return out

        return Sums(keys[:, 1], keys[:, 0], total(self.weight), total(self.power), total(self.mean))

    def known_weight(self) -> np.ndarray:
        """Samples (b, r, bands, COUNT) of each channel: the weight where it is known, else 0."""
        return np.where(np.isfinite(self.power), self.weight[:, :, None, None], 0.0)

    def mean_square(self) -> np.ndarray:
        """Mean square (r, bands, COUNT) over the rows that have the channel; NaN where none has it."""
        return _mean(self.power, self.known_weight())

    def offset(self) -> np.ndarray:
        """Mean (r, COUNT) of the lowest band over the rows that have the channel; NaN where none has it."""
        return _mean(self.mean, self.known_weight()[:, :, 0])


def _mean(sums: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Mean of values with these sums and weights, each (b, ...); 0 where the weight is 0, NaN where all are NaN."""
    known = np.isfinite(sums)
    total = np.where(known, sums, 0.0).sum(axis=0) / np.maximum(weight.sum(axis=0), 1.0)
    return np.where(known.any(axis=0), total, np.nan)


def join(parts: Sequence[Sums]) -> Sums:
    """Sums of several flights, numbered in their order."""
    if not parts:
        r = len(REGIMES)
        return Sums(np.zeros(0, int), np.zeros(0, int), np.zeros((0, r)),
                    np.zeros((0, r, len(MAP_BANDS_HZ), COUNT)), np.zeros((0, r, COUNT)))
    return Sums(np.concatenate([p.phase for p in parts]),
                np.concatenate([np.full(len(p.phase), i) for i, p in enumerate(parts)]),
                *(np.concatenate([getattr(p, key) for p in parts]) for key in ("weight", "power", "mean")))


def block_sums(flight: Flight, residual: np.ndarray, vehicle: Vehicle) -> Sums:
    """Block sums of one flight's residual (n, COUNT), in the channels' units; lost samples are left out."""
    member = regimes(flight, vehicle)
    parts: list[tuple] = []
    for start, stop in stretches(flight):
        valid = ~flight.bridged[start:stop]
        values = interpolate_over(residual[start:stop], valid)
        bands = filtered(values)
        if flight.rates is None:  # torque is known at low frequency only, and not at rest
            bands[0 if flight.on_ground[start] else 1:, :, TORQUE] = np.nan
        flat = (bands ** 2).transpose(1, 0, 2).reshape(stop - start, -1)
        for here, mask in _blocks_with_samples(flight, member, start, stop):
            parts.append((flight.phase[start + here.start], mask.sum(axis=1),
                          (mask @ flat[here]).reshape(len(REGIMES), len(MAP_BANDS_HZ), COUNT),
                          mask @ bands[0, here]))
    if not parts:
        return join([])
    phase, weight, power, mean = (np.array(column) for column in zip(*parts, strict=True))
    return Sums(phase.astype(int), np.zeros(len(phase), int), weight, power, mean)


def block_bounds(flight: Flight) -> list[tuple[int, int]]:
    """First sample, and the one after the last, of the blocks of `block_sums`."""
    everywhere = np.ones((len(flight), 1), bool)
    return [(start + here.start, start + here.stop) for start, stop in stretches(flight)
            for here, _ in _blocks_with_samples(flight, everywhere, start, stop)]


def sums_over_blocks(flight: Flight, values: np.ndarray, vehicle: Vehicle) -> np.ndarray:
    """Sums (b, r, ...) of values (n, ...) over the blocks of `block_sums`, in each of REGIMES."""
    member, flat = regimes(flight, vehicle), values.reshape(len(values), -1)
    rows = [mask @ flat[start:stop][here] for start, stop in stretches(flight)
            for here, mask in _blocks_with_samples(flight, member, start, stop)]
    return np.array(rows).reshape(-1, len(REGIMES), *values.shape[1:])


def _blocks_with_samples(flight: Flight, member: np.ndarray, start: int, stop: int,
                         ) -> Iterator[tuple[slice, np.ndarray]]:
    """The blocks of a stretch that have a sample: their place in it, and (r, samples) 1 in each regime, else 0.

    member (n, r): which samples of the flight are in which of REGIMES.
    """
    valid = ~flight.bridged[start:stop]
    for first, last in _phase_blocks(flight.phase[start:stop]):
        here = slice(first, last)
        mask = (member[start:stop][here] & valid[here, None]).T.astype(np.float64)
        if mask[0].any():
            yield here, mask


def stretches(flight: Flight) -> list[tuple[int, int]]:
    """First sample and the one after the last of each stretch without contact, in the air or at rest."""
    kind = np.where(flight.on_ground, 1, np.where(flight.phase != GROUND, 2, 0)) * (flight.usable | flight.bridged)
    bounds = np.r_[0, np.flatnonzero(np.diff(kind)) + 1, len(kind)]
    return [(int(a), int(b)) for a, b in zip(bounds[:-1], bounds[1:], strict=True) if kind[a] and b - a > 1]


def _phase_blocks(phase: np.ndarray) -> list[tuple[int, int]]:
    """Runs of one phase cut into equal blocks of about BLOCK samples; short phases are one block."""
    bounds = np.r_[0, np.flatnonzero(np.diff(phase)) + 1, len(phase)]
    blocks = []
    for a, b in zip(bounds[:-1], bounds[1:], strict=True):
        cuts = np.linspace(a, b, max(round((b - a) / BLOCK), 1) + 1).astype(int)
        blocks += list(zip(cuts[:-1].tolist(), cuts[1:].tolist(), strict=True))
    return blocks
