"""Disturbances without a name: how often each is drawn, and how strong."""

from collections import Counter

import numpy as np
import pytest

from airtouch.gap.relations import exposure
from airtouch.gap.relations.nameless_effects import DISTURBANCE, NAMES, Follows


def test_what_has_axes_and_noise_is_drawn_more_often():
    """Of 4000 drawn: three of four a wrench, of these the 22nds that the weights say."""
    rng = np.random.default_rng(1)
    drawn = [exposure.draw(rng) for _ in range(4000)]
    wrenches = [a for a in drawn if a.effect is DISTURBANCE]
    assert len(wrenches) == pytest.approx(3000, abs=150)
    count = Counter(Follows(int(a.values["follows"])) for a in wrenches)
    for follows in Follows:
        expected = len(wrenches) * {Follows.VELOCITY: 3, Follows.BODY_RATE: 3, Follows.NOISE: 3,
                                    Follows.TILT: 2}.get(follows, 1) / 22
        assert count[follows] == pytest.approx(expected, abs=5.0 * np.sqrt(expected))
    whole = np.mean([a.values["end"] > 1e6 for a in wrenches])
    assert whole == pytest.approx(0.7, abs=0.05)


def test_a_wrench_is_as_long_as_its_range_says():
    rng = np.random.default_rng(2)
    for a in (exposure.draw(rng) for _ in range(1000)):
        if a.effect is DISTURBANCE:
            force = np.array([a.values[n] for n in NAMES if n.startswith(("force", "torque"))])
            size = np.linalg.norm([*force[:3], *force[3:] / exposure.LEVER_M])
            assert exposure.FORCE_N[0] * 0.999 < size < exposure.FORCE_N[1] * 1.001
