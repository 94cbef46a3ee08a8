"""Simulated edges over recorded free air: the response is the platform's alone, the background is the recorded one."""

import numpy as np
import pytest

from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import COLUMNS
from airtouch.simulation import scenario
from airtouch.twin import overlay
from airtouch.twin.recorded import missions
from airtouch.twin.recorded.course import course
from twin_courses import PLAIN, made_course


@pytest.fixture(scope="module")
def scene():
    """A scenario with the course at 5 cm."""
    return missions.scenario_of(made_course(1, 0.05), PLAIN)


@pytest.fixture(scope="module")
def responses(scene, vehicle):
    return overlay.simulate_responses(scene, vehicle, 3, seed=4)


def test_a_response_is_nothing_before_the_platform_and_something_over_it(responses):
    """With the same random numbers two flights are the same to the bit until the rotors are near the platform."""
    for response in responses:
        entry, leave = (e.sample for e in response.edges)
        assert [e.kind for e in response.edges] == ["entry", "exit"]
        np.testing.assert_array_equal(response.values[:5], 0.0)
        lift = response.values[entry - 10:entry + 30, 2]
        assert 0.1 < np.abs(lift).max() < 5.0  # m/s^2
        assert np.abs(response.values[leave + 100:, 2]).max() < np.abs(lift).max()
        np.testing.assert_array_equal(response.values[-1], 0.0)


def test_same_seed_same_responses_and_another_seed_others(scene, vehicle, responses):
    repeat, others = (overlay.simulate_responses(scene, vehicle, 1, seed=seed) for seed in (4, 5))
    np.testing.assert_array_equal(repeat[0].values, responses[0].values)
    assert others[0].values.shape != responses[0].values.shape or np.any(others[0].values != responses[0].values)


def test_a_stopped_simulation_continues_with_what_it_stored(scene, vehicle, responses, tmp_path, monkeypatch):
    """Also a flight without a response is not flown again."""
    flown, fly = [], overlay._response

    def response(scene, vehicle, seed, number):
        flown.append(number)
        return fly(scene, vehicle, seed, number - 1) if number else None

    def stop(done, _):
        if len(flown) == 3:
            raise KeyboardInterrupt

    monkeypatch.setattr(overlay, "_response", response)
    with pytest.raises(KeyboardInterrupt):
        overlay.simulate_responses(scene, vehicle, 3, 4, stop, tmp_path / "edges")
    again = overlay.simulate_responses(scene, vehicle, 3, seed=4, folder=tmp_path / "edges")
    assert flown == [0, 1, 2, 3]
    for one, other in zip(again, responses, strict=True):
        np.testing.assert_array_equal(one.values, other.values)
        assert one.edges == other.edges


def test_free_air_holds_no_edge(sweeps):
    """Of flights whose platform is known: everything but the platform, and all of it recorded."""
    air = overlay.free_air([log for _, log, _ in sweeps])
    assert len(air) == len(sweeps)
    for (_, log, _), part in zip(sweeps, air, strict=True):
        sweep = course(log)
        assert len(part.start) + len(part.end) < len(log) - (sweep.exit - sweep.entry)
        np.testing.assert_array_equal(part.start[-1, 6:], log.stack(overlay.PWM)[sweep.entry - 61])
        assert part.step + part.approach == sweep.entry - max(sweep.start - 100, 0)
        values = overlay.values_of(log)[:sweep.entry - 60]
        for level in part.level:  # level flight before the platform, and the velocity step is in none of it
            at = next(i for i in range(len(values)) if np.array_equal(values[i], level[0]))
            np.testing.assert_array_equal(values[at:at + len(level)], level)
            assert sweep.level < at and not at < sweep.step < at + len(level)


def test_laid_edges_are_where_the_labels_say(sweeps, responses):
    """Without responses the flight is recorded free air; with them it differs from 0.4 s before the entry on only."""
    air = overlay.free_air([log for _, log, _ in sweeps])
    silent = [overlay.Response(np.zeros_like(r.values), r.edges) for r in responses]
    with_edges, edges = overlay.flights(air, responses, seed=2)
    silent_logs, same = overlay.flights(air, silent, seed=2)
    assert edges == same and len(edges) >= 2
    made_of = [(log, silent_log, e) for log, silent_log, e in zip(with_edges, silent_logs, edges, strict=True) if e]
    for (log, silent_log, (entry, leave)), response in zip(made_of, responses, strict=True):
        assert leave.sample - entry.sample == response.edges[1].sample - response.edges[0].sample
        assert leave.sample < len(log)
        differing = np.flatnonzero((log.stack(overlay.ACC_WORLD) != silent_log.stack(overlay.ACC_WORLD)).any(axis=1))
        first = entry.sample - response.edges[0].sample
        assert first <= differing[0] <= entry.sample and differing[-1] < first + len(response.values)
        # where two stretches meet it goes on: in level flight nothing jumps
        mean = silent_log.stack(overlay.PWM).mean(axis=1)[entry.sample - 40:leave.sample]
        assert np.abs(np.diff(mean)).max() < 12000.0


def test_an_edge_comes_as_long_after_the_velocity_step_as_in_a_recorded_flight(sweeps, responses):
    """Once anywhere in a hover: a detector took what the step does for an edge, and edges after it for the step."""
    air = overlay.free_air([log for _, log, _ in sweeps])[:1]
    _, edges = overlay.flights(air, responses * 5, seed=3)
    waits = [e[0].sample - air[0].step for e in edges if e]
    assert len(waits) > 10 and np.std(waits) > 0.0
    assert all(0.85 * air[0].approach - 1 <= w <= 1.15 * air[0].approach + 1 for w in waits)


def test_a_third_of_the_flights_has_no_platform(sweeps, responses):
    """They are the same free air: nothing of a response is in them."""
    air = overlay.free_air([log for _, log, _ in sweeps])
    strong = [overlay.Response(r.values + 1e3, r.edges) for r in responses] * 4
    logs, edges = overlay.flights(air, strong, seed=5)
    shaken = [float(np.abs(log.stack(overlay.ACC_WORLD)).max()) > 500.0 for log in logs]
    assert shaken == [bool(e) for e in edges]
    assert edges.count([]) == pytest.approx(len(edges) / 3.0, abs=1.0)


def test_flights_without_down_range_have_no_free_air(sweeps):
    log = sweeps[0][1]
    no_down_range = type(log)({k: v for k, v in log.columns.items() if k != "zrange_m"}, log.meta)
    assert overlay.free_air([no_down_range]) == []


def test_a_scenario_without_platform_is_named(vehicle):
    table = dict(missions.scenario_of(made_course(1, 0.05), PLAIN).table)
    table.pop("platform")
    with pytest.raises(AirTouchError, match="only 0 of 3 flights"):
        overlay.simulate_responses(scenario.Scenario("bare", "", table), vehicle, 1)


def test_logs_of_overlay_flights_train(sweeps, responses):
    """They have what the detector needs and no down range of their own."""
    from airtouch.detector.best.batches import channels_of
    (log, *_), _ = overlay.flights(overlay.free_air([sweeps[0][1]]), responses[:1], seed=1)
    assert not log.has("zrange_m") and set(log.columns) <= set(COLUMNS) and np.isfinite(log["t_s"]).all()
    x, airborne = channels_of(log)
    assert x.shape == (len(log), 12) and airborne.mean() > 0.5
