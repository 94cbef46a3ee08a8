"""The streaming detector: C equals its NumPy definition, piece by piece and whole."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_stream import network

from airtouch import kernels as c
from airtouch import logs
from airtouch.detector.shared.channels import level_acceleration
from airtouch.errors import AirTouchError
from airtouch.kernels.library import ffi, lib
from airtouch.logs.flight_log import GYRO, PWM
from airtouch.reference.edge_decoder import LOGITS, MOST_LOOK_BACK, DecoderConfig, edge_decoder
from airtouch.reference.motion_channels import NAMES, motion_channels
from airtouch.reference.networks.int8_network import quantise
from airtouch.reference.networks.stream_int8 import run_stream

ODD = st.sampled_from([0.0, -0.0, 1e-42, 1e30, -1e38, np.nan, np.inf, -np.inf, 65535.0, 65536.0, -1.0])


def flight(seed: int, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Noise around hover after a second on the ground."""
    rng = np.random.default_rng(seed)
    pwm = 46000 + 2000 * rng.standard_normal((n, 4))
    pwm[:min(n, 100)] = 0
    return rng.normal([0, 0, 9.81], 0.4, (n, 3)), rng.normal(0, 0.3, (n, 3)), pwm


def test_c_and_the_references_agree_on_the_number_of_channels_and_logits():
    assert (lib.MOTION_CHANNELS, lib.EDGE_DECODER_LOGITS) == (len(NAMES), len(LOGITS))
    with pytest.raises(AirTouchError, match="12 channels and give 3 logits"):
        c.stream_detector(*flight(0, 10), network(0, channels=12, outputs=2))


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 2**31), n=st.integers(0, 400),
       odd=st.lists(st.tuples(st.integers(0, 399), st.integers(0, 9), ODD), max_size=20))
def test_channels_equal_the_reference_for_any_input(seed, n, odd):
    signals = np.column_stack(flight(seed, n)).astype(np.float32)
    for row, column, value in odd:
        if row < n:
            signals[row, column] = value
    parts = signals[:, :3], signals[:, 3:6], signals[:, 6:]
    expected, flying = motion_channels(*parts)
    channels, airborne = c.motion_channels(*parts)
    assert np.array_equal(airborne, flying)
    assert np.isfinite(channels).all() and np.abs(channels).max(initial=0) <= 4.0
    huge = np.abs(np.nan_to_num(signals)).max(initial=0) > 1e6  # float32 keeps no detail beside such a value
    assert huge or np.allclose(channels, expected, atol=2e-4)


def test_channels_equal_the_reference_on_real_flights(flights):
    worst = 0.0
    for path in sorted((flights / "airtouch").glob("*_h8*.csv.gz"))[:6]:
        log = logs.read(path)
        parts = level_acceleration(log), log.stack(GYRO), log.stack(PWM)
        worst = max(worst, float(np.abs(c.motion_channels(*parts)[0] - motion_channels(*parts)[0]).max()))
    print(f"largest difference of a channel: {worst:.1e} of its nominal amplitude")
    assert worst < 1e-4


def test_steady_hover_fades_to_zero_and_thrust_explains_itself():
    acc, gyro, pwm = (np.tile(v, (3000, 1)) for v in ([0, 0, 9.81], [0, 0, 0], [45000, 46000, 47000, 48000]))
    pwm[:100] = 0
    channels, airborne = motion_channels(acc, gyro, pwm)
    assert not airborne[:100].any() and airborne[100:].all()
    assert np.abs(channels[-1]).max() < 1e-3


def test_a_lift_shows_as_unexplained_acceleration_whatever_the_battery():
    """0.4 m/s^2 of lift at constant command, with a thrust curve 20 % too strong."""
    acc, gyro = np.tile([0, 0, 9.81], (1000, 1)), np.zeros((1000, 3))
    acc[900:, 2] += 0.4
    channels, _ = motion_channels(acc, gyro, np.full((1000, 4), 52000.0))
    assert channels[905, 10] == pytest.approx(0.4 / 0.5, rel=1e-3)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**31), n=st.integers(0, 600), nan=st.booleans(),
       dwell=st.integers(0, 40), arm=st.integers(0, 60), share=st.floats(0, 1), hold=st.integers(0, 70),
       look_back=st.integers(0, 63))
def test_decoder_equals_the_reference_and_keeps_its_word(seed, n, nan, dwell, arm, share, hold, look_back):
    rng = np.random.default_rng(seed)
    logits = np.cumsum(rng.normal(0, 0.7, (n, 3)), axis=0).astype(np.float32)
    if nan and n:
        logits[rng.integers(0, n, 5)] = np.nan
    airborne = np.cumsum(rng.random(n) < 0.01) % 2 == 0
    config = DecoderConfig(over_share=float(np.float32(share)), dwell_steps=dwell, arm_steps=arm,
                           smooth_gain=0.125, look_back=look_back, hold_steps=hold)
    edges = c.edge_decoder(logits, airborne, config)
    expected = edge_decoder(logits.astype(np.float64), airborne, config)
    first = np.flatnonzero(edges != expected)[:1]
    assert not len(first) or _near_threshold(logits, config, first[0])
    at = np.flatnonzero(edges)
    assert not edges[~airborne].any()
    for a, b in pairwise(at):
        in_the_air = airborne[a:b + 1].all()
        assert not in_the_air or ((hold or b - a >= dwell) and edges[a] != edges[b])


@pytest.mark.parametrize("name", ["dwell_steps", "arm_steps", "look_back", "hold_steps"])
def test_counts_of_steps_are_those_that_both_decoders_take(name):
    """From 0 to the most that the field in C holds, or its ring of logits: others are refused before either runs."""
    field = "".join([name.split("_")[0], *(word.title() for word in name.split("_")[1:])])
    bits = 8 * ffi.sizeof(dict(ffi.typeof("decoderConfig_t").fields)[field].type)
    most = MOST_LOOK_BACK if name == "look_back" else 2**bits - 1
    logits, airborne = np.random.default_rng(0).normal(0, 4, (500, 3)), np.ones(500, bool)
    for steps in (0, np.int64(1), most):
        config = DecoderConfig(**{name: steps})
        np.testing.assert_array_equal(c.edge_decoder(logits, airborne, config),
                                      edge_decoder(logits.astype(np.float32), airborne, config))
    for steps in (-1, most + 1, 2.5, True, None):
        with pytest.raises(AirTouchError, match=f"{name} is {steps}, not a whole number from 0 to {most}"):
            DecoderConfig(**{name: steps})


def test_an_edge_is_reported_a_fixed_time_after_the_peak_of_its_logit():
    """A clear bump is seen at once; a weak one only late, by the state; both are reported hold_steps after."""
    logits = np.tile([-4.0, -6.0, -6.0], (400, 1))
    logits[150:, 0] = 4.0
    config = DecoderConfig(entry_score=3.0, late_entry=2.0, smooth_gain=0.2, hold_steps=30, look_back=50)
    reported = []
    for height in (4.0, -1.0):
        logits[145:156, 1] = height - np.abs(np.arange(-5, 6))
        reported.append(list(np.flatnonzero(edge_decoder(logits, np.ones(400, bool), config))))
        assert list(np.flatnonzero(c.edge_decoder(logits, np.ones(400, bool), config))) == reported[-1]
    assert reported == [[180], [180]]
    at_once = DecoderConfig(entry_score=3.0, late_entry=2.0, smooth_gain=0.2, hold_steps=0)
    assert 150 < np.flatnonzero(edge_decoder(logits, np.ones(400, bool), at_once))[0] < 160


def _near_threshold(logits: np.ndarray, config: DecoderConfig, at: int) -> bool:
    """Whether float32 may honestly decide otherwise there: a score within rounding of its threshold."""
    p, entry, leave = np.clip(logits[at].astype(np.float64), -8, 8)
    scores = [entry + config.over_share * p - config.entry_score, leave - config.over_share * p - config.exit_score]
    return min(abs(s) for s in scores) < 1e-5


@pytest.mark.parametrize("outputs", [3, 5])  # the decoder leaves what follows its three alone
def test_the_whole_equals_its_parts(outputs):
    net = network(9, channels=12, width=8, outputs=outputs)
    acc, gyro, pwm = flight(3, 900)
    events = c.stream_detector(acc, gyro, pwm, net)
    channels, airborne = c.motion_channels(acc, gyro, pwm)
    first = net.layers[0]
    rows = run_stream(net, quantise(channels, first.input_scale, first.input_zero_point))
    logits = net.head.output_scale * (rows[:, :len(LOGITS)].astype(np.float32) - net.head.output_zero_point)
    steps = np.arange(0, len(acc), net.stride)
    assert np.array_equal(np.flatnonzero(events.ready), steps)
    assert np.allclose(events.logits[steps], logits, rtol=1e-6)
    assert np.array_equal(events.edge[steps], c.edge_decoder(logits, airborne[steps]))
    assert np.array_equal(events.airborne, airborne)


def test_another_network_is_refused():
    with pytest.raises(AirTouchError, match="12 channels"):
        c.stream_detector(*flight(0, 50), network(1))
