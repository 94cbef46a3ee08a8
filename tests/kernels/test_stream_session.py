"""The session, sample by sample, against the whole flight in one call."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from airtouch import kernels
from airtouch.detector import best
from airtouch.kernels.stream_session import StreamSession

RNG = np.random.default_rng(0)
SAMPLES = 2000
ACC = RNG.normal(0.0, 1.0, (SAMPLES, 3)) + (0.0, 0.0, 9.81)
GYRO = RNG.normal(0.0, 0.5, (SAMPLES, 3))
PWM = RNG.normal(40000.0, 5000.0, (SAMPLES, 4))
ACC[50:60], PWM[300:303] = np.nan, np.inf


@pytest.fixture(scope="module")
def keen():
    """Network, channels and decoder of the shipped model, the decoder so that noise has edges."""
    model = best.load(None)
    return model.int8, model.recipe.motion, replace(model.decoder, entry_score=-9.0, exit_score=-9.0, over_share=0.0)


@settings(max_examples=25)
@given(st.lists(st.integers(0, SAMPLES), max_size=8))
def test_pieces_of_any_size_give_the_events_of_the_whole(keen, cuts):
    at_once = kernels.stream_detector(ACC, GYRO, PWM, *keen)
    session = StreamSession(*keen)
    bounds = [0, *sorted(cuts), SAMPLES]
    pieces = [session.next(ACC[a:b], GYRO[a:b], PWM[a:b]) for a, b in zip(bounds[:-1], bounds[1:], strict=True)]
    assert at_once.edge.any()
    for name in ("logits", "ready", "edge", "airborne"):
        np.testing.assert_array_equal(np.concatenate([getattr(p, name) for p in pieces]), getattr(at_once, name))


def test_two_sessions_do_not_share_anything(keen):
    session, second_session = (StreamSession(*keen) for _ in range(2))
    first = session.next(ACC, GYRO, PWM)
    second = second_session.next(ACC, GYRO, PWM)
    np.testing.assert_array_equal(first.logits, second.logits)
