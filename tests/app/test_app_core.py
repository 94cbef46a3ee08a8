"""The STM32 app's core with and without a GAP8: same edges, any fault survived, and the log says so."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from airtouch.detector import best, paper
from airtouch.detector.channels import level_acceleration
from airtouch.detector.features import pipeline
from airtouch.errors import AirTouchError
from airtouch.kernels.app_core import DETECTORS, HEALTH, LINK, PARAM_TYPES, PARAMS, AppCore, Gap8Core
from airtouch.kernels.library import call, ffi
from airtouch.logs import read
from airtouch.logs.flight_log import GYRO, PWM
from airtouch import vehicle as vehicles
from airtouch.simulation import scenario
from airtouch.simulation.flight import fly


@pytest.fixture(scope="module")
def flight():
    """Level acceleration, rates and PWM of one simulated flight over platforms, all that the cores are given here."""
    log = fly(scenario.load("paper-4cm"), vehicles.load(), seed=3)
    log = replace(log, columns={k: v for k, v in log.columns.items() if k not in ("roll_rad", "pitch_rad", "vbat_V")})
    return log, level_acceleration(log), log.stack(GYRO), log.stack(PWM)


@pytest.fixture(scope="module")
def best_edges(flight):
    return [(d.sample, d.kind) for d in best.run(flight[0]).edges]


class Drone:
    """Both cores and what lies between them."""

    def __init__(self, detector, loss=0.0, seed=0, have_gap8=True, answers=True):
        self.app = AppCore({"detector": DETECTORS.index(detector)}, have_gap8=have_gap8)
        self.gap8 = Gap8Core()
        self.rng = np.random.default_rng(seed)
        self.loss, self.answers = loss, answers
        self.sent = 0

    def step(self, acc, gyro, pwm):
        edge = self.app.step(acc, gyro, pwm)
        for packet in self.app.packets():
            self.sent += 1
            if not self.answers or self.rng.random() < self.loss:
                continue
            reply = self.gap8.take(packet)
            if reply and self.rng.random() >= self.loss:
                self.app.receive(reply)
        return edge

    def fly(self, flight, stop=None):
        """Edges (sample, kind) of a flight."""
        _, acc, gyro, pwm = flight
        found = [(i, self.step(acc[i], gyro[i], pwm[i])) for i in range(len(acc))[:stop]]
        return [(i, kind) for i, kind in found if kind != "none"]

    @property
    def health(self):
        return {name for name, bit in HEALTH.items() if self.app.log.health & bit}


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
    app, gap8, found = AppCore(have_gap8=True), Gap8Core(), []
    for i in range(len(acc)):
        kind = app.step(acc[i], gyro[i], pwm[i])
        found += [(i, kind)] if kind != "none" else []
        assert list(app.packets()) == []
        if i % 50 == 0:
            app.receive(gap8.heartbeat(10 * i))
    assert DETECTORS[int(app.params()["detector"])] == "best" and found == best_edges and app.log.health == 0
    app.set_params(detector=DETECTORS.index("best-gap8"))
    app.step(acc[0], gyro[0], pwm[0])
    assert len(list(app.packets())) == 1


def test_a_third_of_the_packets_lost_delays_edges_and_changes_none(flight, best_edges):
    drone = Drone("best-gap8", loss=0.3, seed=1)
    found = drone.fly(flight)
    assert [kind for _, kind in found] == [kind for _, kind in best_edges]
    assert all(0 <= late - at <= 30 for (late, _), (at, _) in zip(found, best_edges))
    assert drone.app.log.lost == 0


def test_paper_over_the_link_is_the_paper_pipeline(flight):
    log, *_ = flight
    drone = Drone("paper-gap8")
    _, acc, gyro, pwm = flight
    probability = np.full(len(acc), np.nan)
    edges = []
    for i in range(len(acc)):
        kind = drone.step(acc[i], gyro[i], pwm[i])
        probability[i] = drone.app.log.probability
        edges += [(i, kind)] if kind != "none" else []
    expected = paper.run(log).probability
    known = np.flatnonzero(np.isfinite(probability))
    assert len(known) > 100
    np.testing.assert_allclose(probability[known], expected[known - 1], rtol=1e-6)  # known one sample later
    settings, physical = paper.decoding(paper.load(None))
    later = pipeline(log, settings, np.append(np.nan, expected[:-1]), physical_filter=physical)
    assert edges == [(int(i), ("entry", "exit")[k - 1]) for i, k in enumerate(later.edge) if k]


def test_cfar_alone_reports_its_alerts(flight):
    drone = Drone("cfar")
    edges = drone.fly(flight)
    alerts = np.flatnonzero(np.diff(np.append(False, pipeline(flight[0]).alert).astype(int)) > 0)
    assert edges and all(kind == "edge" for _, kind in edges)
    assert {i for i, _ in edges} <= set(alerts.tolist()) and min(np.diff([i for i, _ in edges]), default=99) >= 25


def test_a_gap8_that_never_answers_leaves_the_stm32_to_do_it(flight, best_edges):
    drone = Drone("best-gap8", answers=False)
    assert drone.fly(flight, stop=24) == [] and np.isnan(drone.app.log.probability)
    assert drone.health == {"link down"}
    drone = Drone("best-gap8", answers=False)
    assert drone.fly(flight) == best_edges
    assert drone.health == {"link down", "no GAP8"} and DETECTORS[drone.app.log.detector] == "best"
    assert drone.sent <= drone.app.log.samples / 10 + 1  # it asks ten times a second, no more


def test_paper_without_answers_knows_no_probability(flight):
    drone = Drone("paper-gap8", answers=False)
    assert drone.fly(flight) == [] and np.isnan(drone.app.log.probability) and drone.health == {"link down"}


def test_the_gap8_loses_power_and_the_link_for_five_seconds(flight):
    _, acc, gyro, pwm = flight
    drone, reference = Drone("best-gap8"), Drone("best")
    logits, link, said, lag = [], [], [], []
    for i in range(1700):
        drone.answers = not 800 <= i < 1300
        if i == 500:
            drone.gap8.reset()
        drone.step(acc[i], gyro[i], pwm[i])
        link.append(LINK[drone.app.log.link])
        said.append(list(drone.app.log.logit))
        lag.append(drone.app.log.lag)
        reference.step(acc[i], gyro[i], pwm[i])
        logits.append(list(reference.app.log.logit))
    assert drone.app.log.gap8Resets == 1
    back = [link.index("up", at) - at for at in (502, 1300)]
    assert max(back) <= 40, "a whole window of the past is sent again within 40 steps"
    assert link[852:1300] == ["down"] * 448, "the log says that the link is down"
    for first, last in ((300, 500), (600, 800), (1400, 1700)):
        assert said[first:last] == logits[first - 1:last - 1] and set(lag[first:last]) == {0}
    assert said[870:1300] == logits[870:1300], "the STM32 runs the network meanwhile"
    assert drone.health == set()


def test_without_an_ai_deck_the_same_detector_runs_on_the_stm32(flight, best_edges):
    drone = Drone("best-gap8", have_gap8=False)
    assert drone.fly(flight) == best_edges
    assert drone.sent == 0 and drone.health == {"no GAP8"} and DETECTORS[drone.app.log.detector] == "best"
    drone = Drone("paper-gap8", have_gap8=False)
    drone.fly(flight, stop=1)
    assert DETECTORS[drone.app.log.detector] == "cfar"


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


OUT_OF_RANGE = {"enable": (9, 1), "detector": (77, 3), "filter": (3, 2), "bandMid": (1e9, 48.0),
                "bandWidth": (50.0, 2.0), "pFa": (0.0, 1e-12), "probabilityIn": (7.0, 0.99),
                "probabilityOut": (0.95, 0.89), "scoreIn": (99.0, 12.0), "scoreOut": (-99.0, -8.0),
                "probabilityDwell": (0, 10), "alertHold": (60_000, 1000)}


@pytest.mark.parametrize("name", PARAMS)
def test_a_parameter_out_of_range_is_put_right_counted_and_logged(flight, name):
    _, acc, gyro, pwm = flight
    drone = Drone("best")
    asked, given = OUT_OF_RANGE[name]
    assert drone.app.set_params(**{name: asked}) == 1
    assert drone.app.params()[name] == pytest.approx(given, rel=1e-5)
    drone.step(acc[0], gyro[0], pwm[0])
    assert "parameter clamped" in drone.health and drone.app.log.paramErrors == 1
    if not isinstance(given, int):
        usual = AppCore().params()[name]
        assert drone.app.set_params(**{name: np.nan}) == 1
        assert drone.app.params()[name] == pytest.approx(usual)


def test_an_unknown_parameter_is_refused():
    with pytest.raises(AirTouchError, match="no such parameter; known: enable"):
        AppCore().set_params(bandwidth=3)


def test_another_band_is_another_power(flight):
    drone, other = Drone("best"), Drone("best")
    other.app.set_params(bandMid=3.0)
    drone.fly(flight, stop=400)
    other.fly(flight, stop=400)
    assert drone.app.log.feature[0] != other.app.log.feature[0]


CHANGES = {300: {"pFa": 1e-3}, 420: {"bandMid": 3.0}, 640: {"bandWidth": 1.0}, 700: {"pFa": 1e-9}, 701: {"bandMid": 20.0},
           1500: {"pFa": 1e-6, "bandMid": 7.0, "bandWidth": 2.0}}


def said(drone, flight, changes):
    """Edges, logits, thresholds and alerts of a flight with changes of parameters, step by step."""
    _, acc, gyro, pwm = flight
    rows, edges = [], []
    for i in range(len(acc)):
        if i in changes:
            assert drone.app.set_params(**changes[i]) == 0
        kind = drone.step(acc[i], gyro[i], pwm[i])
        edges += [(i, kind)] if kind != "none" else []
        log = drone.app.log
        rows.append([*log.logit, log.probability, log.answers, log.threshold, log.alert])
    return edges, np.array(rows)


@pytest.mark.parametrize("detector, gap8", [("best", {}), ("best", {"have_gap8": False}), ("best-gap8", {}),
                                            ("best-gap8", {"answers": False}), ("best-gap8", {"have_gap8": False})],
                         ids=["stm32", "stm32-no-deck", "gap8", "silent-gap8", "no-gap8"])
def test_band_and_false_alarms_change_nothing_of_best(flight, best_edges, detector, gap8):
    edges, rows = said(Drone(detector, **gap8), flight, CHANGES)
    usual, usual_rows = said(Drone(detector, **gap8), flight, {})
    assert edges == usual and [kind for _, kind in edges] == [kind for _, kind in best_edges]
    np.testing.assert_array_equal(rows[:, :5], usual_rows[:, :5])


def test_another_false_alarm_probability_is_in_force_at_once(flight):
    changed = said(Drone("cfar"), flight, {900: {"pFa": 1e-3}})[1]
    before, after = said(Drone("cfar"), flight, {})[1], said(Drone("cfar"), flight, {0: {"pFa": 1e-3}})[1]
    np.testing.assert_array_equal(changed[:900, 5:], before[:900, 5:])
    np.testing.assert_array_equal(changed[900:, 5:], after[900:, 5:])
    assert np.all(after[100:, 5] < before[100:, 5])


def test_another_band_leaves_the_threshold_alone(flight):
    changes = {at: change for at, change in CHANGES.items() if "pFa" not in change}
    np.testing.assert_array_equal(said(Drone("cfar"), flight, changes)[1][:, 5:], said(Drone("cfar"), flight, {})[1][:, 5:])


def test_another_band_begins_the_paper_pipeline_anew_and_false_alarms_do_not(flight):
    usual = said(Drone("paper-gap8"), flight, {})[1][:, 3]
    np.testing.assert_array_equal(said(Drone("paper-gap8"), flight, {900: {"pFa": 1e-3}})[1][:, 3], usual)
    changed = said(Drone("paper-gap8"), flight, {900: {"bandMid": 5.0}})[1][:, 3]
    later = tuple(x[900:] for x in flight[1:])
    fresh = said(Drone("paper-gap8"), (None, *later), {0: {"bandMid": 5.0}})[1][:, 3]
    np.testing.assert_array_equal(changed[:900], usual[:900])
    assert np.isnan(changed[900:900 + 299]).all() and np.isfinite(changed[900 + 310:]).all()
    known = np.isfinite(changed[900:]) & np.isfinite(fresh)
    assert known.sum() > 100
    np.testing.assert_allclose(changed[900:][known], fresh[known], atol=0.02)


def test_a_change_in_a_recorded_flight_with_a_silent_gap8_loses_no_edge(flights):
    path = sorted((flights / "airtouch").glob("imu_data_02*h79*"))[0]
    log = read(path)
    flight = log, level_acceleration(log), log.stack(GYRO), log.stack(PWM)
    edges = [(d.sample, d.kind) for d in best.run(log).edges]
    first = edges[0][0]
    changes = {first - 200: {"pFa": 1e-5}, first - 100: {"bandMid": 6.0}}
    assert len(edges) >= 2 and said(Drone("best-gap8", answers=False), flight, changes)[0] == edges


def test_switched_off_it_sends_and_finds_nothing_and_comes_back(flight):
    drone = Drone("best-gap8")
    drone.fly(flight, stop=500)
    drone.app.set_params(enable=0)
    sent = drone.sent
    assert drone.fly(flight) == [] and drone.sent == sent
    drone.app.set_params(enable=1)
    drone.fly(flight, stop=500)
    assert LINK[drone.app.log.link] == "up"


def test_a_full_queue_is_logged_and_loses_nothing(flight):
    _, acc, gyro, pwm = flight
    drone = Drone("best-gap8")
    drone.fly(flight, stop=400)
    for i in range(400, 420):
        drone.app.step(acc[i], gyro[i], pwm[i])
        assert list(drone.app.packets(taken=False)) == []
    assert drone.app.log.dropped >= 1 and "packet dropped" in drone.health
    for i in range(420, 460):
        drone.step(acc[i], gyro[i], pwm[i])
    assert drone.app.log.lost == 0 and drone.app.log.lag == 0


def test_world_and_body_axes_come_out_level_with_the_nose_ahead():
    rng = np.random.default_rng(0)
    yaw = rng.uniform(-3, 3, 300)
    turns = Rotation.from_euler("ZYX", np.column_stack([yaw, rng.normal(0, 0.2, (300, 2))]))
    body = rng.normal(0, 1, (300, 3)) + [0, 0, 9.81]
    world = turns.apply(body)
    back = Rotation.from_rotvec(np.column_stack([np.zeros((300, 2)), -yaw]))
    level = back.apply(world)
    plain, of_world, of_body = (AppCore({"detector": 1}) for _ in range(3))
    for i in range(300):
        rest = {"gyro": (0.1, 0.2, 0.3), "pwm": (40000.0,) * 4}
        plain.step(level[i], **rest)
        of_world.step(world[i], **rest, attitude=turns[i].as_quat())
        of_body.step(body[i], **rest, attitude=turns[i].as_quat(), acc_in_body=True)
    for core in (of_world, of_body):
        np.testing.assert_allclose(list(core.log.feature)[0], plain.log.feature[0], rtol=1e-3)
        np.testing.assert_allclose(list(core.log.logit), list(plain.log.logit), atol=0.8)
    axis = (back * turns)[-1].apply([0, 0, 1])  # f_w = m a - Psi R e_z
    force = np.array(list(of_world.log.force))
    np.testing.assert_allclose(np.cross(0.0362 * level[-1] - force, axis), 0, atol=1e-5)


def test_decoding_of_paper_is_that_of_the_shipped_model():
    settings, _ = paper.decoding(paper.load(None))
    core = AppCore().params()
    assert core["probabilityIn"] == pytest.approx(settings.probability_entry)
    assert core["probabilityOut"] == pytest.approx(settings.probability_exit)
    assert (core["probabilityDwell"], core["alertHold"]) == (settings.dwell_samples, settings.alert_hold)


def test_settings_are_compared_field_by_field_and_nothing_between_them_counts():
    size = ffi.sizeof("appParams_t")
    one, other = ffi.new("appParams_t *"), ffi.new("appParams_t *")
    ffi.memmove(one, b"\x00" * size, size)
    ffi.memmove(other, b"\xff" * size, size)  # what lies between the fields differs
    for name in PARAMS:
        setattr(one, name, 1)
        setattr(other, name, 1)
    assert call("appHostSame")(one, other)
    for name, kind in PARAM_TYPES.items():
        setattr(other, name, 2)
        assert not call("appHostSame")(one, other), name
        setattr(other, name, 1)
        if kind == "float":  # else what was put right is never written back, and counts again each step
            setattr(one, name, np.nan)
            setattr(other, name, np.nan)
            assert call("appHostSame")(one, other), name
            setattr(one, name, 1)
            assert not call("appHostSame")(one, other), name
            setattr(other, name, 1)


def test_recorded_flights_give_the_same_edges_on_both_processors(flights):
    for path in sorted((flights / "airtouch").glob("imu_data_02*h79*"))[:3]:
        log = read(path)
        flight = log, level_acceleration(log), log.stack(GYRO), log.stack(PWM)
        edges = [(d.sample, d.kind) for d in best.run(log).edges]
        assert Drone("best").fly(flight) == edges
        assert Drone("best-gap8").fly(flight) == [(i + 1, kind) for i, kind in edges]


@pytest.mark.parametrize("now, last, stalled", [
    (1000, 1000, 0), (1050, 1000, 0), (1051, 1000, 1), (90_000, 1000, 1),
    (1000, 1001, 0), (1000, 1060, 0),  # the step ended after the clock was read
    (20, 2**32 - 30, 0), (21, 2**32 - 30, 1), (2**32 - 1, 3, 0),  # ticks wrap
    (40, 0, 0), (60, 0, 1)])  # no step yet
def test_an_old_tick_is_no_stalled_app(now, last, stalled):
    assert call("appHostStalled")(now, last, 50) == stalled


def test_load_and_late_steps_are_logged():
    app = AppCore({"detector": 1})
    rest = (0.0, 0.0, 9.81), (0.0, 0.0, 0.0), (0.0,) * 4
    for microseconds, late in ((120, False), (70_000, True), (90, False)):
        app.step(*rest)
        app.time(microseconds, late)
    app.step(*rest)
    assert (app.log.load, app.log.loadMax, app.log.late) == (90, 65_535, 1)
    assert app.log.health == HEALTH["late"]
    for _ in range(100):
        app.step(*rest)
    assert app.log.health == 0
