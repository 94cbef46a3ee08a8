"""Mean power spectra of the commands, as flown and as nominal flights have them: what a report shows of the loop."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from airtouch.gap.flights.flight import Flight
from airtouch.gap.loop.command_spectra import block_spectra, command_frequencies
from airtouch.gap.loop.controller import AXES
from airtouch.vehicle import Vehicle


class SummedPower(NamedTuple):
    """Power (bins, AXES) of the commands, N^2/Hz, summed over blocks, and the number of blocks."""

    total: np.ndarray
    blocks: int


def command_power(flight: Flight, vehicle: Vehicle) -> SummedPower:
    """The power of a flight's commands."""
    spectra = block_spectra(flight, vehicle)[1]
    return SummedPower((np.abs(spectra) ** 2).sum(axis=0), len(spectra))


@dataclass(frozen=True)
class MeanSpectra:
    """Mean power spectra (bins,) of the command of each axis, N^2/Hz, of some flights and of nominal ones, if any."""

    frequency_hz: np.ndarray
    flown: Mapping[str, np.ndarray]
    nominal: Mapping[str, np.ndarray]

    def plain(self) -> dict[str, Any]:
        """JSON-ready, by axis."""
        of_nominal = {axis: {"nominal": power.tolist()} for axis, power in self.nominal.items()}
        return {"unit": "N^2/Hz", "frequency_hz": self.frequency_hz.tolist(),
                **{axis: {"flown": power.tolist(), **of_nominal.get(axis, {})} for axis, power in self.flown.items()}}


def mean_spectra(flown: Sequence[SummedPower], nominal: Sequence[SummedPower]) -> MeanSpectra | None:
    """Mean spectra of some flights and of nominal ones; None without a steady stretch in flight."""
    of_flown, of_nominal = _mean_by_axis(flown), _mean_by_axis(nominal)
    return MeanSpectra(command_frequencies(), of_flown, of_nominal) if of_flown else None


def _mean_by_axis(powers: Sequence[SummedPower]) -> dict[str, np.ndarray]:
    """Mean power (bins,) over all blocks, by axis; empty without a block."""
    blocks = sum(p.blocks for p in powers)
    return dict(zip(AXES, (np.sum([p.total for p in powers], axis=0) / blocks).T, strict=True)) if blocks else {}
