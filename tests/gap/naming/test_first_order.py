"""First looks at effects whose gain is known in closed form."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.gap.evidence.data import Data
from airtouch.gap.naming.judging import trial_of
from airtouch.gap.naming.screening.first_order import judge_means, remainder_of
from airtouch.gap.signals.channels import COLUMN, COUNT
from airtouch.gap.signatures.candidates import terms
from hovers import DOWN, FLOOR, hover

SPREAD = 0.1  #: m/s^2, standard deviation of the lift's offset between nominal flights


@pytest.mark.parametrize("count", [1, 4])
def test_what_all_flights_share_is_no_offset_of_each(count):
    """Every flight is pushed down alike: without an effect its offset costs (DOWN / SPREAD)^2 / 2 nats, with one none.

    One flight is halved by blocks, so that it has an offset in either half.
    """
    offset = np.where(np.arange(COUNT) == COLUMN["force_z"], SPREAD, 0.0)
    study = replace(FLOOR, floor=replace(FLOOR.floor, offset=offset))
    data = Data(study, [hover(40 + k, (0.0, 0.0, -DOWN), name=f"flight {k}") for k in range(count)])
    remainders = [remainder_of(data, part, ()) for part in trial_of(data).halves]
    look = judge_means(data, remainders, terms("mass")[:1])
    assert look.gain == pytest.approx(max(count, 2) * 0.5 * (DOWN / SPREAD) ** 2, rel=0.1)
