"""The closed loop flies the firmware: over platforms with each release and range module, estimate against truth."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch import vehicle as vehicles
from airtouch.errors import AirTouchError
from airtouch.logs import true_edges
from airtouch.simulation import effects, flight, scenario
from airtouch.simulation.firmware import battery_compensation, controller, setpoint, settings
from airtouch.simulation.sensors import ranging
from airtouch.simulation.stepper import Stepper

PLATFORM = """
name = "platform"
{choice}
[[platform]]
size_m = [1.2, 4.0]
centre_m = [1.6, 0.0]
top_m = {top}
[[mission.step]]
do = "take-off"
height_m = 0.82
[[mission.step]]
do = "hover"
time_s = 8.0
[[mission.step]]
do = "go"
distance_m = 3.5
speed_mps = 0.3
"""


def swept(vehicle, top=0.75, **choice):
    """The log of a pass over a platform, and its rows before, over and after it."""
    lines = "\n".join(f'{key} = "{value}"' for key, value in choice.items())
    scene = scenario.parse(PLATFORM.format(choice=lines, top=top), "platform")
    log = flight.fly(scene, vehicle, 1, 0)
    assert not isinstance(log, flight.Diverged), str(log)
    over = (log["x_m"] > 1.5) & (log["x_m"] < 2.1)
    assert over.any()
    return log, (log["x_m"] > 0.3) & (log["x_m"] < 0.8), over


def test_the_stock_firmware_climbs_over_a_platform(ideal):
    log, before, over = swept(ideal, top=0.3, firmware="2026.08", range_module="firmware")
    assert log["z_m"][before].mean() == pytest.approx(0.82, abs=0.06)
    assert log["z_m"][over].mean() == pytest.approx(0.3 + 0.82, abs=0.12)  # the height over what is below
    assert log.meta["firmware"] == "2026.08" and log.meta["range_module"] == "firmware"


def test_the_authors_firmware_keeps_its_height(ideal):
    """Their module adds 0.75 m: the drone keeps its height over a platform as high, and errs by what it is off."""
    log, before, over = swept(ideal, firmware="authors-2024-01", range_module="firmware")
    assert log["z_m"][over].mean() == pytest.approx(log["z_m"][before].mean(), abs=0.03)
    assert [e.kind for e in true_edges(log)] == ["entry", "exit"]
    high, _, above = swept(ideal, top=0.77, firmware="authors-2024-01", range_module="firmware")
    low, _, under = swept(ideal, top=0.72, firmware="authors-2024-01", range_module="firmware")
    assert high["z_m"][above].mean() - low["z_m"][under].mean() == pytest.approx(0.05, abs=0.015)


@pytest.mark.parametrize("firmware", settings.names())
def test_a_module_that_knows_the_floor_keeps_the_height_over_any_platform(ideal, firmware):
    log, before, over = swept(ideal, top=0.4, firmware=firmware, range_module="map")
    assert log["z_m"][over].mean() == pytest.approx(log["z_m"][before].mean(), abs=0.03)


def test_without_a_module_the_authors_firmware_climbs_too(ideal):
    log, _, over = swept(ideal, top=0.3, firmware="authors-2024-01", range_module="none")
    assert log["z_m"][over].mean() > 1.0


@pytest.mark.parametrize("firmware", settings.names())
def test_the_estimate_follows_the_truth(vehicle, firmware):
    """Sensors as noisy as declared: height, velocity and tilt of the estimate against the state, 20 s of flight."""
    plan = scenario.draw_flight(scenario.load("hover"), 3, 0)
    stepper = Stepper(plan, replace(vehicle, firmware=firmware), 3, 0, ())
    stepper.begin(plan.setpoints[0])
    table, errors = np.zeros((1, 33)), []
    for row in plan.setpoints[:1300]:
        assert stepper.fly(row[None], table)[0] == 0
        s = stepper.state[0]["firmware"]
        errors.append([s["kalman"]["x"][2] - table[0, 19], *(s["estimate"]["velocity"] - table[0, 20:23]),
                       *(s["angles"][:2] - table[0, 23:25])])
    rms = np.sqrt(np.mean(np.square(errors[400:]), axis=0))
    assert rms[0] < 0.02  # m; the down range errs by 1.25 % of 0.8 m
    assert rms[1] < 0.11 and rms[2] < 0.05  # m/s: less than optical flow errs, as declared
    assert rms[3] < 0.08
    assert np.degrees(rms[4:]).max() < 1.0


def test_readings_come_when_the_firmware_reads_them(ideal):
    """Down range every 25 ms, flow every 10 ms, at ticks of their own; a delay makes them older by itself."""
    plan = scenario.draw_flight(scenario.load("hover"), 0, 0)

    def looks(**fields):
        stepper = Stepper(plan, ideal, 0, 0, ())
        for name, value in fields.items():
            stepper.plant[name] = value
        stepper.begin(plan.setpoints[0])
        table = np.zeros((800, 33))
        assert stepper.fly(plan.setpoints[:800], table)[0] == 0
        climb = table[180:260]
        age = ((climb[:, 19] - climb[:, 11]) / climb[:, 22]).mean()  # of the logged reading, s
        return stepper.state[0]["ranging"]["count"], age
    count, age = looks()
    assert count == (7990 - ranging.RANGE_MS) // 25 + 1
    assert age == pytest.approx(0.0125, abs=0.006)
    assert looks(range_delay=0.05)[1] - age == pytest.approx(0.05, abs=0.005)


def test_errors_of_the_down_range_act_where_they_should(ideal):
    plan = scenario.draw_flight(scenario.load("hover"), 0, 0)

    def hovering(**fields):
        stepper = Stepper(plan, ideal, 0, 0, ())
        for name, value in fields.items():
            stepper.plant[name] = value
        stepper.begin(plan.setpoints[0])
        table = np.zeros((1100, 33))
        assert stepper.fly(plan.setpoints[:1100], table)[0] == 0
        return table[1000:, 19].mean(), table[:50, 11].mean()
    height, ground = hovering()
    biased, near = hovering(range_bias=0.01, range_bias_fade=0.05)
    assert near - ground == pytest.approx(0.01 * np.exp(-0.004 / 0.05), abs=1e-3)
    assert biased == pytest.approx(height, abs=2e-3)  # far from the floor nothing is left of it
    dipped, _ = hovering(range_dip=0.02)
    assert dipped == height  # no edge, no dip


def test_late_flow_makes_the_velocity_loop_ring(ideal):
    """The estimate of the velocity lags, and steps of the set-point overshoot more."""
    plan = scenario.draw_flight(scenario.parse(PLATFORM.format(choice="", top=0.0), "flat"), 0, 0)

    def overshoot(delay):
        stepper = Stepper(plan, ideal, 0, 0, ())
        stepper.plant["flow_delay"] = delay
        stepper.begin(plan.setpoints[0])
        table = np.zeros((1250, 33))
        assert stepper.fly(plan.setpoints[:1250], table)[0] == 0
        return table[1000:, 20].max()
    assert overshoot(0.15) > overshoot(0.0) + 0.01


def test_set_points_reach_the_firmware_in_its_modes():
    out, row = np.zeros(1, controller.SETPOINT)[0], np.zeros(setpoint.SETPOINT_SIZE)
    row[:] = setpoint.FLY, 1.0, 2.0, 0.7, 0.3, -0.1, np.pi / 2, 1.0
    setpoint.to_firmware(row, out)
    assert out["mode"].tolist() == [2, 2, 1, 0, 0, 1] and out["attitude"][2] == pytest.approx(90.0)
    np.testing.assert_allclose(out["velocity"], [0.3, -0.1, 0.0])
    row[setpoint.MODE] = setpoint.HOLD
    setpoint.to_firmware(row, out)
    assert out["mode"].tolist() == [1, 1, 1, 0, 0, 1]
    row[setpoint.MODE], row[setpoint.VX], row[setpoint.VY] = setpoint.TILT_THRUST, 4.0, 5.0
    setpoint.to_firmware(row, out)
    assert out["mode"].tolist() == [0, 0, 0, 1, 1, 1] and out["thrust"] == 0.7
    np.testing.assert_allclose(out["attitude"][:2], [4.0, -5.0])  # its pitch is nose up
    np.testing.assert_allclose(out["velocity"], 0.0)
    row[setpoint.MOTORS] = 0.0
    setpoint.to_firmware(row, out)
    assert out["mode"].tolist() == [0] * 6 and out["thrust"] == 0.0


@pytest.mark.parametrize(("line", "message"), [
    ('firmware = "2025.01"', "no firmware '2025.01'; did you mean 2026.08"),
    ('firmware = "zzz"', "no firmware 'zzz'; known: 2026.08, authors-2024-01"),
    ('firmware = "mine.toml"', "no such firmware file"),
    ("firmware = 3", "text in quotes"),
    ('range_module = "laser"', "one of map, platform, none, firmware")])
def test_unknown_choices_get_one_clear_line(line, message):
    for parse, text in ((scenario.parse, PLATFORM.format(choice=line, top=0.0)), (vehicles.parse, VEHICLE + line)):
        with pytest.raises(AirTouchError, match=message) as error:
            parse(text, "mine")
        assert "\n" not in str(error.value) and str(error.value).startswith("mine")


VEHICLE = """
name = "t"
mass_kg = 0.03
arm_m = 0.04
inertia_kg_m2 = [1e-5, 1e-5, 2e-5]
thrust_of_pwm_n = [0.0, 0.0, 4e-11]
yaw_torque_over_thrust_m = 0.006
motor_time_constant_s = 0.05
rotor_radius_m = 0.02
"""


def test_a_firmware_of_ones_own_is_a_small_file(tmp_path, ideal, hover):
    path = tmp_path / "slow.toml"
    path.write_text('base = "2026.08"\n[loops.position_z]\np = 1.0\n')
    mine = replace(ideal, firmware=str(path))
    assert flight.prepare(mine, ())[0][0]["firmware"]["loops"][settings.POSITION_Z]["p"] == 1.0
    slow, stock = flight.fly(hover, mine, 0, 0), flight.fly(hover, replace(ideal, firmware="2026.08"), 0, 0)
    assert slow["z_m"][:250].max() < stock["z_m"][:250].max()


def test_on_a_crazyflie_the_firmware_flies_unscaled():
    row = flight.prepare(vehicles.load("crazyflie-2.1-flow"), ())[0][0]
    assert (row["rate_scale"], row["thrust_base"], row["thrust_scale"]) == (1.0, 36000.0, 1000.0)
    assert row["firmware"]["battery_compensation"]["kind"] == settings.QUADRATIC
    other = flight.prepare(vehicles.load("quadrotor-450"), effects.activate(()))[0][0]
    assert other["firmware"]["battery_compensation"]["kind"] == settings.NO_COMPENSATION


@pytest.mark.parametrize("firmware", settings.names())
def test_slope_of_the_compensation_is_that_of_its_commands(vehicle, firmware):
    row = flight.prepare(replace(vehicle, firmware=firmware), ())[0][0]
    low, high = (battery_compensation.compensate(row["firmware"], row, 3.8, c) for c in (44000.0, 46000.0))
    slope = battery_compensation.slope(row["firmware"], row, 0.5 * (low + high))
    assert slope == pytest.approx((high - low) / 2000.0, rel=0.01) and 0.4 < slope < 0.7
