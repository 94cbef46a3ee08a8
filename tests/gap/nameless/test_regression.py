"""The regression on a flight's own signals: made-up effects, and what is no news beside an effect."""

from dataclasses import replace

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.nameless.basis import BASIS
from airtouch.gap.nameless.columns import WIDEST, allowed_columns
from airtouch.gap.nameless.regression import BlockResiduals, coefficients
from airtouch.gap.naming.judging import halves
from airtouch.gap.signatures import candidates
from gap_flights import fly


def test_torque_that_answers_the_commands_otherwise_shows_in_simulated_flights(study):
    """Half as much inertia again; recorded flights' loop is not modelled as well."""
    data = Data(study, fly(1, 50, {"inertia": {"fraction": 0.5}}))
    halves_coefficients = [coefficients(BlockResiduals(data, p, ()), 4, study.nameless_floor) for p in halves(data)]
    assert all(f[len(BASIS):].any() for f in halves_coefficients)
    among = np.arange(WIDEST) < len(BASIS)
    recorded = [coefficients(BlockResiduals(data, p, ()), 4, study.nameless_floor, among)
                for p in halves(data)]
    assert not any(f[len(BASIS):].any() for f in recorded)


def test_how_changed_gains_turn_the_vehicle_about_its_yaw_axis_is_not_asked(study):
    data, yaw = Data(study, fly(1, 52)), [BASIS.index(n) for n in ("yaw", "d_yaw")]
    for name, values, expected in (("controller_gain", {"attitude": 1.4}, False), ("mass", {"fraction": 0.1}, True)):
        term = candidates.terms(name)[0]
        term = replace(term, values={**term.values, **values})
        assert (allowed_columns(data, [term], 5)[yaw] == expected).all()
        assert allowed_columns(data, [term], 4).all()  # roll and pitch are modelled
