"""The filters against those of scipy.signal."""

import numpy as np
import pytest
from scipy.signal import butter, lfilter, sosfiltfilt

from airtouch.gap.flights.filters import both_ways, highpass, lagged, lowpass

WALK = np.random.default_rng(1).normal(size=(2000, 3)).cumsum(axis=0)


@pytest.mark.parametrize("share", [0.008, 0.02, 0.3])
@pytest.mark.parametrize(("kind", "ours"), [("lowpass", lowpass), ("highpass", highpass)])
def test_both_ways_as_scipy(share, kind, ours):
    section = butter(2, share, kind, output="sos")
    np.testing.assert_allclose(ours(share), section[0], atol=1e-14)
    np.testing.assert_allclose(both_ways(ours(share), WALK), sosfiltfilt(section, WALK, axis=0), atol=1e-9)
    np.testing.assert_allclose(both_ways(ours(share), WALK[:, 0], 60), sosfiltfilt(section, WALK[:, 0], padlen=60),
                               atol=1e-9)


def test_lag_as_scipy():
    np.testing.assert_allclose(lagged(0.9, WALK), lfilter([0.1], [1.0, -0.9], WALK, axis=0), atol=1e-11)
