"""FR-CFAR against its definition and against the theory of its false alarms."""

import numpy as np
import pytest
from scipy.stats import binomtest, norm

from airtouch.errors import AirTouchError
from airtouch.reference import fr_cfar, threshold_factor


def test_is_the_equations_cell_by_cell():
    power = np.random.default_rng(0).exponential(size=300)
    threshold, alert = fr_cfar(power, guard_cells=4, leading_window=20, p_fa=1e-2)
    alpha = 20 * (1e-2 ** (-1 / 20) - 1)
    for i in range(300):
        if i < 24:
            assert np.isnan(threshold[i]) and not alert[i]
        else:
            assert threshold[i] == pytest.approx(alpha * power[i - 24:i - 4].mean(), rel=1e-12)
            assert alert[i] == (power[i] > threshold[i])


@pytest.mark.parametrize("p_fa", [1e-1, 1e-2, 1e-3])
def test_counted_false_alarms_on_exponential_noise(p_fa):
    """Cells under test one whole window apart are independent, so the count is binomial."""
    cells = 66
    power = np.random.default_rng(1).exponential(3.0, size=cells * 40_000)
    _, alert = fr_cfar(power, p_fa=p_fa)
    independent = alert[cells - 1::cells]
    interval = binomtest(int(independent.sum()), len(independent)).proportion_ci(0.999)
    print(f"P_FA {p_fa:g}: counted {independent.mean():.3g}, 99.9 % [{interval.low:.3g}, {interval.high:.3g}], n "
          f"{len(independent)}")
    assert interval.low <= p_fa <= interval.high


def test_false_alarms_at_one_in_a_million_by_importance_sampling():
    """Leading cells are drawn too weak and the cell under test too strong, weighed by the ratio of the densities.

    e^(-alpha Z) times the exponential density is again one, 1 + alpha / N times as steep: that is how weak.
    """
    cells, trials, p_fa = 66, 40_000, 1e-6
    scale = np.ones(cells)
    scale[:50], scale[-1] = 1 / (1 + threshold_factor(50, p_fa) / 50), 13.0
    power = np.random.default_rng(2).exponential(size=(trials, cells)) * scale
    _, alert = fr_cfar(power.reshape(-1), p_fa=p_fa)
    weight = np.exp((np.log(scale) + power / scale - power).sum(axis=1)) * alert[cells - 1::cells]
    half = norm.ppf(0.9995) * weight.std() / trials**0.5
    print(f"P_FA 1e-6: estimated {weight.mean():.3g} +- {half:.1g} (99.9 %), n {trials}")
    assert abs(weight.mean() - p_fa) <= half < 0.15 * p_fa


def test_factor_is_the_equation():
    assert threshold_factor(50, 1e-6) == pytest.approx(50 * (1e-6 ** (-1 / 50) - 1))


def test_cells_that_are_not_powers():
    power = np.array([np.nan, -1.0, 2.0, np.inf, 3.0, -np.inf])
    threshold, _ = fr_cfar(power, guard_cells=0, leading_window=1, p_fa=0.5)
    np.testing.assert_allclose(threshold, [np.nan, 0, 0, 2, 2, 3])


@pytest.mark.parametrize("settings", [dict(leading_window=0), dict(guard_cells=-1), dict(p_fa=0.0), dict(p_fa=1.0),
                                      dict(p_fa=1e-40), dict(p_fa=np.nan)])
def test_settings_out_of_range_are_refused(settings):
    with pytest.raises(AirTouchError):
        fr_cfar(np.ones(10), **settings)
