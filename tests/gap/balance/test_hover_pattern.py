"""The eight numbers of a hover against closed forms: commands, voltage and corrections of known size."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.gap.balance.hover_hypotheses import commanded_change
from airtouch.gap.balance.hover_pattern import SETTLE_S, hover_pattern, stretches_in_air
from airtouch.gap.balance.hover_posterior import side_is_sure
from airtouch.logs.flight_log import VELOCITY
from gap_flights import VEHICLE, flight, noise

SECONDS, VOLTAGE_V = 20.0, 3.7


def noisy(seconds=SECONDS, **columns):
    """A hover whose commands and acceleration are white noise around a mean, as spectra of a constant are 0."""
    hover = flight(seconds, noise(seconds, 0.1, 1))
    pwm = hover.pwm + np.random.default_rng(2).normal(0.0, 300.0, hover.pwm.shape)
    return replace(hover, pwm=pwm, log=hover.log.with_columns(columns))


def test_a_rotor_with_more_thrust_is_the_change_that_hypotheses_draw():
    hover, stronger = noisy(), noisy()
    stronger.pwm[:, 2] = 45000.0
    thrust = [VEHICLE.thrust(f.pwm).mean(axis=0) for f in (hover, stronger)]
    difference = hover_pattern(stronger, VEHICLE).balance - hover_pattern(hover, VEHICLE).balance
    np.testing.assert_allclose(difference, commanded_change((thrust[1] / thrust[0])[None])[0], atol=2e-3)
    assert np.sign(difference).tolist() == [1.0, 1.0, 1.0, -1.0]


def test_the_lift_at_one_volt_is_that_at_the_voltage_flown_times_its_power():
    hover = noisy(vbat_V=np.full(round(100 * SECONDS), VOLTAGE_V))
    at_one, as_flown = (hover_pattern(hover, VEHICLE, at_one_volt).balance for at_one_volt in (True, False))
    np.testing.assert_allclose(at_one - as_flown, [1.2 * np.log(VOLTAGE_V), 0.0, 0.0, 0.0], atol=1e-9)


@pytest.mark.parametrize("lost", [0, 40])
def test_corrections_are_the_steps_of_the_velocity_that_no_acceleration_makes(lost):
    """At 1 g, of which the specific force of a hover is; rows without a velocity say nothing."""
    hovering = np.tile([0.0, 0.0, 9.81], (round(100 * SECONDS), 1))
    velocity = noise(SECONDS, 0.01, 3)
    velocity[np.random.default_rng(4).choice(len(velocity), lost, replace=False)] = np.nan
    hover = replace(noisy(**dict(zip(VELOCITY, velocity.T, strict=True))), acceleration=hovering)
    with np.errstate(divide="ignore"):  # heave of a constant acceleration
        corrections = hover_pattern(hover, VEHICLE).corrections
    np.testing.assert_allclose(10.0 ** corrections, [4e-4, 2e-4], rtol=0.15)  # two and one axis, twice the variance


@pytest.mark.parametrize("period", [0, 4])
def test_without_velocities_in_succession_the_corrections_are_not_known(period):
    """No column, or a velocity in one row of four: zeros would say that nothing was corrected."""
    velocity = np.full((round(100 * SECONDS), 3), np.nan)
    if period:
        velocity[::period] = 0.1
    hover = hover_pattern(noisy(**dict(zip(VELOCITY, velocity.T, strict=True)) if period else {}), VEHICLE)
    assert hover.known and np.isnan(hover.corrections).all()


def test_a_stretch_without_velocities_takes_no_part_in_the_corrections():
    hole, velocity = np.zeros(round(100 * SECONDS), bool), noise(SECONDS, 0.01, 3)
    hole[900:1100] = True
    whole, half = velocity.copy(), velocity.copy()
    half[1100:] = np.nan
    of_whole, of_half = (hover_pattern(replace(noisy(**dict(zip(VELOCITY, v.T, strict=True))), lost=hole),
                                       VEHICLE).corrections for v in (whole, half))
    np.testing.assert_allclose(of_half, of_whole, atol=0.05)  # with zeros for the second half, 0.3 less


@pytest.mark.parametrize(("seconds", "count"), [(3.9, 0), (4.1, 1)])
def test_a_hover_lasts_four_seconds_without_take_off_and_landing(seconds, count):
    hover = noisy(seconds + 2.0 * SETTLE_S)
    assert len(stretches_in_air(hover)) == count and hover_pattern(hover, VEHICLE).known == bool(count)


@pytest.mark.parametrize("kind", ["lost", "unmeasured"])
def test_a_hole_in_which_nothing_is_logged_does_not_count(kind):
    """The straight line over it, at half thrust, changes nothing: each side of it is a hover of its own."""
    hover, hole = noisy(), np.zeros(round(100 * SECONDS), bool)
    hole[300:1100] = True
    changed = replace(hover, **{kind: hole}, pwm=np.where(hole[:, None], 0.5 * hover.pwm.mean(), hover.pwm),
                      acceleration=np.where(hole[:, None], hover.acceleration.mean(axis=0), hover.acceleration))
    assert stretches_in_air(changed) == [(round(100 * SETTLE_S), 300), (1100, round(100 * (SECONDS - SETTLE_S)))]
    whole, others = (hover_pattern(f, VEHICLE) for f in (hover, changed))
    assert others.balance[0] == pytest.approx(whole.balance[0], abs=0.002)
    assert others.power == pytest.approx(whole.power, abs=0.15)  # with the line -0.2 and less


@pytest.mark.parametrize(("rows", "parts"), [(10, 1), (11, 2)])
def test_rows_lost_for_a_tenth_of_a_second_are_bridged_and_more_are_not(rows, parts):
    lost = np.zeros(round(100 * SECONDS), bool)
    lost[900:900 + rows] = True
    assert len(stretches_in_air(replace(noisy(), lost=lost))) == parts


@pytest.mark.parametrize(("samples", "count"), [(390, 0), (410, 1)])
def test_what_is_left_beside_a_hole_lasts_four_seconds(samples, count):
    lost = np.zeros(round(100 * SECONDS), bool)
    lost[round(100 * SETTLE_S) + samples:] = True
    hover = replace(noisy(), lost=lost)
    assert len(stretches_in_air(hover)) == count and hover_pattern(hover, VEHICLE).known == bool(count)


@pytest.mark.parametrize(("right", "sure"), [(0.95, True), (0.85, False), (0.15, False), (0.05, True)])
def test_a_side_is_sure_from_nine_in_ten_on(right, sure):
    assert side_is_sure(np.array([1.0, -1.0]), np.array([right, 1.0 - right])) == sure
