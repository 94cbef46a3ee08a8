"""What holds for every plot."""

import sys

import pytest


@pytest.fixture(autouse=True)
def _no_figure_stays_open():
    """Pyplot keeps each of its figures open until it is closed, and takes memory for it."""
    yield
    pyplot = sys.modules.get("matplotlib.pyplot")
    assert pyplot is None or not pyplot.get_fignums()
