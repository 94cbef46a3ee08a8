"""The hover balance alone on CrazyPAD: fits and tests of synthetic balances whose change and scatter are known."""

import numpy as np
import pytest
from scipy.stats import t as student

from airtouch.gap.balance.hover_pattern import HoverPattern
from tools.diagnosis.recordings.crazypad import balance


def test_a_cut_rotor_is_commanded_more_in_all_four():
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


CUTS = [{r: float(mm)} for r in (1, 2, 3, 4) for mm in (2, 3, 4)]
SOLUTION = np.array([0.03, 1.2])


def test_the_rotor_is_named_where_noise_is_small_and_guessed_where_it_is_large():
    """One rotor of four cut: all flights right without noise; in noise far above the change a quarter are expected."""
    cut = ("E8", "cut_M3_3.0mm")
    rng = np.random.default_rng(0)
    true = balance.change({3: 3.0}, *SOLUTION)
    clear = balance.rotor_test(cut, np.tile(true, (5, 1)), SOLUTION, 1e4 * np.eye(4), rng)
    assert clear.hits.all() and clear.sides.all() and not clear.small and clear.expected == 1.0
    assert clear.mm == pytest.approx([3.0] * 5)
    drowned = balance.rotor_test(cut, np.tile(-true, (5, 1)), SOLUTION, 1e-3 * np.eye(4), rng)
    assert drowned.small and drowned.expected == pytest.approx(0.25, abs=0.03) and not drowned.sides.any()
    assert not drowned.hits.any() and drowned.mm == pytest.approx([-3.0] * 5)


def test_two_cut_rotors_are_right_in_either_order_of_their_cuts():
    """The test chooses rotors, not which of them lost more."""
    swapped = balance.change({1: 5.0, 2: 1.0}, *SOLUTION)
    test = balance.rotor_test(("E8", "cut_M1_1.0mm_M2_5.0mm"), swapped[None], SOLUTION, 1e4 * np.eye(4),
                              np.random.default_rng(0))
    assert test.hits.tolist() == [True]


def test_a_condition_is_tested_by_what_the_others_say():
    """Without scatter between conditions but their own, each is named by a slope that was fitted without it."""
    rows = [{"drone": "E8", "condition": "normal_flight"}] * 4
    rows += [{"drone": "E8", "condition": f"cut_M{r}_{mm}mm"} for cut in CUTS for r, mm in cut.items()]
    rng = np.random.default_rng(3)
    patterns = [HoverPattern(rng.normal(0.0, 1e-4, 4), np.full(2, -4.0), np.full(2, -6.0)) for _ in range(4)]
    patterns += [HoverPattern(balance.change(cut, *SOLUTION) + rng.normal(0.0, 1e-4, 4), np.full(2, -4.0),
                              np.full(2, -6.0)) for cut in CUTS]
    balances = balance.Balances(rows, patterns)
    assert balance.fit(balances.means, balances.cuts)[0] == pytest.approx(SOLUTION, rel=0.02)
    tests = balance.rotor_tests(balances)
    assert len(tests) == len(CUTS) and all(t.hits.all() for t in tests)
    assert [t.mm[0] for t in tests] == pytest.approx([sum(c.values()) for c in balances.cuts], rel=0.05)


@pytest.mark.parametrize(("kind", "extra"), [("rotor damage", 1.0), ("normal", 0.5)])
def test_drawn_balances_scatter_as_the_priors_say(kind, extra):
    """Student's t: variance of freedom / (freedom - 2); half of the normal flights were never maintained."""
    variance, rng = np.array([*[1e-6] * 4, 0.01, 0.01]), np.random.default_rng(1)
    change = np.array([[0.1, 0.0, -0.1, 0.2]])
    drawn = np.array([balance.drawn_pattern(kind, change, variance, rng).balance for _ in range(3000)])
    scatter = np.array(balance.PRIORS.maintenance)
    middle = np.median(drawn, axis=0)
    assert middle == pytest.approx(change[0], abs=0.1 * scatter.max())
    inside = (np.abs(drawn - change) < np.sqrt(1e-6 + scatter ** 2) * student.ppf(0.75, balance.PRIORS.freedom)).mean(0)
    narrow = 2.0 * student.cdf(np.sqrt(1e-6 + scatter ** 2) * student.ppf(0.75, balance.PRIORS.freedom) / 1e-3,
                               balance.PRIORS.freedom) - 1.0
    assert inside == pytest.approx(extra * 0.5 + (1.0 - extra) * narrow, abs=0.04)
