"""The figures of `bench_simulation.py`, from synthetic rounds."""

import pytest

from airtouch.errors import AirTouchError
from tools import bench_simulation


def rounds(*rates):
    """Rounds with these simulated seconds a wall second, half as many a CPU second."""
    return [{"first_flight_s": 10.0 + i, "simulated_s_per_wall_s": rate, "simulated_s_per_cpu_s": rate / 2}
            for i, rate in enumerate(rates)]


def test_rates_and_ratios_are_medians_and_a_ratio_is_of_one_round():
    """The medians of 100, 300, 200 and of 10, 60, 10 have a ratio of 20, the rounds' ratios, 10, 5, 20, one of 10."""
    crazyflow = [{"euler": [10.0, 25.0]}, {"euler": [60.0, 150.0]}, {"euler": [10.0, 10.0]}]
    figures = bench_simulation.figures_of(rounds(100, 300, 200), rounds(1000, 600, 1200), [50.0, 10.0, 10.0], crazyflow)
    assert figures["first_flight_s"] == 10.0 and figures["simulated_s_per_wall_s"] == 200
    assert figures["no_effects_s_per_cpu_s"] == 500
    assert figures["crazyflow_euler_s_per_cpu_s"] == 25.0 and figures["times_crazyflow_euler_wall_s"] == 10.0
    assert figures["no_effects_times_crazyflow_euler_wall_s"] == 100.0
    assert figures["times_crazyflow_euler_cpu_s"] == pytest.approx(2.0)  # of 50 / 25, 150 / 150, 100 / 10
    assert figures["rotorpy_s_per_wall_s"] == 10.0 and figures["times_rotorpy"] == 20  # of 2, 30, 20


def test_peers_that_are_not_there_have_no_figures():
    figures = bench_simulation.figures_of(rounds(100), rounds(200), [], [{}])
    assert not any("rotorpy" in name or "crazyflow" in name for name in figures)


def test_a_python_that_fails_is_no_python_without_crazyflow(tmp_path):
    failing = tmp_path / "python"
    failing.write_text("#!/bin/sh\necho no module named crazyflow >&2\nexit 1\n")
    failing.chmod(0o755)
    with pytest.raises(AirTouchError, match="no module named crazyflow"):
        bench_simulation.crazyflow_rates(str(failing))
