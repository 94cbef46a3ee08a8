"""The lift near the floor that a diagnosis gives: against the equation of its source, and against measured lift."""

import numpy as np
import pytest

from airtouch import vehicle as vehicles
from airtouch.simulation.flight import prepare
from tools.diagnosis.recordings import swarm_lift

NAMED = {"strength": 0.8, "fountain": 2.0, "fade": 0.1, "turbulence": 0.5, "turbulence_time": 0.1, "heave": 1.0,
         "pitch": 1.0, "swirl": 0.0, "even": 0.0, "leaving": 0.0,
         "joint": 0.0}


def test_the_lift_is_that_of_the_published_equation():
    """Sanchez-Cuevas, Heredia, Ollero 2017, eq. 8, which fades; in hover g / (1 + g) of the weight is carried."""
    row = prepare(vehicles.load("crazyflie-2.1"), ())[0][0]
    r, d = float(row["rotor_radius"]), float(row["rotor_spacing"])
    z = np.array(swarm_lift.HEIGHTS_M) + swarm_lift.STANDING_M["ns-34g"]
    loss = (r / (4.0 * z)) ** 2 + r ** 2 * z / (d ** 2 + 4.0 * z ** 2) ** 1.5 \
        + (0.5 + 2.0 * NAMED["fountain"]) * r ** 2 * z / (2.0 * d ** 2 + 4.0 * z ** 2) ** 1.5
    gain = NAMED["strength"] * (1.0 / (1.0 - loss) - 1.0) * np.exp(-(z / NAMED["fade"]) ** 2)
    assert swarm_lift.lift("crazyflie-2.1", "ns-34g", NAMED) == pytest.approx(gain / (1.0 + gain), rel=1e-3)
    assert swarm_lift.lift("crazyflie-2.1", "ns-34g", {**NAMED, "strength": 0.0}) == pytest.approx([0.0, 0.0])


@pytest.mark.parametrize(("factors", "right"), [((1.2, 0.8), True), ((1.0, 1.3), False), ((0.7, 1.0), False)])
def test_both_heights_must_be_within_a_quarter(factors, right, monkeypatch, tmp_path):
    measured = np.interp(swarm_lift.HEIGHTS_M, swarm_lift.CURVE_M, swarm_lift.CURVE["ns-67g"])
    monkeypatch.setattr(swarm_lift, "lift", lambda vehicle, name, parameters: parameters["strength"]
                        * np.array(factors) * measured)
    effect = {"name": "ground_effect", "parameters": {"strength": {"value": 1.0}}}
    result = {"condition": "ns-67g", "effects": [{"name": "mass", "parameters": {}}, effect]}
    assert swarm_lift.close(result, tmp_path) is right
    assert swarm_lift.close({**result, "effects": result["effects"][:1]}, tmp_path) is False
