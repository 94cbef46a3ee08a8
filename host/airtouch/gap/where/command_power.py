"""Mean power spectra of the commands, as flown and as nominal flights have them: what a report shows of the loop."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from airtouch.gap.flights.flight import Flight
from airtouch.gap.loop.command_spectra import block_spectra, frequencies
from airtouch.gap.loop.controller import AXES
from airtouch.vehicle import Vehicle


class CommandPower(NamedTuple):
    """Power (bins, AXES) of the commands, N^2/Hz, summed over blocks, and the number of blocks."""

    total: np.ndarray
    blocks: int


def command_power(flight: Flight, vehicle: Vehicle) -> CommandPower:
    """The power of a flight's commands."""
    spectra = block_spectra(flight, vehicle)[1]
    return CommandPower((np.abs(spectra) ** 2).sum(axis=0), len(spectra))


@dataclass(frozen=True)
class MeanSpectra:
    """Mean power spectra of the commands (bins, AXES), N^2/Hz, of some flights and of nominal ones, None without these.

    The bins are at `command_spectra.frequencies`.
    """

    flown: np.ndarray
    nominal: np.ndarray | None

    def plain(self) -> dict[str, Any]:
        """JSON-ready, by axis."""
        content: dict[str, Any] = {"unit": "N^2/Hz", "frequency_hz": frequencies().tolist()}
        for i, axis in enumerate(AXES):
            content[axis] = {"flown": self.flown[:, i].tolist()}
            if self.nominal is not None:
                content[axis]["nominal"] = self.nominal[:, i].tolist()
        return content


def mean_spectra(flown: Sequence[CommandPower], nominal: Sequence[CommandPower]) -> MeanSpectra | None:
    """Mean spectra of some flights and of nominal ones; None without a steady stretch in flight."""
    blocks, nominal_blocks = (sum(p.blocks for p in powers) for powers in (flown, nominal))
    if not blocks:
        return None
    of_nominal = np.sum([p.total for p in nominal], axis=0) / nominal_blocks if nominal_blocks else None
    return MeanSpectra(np.sum([p.total for p in flown], axis=0) / blocks, of_nominal)
