"""Cells of flattened spectra: each is one channel in one band of frequencies of one view, and has a number.

    number = VIEW_STRIDE * view + COUNT * band + channel        `cell_numbers`; `cell_indices` is its inverse

view: REPLAY_VIEW, REST_VIEW or COMMAND_VIEW; channel: its index in `channels.CHANNELS`, of which there are COUNT; band:
its index in `blocks.BANDS_HZ`, counted from 0, but from 1 in the command view (COMMAND_FIRST_BAND). So band 0 is the
one with the means, which the command view does not have.

`channel_cells`, `heading_cells`, `sensor_cells` and `band_cells` make groups of cells: they give each cell the number
of the first cell of its group.
"""

from typing import NamedTuple

import numpy as np

from airtouch.gap.flights.blocks import BANDS_HZ
from airtouch.gap.flights.flight import PERIOD_S
from airtouch.gap.signals.channels import CHANNELS, COUNT

REPLAY_VIEW, REST_VIEW, COMMAND_VIEW = 0, 1, 2  #: views: of the replay in the air, on the ground, of the commands
VIEW_STRIDE = 1000  #: numbers that each view has for its cells; chosen, more than any view needs
CELLS = 3 * VIEW_STRIDE  #: numbers of cells are below it
COMMAND_FIRST_BAND = 1  #: number of the lowest band in the command view
NYQUIST_HZ = 0.5 / PERIOD_S  #: end of the highest band
SENSOR_AXES = 3  #: channels of one sensor (x, y and z), which follow one another in `channels.CHANNELS`
#: for each channel the index of the first that a turn about the vertical mixes with it: y and pitch follow x and roll
_FIRST_OF_TURN = np.array([i - c.name.endswith(("_y", "_pitch")) for i, c in enumerate(CHANNELS)])


class CellIndices(NamedTuple):
    """Indices of the view, band and channel of n cells, integers (n,); of one cell one integer each."""

    view: np.ndarray
    band: np.ndarray
    channel: np.ndarray


class CellPlace(NamedTuple):
    """What a cell stands for: number of its view, name of its channel, lower and upper end of its band, Hz."""

    view: int
    channel: str
    band_hz: tuple[float, float]


def cell_numbers(view: np.ndarray | int, band: np.ndarray, channel: np.ndarray) -> np.ndarray:
    """Numbers of the cells of views, bands and channels, which broadcast together."""
    return band * COUNT + channel + VIEW_STRIDE * view


def cell_indices(cell: np.ndarray | int) -> CellIndices:
    """View, band and channel of cells by their numbers: the inverse of `cell_numbers`."""
    view, within = np.divmod(cell, VIEW_STRIDE)
    return CellIndices(view, *np.divmod(within, COUNT))


def channel_cells() -> np.ndarray:
    """For each cell (CELLS,) the number of the first cell of its view and channel, all bands together."""
    view, _, channel = cell_indices(np.arange(CELLS))
    return cell_numbers(view, np.zeros_like(channel), channel)


def sensor_cells() -> np.ndarray:
    """For each cell (CELLS,) the number of the first cell of its sensor, in the same view and band.

    A sensor has SENSOR_AXES channels; of the commands thrust, roll and pitch count as one, yaw as another.
    """
    view, band, channel = cell_indices(np.arange(CELLS))
    return cell_numbers(view, band, channel - channel % SENSOR_AXES)


def heading_cells() -> np.ndarray:
    """For each cell (CELLS,) the number of the first cell of its view and of the channels that a turn mixes.

    A turn about the vertical mixes x and y of a sensor, and the commands of roll and pitch; any other channel stands
    alone. All bands together.
    """
    view, _, channel = cell_indices(np.arange(CELLS))
    return cell_numbers(view, np.zeros_like(channel), _FIRST_OF_TURN[channel])


def band_cells() -> np.ndarray:
    """For each cell (CELLS,) the number of the first cell of its view and band, all channels together."""
    view, band, _ = cell_indices(np.arange(CELLS))
    return cell_numbers(view, band, np.zeros_like(band))


def above_means() -> np.ndarray:
    """Whether each cell (CELLS,) is in a band above band 0, which has the means; every cell of the commands is."""
    return cell_indices(np.arange(CELLS)).band > 0


def place_of(cell: int) -> CellPlace:
    """What the cell with a number stands for."""
    view, band, channel = (int(index) for index in cell_indices(cell))
    lowest = COMMAND_FIRST_BAND if view == COMMAND_VIEW else 0
    low, high = BANDS_HZ[max(band - lowest, 0):][:2]
    return CellPlace(view, CHANNELS[channel].name, (low, min(high, NYQUIST_HZ)))
