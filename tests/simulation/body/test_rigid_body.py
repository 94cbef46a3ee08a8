"""Closed forms: free fall, torque-free precession, hover; order of convergence."""

import numpy as np
import pytest

from airtouch.simulation.body import rigid_body
from airtouch.simulation.body.rotation import as_matrix, euler, from_euler, matrix, rotate, rotate_back
from airtouch.simulation.plant import from_vehicle, hover_speed


@pytest.fixture
def plant(vehicle):
    return from_vehicle(vehicle)


def body_of(plant, state, speed, target):
    """A BODY (1,) of the plant's nominal rotors, without effects."""
    body = np.zeros(1, rigid_body.BODY)
    body["state"], body["rotor_speed"], body["target_speed"], body["gain"] = state, speed, target, plant["gain"]
    return body


def integrate(plant, state, speed, target, h, steps):
    plant, body = plant.copy(), body_of(plant, state, speed, target)
    plant["step"] = h
    for _ in range(steps):
        rigid_body.step(plant[0], body[0])
    return body["state"][0], body["rotor_speed"][0]


def at_rest():
    state = np.zeros(13)
    state[6] = 1.0
    return state


def test_free_fall_is_a_parabola(plant):
    state, _ = integrate(plant, at_rest(), np.zeros(4), np.zeros(4), 0.002, 500)
    assert state[2] == pytest.approx(-0.5 * 9.81, abs=1e-9)
    assert state[5] == pytest.approx(-9.81, abs=1e-9)


def test_torque_free_precession_keeps_energy_and_angular_momentum(plant):
    plant["inertia"] = (1.4e-5, 1.9e-5, 2.8e-5)
    state = at_rest()
    state[10:] = (3.0, 8.0, 2.0)
    inertia = plant[0]["inertia"]

    def energy_and_momentum(x):
        momentum = np.array(rotate(x[6:10], *(inertia * x[10:])))
        return 0.5 * np.sum(inertia * x[10:] ** 2), momentum

    energy, momentum = energy_and_momentum(state)
    later, _ = integrate(plant, state, np.zeros(4), np.zeros(4), 0.002, 5000)
    energy_later, momentum_later = energy_and_momentum(later)
    assert energy_later == pytest.approx(energy, rel=1e-6)
    np.testing.assert_allclose(momentum_later, momentum, atol=1e-6 * np.linalg.norm(momentum))


def test_symmetric_top_precesses_at_its_closed_form(plant):
    plant["inertia"] = (1.5e-5, 1.5e-5, 2.5e-5)
    state = at_rest()
    state[10:] = (1.0, 0.0, 6.0)
    later, _ = integrate(plant, state, np.zeros(4), np.zeros(4), 0.002, 1000)
    turn = (2.5e-5 - 1.5e-5) / 1.5e-5 * 6.0 * 2.0
    np.testing.assert_allclose(later[10:], [np.cos(turn), np.sin(turn), 6.0], atol=1e-7)


def test_spinning_rotors_add_their_gyroscopic_torque(plant):
    """Two rotors that both carry momentum about z, h in all: a roll rate makes the nose go J wy' = wx h."""
    plant["rotor_inertia"], plant["thrust_per_speed2"], plant["gravity"] = 2e-8, 1e-30, 0.0
    speed, spin = np.array([2500.0, 0.0, 2500.0, 0.0]), 1e-4
    body = body_of(plant, at_rest(), speed, speed)
    body["state"][0, 10:] = (2.0, 0.0, 0.0)
    rigid_body.derivative(plant[0], body[0])
    assert body["slope"][0, 11] == pytest.approx(2.0 * spin / plant[0]["inertia"][1])
    body["state"][0, 10:] = (0.0, 2.0, 0.0)
    rigid_body.derivative(plant[0], body[0])
    assert body["slope"][0, 10] == pytest.approx(-2.0 * spin / plant[0]["inertia"][0])


def test_angular_momentum_of_body_and_rotors_is_kept_while_rotors_spin_up(plant):
    plant["rotor_inertia"], plant["thrust_per_speed2"], plant["gravity"] = 2e-8, 1e-30, 0.0
    target = np.array([2000.0, 0.0, 2000.0, 0.0])  # both spin towards +z
    state, speed = integrate(plant, at_rest(), np.zeros(4), target, 0.002, 300)
    rotors = 2e-8 * np.dot(rigid_body.SPIN, speed)
    assert plant[0]["inertia"][2] * state[12] == pytest.approx(-rotors, rel=1e-6)


def test_hover_speed_holds_height(plant):
    speed = np.full(4, hover_speed(plant))
    state, _ = integrate(plant, at_rest(), speed, speed, 0.002, 1000)
    np.testing.assert_allclose(state, at_rest(), atol=1e-9)


@pytest.mark.parametrize(("rotor", "roll", "pitch", "yaw"), [(0, -1, -1, -1), (1, -1, 1, 1), (2, 1, 1, -1),
                                                             (3, 1, -1, 1)])
def test_each_rotor_turns_the_body_the_documented_way(plant, rotor, roll, pitch, yaw):
    speed = np.zeros(4)
    speed[rotor] = 2000.0
    assert tuple(np.sign(rigid_body.rotor_wrench(plant[0], speed, np.ones(4)))) == (1, roll, pitch, yaw)


def test_the_error_falls_with_the_fourth_power_of_the_step(plant):
    plant["rotor_inertia"] = 2e-8
    state, speed = at_rest(), np.full(4, 1000.0)
    state[10:] = (4.0, -3.0, 5.0)
    target = np.array([1900.0, 2100.0, 2050.0, 1950.0])

    def end(steps):
        return integrate(plant, state, speed, target, 0.4 / steps, steps)[0]

    truth = end(1600)
    errors = np.array([np.linalg.norm(end(n) - truth) for n in (25, 50, 100)])
    orders = np.log2(errors[:-1] / errors[1:])
    assert np.all(orders > 3.6), orders


def test_rotor_step_has_its_time_constant(plant):
    plant["motor_rise"] = plant["motor_fall"] = 0.05
    _, speed = integrate(plant, at_rest(), np.zeros(4), np.full(4, 2000.0), 0.002, 25)
    np.testing.assert_allclose(speed, 2000.0 * (1 - np.exp(-1)), rtol=1e-9)


def test_rotations_agree_with_each_other():
    q, out = np.zeros(4), np.zeros(9)
    from_euler(0.3, -0.4, 1.2, q)
    np.testing.assert_allclose(euler(q), (0.3, -0.4, 1.2), atol=1e-12)
    matrix(q, out, 0)
    expected = as_matrix(np.array([0.3]), np.array([-0.4]), np.array([1.2]))[0]
    np.testing.assert_allclose(out.reshape(3, 3), expected, atol=1e-12)
    np.testing.assert_allclose(rotate(q, 1.0, 2.0, 3.0), expected @ (1, 2, 3), atol=1e-12)
    np.testing.assert_allclose(rotate_back(q, *rotate(q, 1.0, 2.0, 3.0)), (1, 2, 3), atol=1e-12)
