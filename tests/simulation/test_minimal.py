"""The minimal generator: physics in closed form, truth as commanded, the same bits for the same seed."""

import numpy as np
import pytest

from airtouch import logs, vehicle
from airtouch.logs.flight_log import PWM
from airtouch.simulation.minimal import Mission, fly, missions, sanchez_cuevas

PLAN = [Mission(0.2, 0.04, 0.0, 1.0), Mission(0.35, 0.07, -20.0, 1.5)]


@pytest.fixture(scope="module")
def flown():
    return fly(PLAN, seed=3)


def test_ground_effect_fades_and_has_the_published_size():
    v = vehicle.load()
    heights = np.array([0.04, 0.06, 0.08, 0.12, 10.0])
    gain = sanchez_cuevas(heights, v.rotor_radius_m, 2 * v.arm_m / np.sqrt(2)) - 1
    assert gain[:4] == pytest.approx([0.116, 0.075, 0.050, 0.025], rel=0.1)
    assert gain[4] < 1e-5 and (np.diff(gain) < 0).all()


def test_one_entry_and_one_exit_where_the_platform_is(flown):
    for log, mission in zip(flown, PLAN, strict=True):
        edges = logs.true_edges(log)
        assert [e.kind for e in edges] == ["entry", "exit"]
        assert log["x_m"][edges[0].sample] == pytest.approx(mission.before_m, abs=0.05)
        length = log["x_m"][edges[1].sample] - log["x_m"][edges[0].sample]
        assert length == pytest.approx(0.75 / np.cos(np.deg2rad(mission.angle_deg)), abs=0.05)
        assert edges[0].height_after_m == pytest.approx(mission.clearance_m, abs=0.03)


def test_hover_carries_the_weight(flown):
    v = vehicle.load()
    for log in flown:
        hover = slice(400, 550)
        volts = log["vbat_V"][hover] / 4.0
        lift = (v.thrust(log.stack(PWM)[hover]).sum(axis=1) * volts**2).mean()
        assert lift == pytest.approx(v.mass_kg * v.gravity_mps2, rel=0.05)  # motors differ by 2 %
        assert log["acc_world_z_mps2"][hover].mean() == pytest.approx(9.81, abs=0.2)


def test_battery_sags_and_pwm_rises(flown):
    log = flown[0]
    edges = logs.true_edges(log)
    late = slice(edges[1].sample + 150, edges[1].sample + 250)
    assert log["vbat_V"][late].mean() < log["vbat_V"][400:500].mean()
    assert log.stack(PWM)[late].mean() > log.stack(PWM)[400:500].mean()


def test_the_platform_is_felt(flown):
    log = flown[0]
    entry, leave = (e.sample for e in logs.true_edges(log))
    rates = log["gyro_x_radps"]
    assert rates[entry:leave].std() > 2 * rates[400:550].std()


def test_deterministic_whatever_the_batch(flown):
    again = fly(PLAN[:1], seed=3)[0]
    for name, values in again.columns.items():
        assert np.array_equal(values, flown[0].columns[name]), name
    assert not np.array_equal(fly(PLAN[:1], seed=4)[0]["gyro_x_radps"], again["gyro_x_radps"])


def test_all_of_a_plan_ends_on_the_ground():
    for log in fly(missions(6, seed=5), seed=5):
        assert np.isfinite(log.stack(log.columns)).all()
        assert log["z_m"][-1] < 0.02 and log["z_m"].max() < 1.0
        assert np.abs(log["roll_rad"]).max() < 0.6
