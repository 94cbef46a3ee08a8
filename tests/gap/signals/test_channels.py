"""The residual at the ends of a flight."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.gap.signals.channels import TORQUE, residual
from gap_flights import VEHICLE, flight


def test_the_end_of_a_flight_without_a_gyro_knows_nothing_of_its_beginning():
    """A vehicle that rolls at first and hovers in the end."""
    hover = replace(flight(4.0), rates=None)
    pwm = hover.pwm.copy()
    pwm[:50, :2] += 3000.0
    torque = residual(replace(hover, pwm=pwm), VEHICLE)[:, TORQUE]
    assert np.abs(torque[0]).max() > 1.0
    assert torque[-1] == pytest.approx(residual(hover, VEHICLE)[-1, TORQUE], abs=1e-3)
