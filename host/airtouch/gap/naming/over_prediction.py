"""Over-prediction: where the effects named predict what the flights do not show."""

import numpy as np

from airtouch.gap.evidence.cells import CELLS, heading_cells
from airtouch.gap.naming.judging import Trial, held_out_cell_gains
from airtouch.gap.naming.policy import CHANCE_LOSS, UNKNOWN_ASSUMED
from airtouch.gap.naming.records import Hypothesis, OverPrediction


def over_prediction_of(trial: Trial, hypothesis: Hypothesis | None) -> OverPrediction:
    """Nats that the effects named lose by over-prediction; 0 nats and no cell where they lose nothing.

    hypothesis: these effects together, None where none is named.
    """
    if hypothesis is None or not hypothesis.fits:
        return OverPrediction()
    gains = held_out_cell_gains(trial, hypothesis)
    lost = over_prediction_by_channel(gains)
    if not lost.any():
        return OverPrediction()
    in_a_channel_that_loses = lost[heading_cells()] > 0.0
    worst = int(np.argmin(np.where(in_a_channel_that_loses, gains, np.inf)))
    return OverPrediction(float(lost.sum()), worst)


def over_prediction_by_channel(gains: np.ndarray) -> np.ndarray:
    """Nats (CELLS,) that channels lose beyond chance, view by view, at the first cell of `heading_cells`.

    gains (CELLS,): nats that a hypothesis gains in each cell, over none. Where it is right, the likelihood ratio of
    none over it has the mean 1 in every cell, so that a loss beyond x nats has a chance of at most exp(-x) (Markov). So
    CHANCE_LOSS nats of a cell's loss do not count. In a channel that a hypothesis explains, its detail may be wrong by
    a share UNKNOWN_ASSUMED of what it gains there. Channels that a turn about the vertical mixes count as one: the
    direction of the path or of an edge is known to some degrees, and an error turns an effect from x into y.
    """
    mixed = heading_cells()
    lost = np.bincount(mixed, np.maximum(-gains - CHANCE_LOSS, 0.0), CELLS)
    gained = np.bincount(mixed, np.maximum(gains, 0.0), CELLS)
    return np.maximum(lost - UNKNOWN_ASSUMED * gained, 0.0)
