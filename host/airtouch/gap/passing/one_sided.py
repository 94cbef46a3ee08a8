"""Whether what pushes a flight along its thrust pushes it down: a wake from above does, most other disturbances do not.

The likelihood knows spectra alone, which are the same whichever way a push goes.
"""

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.passing.bursts import FORCE_BURSTS, residual_in_band

DOWNWARD = "downward"  #: of `Scatter.passing`, what nominal flights have of `downward`
#: band in which the sign of pushes is seen; chosen: a wake is passed in a tenth of a second or more. A higher upper end
#: takes in shorter pushes, and more of what shakes both ways
PUSH_BAND_HZ = (1.0, 8.0)


def downward(data: Data) -> float:
    """Skewness of the force along the thrust in PUSH_BAND_HZ, with its sign changed.

    Above 0 where the strongest pushes point down. What `residual_in_band` leaves out does not count, nor does
    the mean of each flight; 0 where nothing is left.
    """
    deviations = []
    for flight in data.flights:
        force, counts = residual_in_band(data.study, flight, FORCE_BURSTS.column, PUSH_BAND_HZ)
        pushes = force[counts]
        deviations.append(pushes - pushes.mean() if len(pushes) else pushes)
    pushes = np.concatenate(deviations)
    power = float(np.square(pushes).mean()) if len(pushes) else 0.0
    return -float((pushes ** 3).mean()) / power ** 1.5 if power else 0.0
