"""The evidence for an effect: its gain over the base, and no more than nominal flights and its bound leave it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from airtouch.gap.evidence.data import Data
from airtouch.gap.naming.evidence import with_evidence
from airtouch.gap.naming.policy import LEAST_GAIN
from airtouch.gap.naming.records import Hypothesis, Strength
from airtouch.gap.signals.spectra import AIR
from airtouch.gap.signatures.candidates import terms
from airtouch.gap.signatures.scatter import Scatter
from gap_flights import VEHICLE
from hovers import LIFT_N, hover, scattered, select_from

FREEDOM, RMS = 8.0, 0.5
NOMINAL = Scatter({"mass": np.array([RMS])}, FREEDOM, (0.0, 0.0))


def evidence(scatter, strength, gain=100.0):
    """Evidence for a mass of an exact strength that gains so many nats, 40 of them its base's."""
    exact = Strength(np.array([strength]), np.zeros((1, 1)))
    candidate = Hypothesis("mass", (terms("mass")[0],), gain, strength=exact)
    data = SimpleNamespace(study=SimpleNamespace(scatter=scatter))
    return with_evidence(data, {"mass": candidate}, 40.0)["mass"].evidence


def test_without_nominal_flights_the_gain_decides():
    assert evidence(None, 2.0) == 60.0


@pytest.mark.parametrize("strength", [0.5, 1.0, -0.5])
def test_rarity_limits_the_gain(strength):
    """Student's log density at 0 over that at the strength."""
    rarity = 0.5 * (FREEDOM + 1.0) * np.log1p((strength / RMS) ** 2 / FREEDOM)
    assert evidence(NOMINAL, strength) == pytest.approx(rarity)
    assert evidence(NOMINAL, strength, 40.0 + 0.1 * rarity) == pytest.approx(0.1 * rarity), "which is less"


@pytest.mark.parametrize("scatter", [None, NOMINAL])
def test_a_strength_at_its_bound_is_no_evidence(scatter):
    (high,) = terms("mass")[0].bounds()[1]
    assert evidence(scatter, high) == 0.0
    assert evidence(scatter, high, 30.0) == -10.0


def test_halves_that_differ_lower_the_evidence():
    """Four flights of the same mean push: alike, or 1.0 and 0.4 m/s^2 in turns."""
    def pushed(*amounts):
        return [hover(20 + k, (0.0, 0.0, -a), length_s=10.0) for k, a in enumerate(amounts)]

    alike, apart = pushed(0.7, 0.7, 0.7, 0.7), pushed(1.0, 0.4, 1.0, 0.4)
    (sure,), (doubted,) = (select_from(f, ("imu_bias",))[0].steps for f in (alike, apart))
    unit = 0.1  # m/s^2, the parameter's step
    assert doubted.strength.mean[2] == pytest.approx(sure.strength.mean[2], rel=0.02)
    assert sure.strength.mean[2] == pytest.approx(-0.7 / unit, rel=0.02)
    # the mean of two values that lie 0.6 apart
    assert doubted.strength.variance[2] == pytest.approx((0.6 / unit) ** 2 / 4.0, rel=0.05)
    assert sure.strength.variance[2] < 0.01 * doubted.strength.variance[2]

    (mass,) = select_from(alike, ("mass",))[0].steps
    nominal = scattered(mass=[abs(mass.strength.mean[0]) / 14.0])
    (evident,), (deviation,) = (select_from(f, ("mass",), nominal)[0].steps for f in (alike, apart))
    # Student's density of 8 degrees of freedom, 14 deviations out; the other counts as far as both halves have it
    assert evident.evidence == pytest.approx(4.5 * np.log1p(14.0 ** 2 / 8.0), rel=0.05) and evident.is_named
    weak, between = (a / (4.0 * LIFT_N / VEHICLE.mass_kg - a) for a in (0.4, 0.7))  # shares of the mass
    assert deviation.evidence == pytest.approx(4.5 * np.log1p((14.0 * weak / between) ** 2 / 8.0), rel=0.1)
    assert not deviation.is_named
    assert deviation.gain > LEAST_GAIN


@pytest.mark.parametrize("seconds", [10.0, 40.0])
def test_the_chance_error_of_a_noise_counts(seconds):
    """Of n samples of white noise the rms is known to 1 / sqrt(2 n), so that no more than this is evidence."""
    nominal = scattered(imu_noise=[1e-6])  # next to none beyond chance
    selection, data = select_from([hover(3, louder=1.06, length_s=seconds)], ("imu_noise",), nominal)
    noise = selection.single_effects["imu_noise"]
    samples = 6.0 * 100.0 * seconds
    off_by_chance = noise.strength.mean[0] * np.sqrt(2.0 * samples)
    sure = with_evidence(data, {"imu_noise": replace(noise, gain=1000.0)}, 0.0)["imu_noise"]  # the gain limits nothing
    assert 0.1 * 0.5 * off_by_chance ** 2 < sure.evidence < 0.5 * off_by_chance ** 2


def test_a_floor_of_as_many_blocks_halves_what_a_noise_is_evidence_of():
    """The chance error of a ratio of two powers of as many blocks has twice the variance of that of one power."""
    nominal = scattered(imu_noise=[1e-6])
    selection, data = select_from([hover(3, louder=1.06)], ("imu_noise",), nominal)
    noise = {"imu_noise": replace(selection.single_effects["imu_noise"], gain=1000.0)}
    blocks = sum(len(first[AIR]) for first in data.block_starts)

    def evidence_with_floor_of(count):
        floor = replace(data.study.floor, block_counts={**data.study.floor.block_counts, AIR: count})
        study = replace(data.study, floor=floor, nominal_count=2)
        return with_evidence(Data(study, data.flights), noise, 0.0)["imu_noise"].evidence

    exact = evidence_with_floor_of(10**9)
    assert evidence_with_floor_of(blocks) == pytest.approx(0.5 * exact, rel=1e-3)
    assert evidence_with_floor_of(4 * blocks) == pytest.approx(0.8 * exact, rel=1e-3)
