"""What several files of the diagnosis' tests share."""

import pytest

from airtouch.gap.nominal import calibrate
from gap_flights import VEHICLE, fly
from shared_fixture import once


@pytest.fixture(scope="session")
def study(tmp_path_factory):
    """A vehicle calibrated on five nominal flights."""
    return once(tmp_path_factory, "study", lambda: calibrate.calibrated(VEHICLE, fly(5, 41))[0])
