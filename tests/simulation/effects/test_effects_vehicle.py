"""Effects on the vehicle and its motors: each against its closed form."""

import numpy as np
import pytest
from scipy.optimize import brentq

from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import PWM, FlightLog
from airtouch.simulation import effects, replay
from airtouch.simulation.body import battery
from airtouch.simulation.firmware import battery_compensation
from airtouch.simulation.flight import prepare
from airtouch.simulation.plant import from_vehicle

WEIGHT = 0.0362 * 9.81


def thrusts(log, vehicle):
    return vehicle.thrust(log.stack(PWM)).mean(axis=0)


def command(pwm):
    pwm = np.asarray(pwm, dtype=float)
    if pwm.ndim == 1:
        pwm = np.tile(pwm[:, None], (1, 4))
    return FlightLog({name: pwm[:, i] for i, name in enumerate(PWM)})


def rotor_speeds(pwm, vehicle, chosen=(), period_s=0.002):
    return replay.run(command(pwm), vehicle, effects.activate(chosen), period_s=period_s)


def test_mass_and_thrust_coefficient_are_carried_by_more_thrust(steady, vehicle):
    assert thrusts(steady(), vehicle).sum() == pytest.approx(WEIGHT, rel=1e-3)
    assert thrusts(steady({"mass": {"fraction": 0.1}}), vehicle).sum() == pytest.approx(1.1 * WEIGHT,
            rel=1e-3)
    lossy = thrusts(steady({"thrust_coefficient": {"loss": 0.1}}), vehicle).sum()
    assert lossy == pytest.approx(WEIGHT / 0.9, rel=1e-3)


@pytest.mark.parametrize("rotor", [1, 2, 3, 4])
def test_weak_motor_gets_more_command_and_the_others_none(steady, vehicle, rotor):
    thrust = thrusts(steady({"weak_motor": {"rotor": rotor, "thrust_loss": 0.12}}), vehicle)
    expected = np.full(4, WEIGHT / 4)
    expected[rotor - 1] /= 0.88
    np.testing.assert_allclose(thrust, expected, rtol=3e-3)


def test_two_weak_motors_are_two_entries(steady, vehicle):
    pair = [("weak_motor", {"rotor": 1, "thrust_loss": 0.1}), ("weak_motor", {"rotor": 3,
            "thrust_loss": 0.05})]
    expected = WEIGHT / 4 / np.array([0.9, 1.0, 0.95, 1.0])
    np.testing.assert_allclose(thrusts(steady(pair), vehicle), expected, rtol=3e-3)


def test_centre_of_mass_is_carried_by_the_rotors_nearer_to_it(steady, vehicle):
    half = vehicle.arm_m / np.sqrt(2)
    thrust = thrusts(steady({"com_offset": {"x": 0.002, "y": -0.001}}), vehicle)
    front_share, right_share = thrust[[0, 3]].sum() / thrust.sum(), thrust[[0, 1]].sum() / thrust.sum()
    assert front_share == pytest.approx(0.5 + 0.5 * 0.002 / half, rel=3e-3)
    assert right_share == pytest.approx(0.5 + 0.5 * 0.001 / half, rel=3e-3)


def test_inertia_slows_the_turn(vehicle):
    pwm = np.tile([42000.0, 42000.0, 46000.0, 46000.0], (200, 1))
    nominal = rotor_speeds(pwm, vehicle).angular_acceleration[-1]
    heavy = rotor_speeds(pwm, vehicle, {"inertia": {"fraction": 0.5}}).angular_acceleration[-1]
    np.testing.assert_allclose(heavy, nominal / 1.5, rtol=1e-9)


@pytest.mark.parametrize("factor", [0.5, 1.0, 2.0])
def test_motor_lag_has_its_time_constant(vehicle, factor):
    pwm = np.r_[np.full(100, 30000.0), np.full(400, 45000.0)]
    speed = rotor_speeds(pwm, vehicle, {"motor_lag": {"factor": factor}}).rotor_speed[:, 0]
    share = (speed - speed[0]) / (speed[-1] - speed[0])
    rise_s = 0.002 * (np.argmax(share >= 1 - np.exp(-1)) - 100)
    assert rise_s == pytest.approx(factor * vehicle.motor_time_constant_s, abs=0.003)


def test_motor_lag_may_differ_between_rise_and_fall(vehicle):
    pwm = np.r_[np.full(500, 45000.0), np.full(400, 30000.0)]
    speed = rotor_speeds(pwm, vehicle, {"motor_lag": {"factor": 1.0, "fall": 2.0}}).rotor_speed[:, 0]
    share = (speed - speed[0]) / (speed[-1] - speed[0])
    assert 0.002 * (np.argmax(share >= 1 - np.exp(-1)) - 500) == pytest.approx(0.12, abs=0.003)


def test_an_actuator_delay_longer_than_the_delay_line_is_refused(vehicle):
    """A line of 64 samples: up to 63 of them the thrust is shifted, beyond it no other delay is flown instead."""
    pwm = np.r_[np.full(200, 30000.0), np.full(800, 45000.0)]
    late = {"actuator_delay": {"delay": 0.1}}
    speed = rotor_speeds(pwm, vehicle, late, period_s=0.002).rotor_speed[:, 0]
    assert np.argmax(speed > speed[0] + 1.0) - 200 == pytest.approx(0.1 / 0.002, abs=2)
    with pytest.raises(AirTouchError, match="actuator_delay = 0.1 s"):
        rotor_speeds(pwm, vehicle, late, period_s=0.001)


@pytest.mark.parametrize("delay", [0.0, 0.004, 0.013, 0.03])
def test_actuator_delay_shifts_the_thrust(vehicle, delay):
    pwm = np.r_[np.full(100, 30000.0), np.full(400, 45000.0)]
    early = rotor_speeds(pwm, vehicle).rotor_speed[:, 0]
    late = rotor_speeds(pwm, vehicle, {"actuator_delay": {"delay": delay}}).rotor_speed[:, 0]
    t = 0.002 * np.arange(500)
    half = 0.5 * (early[0] + early[-1])
    assert np.interp(half, late, t) - np.interp(half, early, t) == pytest.approx(delay, abs=0.0012)


@pytest.mark.parametrize("names", [("rms", "time"), ("fast", "fast_time")])
def test_motor_noise_has_its_rms_and_colour(steady, names):
    rms, time = 0.05, 0.02
    values = {"rms": 0.0, **dict(zip(names, (rms, time), strict=True))}
    log = steady({"motor_noise": values, "controller_gain": {"rate": 0.7}})
    nominal = steady()
    force = log["acc_z_mps2"] - nominal["acc_z_mps2"].mean()
    # four rotors each on their own: rms / 2 of the weight; the loop and 10 ms sampling change little
    assert force.std() == pytest.approx(9.81 * rms / 2, rel=0.2)
    lagged = np.corrcoef(force[:-1], force[1:])[0, 1]
    assert lagged == pytest.approx(np.exp(-0.01 / time), abs=0.15)


def test_battery_solves_its_circuit(vehicle):
    plant = from_vehicle(vehicle)[0]
    charge, volts = battery.drain(plant, 0.6, 6.0, 1.0)
    current = 6.0 / volts
    assert volts == pytest.approx(battery.open_circuit(0.6) - plant["battery_resistance"] * current,
                                  rel=1e-12)
    assert 0.6 - charge == pytest.approx(current / plant["battery_capacity"], rel=1e-9)


def test_battery_sag_raises_the_command_with_the_square_of_the_voltage(steady, vehicle):
    log = steady({"battery_sag": {"charge": 0.5}})
    thrust = vehicle.thrust(log.stack(PWM)).sum(1) * (log["vbat_V"] / vehicle.nominal_voltage_v) ** 2
    assert thrust.mean() == pytest.approx(WEIGHT, rel=2e-3)
    mean = log.stack(PWM).mean(1)
    assert mean[-100:].mean() > mean[:100].mean()


@pytest.mark.parametrize("firmware", ["2026.08", "authors-2024-01"])
def test_firmware_compensation_undoes_the_sag(ideal, steady, firmware):
    """Its commands change less with the charge than the PWM that carries the same weight."""
    from dataclasses import replace
    compensating = replace(ideal, firmware=firmware)
    full, empty = (steady({"battery_sag": {"charge": c}}, vehicle=compensating) for c in (0.9, 0.2))
    for log in (full, empty):
        thrust = compensating.thrust(log.stack(PWM)).sum(1) * (log["vbat_V"] / compensating.nominal_voltage_v) ** 2
        assert thrust.mean() == pytest.approx(WEIGHT, rel=2e-3)
        assert log["z_m"].std() < 0.02
    pwm = [log.stack(PWM).mean() for log in (full, empty)]
    plant = prepare(compensating, ())[0][0]
    volts = [log["vbat_V"].mean() for log in (full, empty)]

    def command(p, v):
        """The command whose compensation is p, by bisection."""
        return brentq(lambda c: battery_compensation.compensate(plant["firmware"], plant, v, c) - p, 10000.0, 65000.0,
                      xtol=2.0)
    commands = [command(p, v) for p, v in zip(pwm, volts, strict=True)]
    # the firmware takes thrust to follow PWM times voltage; here it follows a curve of PWM times voltage squared
    assert abs(commands[1] - commands[0]) < 0.6 * abs(pwm[1] - pwm[0])


def test_a_command_that_is_lost_holds_the_one_before(vehicle):
    pwm = np.tile(np.linspace(30000.0, 40000.0, 60)[:, None], (1, 4))
    held, lost = pwm.copy(), pwm.copy()
    held[20:25, 1] = held[19, 1]
    held[:3, 2] = held[3, 2]
    lost[20:25, 1] = [np.nan, np.inf, -np.inf, np.nan, np.nan]
    lost[:3, 2] = np.nan
    np.testing.assert_array_equal(rotor_speeds(lost, vehicle).rotor_speed, rotor_speeds(held, vehicle).rotor_speed)
    lost[:, 0], held[:, 0] = np.nan, 0.0  # of a motor without any command: off
    np.testing.assert_array_equal(rotor_speeds(lost, vehicle).rotor_speed, rotor_speeds(held, vehicle).rotor_speed)


def test_a_voltage_that_is_lost_holds_the_one_before(vehicle):
    pwm, n = np.full((60, 4), 36000.0), 60
    fly = {f"m{i + 1}_pwm": pwm[:, i] for i in range(4)} | {"t_s": 0.01 * np.arange(n)}
    low = np.full(n, 3.4)
    sparse = np.where(np.arange(n) % 10 == 3, low, np.nan)
    every_row, few_rows = (replay.run(FlightLog({**fly, "vbat_V": v}, {}), vehicle) for v in (low, sparse))
    np.testing.assert_array_equal(few_rows.specific_force, every_row.specific_force)
    unknown, none = (replay.run(FlightLog({**fly, **v}, {}), vehicle) for v in ({"vbat_V": low * np.nan}, {}))
    np.testing.assert_array_equal(unknown.specific_force, none.specific_force)
    assert few_rows.specific_force[-1, 2] < none.specific_force[-1, 2], "it is lower than the nominal one"
