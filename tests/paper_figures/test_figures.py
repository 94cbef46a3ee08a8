"""Parts of the figures against closed forms, published values and flights whose answer is known."""

import numpy as np
import pytest

from airtouch.logs.flight_log import FlightLog
from airtouch.paper_figures import sensing_range, simulated, table1, words
from airtouch.paper_figures.claims import REPRODUCED, UNTESTABLE
from airtouch.paper_figures.figure import Job


def test_curves_are_the_published_ones():
    """At 4, 6, 8 and 12 cm for a Crazyflie (radius 23.1 to 23.5 mm): lift in % as tabulated from the publications."""
    heights = np.array([0.04, 0.06, 0.08, 0.12])
    assert 100 * sensing_range.cheeseman_bennett(heights, 0.0235) == pytest.approx([2.2, 1.0, 0.5, 0.2], abs=0.06)
    assert 100 * sensing_range.sanchez_cuevas(heights, 0.0235, 0.065) == pytest.approx([11.6, 7.5, 5.0, 2.5], rel=0.1)


def test_the_measured_curve_is_what_neural_swarm_flew():
    """34 g: 9.0, 5.2, 2.0 and -0.1 % at 2, 4, 6 and 9 cm above standing, the rotors 29 mm higher."""
    heights = np.array([0.02, 0.04, 0.06, 0.09]) + 0.029
    assert 100 * sensing_range.measured(heights, "crazyflie-34g") == pytest.approx([9.0, 5.2, 2.0, -0.1], abs=0.8)


def test_reach_inverts_a_curve():
    """1 / (1 - (R / 4 h)^2) - 1 = t at h = R / (4 sqrt(t / (1 + t)))."""
    found = sensing_range.reach(lambda h: sensing_range.cheeseman_bennett(h, 0.1), 0.01)
    assert found == pytest.approx(0.1 / (4 * np.sqrt(0.01 / 1.01)), rel=0.02)
    assert sensing_range.reach(lambda h: 0 * h, 0.01) == 0.0


def test_white_noise_is_averaged_over_so_many_seconds():
    """The mean of n samples has sigma / sqrt(n): lift = 3 sigma / sqrt(n)."""
    seconds = sensing_range.averaging_s(0.001)
    assert 3 * sensing_range.NOISE / np.sqrt(100 * seconds) == pytest.approx(0.001)


def row(error, low, missed):
    return {"mean_abs_error_m": error, "missed": missed, "intervals": {"mean_abs_error_m": low and (low, 9.0)}}


def test_an_error_is_reached_within_its_interval_and_with_few_misses_alone():
    assert words.reaches(row(0.04, 0.029, 0.05), 0.03)
    assert not words.reaches(row(0.04, 0.031, 0.05), 0.03)
    assert not words.reaches(row(0.01, 0.005, 0.66), 0.03)
    assert not words.reaches(row(None, None, 1.0), 0.03)
    assert words.reaches(row(0.02, None, 0.0), 0.03)


def test_a_log_of_a_meter_is_judged_by_its_total(tmp_path):
    path = tmp_path / "run.csv"
    levels = {"baseline": 78.0, "FC-FE": 80.0, "CCS-FF": 81.0, "filter": 82.0, "network": 90.0}
    lines, t = ["time_ms,bus_V,current_mA,stage"], 0.0
    for stage, mw in levels.items():
        for _ in range(400):
            lines.append(f"{t:.1f},3.8,{mw / 3.8:.4f},{stage}")
            t += 10.0
    path.write_text("\n".join(lines) + "\n")
    made = table1.power(Job(None, tmp_path, power_log=path))
    assert [r["mw"] for r in made.rows] == pytest.approx([78.0, 2.0, 1.0, 1.0, 8.0], abs=0.05)
    assert made.verdicts["power"].verdict == REPRODUCED and "90.0 mW" in made.verdicts["power"].found
    assert table1.power(Job(None, tmp_path)).verdicts["power"].verdict == UNTESTABLE


def test_a_crossing_by_place_is_where_the_drone_passes_the_outline():
    corners = np.array([[1.0, -1.0], [2.0, -1.0], [2.0, 1.0], [1.0, 1.0]])
    x = np.linspace(0.0, 3.0, 301)
    inside = simulated.inside(corners, x, np.zeros(301))
    assert x[inside].min() == pytest.approx(1.0) and x[inside].max() == pytest.approx(2.0)
    assert not simulated.inside(corners, x, np.full(301, 1.5)).any()


def test_labels_by_place_are_a_step_of_the_down_range_and_nothing_else():
    from airtouch.logs.edges import Edge, true_edges

    n = 900
    log = FlightLog({"t_s": 0.01 * np.arange(n), "zrange_m": np.full(n, 0.04), **{f"m{i}_pwm": np.full(n, 4e4)
                                                                             for i in range(1, 5)}},
                    {"source": "made", "sample_period_s": 0.01})
    told = simulated.labelled(log, lambda _: [Edge(300, "entry", 0, 0), Edge(500, "exit", 0, 0)])
    assert [(e.sample, e.kind) for e in true_edges(told)] == [(300, "entry"), (500, "exit")]
    assert all(np.array_equal(told[c], log[c]) for c in log.columns if c != "zrange_m")
