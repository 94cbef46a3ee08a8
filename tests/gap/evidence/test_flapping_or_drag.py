"""Blade flapping and the drag of the rotors: what a flight at walking speed says for one over the other."""

import numpy as np
import pytest

from airtouch import vehicle as vehicles
from airtouch.gap.evidence import fit
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.problem import whole_of
from airtouch.gap.flights import flight
from airtouch.gap.nominal.build_study import declared_study
from airtouch.gap.sealed.make import SCENARIO
from airtouch.gap.signatures import candidates
from airtouch.gap.signatures.alike import names_alike
from airtouch.simulation import replay, scenario
from airtouch.simulation import signals as at
from airtouch.simulation.batch import flights as simulated
from airtouch.simulation.effects import activate

VEHICLE = vehicles.load("crazyflie-2.1-flow")
WEIGHT = VEHICLE.mass_kg * VEHICLE.gravity_mps2
UPPER_GUESS = 0.01  #: rad s/m: the effect's default


def fly(count, effects, seed):
    off = [e for e in scenario.load(SCENARIO).table.get("effects", {}) if e not in effects]
    logs = simulated(SCENARIO, count, vehicle=VEHICLE, effects=effects, without=off, seed=seed, workers=1)
    return [flight.ready(log, VEHICLE) for log in logs]


@pytest.fixture(scope="module")
def study():
    return declared_study(VEHICLE, fly(5, {}, 31))


def test_one_force_while_thrust_is_steady():
    """Drag tilt x weight: apart by sqrt(thrust / weight) where rotor speed is the root of thrust."""
    signals = np.zeros((3, at.COUNT))
    signals[:, at.VELOCITY:at.VELOCITY + 2] = (0.4, -0.3)
    signals[:, at.HOVER_SPEED] = 2000.0
    ratio = np.array([0.8, 1.0, 1.2])
    signals[:, at.THRUST:at.THRUST + 4] = 0.25 * WEIGHT * ratio[:, None]
    signals[:, at.ROTOR_SPEED:at.ROTOR_SPEED + 4] = 2000.0 * np.sqrt(ratio)[:, None]
    flapping, drag = (replay.wrench_of(activate(e)[0], signals) for e in (
        {"blade_flapping": {"tilt": UPPER_GUESS, "hub": 0.0, "above": 0.0}},
        {"rotor_drag": {"horizontal": UPPER_GUESS * WEIGHT}}))
    np.testing.assert_allclose(flapping, drag * np.sqrt(ratio)[:, None], atol=1e-15)


@pytest.mark.parametrize(("tilt", "most_nats"), [(UPPER_GUESS, 40.0), (2.0 * UPPER_GUESS, 110.0)])
def test_a_fit_hardly_tells_flapping_from_drag(study, tilt, most_nats):
    """Log likelihood: 50 and 134 for a push against the speed, 32 and 87 for the moment of 15 mm of lever."""
    data = Data(study, fly(1, {"blade_flapping": {"tilt": tilt}}, 32))
    blocks = whole_of(data)

    def level(terms):
        return fit.judge(data, blocks, fit.fit(data, blocks, terms).terms)

    flapping, drag = (level(candidates.terms(name)) - level(()) for name in ("blade_flapping", "rotor_drag"))
    assert min(flapping, drag) > 40.0
    assert abs(flapping - drag) < most_nats
    assert names_alike("rotor_drag") == names_alike("blade_flapping") is not None


def test_gusts_have_no_drag_of_their_own_when_drag_is_left_out():
    out = candidates.all_candidates({"rotor_drag", "blade_flapping"})
    assert {t.name for name in ("wind", "gust") for terms in out[name] for t in terms} == {"wind", "gust"}
