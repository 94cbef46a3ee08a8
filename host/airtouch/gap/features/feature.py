"""A feature of a flight, as its module declares it: its name, and how little it may scatter in nominal flights.

No feature is taken to say more than the simulator is exact: its scatter in nominal flights is `least` at least.
"""

from typing import NamedTuple

LEAST_COHERENCE = 0.01  #: of a coherence; chosen, as all numbers here
LEAST_LOG = 0.03  #: of a logarithm of a power or a variance
LEAST_CLOCK = 0.1  #: of a logarithm of the rms of the logged times
LEAST_LOST = 0.5  #: of the logarithm of one more than a number of lost rows: one by chance is no news


class Feature(NamedTuple):
    """One feature. least: its least standard deviation, in its own unit; 0 where nominal flights alone tell."""

    name: str
    least: float = 0.0
