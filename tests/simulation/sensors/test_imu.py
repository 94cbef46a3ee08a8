"""The accelerometer beside the centre of mass against the motion of that point, differentiated."""

import numpy as np
from scipy.spatial.transform import Rotation

from airtouch.simulation import state as states
from airtouch.simulation.body import rigid_body
from airtouch.simulation.plant import from_vehicle, hover_speed
from airtouch.simulation.random_generator import generator
from airtouch.simulation.sensors import imu

STEP_S = 1e-4


def test_specific_force_is_the_second_derivative_of_the_sensors_place_plus_gravity(ideal):
    """A vehicle that spins freely, its centre of mass 8 mm off: the sensor in the middle feels the spin."""
    plants = from_vehicle(ideal)
    plants["com"], plants["inertia"], plants["step"] = (0.006, -0.004, 0.003), (1.4e-5, 1.9e-5, 2.8e-5), STEP_S
    plant, record = plants[0], states.empty()[0]
    speed = hover_speed(plants)
    body = record["body"]
    body["state"][6], body["state"][10:] = 1.0, (3.0, 8.0, 2.0)
    body["rotor_speed"], body["target_speed"], body["gain"] = speed, speed, plant["gain"]
    at_sensor = -plant["com"]
    places, forces = [], []
    for _ in range(201):
        q = body["state"][6:10]
        turn = Rotation.from_quat([*q[1:], q[0]])
        places.append(body["state"][:3] + turn.apply(at_sensor))
        rigid_body.derivative(plant, body)
        imu.sense(plant, record, speed, generator(1, 0, "imu"))
        forces.append(turn.apply(record["imu"]["motion"][:3]))
        rigid_body.step(plant, body)
    places, forces = np.array(places), np.array(forces)
    acceleration = np.diff(places, 2, axis=0) / STEP_S**2
    np.testing.assert_allclose(forces[1:-1], acceleration + [0.0, 0.0, plant["gravity"]], atol=2e-3)
    lever = forces - np.array(forces).mean(axis=0)
    assert np.abs(lever).max() > 0.1  # the spin is felt


def test_a_sensor_at_rest_reads_gravity_bias_and_its_noise(vehicle):
    plants = from_vehicle(vehicle)
    plants["acc_bias"], plants["gyro_bias"] = (0.1, -0.2, 0.3), (0.01, 0.02, -0.03)
    plant, record = plants[0], states.empty()[0]
    speed, numbers = hover_speed(plants), generator(2, 0, "imu")
    record["body"]["state"][6] = 1.0
    record["body"]["wrench"][2] = plant["mass"] * plant["gravity"]  # the floor's
    imu.begin(plant, record)
    rows = []
    for step in range(20_000):
        record["step"] = step
        imu.sense(plant, record, speed, numbers)
        rows.append([*record["imu"]["acc"], *record["imu"]["gyro"]])
    rows = np.array(rows)
    still = np.r_[plant["acc_bias"] + [0.0, 0.0, plant["gravity"]], plant["gyro_bias"]]
    noise = np.r_[plant["acc_noise"], plant["gyro_noise"]]
    assert (np.abs(rows.mean(axis=0) - still) < 0.1 * noise).all()
    np.testing.assert_allclose(rows.std(axis=0), noise, rtol=0.06)
