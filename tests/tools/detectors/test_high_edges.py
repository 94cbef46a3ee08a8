"""By which channels a detector detects a platform: known where the network reads one, or the noise is synthetic."""

from types import SimpleNamespace

import numpy as np
import pytest

from airtouch.detector.best.batches import channels_of
from airtouch.detector.best.network import weight_shapes
from airtouch.twin.recorded.course import course
from made_flight import SMALL, made_flight
from tools.detectors import high_edges


def one_channel(channel):
    """A network whose "over" logit reads this channel alone."""
    rng = np.random.default_rng(0)
    weights = {name: rng.normal(0.0, 0.3, shape).astype(np.float32)
               for name, shape in weight_shapes(SMALL.graph).items()}
    first = weights["layer0.kernel"]
    (axis,) = (i for i, size in enumerate(first.shape) if size == len(high_edges.NAMES))
    np.moveaxis(first, axis, 0)[np.arange(first.shape[axis]) != channel] = 0.0
    return SimpleNamespace(recipe=SMALL, weights=weights)


@pytest.mark.parametrize("name", ["gyro y", "motor mean"])
def test_only_the_channel_that_is_read_matters_when_muted(name):
    log = made_flight(0)
    x, _ = channels_of(log)
    edges = np.flatnonzero(np.abs(np.diff(log["zrange_m"])) > 0.05)
    span = SimpleNamespace(entry=int(edges[0]), exit=int(edges[-1]))
    channel = high_edges.CHANNELS.index(name)
    assert np.ptp(x[span.entry:span.exit, channel]) > 0.0
    changes = high_edges.mute_each_channel(log, span, one_channel(channel))[1:]
    assert changes[channel] != 0.0
    np.testing.assert_array_equal(np.delete(changes, channel), 0.0)


def test_air_is_replaced_by_the_flights_own_hover_there_and_nowhere_else():
    log = made_flight(0)
    sweep = course(log, 0.3)
    values = np.arange(len(log))[:, None] * np.ones(3)
    hover, middle = sweep.phases()["hover"], sweep.entry - high_edges.AHEAD
    for before, platform in ((True, False), (False, True), (True, True)):
        out = high_edges.hovering(values, sweep, before, platform)
        replaced = np.zeros(len(values), bool)
        replaced[hover.start:middle] = before
        replaced[middle:sweep.exit] = platform
        np.testing.assert_array_equal(out[~replaced], values[~replaced])
        shift = values[middle - 100:middle].mean() - values[hover].mean()
        assert hover.start <= (out[replaced] - shift).min() <= (out[replaced] - shift).max() <= hover.stop - 1
        if before:
            np.testing.assert_allclose(out[middle - 200:middle] - shift, values[hover][-200:])
        assert np.abs(np.diff(out[replaced][:, 0])).max() <= 1.0, "the hover jumps"


def test_a_network_that_forgets_the_approach_does_not_feel_it():
    log = made_flight(0)
    sweep = course(log, 0.3)
    channel = high_edges.CHANNELS.index("gyro y")
    full, hovered = high_edges.approach(log, sweep, one_channel(channel))[:2]
    reach = SMALL.receptive_samples
    assert sweep.exit - sweep.entry > 2 * (reach + high_edges.AHEAD), "the flight is too short for this test"
    assert full == pytest.approx(hovered, abs=0.2 * abs(full))


def test_shaking_over_a_platform_is_counted_above_3_hz_only():
    rng, t = np.random.default_rng(1), np.arange(1200) / 100.0
    values = rng.normal(0.0, 1.0, (1200, 10)) + 5.0 * np.sin(2 * np.pi * 0.5 * t)[:, None]
    values[600:900] += rng.normal(0.0, 3.0**0.5, (300, 10))
    before, over = high_edges.shaking(values, 600, 900)
    assert np.sqrt(over / before).mean() == pytest.approx(2.0, rel=0.1)
    assert before.mean() < 1.1, "the slow swing counts"


def test_hover_and_the_second_before_the_entry_are_apart():
    log = made_flight(0)
    columns = {name: values.copy() for name, values in log.columns.items()}
    sweep = course(log, 0.3)
    hover = sweep.phases()["hover"]
    columns["gyro_y_radps"][hover] += np.random.default_rng(2).normal(0.0, 0.2618 * 3, hover.stop - hover.start)
    rough, before = high_edges.calm(type(log)(columns, log.meta), sweep)
    same, calm = high_edges.calm(log, sweep)
    pitch = high_edges.CHANNELS.index("gyro y")
    assert rough[pitch] > same[pitch] + 1.0
    np.testing.assert_allclose(before, calm, atol=1e-9)
