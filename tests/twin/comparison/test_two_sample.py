"""The classifier test: 0.5 for two halves of one set, near 1 for sets that differ; areas as in SciPy."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import mannwhitneyu

from airtouch.errors import AirTouchError
from airtouch.twin.comparison.two_sample import area, area_within, feature_names, two_sample, windows
from airtouch.twin.recorded.channels import channels
from airtouch.twin.recorded.course import course
from skips import needs
from twin_courses import PLAIN, made_course

pytestmark = needs("sklearn")


def fly(fly_course, count, seed, effects=PLAIN, **options):
    out = []
    for number in range(count):
        log = fly_course(made_course(number, 0.06), effects, number, seed, **options)
        try:
            sweep = course(log) if log is not None else None
        except AirTouchError:
            sweep = None
        if sweep is not None:
            out.append((channels(log), sweep, number))
    return out


@pytest.fixture(scope="module")
def some(fly_course):
    return fly(fly_course, 40, 3)


def test_area_is_that_of_the_rank_sum_test():
    rng = np.random.default_rng(0)
    score, kind = np.round(rng.normal(size=300), 1), rng.integers(0, 2, 300)
    score[kind == 1] += 0.4
    expected = mannwhitneyu(score[kind == 1], score[kind == 0]).statistic / (kind.sum() * (1 - kind).sum())
    assert area(score, kind) == pytest.approx(expected, abs=1e-12)


def test_area_within_folds_does_not_compare_folds():
    score, kind, fold = np.array([0.1, 0.2, 0.8, 0.9]), np.array([0, 1, 0, 1]), np.array([0, 0, 1, 1])
    assert area(score, kind) == 0.75
    assert area_within(score, kind, fold) == 1.0
    assert np.isnan(area_within(score, kind, np.arange(4)))


def test_two_halves_of_one_set_cannot_be_told_apart(some):
    """Other courses, other seeds: the 95 % interval of most phases holds 0.5, none is far off."""
    real, fake = windows(some[0::2]), windows([(x, c, n + 1000) for x, c, n in some[1::2]])
    by_phase = {a.phase: a for a in two_sample(real, fake)}
    print(*by_phase.values(), sep="\n")
    assert {"hover", "cruise", "over", "after"} <= set(by_phase)
    values = [a.value for a in by_phase.values()]
    assert np.mean(values) == pytest.approx(0.5, abs=0.1)
    assert 0.25 < min(values) and max(values) < 0.75
    assert sum(a.low <= 0.5 <= a.high for a in by_phase.values()) >= 4


def test_other_noise_and_other_air_are_told_apart(some, fly_course, vehicle):
    noisy = replace(vehicle, gyro_noise_rms_radps=2.0 * vehicle.gyro_noise_rms_radps)
    other = fly(fly_course, 16, 4, {**PLAIN, "ground_effect": {"strength": 2.5, "turbulence": 1.0}}, craft=noisy)
    by_phase = {a.phase: a for a in two_sample(windows(some), windows(other))}
    print(*by_phase.values(), sep="\n")
    assert by_phase["hover"].value > 0.9 and by_phase["over"].value > 0.9
    assert "gyro" in by_phase["hover"].telling[0]
    for a in by_phase.values():
        assert a.low <= a.value <= a.high


def test_windows_stay_in_their_phase_and_flight(some):
    features = windows(some[:3])
    assert features.values.shape == (len(features.phase), len(feature_names()))
    assert np.isfinite(features.values).all()
    assert set(features.flight) == {n for _, _, n in some[:3]}


def test_trims_do_not_tell(some):
    """A constant on a motor channel changes no window."""
    x, sweep, number = some[0]
    trimmed = x + np.r_[np.zeros(6), [500.0, -300.0, 200.0, 1000.0], np.zeros(2)]
    np.testing.assert_allclose(windows([(trimmed, sweep, number)]).values, windows([(x, sweep, number)]).values,
                               atol=1e-6)
