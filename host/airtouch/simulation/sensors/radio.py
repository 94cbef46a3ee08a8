"""What of a flight reaches the log: lost samples and times that jitter."""

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.simulation.compiled import jit


def received(table: np.ndarray, jitter_s: float, loss: float, burst: float,
             rng: np.random.Generator) -> np.ndarray:
    """The rows of a log (n, columns), time in column 0, that reach the host, with the host's times.

    jitter_s: rms of the error of each time; times never run backwards. loss: share of rows
    lost, in runs of `burst` rows on average (Gilbert's two-state channel), or of loss / (1 - loss)
    rows where that is more, as a row or more arrives between two runs. The first row always arrives.
    Raises AirTouchError for a loss outside 0..1, 1 excluded.
    """
    if not 0.0 <= loss < 1.0:
        raise AirTouchError(f"radio: the share of lost rows must be 0 or more and below 1, not {loss:g}")
    n = len(table)
    draws, errors = rng.random(n), rng.standard_normal(n)
    if jitter_s > 0.0:
        table[:, 0] = np.maximum.accumulate(table[:, 0] + jitter_s * errors)
    if loss <= 0.0:
        return table
    recover = 1.0 / max(burst, loss / (1.0 - loss))
    arrived = np.ones(n, dtype=bool)
    _lose(draws, recover, min(recover * loss / (1.0 - loss), 1.0), arrived)
    return table[arrived]


@jit
def _lose(draws, recover, fail, arrived):
    """Mark lost rows in arrived (n,), by draws (n,) in 0..1 and the chances to recover and to fail at each row."""
    lost = False
    for i in range(1, len(draws)):
        lost = draws[i] >= recover if lost else draws[i] < fail
        arrived[i] = not lost


@jit
def rounded(table, per_unit):
    """Round a table (n, m) to whole multiples of 1 / per_unit in place."""
    for i in range(table.shape[0]):
        for j in range(table.shape[1]):
            table[i, j] = np.rint(table[i, j] * per_unit) / per_unit
