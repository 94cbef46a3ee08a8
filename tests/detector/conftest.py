"""What several files of the detector's tests share."""

import pytest

from airtouch.detector import best
from made_flight import SMALL, SMALL_SEED, made_flight
from shared_fixture import once


@pytest.fixture(scope="session")
def small(tmp_path_factory):
    """A small network, trained on two made flights."""
    pytest.importorskip("tensorflow")
    return once(tmp_path_factory, "small", lambda: best.fit([made_flight(0), made_flight(1)], SMALL_SEED, recipe=SMALL))
