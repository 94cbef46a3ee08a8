"""What several files of the detector's tests share."""

import pytest

from airtouch.detector import best
from made_flight import SMALL, made_flight


@pytest.fixture(scope="session")
def small():
    """A small network, trained on two made flights."""
    pytest.importorskip("tensorflow")
    return best.fit([made_flight(0), made_flight(1)], seed=3, recipe=SMALL)
