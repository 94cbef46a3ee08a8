"""The nameless model of the residual that a hypothesis leaves: a regression and free powers, without any effect.

Both are fitted to one half of the data and judged on the other. The `regression` fits every force, torque and rate by
the flight's own signals: thrust and its rate of change, roll, pitch and yaw commands, velocity, tilt, height over what
is below, time. The free `powers` are one factor for each view, channel and band. Only columns and bands are used that
gain more than chance gives the best of so many. What nominal flights have of a column or a band is no evidence: each
flight has a coefficient and a power of its own with a prior as wide as they scatter.
"""

from collections.abc import Sequence

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.problem import TWO_FOLDS, BlockSet, whole_of
from airtouch.gap.nameless.basis import BASIS
from airtouch.gap.nameless.columns import CHANNELS, WIDEST, NamelessFloor, allowed_columns, no_floor
from airtouch.gap.nameless.powers import power_floor, power_gain
from airtouch.gap.nameless.regression import BlockResiduals, coefficients, column_floor, linear_gain
from airtouch.gap.signals.channels import COLUMN
from airtouch.gap.signatures.term import Term

LIFT = COLUMN["force_z"]  #: channel of the force along the thrust
OF_HEIGHT = ("near", "low", "height")  #: columns of the height


def held_out_gains(data: Data, halves: Sequence[BlockSet], terms: Sequence[Sequence[Term]]) -> tuple[float, float]:
    """Held-out nats that columns, and powers on top of them, add to a hypothesis.

    halves: the blocks of the two; terms: the hypothesis as fitted to each of them. Less power than nominal flights have
    counts in simulated flights alone, as a recorded flight may have calmer air, and not in the band of the means, whose
    power the offsets may take.
    """
    floor = data.study.nameless_floor or no_floor()
    linear = power = 0.0
    for train, test in TWO_FOLDS:
        trained, held_out = (BlockResiduals(data, halves[half], terms[train]) for half in (train, test))
        fitted = np.array([coefficients(trained, channel, floor, allowed_columns(data, terms[train], channel))
                           for channel in range(CHANNELS)])
        for channel in range(CHANNELS):
            linear += linear_gain(held_out, channel, fitted[channel], floor)
        powers = [half.powers(half.whole_residual_under(fitted, floor)) for half in (trained, held_out)]
        power += power_gain(powers[0], powers[1], floor, data.study.simulated)
    return linear, power


def height_gain(data: Data, halves: Sequence[BlockSet]) -> float:
    """Held-out nats that a force along the thrust gains which follows the height over what is below."""
    floor = data.study.nameless_floor or no_floor()
    residuals = [BlockResiduals(data, half, ()) for half in halves]
    among = np.isin(np.arange(WIDEST), [BASIS.index(name) for name in OF_HEIGHT])
    return sum(linear_gain(residuals[test], LIFT, coefficients(residuals[train], LIFT, floor, among), floor)
               for train, test in TWO_FOLDS)


def nameless_floor(data: Data) -> NamelessFloor:
    """Scatter of coefficients and powers of nominal flights beyond that of chance; none with fewer than two."""
    flights = [BlockResiduals(data, whole_of(data, [i]), ()) for i in range(len(data.flights))]
    if len(flights) < 2:
        return no_floor()
    floor = NamelessFloor(column_floor(flights), no_floor().power)
    return NamelessFloor(floor.columns, power_floor([flight.floor_powers(floor) for flight in flights]))
