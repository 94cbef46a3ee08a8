"""A detector's output over one flight: probabilities and edges."""

from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Detection:
    """One detected edge.

    sample: index at which the detector declared it, so every delay is in it.
    kind: "entry", "exit", or "edge" where the detector cannot tell which.
    probability: how sure it was, 0 to 1; NaN where it does not say.
    """

    sample: int
    kind: str
    probability: float = float("nan")


@dataclass
class Trace:
    """A detector's output over a flight of n samples.

    probability: (n,) P(over a platform); NaN where it is not known (yet).
    edges: detections in order of time.
    signals: what reports plot, each (n,) or (n, k).
    note: what limits this flight's result, one line, or nothing.
    """

    probability: np.ndarray
    edges: list[Detection]
    signals: dict[str, np.ndarray] = field(default_factory=dict)
    note: str = ""
