"""The curves of a report."""

import numpy as np
import pytest

from airtouch.gap.answer.pictures import pictures_of
from airtouch.gap.nominal.build_study import declared_study
from gap_flights import VEHICLE, flight
from made_diagnosis import cell


def test_lost_rows_add_nothing_to_a_spectrum_that_is_drawn():
    """A constant gap has no power above the means, whatever rows are lost."""
    lost = np.arange(1500) % 100 < 3
    whole, poor = (flight(15.0, np.array([0.5, 0.0, 0.0]), lost=rows) for rows in (None, lost))
    headline = cell("force_x", "hover", 0.5)
    power, poorer = (pictures_of(declared_study(VEHICLE, ()), [f], [], [], [headline]).spectra[0].before
                     for f in (whole, poor))
    assert poorer == pytest.approx(power, abs=1e-9) and power[3:].max() < 1e-9
