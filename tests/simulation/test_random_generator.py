"""Streams: the right distributions, independent of each other, the same for one key."""

import numpy as np
from scipy import stats

from airtouch.simulation.random_generator import generator, normal, normals, uniform


def test_draws_are_uniform_and_normal_out_to_the_tail():
    state = generator(1, 2, "imu")
    u = np.array([uniform(state) for _ in range(50_000)])
    assert u.min() > 0.0 and u.max() <= 1.0
    assert stats.kstest(u, "uniform").pvalue > 0.01
    n = np.empty(400_000)
    normals(state, n)
    assert stats.kstest(n, "norm").pvalue > 0.01
    tail = np.abs(n[np.abs(n) > 3.0])
    assert abs(len(tail) / len(n) / (2 * stats.norm.sf(3.0)) - 1) < 0.12
    beyond = n[np.abs(n) > 3.4426]
    assert abs(len(beyond) / len(n) / (2 * stats.norm.sf(3.4426)) - 1) < 0.25
    assert abs(np.corrcoef(n[:-1], n[1:])[0, 1]) < 0.006


def test_a_stream_depends_on_its_key_only():
    first = [normal(generator(3, 4, "imu")) for _ in range(2)]
    assert first[0] == first[1]
    first_draws = [normal(generator(*key)) for key in ((4, 3, "imu"), (3, 5, "imu"), (3, 4, "motors"))]
    assert len({first[0], *first_draws}) == 4
    a, b = np.empty(50_000), np.empty(50_000)
    normals(generator(3, 4, "imu"), a)
    normals(generator(3, 5, "imu"), b)
    assert abs(np.corrcoef(a, b)[0, 1]) < 0.015
