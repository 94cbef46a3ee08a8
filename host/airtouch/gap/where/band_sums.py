"""The gap cut into bands and summed over short blocks of each phase: what the gap map is made of."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from airtouch.gap.flights.flight import GROUND, Flight
from airtouch.gap.flights.missing import interpolate_over
from airtouch.gap.signals.channels import COUNT
from airtouch.gap.where.filter_bank import MAP_BANDS_HZ, filtered
from airtouch.gap.where.regimes import REGIMES, regimes
from airtouch.vehicle import Vehicle

BLOCK = 256  #: samples (2.56 s) that a block has about: a phase is cut into equal blocks of nearly this length; chosen


@dataclass(frozen=True)
class Sums:
    """Blocks of one flight, or whole phases of it, with their sums over samples.

    phase (b,): place in `segments.KINDS`; flight (b,): number of the flight; weight (b, r):
    samples in each of REGIMES; power (b, r, bands, COUNT): sum of squares; mean
    (b, r, COUNT): sum of the lowest band. NaN where a channel is missing.
    """

    phase: np.ndarray
    flight: np.ndarray
    weight: np.ndarray
    power: np.ndarray
    mean: np.ndarray

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
        flat = (bands ** 2).transpose(1, 0, 2).reshape(stop - start, -1)
        for first, last in _blocks(flight.phase[start:stop]):
            here = slice(first, last)
            mask = (member[start:stop][here] & valid[here, None]).T.astype(np.float64)
            if mask[0].any():
                parts.append((flight.phase[start + first], mask.sum(axis=1),
                              (mask @ flat[here]).reshape(len(REGIMES), len(MAP_BANDS_HZ), COUNT),
                              mask @ bands[0, here]))
    if not parts:
        return join([])
    phase, weight, power, mean = (np.array(column) for column in zip(*parts, strict=True))
    return Sums(phase.astype(int), np.zeros(len(phase), int), weight, power, mean)


def stretches(flight: Flight) -> list[tuple[int, int]]:
    """First sample and the one after the last of each stretch without contact, in the air or at rest."""
    kind = np.where(flight.on_ground, 1, np.where(flight.phase != GROUND, 2, 0)) * (flight.usable | flight.bridged)
    bounds = np.r_[0, np.flatnonzero(np.diff(kind)) + 1, len(kind)]
    return [(int(a), int(b)) for a, b in zip(bounds[:-1], bounds[1:], strict=True) if kind[a] and b - a > 1]


def _blocks(phase: np.ndarray) -> list[tuple[int, int]]:
    """Runs of one phase cut into equal blocks of about BLOCK samples; short phases are one block."""
    bounds = np.r_[0, np.flatnonzero(np.diff(phase)) + 1, len(phase)]
    blocks = []
    for a, b in zip(bounds[:-1], bounds[1:], strict=True):
        cuts = np.linspace(a, b, max(round((b - a) / BLOCK), 1) + 1).astype(int)
        blocks += list(zip(cuts[:-1].tolist(), cuts[1:].tolist(), strict=True))
    return blocks
