"""A class recovers the curve and the scatter that its flights were drawn from."""

import numpy as np
import pytest

from airtouch.gap.relations.effect_class import ClassFlights, EffectClass, learn_class, stands_out

Q, N = 20, 400


def test_a_bent_curve_and_its_scatter_are_recovered():
    """Shift s along one axis and 0.02 s^1.5 along another, with 20 % scatter along a third."""
    rng = np.random.default_rng(1)
    strength = np.exp(rng.uniform(np.log(1.0), np.log(100.0), N))
    shift = np.zeros((N, Q))
    shift[:, 0], shift[:, 1] = strength, 0.02 * strength ** 1.5
    shift[:, 2] = 0.2 * rng.normal(size=N) * np.linalg.norm(shift[:, :2], axis=1)
    features = shift + rng.normal(size=(N, Q))
    effect_class = learn_class("one", "one", None, ClassFlights(0.01 * strength[:, None], shift, features))
    assert not effect_class.signed and effect_class.parameters == 1
    for s in (5.0, 20.0, 80.0):
        expected = np.zeros(Q)
        expected[:2] = s, 0.02 * s ** 1.5
        # the strength is the shift along the main direction, which is nearly the first axis
        nearest = min((effect_class.mean(np.array([[x]]))[0] for x in np.geomspace(0.8 * s, 1.3 * s, 200)),
                      key=lambda m: np.linalg.norm(m - expected))
        assert np.linalg.norm(nearest - expected) < 0.05 * np.linalg.norm(expected)
    assert np.abs(effect_class.axes[2, 0]) > 0.95
    assert np.sqrt(effect_class.variances[0]) == pytest.approx(0.2, rel=0.15)


def test_two_signs_are_two_branches():
    rng = np.random.default_rng(2)
    strength = np.exp(rng.uniform(np.log(3.0), np.log(50.0), N)) * rng.choice([-1.0, 1.0], N)
    shift = np.zeros((N, Q))
    shift[:, 0], shift[:, 1] = strength, 0.5 * np.abs(strength)
    flights = ClassFlights(strength[:, None], shift, shift + 0.3 * rng.normal(size=(N, Q)))
    effect_class = learn_class("one", "one", None, flights)
    assert effect_class.signed
    up, down = effect_class.mean(np.array([[20.0], [-20.0]]))
    assert up[0] == pytest.approx(-down[0], rel=0.05)
    assert up[1] == pytest.approx(down[1], rel=0.05) and up[1] > 0.0


def test_a_plane_of_two_parameters():
    rng = np.random.default_rng(3)
    plane = rng.normal(size=(2, Q))
    way = rng.normal(size=(N, 2))
    strength = way / np.linalg.norm(way, axis=1, keepdims=True) * np.exp(rng.uniform(0.0, 3.0, N))[:, None]
    shift = strength @ plane
    effect_class = learn_class("two", "two", None, ClassFlights(strength, shift, shift + 0.1 * rng.normal(size=(N, Q))))
    strength_pair = np.array([[0.6, -0.8]])
    middle = np.median(np.abs(strength))  # what strengths are scaled by
    assert effect_class.mean(strength_pair)[0] == pytest.approx(middle * strength_pair[0] @ plane, rel=0.05, abs=0.05)


def test_flights_that_hit_something_do_not_bend_the_curve():
    """One flight in twenty lies far off, across the others."""
    rng = np.random.default_rng(4)
    strength = np.exp(rng.uniform(np.log(5.0), np.log(50.0), N))
    shift = strength[:, None] * np.eye(Q)[0] + 0.01 * rng.normal(size=(N, Q))
    shift[::20, 1] += 10.0 * strength[::20]
    effect_class = learn_class("one", "one", None, ClassFlights(strength[:, None], shift, shift))
    direction = effect_class.mean(np.array([[20.0]]))[0]
    assert abs(direction[1]) < 0.02 * abs(direction[0])
    assert effect_class.variances.size == 0  # no scatter is learned from them


def test_noise_alone_stands_out_in_no_direction():
    """Eigenvalues of noise reach (1 + sqrt(dimensions / samples))^2 times its variance (Marchenko and Pastur)."""
    rng = np.random.default_rng(5)
    samples = 0.3 * rng.normal(size=(N, 100))
    variance = np.linalg.svd(samples / np.sqrt(N), compute_uv=False) ** 2
    assert variance[0] > 1.5 * 0.3 ** 2
    assert not stands_out(variance, 0.3 ** 2, 100, N).any()
    assert stands_out(np.append(1.5 * variance[0], variance), 0.3 ** 2, 100, N).sum() == 1


def test_a_class_of_one_parameter_of_several_says_which():
    def named(name, effect):
        return EffectClass(name, effect, None, 1, False, np.zeros(2), np.zeros((1, 2, Q)), np.zeros((Q, 0)),
                           np.zeros(0))

    assert named("controller_gain rate", "controller_gain").own_parameter == "rate"
    assert named("mass", "mass").own_parameter is None


def test_scatter_is_that_beyond_nominal_flights():
    """Shifts have length 5: nominal flights scatter by a fifth of it in every direction, the class by 0.3 in one."""
    rng = np.random.default_rng(6)
    strength = np.full((4000, 1), 5.0) * np.exp(0.01 * rng.normal(size=(4000, 1)))
    shift = strength * np.eye(Q)[0]
    flights = shift + rng.normal(size=(4000, Q)) + 1.5 * rng.normal(size=(4000, 1)) * np.eye(Q)[2]
    effect_class = learn_class("one", "one", None, ClassFlights(strength, shift, flights))
    assert np.sqrt(effect_class.variances) == pytest.approx([1.5 / 5.0], rel=0.08)


def test_a_curve_has_a_knot_for_every_factor_of_three():
    """Strengths over a factor of 3^6, but for the weakest hundredth: six stretches, each of nearly that factor."""
    strength = np.geomspace(1.0, 3.0 ** 6, N)
    shift = strength[:, None] * np.eye(Q)[0]
    knots = learn_class("one", "one", None, ClassFlights(strength[:, None], shift, shift)).knots
    assert len(knots) == 7
    assert np.diff(knots) == pytest.approx(np.log(3.0), rel=0.02)


def test_no_more_than_the_sixteen_widest_directions_of_scatter_are_learned():
    """Shifts have length 50 and flights scatter in 20 directions, by 0.2 to 0.6 of it."""
    rng = np.random.default_rng(7)
    many, dimensions = 3000, 30
    spread = np.linspace(0.6, 0.2, 20)
    shift = 50.0 * np.exp(0.01 * rng.normal(size=(many, 1))) * np.eye(dimensions)[0]
    flights = shift + rng.normal(size=(many, dimensions))
    flights[:, 1:21] += 50.0 * spread * rng.normal(size=(many, 20))
    learned = learn_class("one", "one", None, ClassFlights(shift[:, :1], shift, flights))
    assert np.sqrt(learned.variances) == pytest.approx(spread[:16], rel=0.15)


@pytest.mark.parametrize(("negative", "signed"), [(32, False), (48, True)])
def test_a_class_has_two_signs_from_a_tenth_of_negative_strengths_on(negative, signed):
    """Of 400 flights; a few that hit something may lie on the other side."""
    strength = np.geomspace(3.0, 50.0, N) * np.where(np.arange(N) % (N // negative) == 0, -1.0, 1.0)
    strength[np.flatnonzero(strength < 0.0)[negative:]] *= -1.0
    shift = strength[:, None] * np.eye(Q)[0]
    assert learn_class("one", "one", None, ClassFlights(np.abs(strength[:, None]), shift, shift)).signed is signed


@pytest.mark.parametrize(("shortest", "longest"), [(0.6, 1.5), (0.6, 0.9)])
@pytest.mark.parametrize("seed", range(4))
def test_weak_shifts_in_any_direction_are_no_class(shortest, longest, seed):
    """Each of 40 shifts is longer than LEAST_SHIFT, but few are along the direction that they have in common."""
    rng = np.random.default_rng(seed)
    way = rng.normal(size=(40, Q))
    shift = way / np.linalg.norm(way, axis=1, keepdims=True) * rng.uniform(shortest, longest, (40, 1))
    flights = ClassFlights(np.ones((40, 1)), shift, shift + rng.normal(size=(40, Q)))
    assert learn_class("one", "one", None, flights, least_flights=20) is None


def test_strengths_of_one_magnitude_are_no_class():
    """A curve along the strength needs two, and the prior of the strength a range."""
    strength = np.full((40, 1), 5.0)
    shift = strength * np.eye(Q)[0]
    assert learn_class("one", "one", None, ClassFlights(strength, shift, shift)) is None


def test_a_curve_does_not_pass_through_few_flights():
    """24 flights over a factor of 3^11, with two signs: their scatter of 30 % shows.

    With a knot for each factor of three, each coordinate would have as many coefficients as there are flights.
    """
    rng = np.random.default_rng(8)
    strength = np.geomspace(1.0, 3.0 ** 11, 24) * np.where(np.arange(24) % 2 == 0, 1.0, -1.0)
    shift = strength[:, None] * np.eye(Q)[0]
    shift[:, 1:] += 0.3 * np.abs(strength[:, None]) * rng.normal(size=(24, Q - 1))
    learned = learn_class("one", "one", None, ClassFlights(np.sign(strength[:, None]), shift, shift))
    assert learned.signed
    assert len(learned.variances) and np.sqrt(learned.variances[0]) > 0.5 * 0.3
