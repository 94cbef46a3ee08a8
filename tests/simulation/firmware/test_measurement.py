"""The Kalman corrections against the textbook's matrices: gain, covariance, and Jacobians by finite differences."""

import math

import numpy as np
import pytest

from airtouch.simulation.firmware import estimator, kalman, measurement, settings

K = settings.load("2026.08")[0]


def random_estimate(rng, tilt_rad=0.15):
    """A kalman.STATE with a random state, covariance and small tilt; z about 1 m."""
    est = np.zeros(1, kalman.STATE)[0]
    kalman.begin(K, est, 0.3, -0.2, 1.0 + 0.2 * rng.random(), np.array([1.0, 0.0, 0.0, 0.0]))
    spread = rng.normal(size=(9, 9)) * 0.1
    est["p"] = spread @ spread.T + 0.01 * np.eye(9)
    est["v"] = 0.4 * rng.normal(size=3)
    est["gyro"] = 0.5 * rng.normal(size=3)
    c, s = math.cos(tilt_rad), math.sin(tilt_rad)
    est["r"] = [[c, 0, s], [0, 1, 0], [-s, 0, c]]
    return est


def textbook(x, p, h, error, std):
    """State (9,) and covariance after x += K e, P = (I - K H) P, with K = P H' / (H P H' + std^2)."""
    gain = p @ h / (h @ p @ h + std**2)
    return x + gain * error, (np.eye(9) - np.outer(gain, h)) @ p


def state_of(est):
    return np.r_[est["x"], est["v"], est["d"]]


@pytest.mark.parametrize("seed", range(4))
def test_the_range_is_one_update_along_the_tilted_beam(seed):
    rng = np.random.default_rng(seed)
    est, reading = random_estimate(rng, tilt_rad=0.35), np.zeros(1, estimator.READING)[0]
    reading["distance"], reading["distance_std"] = 1.3, 0.02
    beyond = max(0.35 - math.radians(K["range"]["cone_deg"]), 0.0)
    h = np.zeros(9)
    h[2] = 1 / math.cos(beyond)
    x, p = textbook(state_of(est), est["p"], h, 1.3 - est["x"][2] * h[2], 0.02)
    measurement.correct_range(K, est, reading)
    np.testing.assert_allclose(state_of(est), x, atol=1e-12)
    np.testing.assert_allclose(est["p"], p, atol=1e-12)
    assert est["updated"] == 1


def test_a_range_is_not_used_on_the_back():
    est, reading = random_estimate(np.random.default_rng(0)), np.zeros(1, estimator.READING)[0]
    est["r"] = np.diag([1.0, -1.0, -1.0])
    reading["distance"], reading["distance_std"], before = 0.5, 0.02, est["x"].copy()
    measurement.correct_range(K, est, reading)
    np.testing.assert_array_equal(est["x"], before)


@pytest.mark.parametrize("seed", range(4))
def test_the_flow_is_two_updates_whose_jacobians_are_the_slopes_of_the_counts(seed):
    rng = np.random.default_rng(seed)
    est, reading = random_estimate(rng), np.zeros(1, estimator.READING)[0]
    reading["forward"], reading["left"], reading["dt"], reading["std"] = 3.0, -2.0, 0.01, 2.0
    flow, height, ahead, aside = K["flow"], float(est["x"][2]), float(est["v"][0]), float(est["v"][1])
    r22, gyro = float(est["r"][2, 2]), est["gyro"].copy()
    pixels_per_rad = reading["dt"] * flow["pixels"] / flow["aperture_rad"]

    def counts(z, v, turn):
        """Pixels of a camera that looks down: angle rate of the ground, less the turn of the camera."""
        return pixels_per_rad * (v * r22 / z - turn)

    lsb, small = flow["counts_per_pixel"], 1e-6
    x, p = state_of(est), est["p"].copy()
    for column, v, turn, measured in ((3, ahead, gyro[1], 3.0), (4, aside, -gyro[0], -2.0)):
        h = np.zeros(9)
        h[2] = (counts(height + small, v, turn) - counts(height - small, v, turn)) / (2 * small)
        h[column] = (counts(height, v + small, turn) - counts(height, v - small, turn)) / (2 * small)
        x, p = textbook(x, p, h, measured / lsb - counts(height, v, turn), reading["std"] / lsb)
    measurement.correct_flow(K, est, reading)
    np.testing.assert_allclose(state_of(est), x, atol=1e-6)
    np.testing.assert_allclose(est["p"], p, atol=1e-6)


def test_the_spread_of_a_range_grows_as_its_exponential():
    s = K["range"]
    near, far = (measurement.range_std(K, d) for d in (0.1, s["std_far_m"]))
    assert far == pytest.approx(2 * s["std_m"])
    assert near == pytest.approx(s["std_m"] * (1 + math.exp(s["std_growth_1pm"] * (0.1 - s["std_far_m"]))))
