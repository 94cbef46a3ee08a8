"""Mean power spectra of the commands, as flown and as nominal flights have them: what a report shows of the loop."""

from collections.abc import Iterable, Sequence
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


def mean_spectra(flown: Sequence[CommandPower], nominal: Sequence[CommandPower]) -> dict[str, Any]:
    """Mean spectra of some flights and of nominal ones, JSON-ready; empty without a steady stretch in flight."""
    blocks, nominal_blocks = (sum(p.blocks for p in powers) for powers in (flown, nominal))
    if not blocks:
        return {}
    content: dict[str, Any] = {"unit": "N^2/Hz", "frequency_hz": frequencies().tolist()}
    mean = np.sum([p.total for p in flown], axis=0) / blocks
    of_nominal = np.sum([p.total for p in nominal], axis=0) / nominal_blocks if nominal_blocks else None
    for i, axis in enumerate(AXES):
        content[axis] = {"flown": mean[:, i].tolist()}
        if of_nominal is not None:
            content[axis]["nominal"] = of_nominal[:, i].tolist()
    return content


def command_spectra(flights: Iterable[Flight], nominal: Iterable[Flight], vehicle: Vehicle) -> dict[str, Any]:
    """`mean_spectra` of flights."""
    return mean_spectra(*([command_power(f, vehicle) for f in some] for some in (flights, nominal)))
