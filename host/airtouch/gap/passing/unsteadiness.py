"""How unsteady a flight is: whether torque and lift are far stronger in some seconds than in others.

The spectra of blocks are means over seconds, and no two nominal flights have the same. But each is about as steady as
the next, and what comes and goes makes a flight less steady than they are, whatever it is: each is held against itself.
"""

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.flights.flight import Flight
from airtouch.gap.passing.bursts import LEAST_PIECES, SHAKE_BAND_HZ, SHAKE_PIECE_S, piece_powers
from airtouch.gap.signals.channels import FORCE, TORQUE
from airtouch.gap.signatures.scatter import UNSTEADY_LIFT, UNSTEADY_TORQUE
from airtouch.gap.study import Study

#: columns of the residual whose powers make each of the two
COLUMNS = {UNSTEADY_TORQUE: tuple(range(TORQUE.start, TORQUE.stop)), UNSTEADY_LIFT: (FORCE.stop - 1,)}
#: least entropy, without unit; chosen: noise that is equally strong all along has 0.02 to 0.06. A larger number makes
#: steady flights alike
LEAST_ENTROPY = 1e-3


def log_entropies(data: Data) -> dict[str, float]:
    """How unsteady torque and lift are, by name: natural logarithms of their `entropy`, LEAST_ENTROPY at least.

    A measure of which nothing is known is left out: the flights are too short to say how steady they are.
    The logarithm scatters more nearly as a Student's variable than the entropy does (host/docs/looks.md, 2026-11-27).
    It is measured once: the evidence for a wake and the verdict both ask for it.
    """
    return data.workspace.cached("log entropies", (), lambda: {
        name: float(np.log(max(value, LEAST_ENTROPY))) for name, columns in COLUMNS.items()
        if (value := entropy(data, columns)) is not None})


def entropy(data: Data, columns: tuple[int, ...]) -> float | None:
    """Log of the arithmetic over the geometric mean of the power of some columns of the residual, piece by piece.

    Band and pieces are SHAKE_BAND_HZ and SHAKE_PIECE_S, above the commands by which the vehicle is steered. It is 0
    where the power is the same all along (Wiener entropy, in time), and grows with bursts. Each flight's powers, and
    each column's, are over their geometric mean; None where nothing is known.
    """
    relative = np.concatenate([_relative_powers(data.study, flight, columns) for flight in data.flights])
    return float(np.log(relative.mean() / np.exp(np.log(relative).mean()))) if len(relative) else None


def _relative_powers(study: Study, flight: Flight, columns: tuple[int, ...]) -> np.ndarray:
    """Powers (pieces,) of columns, each over its geometric mean, averaged; without the pieces that do not count."""
    of_columns = np.array([piece_powers(study, flight, c, SHAKE_BAND_HZ, SHAKE_PIECE_S) for c in columns])
    known = of_columns[:, (of_columns > 0.0).all(axis=0)]
    if known.shape[1] < LEAST_PIECES:
        return np.zeros(0)
    relative = (known / np.exp(np.log(known).mean(axis=1, keepdims=True))).mean(axis=0)
    return relative / np.exp(np.log(relative).mean())


def rms_over_median(study: Study, flight: Flight, column: int) -> np.ndarray:
    """Rms of a column of the residual in each piece over the median of the flight's (pieces,); NaN where not known."""
    power = piece_powers(study, flight, column, SHAKE_BAND_HZ, SHAKE_PIECE_S)
    known = power > 0.0
    if not known.any():
        return np.full(len(power), np.nan)
    return np.sqrt(np.where(known, power, np.nan) / np.median(power[known]))
