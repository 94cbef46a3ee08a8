"""Cells of flattened spectra: each is one channel in one band of frequencies of one view.

A cell's number is VIEW_STRIDE times the number of its view, plus COUNT times that of its band, plus that of its
channel.
"""

from typing import NamedTuple

import numpy as np

from airtouch.gap.flights.blocks import BANDS_HZ
from airtouch.gap.flights.flight import PERIOD_S
from airtouch.gap.signals.channels import CHANNELS, COUNT

REPLAY_VIEW, REST_VIEW, COMMAND_VIEW = 0, 1, 2  #: numbers of the views: in the air, on the ground, of the commands
VIEW_STRIDE = 1000  #: numbers that each view has for its cells; chosen, more than any view has
CELLS = 3 * VIEW_STRIDE  #: numbers of cells are below it
NYQUIST_HZ = 0.5 / PERIOD_S  #: end of the highest band
SENSOR_AXES = 3  #: channels of one sensor (x, y and z), whose numbers follow one another


class CellPlace(NamedTuple):
    """Where a cell is: number of its view, name of its channel, ends of its band."""

    view: int
    channel: str
    band_hz: tuple[float, float]


def cell_numbers(view: int, band: np.ndarray, channel: np.ndarray) -> np.ndarray:
    """Numbers of the cells of bands and channels, two arrays of integers that broadcast together.

    Bands count from 0, those of the command view from 1: its values hold no means, and `above_means` asks the number.
    """
    return band * COUNT + channel + VIEW_STRIDE * view


def channel_cells() -> np.ndarray:
    """For each cell (CELLS,) the number that stands for its view and channel, all bands together."""
    cell = np.arange(CELLS)
    return cell - cell % VIEW_STRIDE + cell % VIEW_STRIDE % COUNT


def sensor_cells() -> np.ndarray:
    """For each cell (CELLS,) the number of the first cell of its sensor, in the same view and band.

    A sensor has SENSOR_AXES channels; of the commands thrust, roll and pitch count as one, yaw as another.
    """
    cell = np.arange(CELLS)
    return cell - cell % VIEW_STRIDE % COUNT % SENSOR_AXES


def band_cells() -> np.ndarray:
    """For each cell (CELLS,) the number of the first cell of its view and band, all channels together."""
    cell = np.arange(CELLS)
    return cell - cell % VIEW_STRIDE % COUNT


def above_means() -> np.ndarray:
    """Whether each cell (CELLS,) is in a band above the lowest, which has the means; every cell of the commands is."""
    return np.arange(CELLS) % VIEW_STRIDE >= COUNT


def place_of(cell: int) -> CellPlace:
    """The place of the cell of a number."""
    view, place = divmod(cell, VIEW_STRIDE)
    band, channel = divmod(place, COUNT)
    low, high = BANDS_HZ[max(band - (view == COMMAND_VIEW), 0):][:2]
    return CellPlace(view, CHANNELS[channel].name, (low, min(high, NYQUIST_HZ)))
