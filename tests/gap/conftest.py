"""What several files of the diagnosis' tests share."""

import pytest

from airtouch.gap import calibrate
from gap_flights import VEHICLE, flown


@pytest.fixture(scope="session")
def study():
    """A vehicle calibrated on five nominal flights."""
    return calibrate.calibrated(VEHICLE, flown(5, 41))[0]
