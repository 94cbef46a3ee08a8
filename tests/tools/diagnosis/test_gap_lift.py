"""The lift that a regression finds in a synthetic flight, which has a known multiple of the measured one."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from airtouch import vehicle as vehicles
from airtouch.gap.flights.flight import GROUND
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
