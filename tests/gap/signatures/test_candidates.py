"""Effects as hypotheses."""

import numpy as np
import pytest

from airtouch.gap.signatures import candidates


def test_lines_of_four_rotors_scatter_as_their_phases_do():
    phases = np.random.default_rng(3).uniform(0.0, 2.0 * np.pi, (50_000, 4))
    amplitude = np.abs(np.exp(1j * phases).sum(axis=1))
    assert candidates.OWN_SCATTER["vibration"] == pytest.approx(amplitude.std() / amplitude.mean(), rel=0.1)
