"""Where the effects that are named say what the flights do not show."""

import numpy as np

from airtouch.gap.evidence.cells import CELLS, cell_words, channel_cells
from airtouch.gap.naming.judging import Trial, held_out_cell_gains
from airtouch.gap.naming.selection import UNKNOWN_ASSUMED, Candidate

#: nats that a right effect may lose in a cell by chance; chosen: by the bound in `losses` the chance of more is 37 %
CHANCE_LOSS = 1.0


def contradicted(trial: Trial, chosen: Candidate | None) -> tuple[float, str]:
    """Held-out nats that effects lose where they say what the flights do not show, and the worst cell in words.

    0 and no words where nothing is chosen or lost.
    """
    if chosen is None or not chosen.fits:
        return 0.0, ""
    gains = held_out_cell_gains(trial, chosen)
    lost = losses(gains)
    if not lost.any():
        return 0.0, ""
    in_a_channel_that_loses = lost[channel_cells()] > 0.0
    worst = int(np.argmin(np.where(in_a_channel_that_loses, gains, np.inf)))
    return float(lost.sum()), cell_words(worst)


def losses(gains: np.ndarray) -> np.ndarray:
    """Nats (CELLS,) that each channel of each view loses beyond chance, at its cell of the lowest band.

    gains (CELLS,): nats that a hypothesis gains in each cell, over none. Where it is right, the likelihood ratio of
    none over it has the mean 1 in every cell, so that a loss beyond x nats has a chance of at most exp(-x) (Markov):
    CHANCE_LOSS of a cell is none. In a channel that a hypothesis explains, its detail may be wrong by a share of what
    it gains there, UNKNOWN_ASSUMED.
    """
    channel = channel_cells()
    lost = np.bincount(channel, np.maximum(-gains - CHANCE_LOSS, 0.0), CELLS)
    gained = np.bincount(channel, np.maximum(gains, 0.0), CELLS)
    return np.maximum(lost - UNKNOWN_ASSUMED * gained, 0.0)
