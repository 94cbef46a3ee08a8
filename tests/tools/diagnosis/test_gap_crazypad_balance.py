"""What the hover balance alone tells on CrazyPAD: fits and tests on made ones whose change and scatter are known."""

import numpy as np
import pytest

from tools.diagnosis import gap_crazypad_balance as balance


def test_a_cut_rotor_is_told_more_in_all_four():
    assert np.sign(balance.change({3: 2.0}, 0.03, 1.0)).tolist() == [1.0, 1.0, 1.0, -1.0]
    lift, roll, pitch, yaw = balance.change({1: 2.0, 2: 2.0}, 0.03, 1.0)
    assert lift > 0.0 > roll and abs(pitch) < 1e-12 and abs(yaw) < 1e-12


def test_slope_and_scatter_are_found_again():
    generator = np.random.default_rng(1)
    cuts = [{int(r): float(mm)} for r, mm in zip(generator.integers(1, 5, 400), generator.uniform(1, 8, 400),
                                                 strict=True)]
    scatter = np.array([0.013, 0.008, 0.008, 0.024])
    means = np.array([balance.change(c, 0.03, 1.2) for c in cuts]) + scatter * generator.standard_t(4, (400, 4))
    coefficients, residuals = balance.fit(means, cuts)
    assert coefficients == pytest.approx([0.03, 1.2], rel=0.1)
    assert balance.maintenance(residuals, np.full((400, 4), 1e-8), 4.0) == pytest.approx(scatter, rel=0.2)
