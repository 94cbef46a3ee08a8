"""The heading of a flight changes nothing, on the desktop as on the drone: x is towards the nose in both."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from airtouch import vehicle as vehicles
from airtouch.detector import best, paper
from airtouch.detector.paper.features import pipeline
from airtouch.detector.shared.channels import level_acceleration, thrust_axis
from airtouch.logs.flight_log import ACC_WORLD, ATTITUDE, GYRO, PWM, FlightLog
from airtouch.simulation import scenario
from airtouch.simulation.flight import fly
from firmware.drone import Drone


@pytest.fixture(scope="module")
def ahead():
    """A simulated flight that heads along x, with its attitude."""
    return fly(scenario.load("paper-4cm"), vehicles.load(), seed=3)


def turned(log, heading_deg):
    """The same flight in a world that is turned under it."""
    heading = np.deg2rad(heading_deg)
    acc = Rotation.from_euler("Z", heading).apply(log.stack(ACC_WORLD))
    columns = dict(zip(ACC_WORLD, acc.T, strict=True)) | {"yaw_rad": log["yaw_rad"] + heading}
    return replace(log, columns={**log.columns, **columns})


def on_the_drone(detector, log):
    """Edges (sample, kind), and the P(over) of each sample, of the app's core: world axes and attitude go in."""
    drone, acc, edges, probability = Drone(detector), log.stack(ACC_WORLD), [], []
    attitude = Rotation.from_euler("ZYX", log.stack(ATTITUDE)[:, ::-1]).as_quat()
    volts, gyro, pwm = log["vbat_V"], log.stack(GYRO), log.stack(PWM)
    for i in range(len(log)):
        kind = drone.step(acc[i], gyro[i], pwm[i], vbat_v=volts[i], attitude=attitude[i])
        edges += [(i, kind)] if kind != "none" else []
        probability.append(drone.app.log.probability)
    return edges, np.array(probability)


@pytest.mark.parametrize("heading_deg", [0, 90, 180])
def test_best_finds_the_edges_that_the_drone_finds_at_any_heading(ahead, heading_deg):
    log = turned(ahead, heading_deg)
    edges = [(d.sample, d.kind) for d in best.run(log).edges]
    assert edges and edges == on_the_drone("best", log)[0]
    assert edges == [(d.sample, d.kind) for d in best.run(ahead).edges]


@pytest.mark.parametrize("heading_deg", [0, 90, 180])
def test_paper_sees_what_the_drone_sees_at_any_heading(ahead, heading_deg):
    log = turned(ahead, heading_deg)
    known = on_the_drone("paper-gap8", log)[1]
    expected = paper.run(log).probability
    answered = np.flatnonzero(np.isfinite(known))
    assert len(answered) > 100
    off = np.abs(known[answered] - expected[answered - 1])  # known one sample later; int8 inputs may round apart
    assert np.quantile(off, 0.99) < 0.02 and off.max() < 0.2
    force = pipeline(log).force
    np.testing.assert_allclose(force, pipeline(ahead).force, atol=1e-5)


def test_acceleration_and_thrust_are_in_the_same_axes():
    """Of body axes turned by SciPy, without the yaw."""
    rng = np.random.default_rng(1)
    angles = np.column_stack([rng.normal(0, 0.3, (50, 2)), rng.uniform(-3, 3, 50)])
    attitude, level = (Rotation.from_euler("ZYX", a[:, ::-1]) for a in (angles, angles * (1, 1, 0)))
    body = rng.normal(0, 1, (50, 3))
    columns = {"t_s": np.arange(50) * 0.01} | dict(zip(ATTITUDE, angles.T, strict=True)) | dict(
        zip(ACC_WORLD, attitude.apply(body).T, strict=True))
    log = made_log(columns)
    np.testing.assert_allclose(level_acceleration(log), level.apply(body), atol=1e-12)
    np.testing.assert_allclose(thrust_axis(log), level.apply([0, 0, 1]), atol=1e-12)
    columns["yaw_rad"] = np.where(np.arange(50) == 20, np.nan, 0.7)
    held = level_acceleration(made_log({**columns, "yaw_rad": np.full(50, 0.7)}))
    np.testing.assert_array_equal(level_acceleration(made_log(columns)), held)
    del columns["yaw_rad"]
    np.testing.assert_array_equal(level_acceleration(made_log(columns)), attitude.apply(body))


def made_log(columns):
    return FlightLog(columns, {"source": "made", "sample_period_s": 0.01})
