"""Evidence against the named effects, with its limit."""

from typing import NamedTuple


class Against(NamedTuple):
    """Nats that speak against the named effects, and the limit up to which these may still be right.

    of_distance: whether the nats are the excess of a flight's distance (`relations.inference`), not the gain of a
    nameless disturbance or model.
    """

    nats: float
    limit: float
    of_distance: bool

    @property
    def is_too_much(self) -> bool:
        """Whether the nats exceed the limit."""
        return self.nats > self.limit
