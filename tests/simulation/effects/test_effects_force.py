"""Effects that push: each against its closed form."""

import math

import numpy as np
import pytest
from scipy.signal import welch

from airtouch.logs.flight_log import PWM
from airtouch.simulation import effects, replay, scenario
from airtouch.simulation import signals as at
from airtouch.simulation.effects.air.ground_effect import thrust_ratio

MASS, GRAVITY = 0.0362, 9.81


def wrench(name, values, signals):
    return replay.wrench_of(effects.activate({name: values})[0], signals)


def over_platform(range_m):
    return scenario.parse(f"""
name = "over-platform"
[[platform]]
size_m = [4.0, 4.0]
top_m = 0.5
[[mission.step]]
do = "take-off"
height_m = {0.5 + range_m}
[[mission.step]]
do = "hover"
time_s = 14.0
""", "over-platform")


def test_ground_effect_is_the_published_curve():
    """The published formula, written out as printed, and its values for the cf2x's geometry."""
    radius, d = 0.0231348, 0.0561
    heights = np.array([0.04, 0.06, 0.08, 0.12])
    b = np.sqrt(2) * d
    published = 1 / (1 - (radius / (4 * heights)) ** 2
                     - radius**2 * heights / np.sqrt((d**2 + 4 * heights**2) ** 3)
                     - radius**2 / 2 * heights / np.sqrt((2 * d**2 + 4 * heights**2) ** 3)
                     - 2 * radius**2 * heights / np.sqrt((b**2 + 4 * heights**2) ** 3) * 2.0)
    curve = np.array([1 + thrust_ratio(h, radius, d, 2.0) for h in heights])
    np.testing.assert_allclose(curve, published, rtol=1e-12)
    np.testing.assert_allclose(100 * (curve - 1), [11.6, 7.5, 5.0, 2.5], rtol=0.09)


@pytest.mark.parametrize("range_m", [0.03, 0.06, 0.10])
def test_hover_pwm_over_a_platform_follows_the_curve(steady, vehicle, range_m):
    log = steady({"ground_effect": {"turbulence": 0.0}}, scene=over_platform(range_m))
    ratio = np.mean([thrust_ratio(z + 0.025, vehicle.rotor_radius_m, math.sqrt(2) * vehicle.arm_m, 2.0)
                     for z in log["z_m"] - 0.5])
    thrust = vehicle.thrust(log.stack(PWM)).sum(axis=1).mean() * (1 + ratio)
    assert thrust == pytest.approx(MASS * GRAVITY, rel=2e-3)


def test_ground_effect_grows_with_the_share_of_the_disc_that_is_covered(signals):
    signals[:, at.UPPER_HEIGHT:at.UPPER_HEIGHT + 4] = 0.05
    values = {"turbulence": 0.0}
    forces = []
    for share in (0.0, 0.5, 1.0):
        signals[:, at.COVER:at.COVER + 4] = share
        forces.append(wrench("ground_effect", values, signals)[0, 2])
    assert forces[1] == pytest.approx(0.5 * (forces[0] + forces[2]), rel=1e-9)
    signals[:, at.COVER:at.COVER + 4] = (1.0, 0.0, 0.0, 1.0)  # the two front rotors: the nose goes up
    assert wrench("ground_effect", values, signals)[0, 4] < 0.0


def test_ground_effect_turbulence_has_its_rms(signals):
    signals = np.repeat(signals[:1], 20000, axis=0)
    signals[:, at.LOWER_HEIGHT:at.LOWER_HEIGHT + 4] = 0.05
    calm = wrench("ground_effect", {"turbulence": 0.0}, signals)[0, 2]
    rough = wrench("ground_effect", {"turbulence": 0.3}, signals)[:, 2]
    assert rough.std() / calm == pytest.approx(0.3 / 2, rel=0.1)  # four rotors, each on its own


def test_joint_lift_does_not_amplify_the_moments_of_the_motors(signals):
    """At equal heights the lift g of each rotor is alike: it adds g times the motors' moment, or with joint 1 none."""
    signals[:, at.LOWER_HEIGHT:at.LOWER_HEIGHT + 4] = 0.05
    signals[:, at.THRUST:at.THRUST + 4] = (0.05, 0.08, 0.11, 0.10)
    own, half, joint = (wrench("ground_effect", {"turbulence": 0.0, "joint": x}, signals)[0] for x in (0.0, 0.5, 1.0))
    assert [half[2], joint[2]] == pytest.approx([own[2]] * 2)
    thrust, y = signals[0, at.THRUST:at.THRUST + 4], signals[0, at.ROTOR_Y:at.ROTOR_Y + 4]
    assert own[3] == pytest.approx(own[2] / thrust.sum() * (y @ thrust)) and abs(own[3]) > 1e-5
    assert [half[3], half[4]] == pytest.approx([0.5 * own[3], 0.5 * own[4]])
    assert joint[3:5] == pytest.approx(0.0, abs=1e-12)


def test_modes_of_the_turbulence_have_their_shares(signals):
    """heave and pitch scale total force and pitching torque, roll stays; swirl is yaw torque over lift."""
    signals = np.repeat(signals[:1], 5000, axis=0)
    signals[:, at.LOWER_HEIGHT:at.LOWER_HEIGHT + 4] = 0.05
    signals[:, [at.LOWER_FACTOR, at.LOWER_FACTOR + 1, at.LOWER_FACTOR + 2, at.LOWER_FACTOR + 3]] = 1.0
    calm = wrench("ground_effect", {"turbulence": 0.0}, signals)
    common, pairwise = (wrench("ground_effect", {"turbulence": 0.3, **values}, signals) - calm
                        for values in ({}, {"heave": 0.5, "pitch": 0.25, "swirl": 0.01}))
    np.testing.assert_allclose(pairwise[:, 2], 0.5 * common[:, 2], atol=1e-12)
    np.testing.assert_allclose(pairwise[:, 3], common[:, 3], atol=1e-12)
    np.testing.assert_allclose(pairwise[:, 4], 0.25 * common[:, 4], atol=1e-12)
    assert not common[:, 5].any()
    assert pairwise[:, 5].std() == pytest.approx(0.01 * common[:, 2].std(), rel=0.15)  # as much as four rotors' lift


def test_rotor_drag_is_linear(signals):
    signals[:, at.VELOCITY:at.VELOCITY + 3] = (1.0, -2.0, 0.5)
    force = wrench("rotor_drag", {"horizontal": 0.01, "vertical": 0.02}, signals)[0]
    np.testing.assert_allclose(force, [-0.01, 0.02, -0.01, 0, 0, 0], atol=1e-12)


def test_wind_gives_the_tilt_that_drag_implies(steady):
    log = steady({"wind": {"x": -1.0, "y": 0.5, "drag": 0.0147}})
    weight = MASS * GRAVITY
    assert log["pitch_rad"].mean() == pytest.approx(math.atan(0.0147 * 1.0 / weight), rel=0.03)
    assert log["roll_rad"].mean() == pytest.approx(math.atan(0.0147 * 0.5 / weight), rel=0.03)


def test_wind_above_the_centre_of_mass_tips_the_vehicle_over(signals):
    """Moment = lever x force, for any attitude: wind to the left lowers the left side."""
    angle = 0.4
    signals[:, at.ROTATION:at.ROTATION + 9] = (1, 0, 0, 0, math.cos(angle), -math.sin(angle),
                                               0, math.sin(angle), math.cos(angle))
    values = {"x": 0.3, "y": 0.8, "drag": 0.0147, "lever": 0.02}
    with_lever = wrench("wind", values, signals)[0]
    force = 0.0147 * np.array([0.3, 0.8 * math.cos(angle), 0.0])
    np.testing.assert_allclose(with_lever[:3], force, atol=1e-15)
    np.testing.assert_allclose(with_lever[3:], np.cross([0, 0, 0.02], force), atol=1e-15)
    assert with_lever[3] < 0.0
    without_lever = wrench("wind", {**values, "lever": 0.0}, signals)[0]
    assert not without_lever[3:].any() and np.array_equal(without_lever[:3], with_lever[:3])


def test_rotors_on_the_lee_side_hold_against_wind_above_the_centre_of_mass(steady, vehicle):
    """Hover: torque of the rotors = minus the moment of the wind."""
    log = steady({"wind": {"x": 0.0, "y": 1.0, "drag": 0.0147, "lever": 0.03}})
    still = steady({"wind": {"x": 0.0, "y": 1.0, "drag": 0.0147}})
    roll = [(t := vehicle.thrust(hover.stack(PWM)).mean(axis=0))[2] + t[3] - t[0] - t[1] for hover in (log, still)]
    torque = vehicle.arm_m / math.sqrt(2.0) * (roll[0] - roll[1])
    assert torque == pytest.approx(0.0147 * 1.0 * 0.03, rel=0.05)


def test_gusts_have_the_dryden_spectrum(signals):
    signals = np.repeat(signals[:1], 200_000, axis=0)
    signals[:, at.STEP] = 0.01
    tau, rms, drag = 0.5, 0.4, 0.01
    air = wrench("gust", {"rms": rms, "length": tau, "airspeed": 1.0, "drag": drag}, signals)[:, :2] / drag
    f, power = welch(air.T, fs=100.0, nperseg=8192)
    band = (f > 0.05) & (f < 3.0)
    w = 2 * np.pi * f[band] * tau
    along = 4 * rms**2 * tau / (1 + w**2)
    across = 2 * rms**2 * tau * (1 + 3 * w**2) / (1 + w**2) ** 2
    for measured, formula in zip(power[:, band], (along, across), strict=True):
        assert abs(np.mean(10 * np.log10(measured / formula))) < 0.3
        assert np.std(10 * np.log10(measured / formula)) < 1.5


def test_gusts_above_the_centre_of_mass_and_small_eddies_turn_the_vehicle(signals):
    """Roll, pitch: lever x force. Yaw: mean x^2 of the rotors x drag x r_g with the spectrum of MIL-F-8785C."""
    signals = np.repeat(signals[:1], 200_000, axis=0)
    signals[:, at.STEP] = 0.01
    tau, rms, drag, speed = 0.4, 0.4, 0.01, 1.25
    centred = {"rms": rms, "length": tau * speed, "airspeed": speed, "drag": drag}
    calm, gusty = (wrench("gust", values, signals) for values in (centred, {**centred, "lever": 0.02, "shear": 1.0}))
    assert np.array_equal(gusty[:, :3], calm[:, :3]) and not calm[:, 3:].any()
    np.testing.assert_allclose(gusty[:, 3:5], 0.02 * np.stack([-gusty[:, 1], gusty[:, 0]], axis=1), atol=1e-15)
    f, power = welch(gusty[:, 5], fs=100.0, nperseg=8192)
    band = (f > 0.05) & (f < 3.0)
    w = 2 * np.pi * f[band]
    across = 2 * rms**2 * tau * (1 + 3 * (w * tau) ** 2) / (1 + (w * tau) ** 2) ** 2
    turning = across * (w / speed) ** 2 / (1 + (3 * signals[0, at.ROTOR_SPACING] / (np.pi * speed) * w) ** 2)
    lever_squared = np.mean(signals[0, at.ROTOR_X:at.ROTOR_X + 4] ** 2)
    decibel = 10 * np.log10(power[band] / (turning * (drag * lever_squared) ** 2))
    assert abs(np.mean(decibel)) < 0.4 and np.std(decibel) < 1.5


def test_blade_flapping_tilts_the_thrust_back(signals):
    signals[:, at.VELOCITY] = 2.0
    force = wrench("blade_flapping", {"tilt": 0.01, "hub": 0.005, "above": 0.01}, signals)[0]
    back = MASS * GRAVITY * 0.02
    np.testing.assert_allclose(force, [-back, 0, 0, 0, -0.015 * back, 0], atol=1e-12)


def test_blade_flapping_has_a_moment_without_a_force_too(signals):
    """Over thrust and speed; negative, it lowers the nose: forward is x, so the torque about y is positive."""
    signals[:, at.VELOCITY], signals[:, at.VELOCITY + 1] = 2.0, -1.0
    moment = wrench("blade_flapping", {"tilt": 0.0, "moment": -3e-4}, signals)[0]
    np.testing.assert_allclose(moment, MASS * GRAVITY * 3e-4 * np.array([0, 0, 0, 1.0, 2.0, 0]), atol=1e-12)


def test_slung_load_hangs_and_swings_at_its_period(signals):
    signals = np.repeat(signals[:1], 15000, axis=0)
    signals[:, at.ACCELERATION] = np.where(np.arange(15000) < 50, 1.0, 0.0)  # a push sets it swinging
    length, load = 0.3, 0.002
    force = wrench("slung_load", {"load": load, "length": length, "damping": 0.0}, signals)
    assert force[5000:, 2].mean() == pytest.approx(-load * GRAVITY, rel=0.02)
    swing = force[2500:, 0] - force[2500:, 0].mean()
    crossings = np.flatnonzero((swing[:-1] < 0) & (swing[1:] >= 0))
    period = np.diff(crossings).mean() * 0.002
    assert period == pytest.approx(2 * math.pi * math.sqrt(length / GRAVITY), rel=0.02)


def test_slung_load_is_carried_in_hover(steady, vehicle):
    log = steady({"slung_load": {"load": 0.003, "length": 0.15}})
    assert vehicle.thrust(log.stack(PWM)).sum(1).mean() == pytest.approx((MASS + 0.003) * GRAVITY, rel=3e-3)
