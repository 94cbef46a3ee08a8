"""What several files of the selection's tests share."""

import pytest

from airtouch.gap.nominal.build_study import declared_study
from gap_flights import VEHICLE, fly


@pytest.fixture(scope="session")
def flying():
    """A vehicle as declared with the loop of four nominal flights; no scatter."""
    return declared_study(VEHICLE, fly(4, 41))
