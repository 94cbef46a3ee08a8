"""Evidence against the named effects, with the limit up to which they may still be right."""

from typing import NamedTuple


class Counterevidence(NamedTuple):
    """Evidence against the named effects, nats, and the limit up to which they may still be right, nats.

    of_distance: whether the evidence is the flight's excess distance from the effects (`relations.inference`); else it
    is the gain of a nameless disturbance or of the nameless model beside them.
    """

    nats: float
    limit: float
    of_distance: bool

    @property
    def is_too_much(self) -> bool:
        """Whether the evidence exceeds the limit."""
        return self.nats > self.limit
