"""The same rotor speed commands, open loop, through RotorPy's Crazyflie and through this simulator."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.simulation import effects, replay
from airtouch.simulation import signals as at
from airtouch.simulation.body import rigid_body
from airtouch.simulation.body.rotation import rotate_back
from airtouch.simulation.plant import from_vehicle, hover_speed

STEP_S, FLOWN_S = 0.002, 2.0
ORDER = [1, 2, 3, 0]  #: RotorPy's rotors front left, front right, rear right, rear left in our order


@pytest.fixture(scope="module")
def peer():
    """(their Multirotor class, their Crazyflie's parameters)."""
    multirotor = pytest.importorskip("rotorpy.vehicles.multirotor", reason="needs the extra 'bench'")
    from rotorpy.vehicles.crazyflie_params import quad_params

    return multirotor.Multirotor, {**quad_params, "motor_noise_std": 0.0}


@pytest.fixture(scope="module")
def same_vehicle(vehicle, peer):
    """Our vehicle with their parameters."""
    p = peer[1]
    return replace(vehicle, mass_kg=p["mass"], inertia_kg_m2=(p["Ixx"], p["Iyy"], p["Izz"]),
                   arm_m=float(np.linalg.norm(p["rotor_pos"]["r1"])), thrust_per_speed2=p["k_eta"],
                   yaw_torque_over_thrust_m=p["k_m"] / p["k_eta"], motor_time_constant_s=p["tau_m"],
                   motor_fall_time_constant_s=p["tau_m"], rotor_inertia_kg_m2=0.0)


def commands(hover):
    """(steps, 4) rad/s, our order: climb, roll, pitch and yaw pulses that end where they began."""
    t = np.arange(0.0, FLOWN_S, STEP_S)

    def pulse(start, size):
        return size * np.sin(2 * np.pi * (t - start) / 0.5) * ((t >= start) & (t < start + 0.5))

    roll, pitch, yaw = pulse(0.1, 14.0), pulse(0.4, 10.0), pulse(0.8, 150.0)
    climb = pulse(0.2, 100.0) + pulse(1.3, 60.0)
    return hover + np.stack([climb - roll - pitch - yaw, climb - roll + pitch + yaw,
                             climb + roll + pitch - yaw, climb + roll - pitch + yaw], axis=1)


def theirs(peer, commands, aero):
    """(steps, 10): position, velocity and quaternion (w first) after each step."""
    kind, parameters = peer
    state = {"x": np.zeros(3), "v": np.zeros(3), "q": np.array([0.0, 0, 0, 1]), "w": np.zeros(3),
             "wind": np.zeros(3), "rotor_speeds": np.full(4, commands[0].mean())}
    craft = kind(parameters, state, aero=aero, integrator_kwargs={"rtol": 1e-8, "atol": 1e-10})
    rows = []
    for command in commands:
        back = np.empty(4)
        back[ORDER] = command
        state = craft.step(state, {"cmd_motor_speeds": back}, STEP_S)
        rows.append(np.r_[state["x"], state["v"], state["q"][3], state["q"][:3]])
    return np.array(rows)


def ours(vehicle, commands, drag=None):
    """The same from our rigid body; drag: the effect that is on, or none."""
    plant, body = from_vehicle(vehicle), np.zeros(1, rigid_body.BODY)
    plant["step"] = STEP_S
    state, speed = body["state"][0], body["rotor_speed"][0]
    state[6], speed[:], body["gain"] = 1.0, commands[0].mean(), plant["gain"]
    s, rows = np.zeros((1, at.COUNT)), []
    s[:, at.HOVER_SPEED] = hover_speed(plant)
    for command in commands:
        body["target_speed"] = command
        if drag is not None:
            s[0, at.ROTOR_SPEED:at.ROTOR_SPEED + 4] = speed
            s[0, at.VELOCITY:at.VELOCITY + 3] = rotate_back(state[6:10], *state[3:6])
            body["wrench"] = replay.wrench_of(drag, s)[0]
        rigid_body.step(plant[0], body[0])
        rows.append(state[:10].copy())
    return np.array(rows)


def path_length(rows):
    return np.linalg.norm(np.diff(rows[:, :3], axis=0), axis=1).sum()


def thrust_axis(rows):
    w, x, y, z = rows[:, 6:10].T
    return np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=1)


@pytest.mark.parametrize("drag", [False, True])
def test_trajectories_agree_within_one_percent(peer, same_vehicle, drag):
    # k_z at the hubs also damps roll and pitch, which `rotor_drag` leaves out: drag in the plane is compared
    kind, parameters = peer[0], {**peer[1], "k_z": 0.0}
    hover = hover_speed(from_vehicle(same_vehicle))
    horizontal = 4.0 * parameters["k_d"] * hover
    active = effects.activate({"rotor_drag": {"horizontal": horizontal}})[0] if drag else None
    pwm = commands(hover)
    them, us = theirs((kind, parameters), pwm, drag), ours(same_vehicle, pwm, active)
    deviation = np.linalg.norm(them[:, :3] - us[:, :3], axis=1).max() / path_length(them)
    tilt = np.arccos(np.clip((thrust_axis(them) * thrust_axis(us)).sum(axis=1), -1, 1)).max()
    largest = np.arccos(thrust_axis(them)[:, 2]).max()
    assert path_length(them) > 2.0 and largest > np.deg2rad(20)
    assert deviation < 0.01
    if not drag:  # with it, RotorPy's hubs damp the yaw as well
        assert deviation < 1e-6 and tilt < 1e-4 * largest
