"""Crops that lose the middle of a platform: edges as recorded, the pass between them shorter."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch import logs
from airtouch.detector.best import batches
from airtouch.detector.best.outputs import goals
from airtouch.detector.best.recipe import CHANNELS, STRIDE, Recipe

ENTRY, LEAVE, N = 1500, 1800, 3000
PLAIN = replace(Recipe(), warp=0.0, gain=0.0, noise=0.0, offset=0.0, yaw_deg=0.0, mirror=0.0, silent_acceleration=0.0,
                silent_rates=0.0, silent_motors=0.0, phases=0.0, batch=400)
PER_SAMPLE = 1e-3  #: of the ramp in the first channel, which says which row is shown


@pytest.fixture(scope="module")
def flight():
    x = np.zeros((N, CHANNELS))
    x[:, 3] = PER_SAMPLE * np.arange(N)
    edges = [logs.Edge(ENTRY, "entry", 0.8, 0.1), logs.Edge(LEAVE, "exit", 0.1, 0.8)]
    over = ((np.arange(N) >= ENTRY) & (np.arange(N) < LEAVE)).astype(float)
    return batches.Flight(x, goals(over, edges, PLAIN), np.array([ENTRY, LEAVE]), np.ones(N, bool))


def crops(flight, share, seed=0):
    recipe = replace(PLAIN, short_passes=share, edge_share=1.0 if len(flight.edges) else 0.5)
    x, y = batches.batch([flight], recipe, np.random.default_rng(seed))
    return x[:, :, 3] / PER_SAMPLE, y


def test_passes_are_shorter_and_never_too_short(flight):
    """Of a pass of 300 samples 50 to 300 are left; without the setting 300 in every crop that holds both edges."""
    for share, shortest, mean in ((0.0, 300, 300), (1.0, 50, 175)):
        _, y = crops(flight, share)
        over = y[:, :, 0] > 0.5
        whole = ~over[:, 0] & ~over[:, -1] & over.any(axis=1)
        lengths = STRIDE * over[whole].sum(axis=1)
        assert whole.sum() > 50
        assert lengths.min() >= shortest - 4 and lengths.max() <= 304
        assert np.mean(lengths) == pytest.approx(mean, abs=25)


def test_rows_go_on_as_recorded_but_for_one_joint_over_the_platform(flight):
    rows, y = crops(flight, 1.0)
    jumps = 0
    for shown, wanted in zip(rows, y, strict=True):
        step = np.diff(shown)
        joint = np.flatnonzero(np.abs(step - 1.0) > 0.01)
        if len(joint):
            jumps += 1
            assert joint[-1] - joint[0] <= 2 * batches.JOINT
            assert shown[joint[0]] > ENTRY and shown[joint[-1] + 1] < LEAVE
        # what the network is to say belongs to the row that it sees
        apart = np.abs(np.diff(wanted[:, 0])) > 0.5
        at = shown[::STRIDE][1:][apart] - PLAIN.over_delay
        assert np.all(np.minimum(np.abs(at - ENTRY), np.abs(at - LEAVE)) <= STRIDE + 1)
    assert jumps > 100


def test_a_flight_without_a_platform_stays(flight):
    free = replace(flight, edges=np.array([], dtype=int), goals=np.zeros_like(flight.goals))
    rows, _ = crops(free, 1.0)
    step = np.diff(rows, axis=1)
    assert step.min() > -0.01 and step.max() < 1.01
