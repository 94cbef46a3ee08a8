"""A floor that rises with how hard the vehicle is flown: slopes against drawn powers whose law is known."""

from types import SimpleNamespace

import numpy as np
import pytest

from airtouch.gap.flights.blocks import BANDS_HZ
from airtouch.gap.flights.hardness import CALMER, HARDER, Slopes, hardness_of, slopes_of
from airtouch.gap.nominal.consistency import flown_unlike

FIRST = np.array([0, 128, 256])
FREQUENCY = np.fft.rfftfreq(256, 0.01)


class Rolling:
    """A vehicle that rolls to and fro by `swing` rad."""

    def __init__(self, swing):
        roll = swing * np.sin(2.0 * np.pi * np.arange(512) / 128.0)
        self.body_to_world = np.zeros((512, 3, 3))
        self.body_to_world[:, 2] = np.stack([np.zeros(512), np.sin(roll), np.cos(roll)], axis=1)
        self.phase = np.ones(512)
        self.on_ground = np.zeros(512, bool)
        self.usable = np.ones(512, bool)
        self.bridged = np.zeros(512, bool)

    def __len__(self):
        return 512


def draw_swings(slope, blocks, seed=0):
    """Exponential powers (blocks, bins, 2) whose mean goes with hardness to a slope in the first channel, 0 in the
    other."""
    rng = np.random.default_rng(seed)
    hardness = rng.uniform(0.0, 2.0, blocks)
    mean = np.exp(hardness[:, None, None] * np.array([slope, 0.0]) + np.array([3.0, -2.0]))
    return rng.exponential(np.broadcast_to(mean, (blocks, len(FREQUENCY), 2))), hardness


@pytest.mark.parametrize("slope", [0.0, 1.0, 2.0])
def test_slope_is_that_of_the_law_drawn(slope):
    slopes = slopes_of(*draw_swings(slope, 200), FREQUENCY).slope
    wide = FREQUENCY >= BANDS_HZ[2]  # the bands with many bins
    assert slopes[wide, 0] == pytest.approx(slope, abs=0.15)
    assert slopes[wide, 1] == pytest.approx(0.0, abs=0.15)


def test_prior_decides_where_all_blocks_are_flown_alike():
    power, _ = draw_swings(0.0, 40)
    slopes = slopes_of(power, np.full(40, 1.3), FREQUENCY)
    assert slopes.slope == pytest.approx(1.0)  # its mean, which is chosen
    assert slopes.relative_power(np.full(3, 1.3)) == pytest.approx(1.0)


def test_level_divides_out_hardness_within_the_trusted_range_only():
    power, hardness = draw_swings(2.0, 400)
    slopes = slopes_of(power, hardness, FREQUENCY)
    even = power / slopes.relative_power(hardness)
    wide = FREQUENCY >= BANDS_HZ[2]
    low, high = (even[k][:, wide, 0].mean() for k in (hardness < 0.5, hardness > 1.5))
    assert high / low == pytest.approx(1.0, abs=0.2)
    assert power[hardness > 1.5][:, wide, 0].mean() / power[hardness < 0.5][:, wide, 0].mean() > 10.0
    edge = np.array([hardness.min() - CALMER, hardness.max() + HARDER])
    assert slopes.relative_power(np.array([-50.0, 50.0])) == pytest.approx(slopes.relative_power(edge))


def test_a_flight_flown_unlike_its_baseline_is_said_so():
    calm, hard, nominal = ((name, Rolling(np.radians(swing)))
                           for name, swing in (("calm", 1.0), ("hard", 30.0), ("usual", 10.0)))
    slopes = Slopes(np.zeros((129, 13)), hardness_of(Rolling(np.radians(5.0)), FIRST, 256).min(),
                    1.5, hardness_of(Rolling(np.radians(15.0)), FIRST, 256).max())
    study = SimpleNamespace(floor=SimpleNamespace(slopes=slopes))
    for name, flight in (calm, hard, nominal):
        flight.file_name = name
        notes = flown_unlike(study, [flight])
        assert bool(notes) == (name != "usual")
        assert name == "usual" or {"calm": "calmer", "hard": "harder"}[name] in notes[0]


def test_hardness_is_the_logarithm_of_how_much_tilt_varies():
    still, hard = (hardness_of(Rolling(np.radians(s)), FIRST, 256) for s in (0.0, 20.0))
    assert still == pytest.approx(0.0)
    assert hard == pytest.approx(np.log(20.0 / np.sqrt(2.0)), rel=0.01)
    assert len(hardness_of(Rolling(0.1), np.zeros(0, int), 256)) == 0
