"""Whether what pushes a flight along its thrust pushes it down: a wake from above does, most other disturbances do not.

The likelihood knows spectra alone, which are the same whichever way a push goes.
"""

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.flights.filters import both_ways, highpass, lowpass
from airtouch.gap.flights.flight import PERIOD_S
from airtouch.gap.passing.bursts import LIVELY_HZ
from airtouch.gap.passing.stretches import ENDS
from airtouch.gap.signals.channels import residual

DOWNWARD = "downward"  #: of `Scatter.passing`, what nominal flights have of `downward`
FAST_HZ = 8.0  #: frequency up to which pushes are seen: a wake is passed in a tenth of a second or more; chosen


def downward(data: Data) -> float:
    """Skewness of the force along the thrust, from LIVELY_HZ to FAST_HZ, with its sign changed.

    Above 0 where the strongest pushes point down. Take-off, landing, ground and bridged samples do not count, nor does
    the mean of each flight; 0 where nothing is left.
    """
    values = []
    for flight in data.flights:
        force = np.nan_to_num(residual(flight, data.study.vehicle, data.study.calibration)[:, 2])
        counts = ~(flight.on_ground | flight.bridged | np.isin(flight.phase, ENDS))
        force[~counts] = 0.0
        slow = both_ways(lowpass(FAST_HZ * 2.0 * PERIOD_S), force)
        pushes = both_ways(highpass(LIVELY_HZ * 2.0 * PERIOD_S), slow)[counts]
        values.append(pushes - pushes.mean() if len(pushes) else pushes)
    every = np.concatenate(values)
    power = float(np.square(every).mean()) if len(every) else 0.0
    return -float((every ** 3).mean()) / power ** 1.5 if power else 0.0
