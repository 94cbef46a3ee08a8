"""Flights of RotorPy's Crazyflie: what is drawn, the loop's signs, a hover that a weak rotor must not upset."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from airtouch import vehicle as vehicles
from airtouch.errors import AirTouchError
from tools.simulation.rotorpy_loop import labels

TOOL = Path(__file__).parents[3] / "tools/simulation/rotorpy_flights.py"


@pytest.fixture(scope="module")
def rotorpy():
    """The modules that need RotorPy."""
    pytest.importorskip("rotorpy", reason="needs the extra 'bench'")
    from tools.simulation.rotorpy_loop import controller, course, flight, vehicle
    return controller, course, flight, vehicle


def test_every_effect_is_drawn_within_its_range_and_each_flight_has_a_seed_of_its_own():
    drawn = labels.labels_of(2, 3, 5)
    assert [x.file for x in drawn[:2]] == ["cal_A_0.csv.gz", "cal_A_1.csv.gz"] and len(drawn) == 2 + 3 + 2 * 17
    assert len({x.seed for x in drawn}) == len({x.file for x in drawn}) == len(drawn)
    assert {x.seed for x in drawn}.isdisjoint(x.seed for x in labels.labels_of(2, 3, 6))
    for name, (low, high, _) in labels.STRENGTHS.items():
        strengths = [x.of(name) for x in drawn if x.effect == name]
        assert len(strengths) == 2 and all(low <= s <= high for s in strengths)
    assert [x.effect for x in drawn].count("none") == 5 and drawn[0].of("mass") == 0.0


def test_other_effects_are_drawn_within_their_ranges_and_are_not_those_of_the_peers():
    drawn = labels.labels_of(2, 1, 5, labels.OTHERS)
    assert len(drawn) == 2 + 1 + 2 * 5 and not set(labels.OTHERS) & set(labels.STRENGTHS)
    for name, (low, high, _) in labels.OTHERS.items():
        strengths = [x.of(name) for x in drawn if x.effect == name]
        assert len(strengths) == 2 and all(low <= s <= high for s in strengths)


def test_pwm_is_the_inverse_of_the_thrust_curve(rotorpy, tmp_path):
    *_, vehicle = rotorpy
    pwm = np.array([1000.0, 20000.0, 40000.0, 65535.0])
    np.testing.assert_array_equal(vehicle.pwm_of_thrust(vehicle.DECLARED.thrust(pwm)), pwm)
    (tmp_path / "v.toml").write_text(vehicle.FILE, encoding="utf-8")
    by_hand = vehicle.C0 + vehicle.C1 * pwm + vehicle.C2 * pwm ** 2
    np.testing.assert_allclose(vehicles.load(tmp_path / "v.toml").thrust(pwm), by_hand, rtol=1e-6)


@pytest.mark.parametrize(("moved", "more"), [("z", (1, 1, 1, 1)), ("roll", (1, 1, 0, 0)), ("pitch", (1, 0, 0, 1)),
                                             ("yaw", (1, 0, 1, 0))])
def test_the_loop_turns_back(rotorpy, moved, more):
    """By hand: too low, all rotors go up; rolled right, the right ones; nose down, the front; turned left, 1 and 3."""
    controller, course, _, vehicle = rotorpy
    at_rest = controller.Estimate(np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3))
    hover = vehicle.pwm_of_thrust(np.full(4, 0.25 * vehicle.MASS_KG * vehicle.GRAVITY))
    set_point = course.SetPoint(np.zeros(3), np.zeros(3))
    np.testing.assert_array_equal(controller.Controller().pwm(set_point, at_rest), hover)
    away = {"z": at_rest._replace(position=np.array([0.0, 0.0, -0.1])),
            "roll": at_rest._replace(angles=np.array([0.1, 0.0, 0.0])),
            "pitch": at_rest._replace(angles=np.array([0.0, 0.1, 0.0])),
            "yaw": at_rest._replace(angles=np.array([0.0, 0.0, 0.1]))}[moved]
    np.testing.assert_array_equal(controller.Controller().pwm(set_point, away) > hover, np.array(more, bool))


def test_a_weak_rotor_gets_the_thrust_it_lost(rotorpy, monkeypatch):
    """In hover each motor lifts a quarter of the weight: its thrust by the curve, less the fraction that is lost."""
    _, course, flight, vehicle = rotorpy
    monkeypatch.setattr(course, "PASS_AT_S", 99.0)
    monkeypatch.setattr(course.Course, "total_s", property(lambda self: 5.0, lambda self, value: None), raising=False)
    log = flight.fly(labels.Label("x", "weak_motor", 0.1, "", 3))
    still = slice(450, 500)
    lifted = vehicle.DECLARED.thrust(np.stack([log[f"m{i}_pwm"][still] for i in (1, 2, 3, 4)])).mean(axis=1)
    quarter = 0.25 * vehicle.MASS_KG * vehicle.GRAVITY
    np.testing.assert_allclose(np.sort(lifted), quarter * np.array([1.0, 1.0, 1.0, 1.0 / 0.9]), rtol=0.02)
    assert np.std(log["z_m"][still]) < 0.02 and log["z_m"][still].mean() > 0.15
    np.testing.assert_allclose(log["acc_z_mps2"][:50].mean(), vehicle.GRAVITY, atol=0.05)
    np.testing.assert_allclose(log["acc_z_mps2"][still].mean(), vehicle.GRAVITY, atol=0.1)


@pytest.mark.parametrize("effect", [("none", 0.0), ("ground_effect", 1.4)])
def test_a_flight_begins_and_ends_on_the_ground(rotorpy, effect):
    """It leaves the ground after the motors start, and stands on it, 1.2 cm high by its range, when they stop."""
    *_, flight, _ = rotorpy
    log = flight.fly(labels.Label("x", *effect, "", 5))
    running = np.flatnonzero(log["m1_pwm"])
    before, after = log["zrange_m"][[running[0], running[-1]]]
    assert max(before, after) < 0.025 and log["zrange_m"].max() > 0.15
    np.testing.assert_allclose(log["acc_z_mps2"][running[-1] + 10:].mean(), 9.81, atol=0.05)


def test_a_rotor_gains_by_the_share_of_its_disc_over_the_platform(rotorpy):
    """Points drawn evenly in the disc, counted; and all of it, none and half by hand."""
    _, course, *_ = rotorpy
    drawn = course.Course(np.random.default_rng(0))
    points = np.random.default_rng(1).uniform(-1.0, 1.0, (200_000, 2))
    inside = points[np.hypot(*points.T) < 1.0, 0]
    for x in (0.77, 0.79, 0.8, 0.815, 1.2, drawn.end_m + 0.01):
        counted = np.mean([drawn.surface(p) > 0.0 for p in x + 0.03 * inside])
        np.testing.assert_allclose(drawn.over_platform(np.array(x), 0.03), counted, atol=0.005)
    np.testing.assert_allclose(course.disc_beyond(np.array([-2.0, 0.0, 2.0])), [1.0, 0.5, 0.0], atol=1e-12)


def test_lost_rows_are_a_share_in_bursts_of_two(rotorpy):
    *_, flight, _ = rotorpy
    lost = flight._lost_rows(400_000, 0.08, np.random.default_rng(0))
    begins = np.count_nonzero(np.diff(lost.astype(int)) > 0)
    np.testing.assert_allclose([lost.mean(), lost.sum() / begins], [0.08, 2.0], rtol=0.03)
    assert not flight._lost_rows(1000, 0.0, np.random.default_rng(0)).any()


def test_the_wake_is_that_of_gym_pybullet_drones(rotorpy):
    """Its formula by hand, 1 m below: 2267.18 (R / 4)^2 on the axis, and a bell of width 0.16 - 0.11 m."""
    *_, flight, _ = rotorpy
    peak = 2267.18 * (0.0231348 / 4.0) ** 2
    np.testing.assert_allclose([flight._wake(np.zeros(3)), flight._wake(np.array([0.03, 0.04, 0.3]))],
                               [peak, peak * np.exp(-0.5)], rtol=1e-6)


def test_rotors_flap_as_rotorpys(rotorpy):
    """By hand: at strength 1 four rotors at 1,800 rad/s and 0.5 m/s forward lower the nose by 3.6e-5 N m."""
    *_, vehicle = rotorpy
    craft = vehicle.craft_of(labels.Label("x", "blade_flapping", 1.0, "", 1), np.array([1.0, 0.0, 0.0]))
    craft.push = 0.05
    force, torque = craft.compute_body_wrench(np.zeros(3), np.full(4, 1800.0), np.array([0.5, 0.0, 0.0]))
    np.testing.assert_allclose(torque, [0.0, 4 * 1e-8 * 1800.0 * 0.5, 0.0], atol=1e-12)
    np.testing.assert_allclose(force, [0.0, 0.0, 4 * 2.3e-8 * 1800.0 ** 2 - 0.05], atol=1e-12)


@pytest.mark.parametrize("options", [("--seed", "1"), ("--slow-error", "0")])
def test_flights_of_other_options_are_not_mixed_in(rotorpy, tmp_path, options):
    """Those without an effect look alike in the manifest, but for the seed and what they err by."""
    from tools.simulation.rotorpy_flights import MANIFEST, manifest
    (tmp_path / MANIFEST).write_bytes(manifest(labels.labels_of(0, 1, 0), 1.0))
    run = subprocess.run([sys.executable, TOOL, tmp_path, "--each", "0", "--nominal", "1", *options],
                         capture_output=True, text=True)
    assert run.returncode == 2 and "choose another folder" in run.stderr
    assert [p.name for p in tmp_path.iterdir()] == [MANIFEST]


def test_more_flights_than_seeds_are_refused():
    with pytest.raises(AirTouchError, match="900"):
        labels.labels_of(0, 901, 0)
