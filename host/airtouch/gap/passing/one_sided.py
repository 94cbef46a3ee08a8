"""Whether what pushes a flight along its thrust pushes it down: a wake from above does, most other disturbances do not.

The likelihood knows spectra alone, which are the same whichever way a push goes.
"""

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.flights.filters import both_ways, highpass, lowpass
from airtouch.gap.flights.flight import PERIOD_S
from airtouch.gap.passing.bursts import LIVELY_HZ, thrust_residual

DOWNWARD = "downward"  #: of `Scatter.passing`, what nominal flights have of `downward`
HIGHEST_HZ = 8.0  #: frequency up to which pushes are seen: a wake is passed in a tenth of a second or more; chosen


def downward(data: Data) -> float:
    """Skewness of the force along the thrust, from LIVELY_HZ to HIGHEST_HZ, with its sign changed.

    Above 0 where the strongest pushes point down. What `thrust_residual` leaves out does not count, nor does the mean
    of each flight; 0 where nothing is left.
    """
    deviations = []
    for flight in data.flights:
        force, counts = thrust_residual(data.study, flight)
        slow = both_ways(lowpass(HIGHEST_HZ * 2.0 * PERIOD_S), force)
        pushes = both_ways(highpass(LIVELY_HZ * 2.0 * PERIOD_S), slow)[counts]
        deviations.append(pushes - pushes.mean() if len(pushes) else pushes)
    pushes = np.concatenate(deviations)
    power = float(np.square(pushes).mean()) if len(pushes) else 0.0
    return -float((pushes ** 3).mean()) / power ** 1.5 if power else 0.0
