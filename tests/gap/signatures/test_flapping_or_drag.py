"""Blade flapping and the drag of the rotors: what a flight at walking speed says for one over the other."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch import vehicle as vehicles
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.fit import fit
from airtouch.gap.evidence.judge import judge
from airtouch.gap.evidence.problem import problem_of, whole_of
from airtouch.gap.flights import flight
from airtouch.gap.naming.policy import LEAST_GAIN
from airtouch.gap.nominal.build_study import declared_study
from airtouch.gap.sealed.make import SCENARIO
from airtouch.gap.signals.spectra import OVERLAP_WEIGHT, squared
from airtouch.gap.signatures import candidates
from airtouch.gap.signatures.alike import names_alike
from airtouch.simulation import replay, scenario
from airtouch.simulation import signals as at
from airtouch.simulation.batch import flights as simulated
from airtouch.simulation.effects import activate

VEHICLE = vehicles.load("crazyflie-2.1-flow")
WEIGHT = VEHICLE.mass_kg * VEHICLE.gravity_mps2
UPPER_GUESS = 0.01  #: rad s/m: the effect's default
LEAST_SHARE = 1.0 / 3.0  #: fraction of the energy of a force that its right model gains at least; chosen
NO_MOMENT = {"hub": 0.0, "above": 0.0}  #: m: the force of flapping acts in the centre of mass


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
        {"blade_flapping": {"tilt": UPPER_GUESS, **NO_MOMENT}},
        {"rotor_drag": {"horizontal": UPPER_GUESS * WEIGHT}}))
    np.testing.assert_allclose(flapping, drag * np.sqrt(ratio)[:, None], atol=1e-15)


@pytest.mark.parametrize("tilt", [UPPER_GUESS, 2.0 * UPPER_GUESS])
def test_a_fit_tells_flapping_from_drag_by_its_moment_alone(study, tilt):
    """The force acts above the centre of mass; in the centre itself flapping would gain what drag gains.

    A part of the gap whose model is right gains at most the energy S that it has over the floor, nats, of which tails
    and offsets take a share, and noise beside it moves that by sqrt(2 S), one standard deviation. Two models of a gap
    of energy S gain alike but for 2 sqrt(S D), where D is the energy of their difference (Cauchy and Schwarz).
    """
    data = Data(study, fly(1, {"blade_flapping": {"tilt": tilt}}, 32))
    blocks, problem = whole_of(data), problem_of(data, whole_of(data))

    def gain(term):
        return judge(data, blocks, fit(data, blocks, [term]).terms) - judge(data, blocks, ())

    def energy(*wrenches):
        ours, theirs = (problem.residual(activate(w)) for w in (*wrenches, {})[:2])
        return OVERLAP_WEIGHT * float(np.sum(squared(ours - theirs) / problem.elements.floor_power))

    (flapping,), (drag, *_) = candidates.terms("blade_flapping"), candidates.terms("rotor_drag")
    flapping = replace(flapping, free=("tilt",))
    in_the_centre = replace(flapping, values={**flapping.values, **NO_MOMENT})
    whole, push = {"blade_flapping": {"tilt": tilt}}, {"blade_flapping": {"tilt": tilt, **NO_MOMENT}}
    as_drag = {"rotor_drag": {"horizontal": tilt * WEIGHT}}
    of_push, of_drag = gain(in_the_centre), gain(replace(drag, free=("horizontal",)))
    as_shipped, drag_as_shipped = gain(flapping), gain(drag)
    assert min(of_push, of_drag, drag_as_shipped) > LEAST_SHARE * energy(push)
    assert as_shipped - drag_as_shipped > LEAST_GAIN, "more than chance, which names an effect"
    assert abs(of_push - of_drag) < 2.0 * np.sqrt(energy(whole) * energy(push, as_drag))
    moment = energy(whole, push)
    assert 0.0 < as_shipped - of_push < moment + 3.0 * np.sqrt(2.0 * moment)


def test_flapping_and_drag_are_names_of_one_thing():
    assert names_alike("rotor_drag") == names_alike("blade_flapping") is not None


def test_gusts_have_no_drag_of_their_own_when_drag_is_left_out():
    out = candidates.all_candidates({"rotor_drag", "blade_flapping"})
    assert {t.name for name in ("wind", "gust") for terms in out[name] for t in terms} == {"wind", "gust"}
