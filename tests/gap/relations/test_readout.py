"""Parameters of an effect from the strength of its class."""

import numpy as np
import pytest

from airtouch.gap.relations import readout as readout_module
from airtouch.gap.relations.readout import Readout, amount_of, read_out
from airtouch.simulation.effects import get


def test_a_power_law_is_read_off_exactly():
    strength = np.geomspace(1.0, 100.0, 40)
    readout = Readout(("fraction",), strength[:, None], 0.02 * strength[:, None] ** 1.5)
    amount, deviation = readout(np.array([20.0]))
    assert amount == pytest.approx([0.02 * 20.0 ** 1.5], rel=1e-3)
    assert deviation[0] < 1e-2 * amount[0]


@pytest.mark.parametrize("scatter", [0.05, 0.3])
def test_nine_intervals_in_ten_hold_the_amount(scatter):
    """The strength of a flight lies off by a normal error of the logarithm: its deviation is that of the amount."""
    rng = np.random.default_rng(1)

    def draw(count):
        amount = np.exp(rng.uniform(np.log(0.01), np.log(1.0), count))
        return 50.0 * amount * np.exp(scatter * rng.normal(size=count)), amount

    covered = []
    for _ in range(10):
        strength, amount = draw(80)
        readout = Readout(("fraction",), strength[:, None], amount[:, None])
        for s, true in zip(*draw(60), strict=True):
            (value,), (deviation,) = readout(np.array([s]))
            covered.append(abs(value - true) <= 1.645 * deviation)
    assert 0.84 < np.mean(covered) < 0.96


def test_either_sign_has_its_own_line():
    size = np.geomspace(1.0, 100.0, 30)
    strength, amount = np.concatenate([size, -size])[:, None], np.concatenate([2.0 * size, -3.0 * size])[:, None]
    readout = Readout(("loss",), strength, amount)
    assert readout(np.array([10.0]))[0] == pytest.approx([20.0], rel=1e-3)
    assert readout(np.array([-10.0]))[0] == pytest.approx([-30.0], rel=1e-3)


def test_a_sign_that_no_calibration_flight_has_mirrors_the_other():
    size = np.geomspace(1.0, 100.0, 30)
    readout = Readout(("fraction",), size[:, None], 2.0 * size[:, None])
    (there,), (here,) = readout(np.array([-20.0]))[0], readout(np.array([20.0]))[0]
    assert there == -here == pytest.approx(-40.0, rel=1e-3)


def test_several_parameters_are_linear_in_the_strengths():
    rng = np.random.default_rng(2)
    matrix, strength = np.array([[0.3, 0.1], [-0.2, 0.5]]), rng.normal(size=(60, 2))
    readout = Readout(("x", "y"), strength, strength @ matrix)
    amount, deviation = readout(np.array([2.0, -1.0]))
    assert amount == pytest.approx(np.array([2.0, -1.0]) @ matrix)
    assert np.all(deviation < 1e-9)


@pytest.mark.parametrize(("name", "parameter", "value"), [
    ("motor_lag", "factor", 1.4), ("controller_gain", "rate", 0.7), ("mass", "fraction", 0.05),
    ("imu_bias", "acc_z", -0.2)])
def test_amounts_and_values_are_the_inverse_of_each_other(name, parameter, value):
    amount = amount_of(get(name), parameter, value)
    size = np.geomspace(0.1, 10.0, 20)[:, None] * np.sign(amount)
    parameters = read_out(Readout((parameter,), size, size), get(name), np.array([amount]))
    assert parameters[parameter][0] == pytest.approx(value, rel=1e-6)


@pytest.mark.parametrize("beyond", [0.01, 100.0])
def test_beyond_the_calibration_the_amount_goes_on_in_proportion_to_the_strength(beyond):
    """Noisy calibration flights from 1 to 10: the line through the nearest ones would go anywhere."""
    rng = np.random.default_rng(3)
    strength = np.exp(rng.uniform(0.0, np.log(10.0), 80))
    amount = 0.02 * strength * np.exp(0.3 * rng.normal(size=80))
    (value,), (deviation,) = Readout(("fraction",), strength[:, None], amount[:, None])(np.array([beyond]))
    assert abs(np.log(value / (0.02 * beyond))) < 1.2
    assert 0.1 < deviation / value < 0.6


def test_one_flight_says_that_amount_and_strength_are_proportional():
    one, two = np.array([[1.0], [1.02]]), np.array([[0.02], [0.0206]])  # a slope of 1.5 from two flights
    (value,), _ = Readout(("fraction",), one, two)(np.array([20.0]))
    assert value == pytest.approx(0.02 * 20.0, rel=0.1)


def test_a_strength_of_which_both_signs_come_is_read_as_a_size():
    size = np.geomspace(1.0, 100.0, 40)
    sign = np.where(np.arange(40) % 2 == 0, 1.0, -1.0)
    mixed = Readout(("share",), size[:, None], (2.0 * size * sign)[:, None])
    assert not mixed.shows_sign(np.array([10.0])) and mixed(np.array([10.0]))[0] == pytest.approx([20.0], rel=1e-3)
    sign = np.where(np.arange(40) == 20, 1.0, -1.0)
    clear = Readout(("share",), size[:, None], (2.0 * size * sign)[:, None])
    assert clear.shows_sign(np.array([10.0])) and clear(np.array([10.0]))[0] == pytest.approx([-20.0], rel=1e-3)


def test_a_sign_that_no_calibration_flight_has_tells_the_amounts_as_the_other_does():
    size = np.geomspace(1.0, 100.0, 40)
    mixed = size * np.where(np.arange(40) % 2 == 0, 1.0, -1.0)
    for amount, shown in ((2.0 * size, True), (-2.0 * size, True), (mixed, False)):
        readout = Readout(("share",), size[:, None], amount[:, None])
        assert readout.shows_sign(np.array([-20.0])) is readout.shows_sign(np.array([20.0])) is shown


@pytest.mark.parametrize("parameters", [1, 2])
def test_a_strength_of_0_is_refused(parameters):
    strength = np.random.default_rng(5).uniform(1.0, 10.0, (40, parameters))
    with pytest.raises(ValueError, match="must not be 0"):
        Readout(("x", "y")[:parameters], strength, strength)(np.zeros(parameters))


def test_weights_fall_as_a_normal_density_from_the_nearest_flight_or_from_one_width_away():
    """Distances in units of the width: within the calibration as they are, beyond it less the way to it."""
    width = readout_module.KERNEL_WIDTH
    for distances, counted in (([-0.5, 1.0, 2.0], [0.5, 1.0, 2.0]), ([3.0, 4.0, 5.0], [1.0, 2.0, 3.0]),
                               ([-3.0, -4.0, -5.0], [1.0, 2.0, 3.0])):
        assert readout_module._weights(width * np.array(distances)) == pytest.approx(
            np.exp(-0.5 * np.array(counted) ** 2))


def test_the_deviation_is_that_of_flights_less_the_two_that_a_line_uses_up():
    residual = np.random.default_rng(4).normal(size=(10, 1))
    exact = np.sqrt((residual ** 2).sum() / (10.0 - 2.0))
    assert readout_module._deviation(residual, np.ones(10)) == pytest.approx([exact])
    twice = np.concatenate([residual, residual])  # half the weight: as many flights (Kish 1965)
    assert readout_module._deviation(twice, np.repeat([1.0, 0.0], 10)) == pytest.approx([exact])
