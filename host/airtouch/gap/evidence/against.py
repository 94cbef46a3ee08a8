"""What speaks against effects that explain flights, in nats, with the nats that may where the effects are right."""

from typing import NamedTuple


class Against(NamedTuple):
    """Nats that speak against effects, and those that may where the effects are right.

    of_distance: whether they are the excess of a flight's distance (`relations.inference`), not the gain of a nameless
    disturbance or model.
    """

    nats: float
    limit: float
    of_distance: bool

    @property
    def is_too_much(self) -> bool:
        """Whether more speaks against the effects than may."""
        return self.nats > self.limit
