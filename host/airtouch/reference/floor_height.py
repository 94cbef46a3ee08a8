"""Height over a platform: what the estimator gets of the down range, and by how much optical flow is scaled.

The firmware takes a shorter down range for lost height. `FloorHeight` tells a step of the floor from a climb: what a
reading changed by beyond the vertical velocity is the floor's. See firmware/app/core/floor_height.h, which flies.
"""

import math

# Chosen in the simulated drone, as in floor_height.h; host/docs/height.md has what each choice costs.
STEP_M = 0.06  #: m, least step of the floor: a climb of 1 m/s makes 0.025 m between two readings at 40 Hz
TILT_SHARE = 0.5  #: share of the range times (1 - cosine of the tilt) by which the least step grows
TILT_COSINE = 0.87  #: cosine of 30 degrees: with more tilt no step is learnt
BEAM_COSINE = 0.1  #: cosine of 84 degrees: with more tilt a reading is passed on as it is; round number
GAP_MS = 150  #: ms, six readings: after a longer gap a reading is compared with the height instead
TRUST_M = 0.15  #: m, the floor is kept after a gap where the height agrees with it so closely
HOME_M = 0.08  #: m, a smaller sum of steps is the first floor, and fades
FADE_MPS = 0.05  #: m/s, speed at which it fades
MOST_M = 2.5  #: m, no floor is further from the first one: the sum of steps starts again
FLOW_NEAREST_M = 0.08  #: m, least range of the flow sensor (PMW3901): its picture does not scale below


class FloorHeight:
    """`range` takes each reading in its turn; `floor` is the height of what is below, over where it took off."""

    def __init__(self) -> None:
        self.floor, self.steps = 0.0, 0
        self._last: tuple[float, int] | None = None

    def range(self, distance: float, ms: int, cosine: float, climb: float, height: float) -> float:
        """What the estimator is to get, m, of a distance along the beam.

        ms: time of the reading; cosine of the angle between beam and plumb; climb: vertical velocity, m/s; height: the
        estimator's, m. A reading that is no number, or one of a drone tilted by more than 30 degrees, teaches nothing.
        """
        plumb = distance * cosine
        if not (math.isfinite(plumb + climb + height) and distance >= 0.0 and TILT_COSINE <= cosine <= 1.0):
            return distance + self.floor / cosine if BEAM_COSINE <= cosine <= 1.0 else distance
        if self._last is None or ms - self._last[1] > GAP_MS:
            if abs(plumb + self.floor - height) > TRUST_M:
                self.floor = 0.0
        else:
            seconds = 0.001 * (ms - self._last[1])
            jump = plumb - self._last[0] - climb * seconds
            if abs(jump) > STEP_M + TILT_SHARE * max(plumb, self._last[0]) * (1.0 - cosine):
                self.floor, self.steps = self.floor - jump, self.steps + 1
                if abs(self.floor) > MOST_M:
                    self.floor = 0.0
            if abs(self.floor) <= HOME_M:
                self.floor = math.copysign(max(abs(self.floor) - FADE_MPS * seconds, 0.0), self.floor)
        self._last = plumb, ms
        return distance + self.floor / cosine

    def flow(self, height: float) -> float:
        """Factor on the part of an optical flow that comes from moving."""
        if self.floor == 0.0 or not height > FLOW_NEAREST_M:  # NaN too
            return 1.0
        return max(height - self.floor, FLOW_NEAREST_M) / height
