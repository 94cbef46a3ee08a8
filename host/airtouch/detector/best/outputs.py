"""The outputs of the network: what each says, what it is trained to say, and how much its error counts.

The decoder reads the first of them (`reference.edge_decoder.LOGITS`, `firmware/kernels/edge_decoder.h`) and leaves the
others alone.
host/docs/change-the-network.md says how to add one.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airtouch import logs

if TYPE_CHECKING:
    from airtouch.detector.best.recipe import Recipe


@dataclass(frozen=True)
class Output:
    """One logit.

    name: one that the decoder reads has its name in `reference.edge_decoder.LOGITS`. start_bias: its bias before
    training. weight(recipe): its share of the loss. target(over, edges, recipe): what it is to say at each sample,
    (n,) float32 in 0..1, for over (n,), 0 or 1, and the flight's edges.
    """

    name: str
    start_bias: float
    weight: Callable[["Recipe"], float]
    target: Callable[[np.ndarray, Sequence[logs.Edge], "Recipe"], np.ndarray]


def _over(over: np.ndarray, edges: Sequence[logs.Edge], recipe: "Recipe") -> np.ndarray:
    """Over a platform, `over_delay` samples late."""
    target = np.zeros(len(over), np.float32)
    target[recipe.over_delay:] = over[:len(over) - recipe.over_delay]
    return target


def _event(kind: str) -> Callable[[np.ndarray, Sequence[logs.Edge], "Recipe"], np.ndarray]:
    """Edges of this kind: bumps of height 1, `delay` samples after their edge."""
    def bumps(over: np.ndarray, edges: Sequence[logs.Edge], recipe: "Recipe") -> np.ndarray:
        target, t = np.zeros(len(over), np.float32), np.arange(len(over))
        for edge in edges:
            if edge.kind == kind:
                bump = np.exp(-0.5 * np.square((t - edge.sample - recipe.delay) / recipe.event_sigma))
                target = np.maximum(target, bump.astype(np.float32))
        return target
    return bumps


OUTPUTS = (
    Output("over", -2.0, lambda recipe: 1.0, _over),
    Output("entry", -4.0, lambda recipe: recipe.event_weight, _event("entry")),
    Output("exit", -4.0, lambda recipe: recipe.event_weight, _event("exit")),
)


def training_targets(over: np.ndarray, edges: Sequence[logs.Edge], recipe: "Recipe") -> np.ndarray:
    """What the logits are to say at each sample, (n, outputs) float32 in 0..1.

    over: (n,), 0 or 1, whether the drone is over a platform. edges: those of the flight.
    """
    return np.column_stack([output.target(over, edges, recipe) for output in OUTPUTS])
