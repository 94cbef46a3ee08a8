"""Spectra of the gap under effects: against spectra of residuals, with a made response of known laws."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from airtouch.gap.evidence.data import Data, command_torque, residual_spectra, step_doubt
from airtouch.gap.loop.torque_share import QUIET, STEPPED, Change
from airtouch.gap.signals.channels import COUNT, FORCE, TORQUE, residual
from airtouch.gap.signals.quiet_blocks import QuietPower
from airtouch.gap.signals.response import CUT_DOUBT, FIRST_BIN, Law, OutsideTorque, Response
from airtouch.gap.signals.spectra import AIR, REST, frequencies, short_time_spectra
from airtouch.simulation.effects import activate
from hovers import FLOOR, VEHICLE, hover, swaying

BINS = len(frequencies(AIR))
ONES = np.ones((BINS, 3))
COMMANDED = 0.5  #: q~ of the made laws
OUTSIDE = 0.25  #: what their loop leaves of a torque from outside
WEIGHT = 2.0  #: of the law of stepped blocks
(WEAK,), (INERTIA,), (FLAPPING,), (LATE,) = map(activate, (
    {"weak_motor": {"rotor": 1, "thrust_loss": 0.2}}, {"inertia": {"fraction": 0.3}},
    {"blade_flapping": {"tilt": 0.1, "hub": 0.05}}, {"sensor_latency": {"delay": 0.003}}))


def flown():
    """A flight back and forth whose commands are noise, as its rates are."""
    swaying_flight = swaying()
    rng = np.random.default_rng(7)
    return replace(swaying_flight, pwm=swaying_flight.pwm + rng.normal(0.0, 2000.0, swaying_flight.pwm.shape),
                   rates=swaying_flight.rates + rng.normal(0.0, 0.02, swaying_flight.rates.shape))


def law(kind, weight):
    return Law(kind, COMMANDED * ONES, COMMANDED * ONES, OutsideTorque(OUTSIDE * ONES, ONES), weight * ONES, ONES,
               0.0 * ONES)


def with_response(quiet, stepped_law=True, change=None):
    """A study in which all blocks are quiet or none is; LATE alone changes its loop, by `change`."""
    response = Response(QuietPower(ONES, np.full(3, 1e-9 if quiet else 1e9)), law(QUIET, 1.0),
                        law(STEPPED, WEIGHT) if stepped_law else None)
    loop = SimpleNamespace(changes_loop=lambda active: LATE in active,
                           torque_change=lambda active, f: change if LATE in active else None)
    return replace(FLOOR, response=response, loop=loop)


def torque_of(flight, effects, data):
    """Spectra (blocks, bins, 3) of measured minus modelled torque, the whole flight replayed once."""
    return short_time_spectra(residual(flight, VEHICLE, effects), data.block_starts[0][AIR], AIR)[:, :, TORQUE]


@pytest.mark.parametrize(("effects", "by_command", "outside"), [
    ([], [], []), ([WEAK], [WEAK], []), ([FLAPPING], [], [FLAPPING]), ([WEAK, FLAPPING], [WEAK], [FLAPPING]),
    ([LATE], [], []), ([LATE, WEAK], [WEAK], [])])
def test_torque_is_seen_by_the_law_of_where_it_comes_from(effects, by_command, outside):
    """Through the commands by q~, from outside by what the loop leaves of it; effects of the loop add none."""
    flight = flown()
    data = Data(with_response(quiet=True), [flight])
    assert data.quiet[0].all()
    nominal, commanded, both = (torque_of(flight, some, data) for some in ([], by_command, [*by_command, *outside]))
    modelled = data.measured_torque[0] - nominal
    expected = data.measured_torque[0] - COMMANDED * modelled + COMMANDED * (commanded - nominal) \
        + OUTSIDE * (both - commanded)
    gap = residual_spectra(data, effects)[0][AIR]
    np.testing.assert_allclose(gap[:, FIRST_BIN:, TORQUE], expected[:, FIRST_BIN:], atol=1e-8)
    for some, change in ((by_command, commanded - nominal), (outside, both - commanded)):
        assert (np.abs(change[:, FIRST_BIN:]).max() > 1e-3) == bool(some), "the effect acts above the means"
    np.testing.assert_allclose(command_torque(data, 0), modelled, atol=1e-8)


def test_without_a_response_what_only_scales_the_torque_leaves_it_alone():
    data = Data(FLOOR, [flown()])
    alone, beside, weak = (residual_spectra(data, some)[0][AIR] for some in ([INERTIA], [INERTIA, WEAK], [WEAK]))
    np.testing.assert_array_equal(alone[:, :, TORQUE], data.residual[0][AIR][:, :, TORQUE])
    np.testing.assert_array_equal(beside[:, :, TORQUE], weak[:, :, TORQUE])
    scaled = torque_of(flown(), [INERTIA, WEAK], data)
    assert np.abs(scaled - weak[:, :, TORQUE]).max() > 0.1, "it would scale it"
    begin = data.block_starts[0][AIR]
    expected = short_time_spectra(residual(flown(), VEHICLE, [INERTIA, WEAK]), begin, AIR)[:, :, FORCE]
    np.testing.assert_allclose(beside[:, :, FORCE], expected, atol=1e-8)


def change_by(cut):
    """A change of the loop that changes nothing but what the limits cut of a step."""
    one = np.ones((2, BINS, 3))
    return Change(np.ones((BINS, 1)), one, one, cut * ONES, np.ones((BINS, 1)), one)


def test_a_step_makes_the_torque_uncertain_by_what_the_limits_cut_of_it():
    flights = [flown(), hover(3, length_s=10.0, resting_s=3.0, name="other")]
    data = Data(with_response(quiet=False, change=change_by(0.4)), flights)
    assert not data.quiet[0].any()
    doubt = step_doubt(data, [LATE], [0])
    size = CUT_DOUBT * WEIGHT * COMMANDED * 0.4
    expected = np.zeros((*data.residual[0][AIR].shape[:2], COUNT))
    expected[:, FIRST_BIN:, TORQUE] = (size * np.abs(command_torque(data, 0)[:, FIRST_BIN:])) ** 2
    np.testing.assert_allclose(doubt[0][AIR], expected, rtol=1e-12)
    assert doubt[0][AIR].any() and not doubt[0][REST].any() and doubt[1] == {}, "of the flight that was asked for alone"


def test_a_step_leaves_no_doubt_where_nothing_is_cut_of_it():
    quiet, uncut = with_response(True, change=change_by(0.4)), with_response(False, change=change_by(0.0))
    lawless = with_response(False, stepped_law=False, change=change_by(0.4))
    assert not step_doubt(Data(quiet, [flown()]), [LATE], [0])[0][AIR].any()
    assert not step_doubt(Data(lawless, [flown()]), [LATE], [0])[0][AIR].any()
    assert step_doubt(Data(uncut, [flown()]), [LATE], [0]) is None
    assert step_doubt(Data(quiet, [flown()]), [WEAK], [0]) is None
    assert step_doubt(Data(FLOOR, [flown()]), [LATE], [0]) is None
