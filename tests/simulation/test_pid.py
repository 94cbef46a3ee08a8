"""One PID loop against sums worked out by hand and a step response in closed form."""

import numpy as np
import pytest

from airtouch.simulation.firmware import pid
from airtouch.simulation.firmware.settings import GAINS


def gains(p=0.0, i=0.0, d=0.0, integral_limit=0.0, output_limit=0.0):
    return np.array([(p, i, d, integral_limit, output_limit)], GAINS)[0]


def outputs(of, options, pairs):
    """What the loop gives for (desired, measured), one after the other."""
    state = np.zeros(1, pid.STATE)
    pid.reset(state[0], pairs[0][1])
    return [pid.run(of, state[0], options, float(desired), float(measured)) for desired, measured in pairs]


LEVEL = pid.Options(dt=0.01, scale=1.0, on_error=False, turns=False)


def test_a_proportional_loop_under_an_integrator_settles_as_an_exponential():
    """x' = p (1 - x): x(t) = 1 - exp(-p t)."""
    of, state, x, options = gains(p=3.0), np.zeros(1, pid.STATE), 0.0, pid.Options(1e-4, 1.0, False, False)
    for _ in range(5000):
        x += 1e-4 * pid.run(of, state[0], options, 1.0, x)
    assert x == pytest.approx(1.0 - np.exp(-1.5), abs=1e-4)


def test_the_integral_is_a_sum_that_stops_at_its_limit():
    pairs = [(2.0, 0.0)] * 5
    assert outputs(gains(i=10.0), LEVEL, pairs) == pytest.approx([0.2, 0.4, 0.6, 0.8, 1.0])
    assert outputs(gains(i=10.0, integral_limit=0.05), LEVEL, pairs) == pytest.approx([0.2, 0.4, 0.5, 0.5, 0.5])
    down = [(-2.0, 0.0)] * 5
    assert outputs(gains(i=10.0, integral_limit=0.05), LEVEL, down)[-1] == pytest.approx(-0.5)


def test_a_step_of_the_set_point_kicks_the_derivative_of_the_error_alone():
    pairs = [(0.0, 0.0), (1.0, 0.0), (1.0, 0.2)]
    assert outputs(gains(d=0.5), LEVEL, pairs) == pytest.approx([0.0, 0.0, -0.5 * 0.2 / 0.01])
    on_error = LEVEL._replace(on_error=True)
    assert outputs(gains(d=0.5), on_error, pairs) == pytest.approx([0.0, 0.5 / 0.01, -0.5 * 0.2 / 0.01])


def test_angles_take_the_shorter_way_round():
    options = LEVEL._replace(turns=True)
    assert outputs(gains(p=1.0), options, [(170.0, -170.0)]) == pytest.approx([-20.0])
    assert outputs(gains(p=1.0), options, [(-170.0, 170.0)]) == pytest.approx([20.0])
    # the measurement passes the turn: 4 degrees further, not 356 back
    assert outputs(gains(d=1.0), options, [(0.0, 178.0), (0.0, -178.0)])[1] == pytest.approx(-4.0 / 0.01)


def test_scale_multiplies_all_gains_and_the_output_ends_at_its_limit():
    options = LEVEL._replace(scale=3.0)
    assert outputs(gains(p=2.0, i=100.0), options, [(1.0, 0.0)]) == pytest.approx([3.0 * (2.0 + 1.0)])
    assert outputs(gains(p=2.0, output_limit=1.5), options, [(1.0, 0.0), (-1.0, 0.0)]) == pytest.approx([1.5, -1.5])
