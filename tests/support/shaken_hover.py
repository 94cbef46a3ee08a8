"""Hovers whose forward gap is white noise of a known strength, and the cell of the map that it lies in."""

import numpy as np

from airtouch.gap.answer.unexplained import ratios_of_blocks
from airtouch.gap.nominal.build_study import declared_study
from airtouch.gap.signals.channels import residual
from gap_flights import VEHICLE, flight, noise
from made_diagnosis import cell

STUDY = declared_study(VEHICLE, ())
SECONDS = 40.0
CELL = cell("force_x", "hover", 1.0, band_hz=(2.0, 6.0))


def hover(strength, seed=1, **more):
    """A hover whose forward gap is white noise of rms `strength` (n,) or one number, m/s^2."""
    force = noise(SECONDS, 1.0, seed) * np.broadcast_to(strength, 4000)[:, None] * [1.0, 0.0, 0.0]
    return flight(SECONDS, force, **more)


def ratio_of(one):
    """Rms over the floor of CELL in each block of a flight."""
    return ratios_of_blocks(one, residual(one, VEHICLE), CELL)
