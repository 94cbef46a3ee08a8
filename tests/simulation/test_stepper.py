"""A flight flown in pieces is the flight flown in one call, bit for bit."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch import vehicle
from airtouch.errors import AirTouchError
from airtouch.simulation import loop, scenario, signals
from airtouch.simulation.effects import Active, Effect, activate
from airtouch.simulation.flight import choose
from airtouch.simulation.plant import hover_speed
from airtouch.simulation.sensors import log_row
from airtouch.simulation.stepper import Stepper, prepare


@pytest.mark.parametrize("name", ["paper-9cm", "gusts", "randomised"])
def test_pieces_equal_the_whole(name):
    plan = scenario.draw_flight(scenario.load(name), 5, 2)
    rows = min(len(plan.setpoints), 1500)

    def fly_in_pieces(sizes):
        stepper = Stepper(plan, vehicle.load(), 5, 2, choose(plan))
        table, row = np.full((rows, log_row.COLUMNS), np.nan), 0
        stepper.begin(plan.setpoints[0])
        while row < rows:
            size = min(next(sizes), rows - row)
            ending, filled = stepper.fly(plan.setpoints[row:row + size], table[row:row + size])
            assert (ending, filled) == (loop.OK, size)
            row += size
        return table

    at_once = fly_in_pieces(iter([rows]))
    assert np.ptp(at_once[:, log_row.POSITION + 2]) > 0.3  # it does fly
    rng = np.random.default_rng(1)
    for sizes in (iter(lambda: 1, 0), iter(lambda: int(rng.integers(1, 40)), 0)):
        np.testing.assert_array_equal(fly_in_pieces(sizes), at_once)


def test_a_second_flight_begins_with_the_rotors_of_the_first():
    """Motor noise is drawn around the thrust of the vehicle, not around that of the last flight's last step."""
    plan = scenario.draw_flight(scenario.load("paper-9cm"), 5, 2)
    stepper = Stepper(plan, vehicle.load(), 5, 2, choose(plan, {"motor_noise": {"rms": 0.05}}))
    nominal = stepper.plant[0]["gain"].copy()
    for _ in range(3):
        stepper.begin(plan.setpoints[0])
        gain = stepper.state[0]["body"]["gain"]
        np.testing.assert_array_equal(gain, nominal)
        stepper.fly(plan.setpoints[:300], np.empty((300, log_row.COLUMNS)))
        assert np.ptp(gain / nominal) > 0.001  # noise of the last step
        np.testing.assert_array_equal(stepper.plant[0]["gain"], nominal)  # which leaves the plant as it is


def with_delay(field, delay_s):
    """An effect that sets a delay of the plant."""
    def set_delay(plant, values):
        plant[field] = delay_s

    return [Active(Effect("late", "late", (), settings=set_delay), {})]


@pytest.mark.parametrize("delay_s", [0.1, 0.125, 0.126])
def test_a_delayed_command_arrives_after_the_delay(delay_s):
    """Rotors without a command slow down; they start `delay_s` after the first one. Physics steps are 2 ms."""
    plan = scenario.draw_flight(scenario.load("hover"), 1, 0)
    started = []
    for late in (0.0, delay_s):
        stepper = Stepper(plan, vehicle.load(), 1, 0, with_delay("actuator_delay", late))
        stepper.begin(plan.setpoints[0])
        table = np.empty((300, log_row.COLUMNS))
        moving = []
        for row in range(300):
            stepper.fly(plan.setpoints[row:row + 1], table[row:row + 1])
            moving.append(stepper.state[0]["body"]["rotor_speed"].max() > 1.0)
        started.append(moving.index(True))
    assert started[1] - started[0] in (int(100 * delay_s), int(100 * delay_s) + 1)


@pytest.mark.parametrize(("field", "fits", "wraps"), [
    ("actuator_delay", 0.126, 0.2), ("sensor_delay", 0.126, 0.13), ("range_delay", 0.399, 0.5),
    ("flow_delay", 0.63, 0.7)])
def test_a_delay_beyond_its_line_is_refused(field, fits, wraps):
    plan = scenario.draw_flight(scenario.load("hover"), 1, 0)
    Stepper(plan, vehicle.load(), 1, 0, with_delay(field, fits))
    for bad in (wraps, np.nan, -0.01):
        with pytest.raises(AirTouchError, match=field):
            Stepper(plan, vehicle.load(), 1, 0, with_delay(field, bad))


@pytest.mark.parametrize("heavier", [0.0, 0.5])
def test_a_vehicles_own_rotor_drag_is_that_of_its_rotors_speed_whatever_it_carries(heavier):
    per_rad = 4e-6  # N per (rad/s) and (m/s)
    own = replace(vehicle.load(), rotor_drag_kg_per_rad=per_rad)
    plant, acting = prepare(own, activate({"mass": {"fraction": heavier}}))
    s, force = np.zeros(signals.COUNT), np.zeros(6)
    s[signals.ROTOR_SPEED:signals.ROTOR_SPEED + 4], s[signals.VELOCITY] = 1500.0, 0.7
    s[signals.HOVER_SPEED] = hover_speed(plant)
    acting[0].effect.wrench(acting[0].effect.vector(acting[0].values), s, np.zeros(12), np.zeros(1, np.uint64), force)
    np.testing.assert_allclose(force[:3], [-per_rad * 4 * 1500.0 * 0.7, 0.0, 0.0])
