"""What a study says of itself: whose flights its nominal ones are, and by how much their means differ."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from airtouch.gap.signals.channels import COUNT
from hovers import FLOOR


def study_of(exact, by_firmware=True):
    """A study whose nominal flights scatter as a simulator's do, or not, with this project's firmware or another."""
    return replace(FLOOR.with_scatter(SimpleNamespace(exact=exact)), loop=SimpleNamespace(by_firmware=by_firmware))


def test_flights_of_unknown_scatter_count_as_recorded():
    assert not FLOOR.simulated and not study_of(exact=False).simulated and study_of(exact=True).simulated


@pytest.mark.parametrize(("exact", "by_firmware", "same"),
                         [(True, True, True), (True, False, False), (False, True, False)])
def test_same_models_needs_simulated_flights_and_own_firmware(exact, by_firmware, same):
    """Other simulators' flights scatter as little, but their models of the air are their own."""
    study = study_of(exact, by_firmware)
    assert study.same_models is same and not replace(study, loop=None).same_models


@pytest.mark.parametrize("exact", [True, False])
def test_what_the_lowest_bin_gives_the_means_is_no_offset_of_simulated_flights(exact):
    floor = replace(FLOOR.floor, offset=np.full(COUNT, 0.5), offset_beyond=np.full(COUNT, 0.3))
    np.testing.assert_array_equal(replace(study_of(exact), floor=floor).offset, 0.3 if exact else 0.5)
