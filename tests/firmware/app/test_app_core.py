"""The STM32 app's core with and without a GAP8: same edges, any fault survived, and the log says so."""

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from airtouch.detector import paper
from airtouch.detector.paper import rolling
from airtouch.detector.paper.features import pipeline
from airtouch.kernels.app_core import DETECTORS, HEALTH, LINK, AppCore, Gap8Core
from airtouch.kernels.library import lib
from firmware.drone import Drone


def test_best_on_the_stm32_is_the_detector_that_is_scored(flight, best_edges):
    assert best_edges, "the flight must have edges"
    drone = Drone("best")
    assert drone.fly(flight) == best_edges
    assert drone.app.log.edges == len(best_edges) and drone.health == set()


def test_best_on_the_gap8_gives_the_same_edges_a_sample_later(flight, best_edges):
    drone = Drone("best-gap8")
    assert drone.fly(flight) == [(i + 1, kind) for i, kind in best_edges]
    assert LINK[drone.app.log.link] == "up" and drone.app.log.lost == 0


def test_nothing_goes_to_the_gap8_unless_a_detector_asks_for_it(flight, best_edges):
    _, acc, gyro, pwm = flight
    app, gap8, edges = AppCore(have_gap8=True), Gap8Core(), []
    for i in range(len(acc)):
        kind = app.step(acc[i], gyro[i], pwm[i])
        edges += [(i, kind)] if kind != "none" else []
        assert list(app.packets()) == []
        if i % 50 == 0:
            assert gap8.heartbeat(10 * i) == b""
    assert DETECTORS[int(app.params()["detector"])] == "best" and edges == best_edges and app.log.health == 0
    app.set_params(detector=DETECTORS.index("best-gap8"))
    app.step(acc[0], gyro[0], pwm[0])
    assert len(list(app.packets())) == 1


def test_a_third_of_the_packets_lost_delays_edges_and_changes_none(flight, best_edges):
    drone = Drone("best-gap8", loss=0.3, seed=1)
    edges = drone.fly(flight)
    assert [kind for _, kind in edges] == [kind for _, kind in best_edges]
    assert all(0 <= late - at <= 30 for (late, _), (at, _) in zip(edges, best_edges, strict=True))
    assert drone.app.log.lost == 0


@pytest.mark.parametrize("module", [paper, rolling], ids=["paper", "paper-stream"])
def test_a_network_of_features_over_the_link_is_its_pipeline(flight, module):
    log, *_ = flight
    drone = Drone("paper-gap8" if module is paper else "paper-stream-gap8")
    _, acc, gyro, pwm = flight
    probability = np.full(len(acc), np.nan)
    edges = []
    for i in range(len(acc)):
        kind = drone.step(acc[i], gyro[i], pwm[i])
        probability[i] = drone.app.log.probability
        edges += [(i, kind)] if kind != "none" else []
    expected = module.run(log).probability
    answered = np.flatnonzero(np.isfinite(probability))
    assert len(answered) > 100
    np.testing.assert_allclose(probability[answered], expected[answered - 1], rtol=1e-6)  # known one sample later
    settings, physical = paper.decoding_settings(module.load(None))
    later = pipeline(log, settings, np.append(np.nan, expected[:-1]), physical_filter=physical)
    assert edges == [(int(i), ("entry", "exit")[k - 1]) for i, k in enumerate(later.edge) if k]


def test_cfar_alone_reports_its_alerts(flight):
    drone = Drone("cfar")
    edges = drone.fly(flight)
    alerts = np.flatnonzero(np.diff(np.append(False, pipeline(flight[0]).alert).astype(int)) > 0)
    assert edges and all(kind == "edge" for _, kind in edges)
    assert {i for i, _ in edges} <= set(alerts.tolist()) and min(np.diff([i for i, _ in edges]), default=99) >= 25


def test_without_an_ai_deck_the_same_detector_runs_on_the_stm32(flight, best_edges):
    drone = Drone("best-gap8", have_gap8=False)
    assert drone.fly(flight) == best_edges
    assert drone.sent == 0 and drone.health == {"no GAP8"} and DETECTORS[drone.app.log.detector] == "best"
    for detector in ("paper-gap8", "paper-stream-gap8"):
        drone = Drone(detector, have_gap8=False)
        drone.fly(flight, stop=1)
        assert DETECTORS[drone.app.log.detector] == "cfar"


@pytest.mark.parametrize("horizontal", [0.0, 0.25], ids=["none", "frozen"])
def test_an_estimator_without_horizontal_acceleration_is_said_after_a_second_of_flight(flight, horizontal):
    _, acc, gyro, pwm = flight
    acc = acc.copy()
    acc[:, :2] = horizontal  # the complementary estimator never sets it
    flies = pwm.mean(axis=1) > 15_000
    took_off = int(np.argmax(flies))
    assert flies[took_off:took_off + 400].all()
    for in_body in (False, True):
        app = AppCore({"detector": 1})
        flagged = []
        for i in range(took_off + 400):
            app.step(acc[i], gyro[i], pwm[i], acc_in_body=in_body)
            flagged.append(bool(app.log.health & HEALTH["no horizontal"]))
        assert flagged == [not in_body and i >= took_off + 99 for i in range(took_off + 400)]
    app = AppCore({"detector": 1})
    for i in range(took_off, took_off + 200):
        app.step(acc[i], gyro[i], pwm[i])
    assert app.log.health == HEALTH["no horizontal"]
    app.step(flight[1][i], gyro[i], pwm[i])
    assert app.log.health == 0
    for _ in range(200):
        app.step(acc[0], gyro[0], (0.0,) * 4)  # on the ground nothing moves
    assert app.log.health == 0


def test_a_flight_is_healthy_at_every_step(flight):
    _, acc, gyro, pwm = flight
    app = AppCore()
    for i in range(len(acc)):
        app.step(acc[i], gyro[i], pwm[i])
        assert app.log.health == 0


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e38])
def test_values_that_are_not_finite_do_not_stay(flight, value):
    _, acc, gyro, pwm = flight
    drone, clean = Drone("best"), Drone("best")
    for i in range(1200):
        if i in (300, 301, 420):
            drone.step((value,) * 3, (value,) * 3, (value,) * 4)
            assert np.isfinite(value) or "non-finite" in drone.health
        else:
            drone.step(acc[i], gyro[i], pwm[i])
        clean.step(acc[i], gyro[i], pwm[i])
    log = drone.app.log
    assert np.all(np.isfinite([*log.feature, *log.force, log.threshold, log.probability, *log.logit]))
    assert log.nonFinite == (30 if not np.isfinite(value) else 0)
    assert drone.health == set()
    if not np.isfinite(value):
        assert list(log.logit) == list(clean.app.log.logit) or abs(log.probability - clean.app.log.probability) < 0.05


def test_world_and_body_axes_come_out_level_with_the_nose_ahead():
    rng = np.random.default_rng(0)
    yaw = rng.uniform(-3, 3, 300)
    turns = Rotation.from_euler("ZYX", np.column_stack([yaw, rng.normal(0, 0.2, (300, 2))]))
    body = rng.normal(0, 1, (300, 3)) + [0, 0, 9.81]
    world = turns.apply(body)
    back = Rotation.from_rotvec(np.column_stack([np.zeros((300, 2)), -yaw]))
    level = back.apply(world)
    of_level, of_world, of_body = (AppCore({"detector": 1}) for _ in range(3))
    for i in range(300):
        other_inputs = {"gyro": (0.1, 0.2, 0.3), "pwm": (40000.0,) * 4}
        of_level.step(level[i], **other_inputs)
        of_world.step(world[i], **other_inputs, attitude=turns[i].as_quat())
        of_body.step(body[i], **other_inputs, attitude=turns[i].as_quat(), acc_in_body=True)
    for core in (of_world, of_body):
        np.testing.assert_allclose(list(core.log.feature)[0], of_level.log.feature[0], rtol=1e-3)
        np.testing.assert_allclose(list(core.log.logit), list(of_level.log.logit), atol=0.8)
    axis = (back * turns)[-1].apply([0, 0, 1])  # f_w = m a - Psi R e_z
    force = np.array(list(of_world.log.force))
    np.testing.assert_allclose(np.cross(0.0362 * level[-1] - force, axis), 0, atol=1e-5)


def test_recorded_flights_give_the_same_edges_on_both_processors(recorded):
    for flight, edges in recorded:
        assert Drone("best").fly(flight) == edges
        assert Drone("best-gap8").fly(flight) == [(i + 1, kind) for i, kind in edges]


def test_the_core_is_as_large_as_its_header_says():
    header = (Path(__file__).parents[3] / "firmware/app/core/app_core.h").read_text()
    assert round(lib.appHostBytes() / 1000) == int(re.search(r"About (\d+) kB\.", header)[1])


def test_a_try_that_the_transport_does_not_take_is_none(flight):
    _, acc, gyro, pwm = flight
    drone = Drone("best-gap8")
    drone.app.step(acc[0], gyro[0], pwm[0])
    assert list(drone.app.packets(accepted=False)) == []
    drone.app.step(acc[0], gyro[0], pwm[0])
    assert len(list(drone.app.packets())) == 1  # the reset goes out with the next step
    drone = Drone("best-gap8")
    drone.fly(flight, stop=400)
    for i in range(400, 460):
        drone.app.step(acc[i], gyro[i], pwm[i])
        assert list(drone.app.packets(accepted=False)) == []
    assert drone.app.log.timeouts == 0 and drone.app.log.dropped > 0
    drone.fly(flight, stop=30)
    assert LINK[drone.app.log.link] == "up" and drone.app.log.lost == 0


@pytest.mark.parametrize("now, last, stalled", [
    (1000, 1000, 0), (1050, 1000, 0), (1051, 1000, 1), (90_000, 1000, 1),
    (1000, 1001, 0), (1000, 1060, 0),  # the step ended after the clock was read
    (20, 2**32 - 30, 0), (21, 2**32 - 30, 1), (2**32 - 1, 3, 0),  # ticks wrap
    (40, 0, 0), (60, 0, 1)])  # no step yet
def test_an_old_tick_is_no_stalled_app(now, last, stalled):
    assert lib.appHostStalled(now, last, 50) == stalled


@pytest.mark.parametrize("detector", ["best", "best-gap8", "paper-gap8", "paper-stream-gap8"])
def test_a_drone_that_landed_on_a_platform_is_over_none_on_the_ground_and_in_the_next_flight(recorded, detector):
    _, acc, gyro, pwm = recorded[0][0]
    drone, over, i = Drone(detector), [], 0
    while not drone.app.log.over:  # the first flight ends behind its first entry
        drone.step(acc[i], gyro[i], pwm[i])
        i += 1
    for _ in range(100):
        drone.step((0.0, 0.0, 9.81), (0.0,) * 3, (0.0,) * 4)
        over.append(drone.app.log.over)
    assert 1 not in over[20:]
    for k in range(i - 100):  # the same flight again, to before its first entry
        drone.step(acc[k], gyro[k], pwm[k])
        assert drone.app.log.over == 0
    assert drone.app.log.edge == 1 and drone.app.log.edges == 1


def test_load_and_late_steps_are_logged():
    app = AppCore({"detector": 1})
    at_rest = (0.0, 0.0, 9.81), (0.0, 0.0, 0.0), (0.0,) * 4
    for microseconds, late in ((120, False), (70_000, True), (90, False)):
        app.step(*at_rest)
        app.time(microseconds, late)
    app.step(*at_rest)
    assert (app.log.load, app.log.loadMax, app.log.late) == (90, 65_535, 1)
    assert app.log.health == HEALTH["late"]
    for _ in range(100):
        app.step(*at_rest)
    assert app.log.health == 0
