"""Between the down range and the estimator: what keeps the height where something higher is below.

`platform` is the module of the paper's fork, `compensated` chooses by the firmware's settings.
"""

import numpy as np

from airtouch.simulation.compiled import jit
from airtouch.simulation.firmware.settings import MAP, PLATFORM

STATE = np.dtype([("reference", np.float64), ("held", np.float64), ("over", np.int64), ("count", np.int64)])


@jit
def platform(settings, state, distance):
    """Height that the fork's range module gives for a reading, m.

    A drop of more than the threshold since the reference sets a flag, a rise of as much clears it; with
    the flag a fixed height is added. What would jump by more than a step is replaced by what was passed
    last. The reference is the reading of each eighth call.
    """
    s = settings.range_module
    change = distance - state.reference
    if change < -s.threshold_m:
        state.over = 1
    elif change > s.threshold_m:
        state.over = 0
    candidate = distance + s.height_m if state.over else distance
    if abs(candidate - state.held) <= s.step_m:
        state.held = candidate
    state.count += 1
    if state.count % s.every == 0:
        state.reference = distance
    return state.held


@jit
def compensated(settings, state, distance, top):
    """Height that the estimator gets for a reading, m. top: true height of the surface under the beam."""
    kind = settings.range_module.kind
    if kind == PLATFORM:
        return platform(settings, state, distance)
    if kind == MAP:
        return distance + top
    return distance
