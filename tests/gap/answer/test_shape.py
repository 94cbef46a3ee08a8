"""How fast the lift of the ground dies out with height is found from all the data, for either curve that was flown."""

import pytest

from airtouch.gap.answer.named_effects import best_shape
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.problem import whole_of
from airtouch.gap.signatures import candidates
from gap_flights import fly


@pytest.mark.parametrize("fade", [0.0, 0.06])
def test_the_shape_that_was_flown_is_found_whichever_was_taken_before(study, fade):
    data = Data(study, fly(2, 77, [("ground_effect", {"strength": 1.5, "fade": fade, "turbulence": 0.0})]))
    for start in candidates.terms("ground_effect"):
        values = best_shape(data, whole_of(data), [start], None).terms[0].values
        assert values["fade"] == fade
