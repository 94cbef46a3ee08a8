"""The lift that a regression finds in a synthetic flight, which has a known multiple of the measured one."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from airtouch import vehicle as vehicles
from airtouch.gap.flights.flight import GROUND
from airtouch.gap.nominal.calibrate import calibrated
from airtouch.logs import true_edges
from airtouch.simulation import batch
from gap_flights import VEHICLE as FLOWN
from gap_flights import fly
from tools.diagnosis import gap_lift
from tools.diagnosis.recordings.swarm_lift import CURVE, CURVE_M

VEHICLE = replace(vehicles.load("crazyflie-2.1"), nominal_voltage_v=4.0)
STANDING_M, LIFT = 0.05, CURVE["ns-34g"]


def descent(lift, offset=0.0):
    """Ten seconds down at the PWM of hover, with a multiple of the measured lift; the last second on the ground."""
    n = 1000
    height = np.linspace(0.3, 0.005, n)
    pwm = np.full((n, 4), 38000.0)
    weight = VEHICLE.mass_kg * VEHICLE.gravity_mps2
    extra = (offset + lift * np.interp(height, CURVE_M, LIFT)) * weight
    up = (VEHICLE.thrust(pwm).sum(axis=1) + extra) / VEHICLE.mass_kg
    phase = np.where(np.arange(n) < n - 100, GROUND + 1, GROUND)
    up[phase == GROUND] = VEHICLE.gravity_mps2  # the floor carries it: no lift
    log = {"vbat_V": np.full(n, VEHICLE.nominal_voltage_v), "z_m": height + STANDING_M}
    return SimpleNamespace(log=log, pwm=pwm, acceleration=up[:, None] * [0.0, 0.0, 1.0], usable=np.ones(n, bool),
                           phase=phase)


@pytest.mark.parametrize("lift", [0.0, 0.7, 1.0])
@pytest.mark.parametrize("offset", [0.0, -0.03])
def test_regression_finds_the_lift_beside_a_thrust_that_is_off(lift, offset):
    assert gap_lift.regressed_lift(descent(lift, offset), VEHICLE, STANDING_M, LIFT) == pytest.approx(lift, abs=1e-6)


@pytest.mark.parametrize("lift", [0.0, 0.7])
def test_a_free_curve_finds_a_lift_of_straight_lines(lift, monkeypatch):
    """A lift that is straight between the free heights is found whatever the measured curve is."""
    monkeypatch.setattr(gap_lift, "CURVE_M", np.array(gap_lift.FREE_M))  # the descent is made of it too
    monkeypatch.setitem(globals(), "CURVE_M", np.array(gap_lift.FREE_M))
    monkeypatch.setitem(globals(), "LIFT", np.array([0.12, 0.1, 0.06, 0.03, 0.01, 0.0]))
    lift_at_heights = gap_lift.free_lift(descent(lift, -0.03), VEHICLE, STANDING_M)
    assert lift_at_heights == pytest.approx(lift * np.array([0.1, 0.06]), abs=1e-6)


def test_each_channel_shows_the_strength_that_was_flown():
    """Of simulated flights with twice the preset's lift, whose nominal ones have none."""
    study = calibrated(FLOWN, fly(3, 41), scatter=False)[0]
    flight, = fly(1, 5, [("ground_effect", {"strength": 2.9, "fade": 0.0875, "turbulence": 0.0})])
    strengths = gap_lift.strengths(study, flight, "crazyflie-34g")
    assert strengths[:2] == pytest.approx([2.0, 2.0], abs=0.4) and strengths[3] == pytest.approx(2.0, abs=0.6)


def test_the_lift_over_a_platform_is_what_no_thrust_explains_there():
    """Two hundredths of the weight more force between the edges than a simulated flight has."""
    flight = next(log for log in batch.flights("paper-low", 3, seed=4, workers=1) if len(true_edges(log)) == 2)
    entry, leave = (e.sample for e in true_edges(flight))
    lifted = flight["acc_z_mps2"].copy()
    lifted[entry:leave] += 0.02 * FLOWN.gravity_mps2
    without, with_lift = (gap_lift.first_pass(log, FLOWN)
                          for log in (flight, flight.with_columns({"acc_z_mps2": lifted})))
    assert with_lift.lift - without.lift == pytest.approx(0.02, abs=1e-9)
    over = flight["zrange_m"][entry + 20:leave - 10]
    assert without.over_m == np.median(over) and without.above_standing_m == without.over_m - without.resting_m
    assert without.resting_m == pytest.approx(np.median(flight["zrange_m"][:50]), abs=0.002)
    assert gap_lift.first_pass(flight.slice(0, entry), FLOWN) is None
