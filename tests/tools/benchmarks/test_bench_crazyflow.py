"""The rates of `bench_crazyflow.py`, with stand-ins for crazyflow and its clock."""

import json
import sys
from types import ModuleType, SimpleNamespace

import pytest

from tools.benchmarks import bench_crazyflow


@pytest.fixture
def clock(monkeypatch):
    """A clock that a stand-in of crazyflow moves: ten times as far in the first round of an integrator, which compiles.

    A step takes 1 ms with Euler's rule and 4 ms with Runge and Kutta's; two processors are busy.
    """
    now = SimpleNamespace(s=0.0)

    class Sim:
        def __init__(self, n_worlds, integrator, **_):
            assert n_worlds == bench_crazyflow.WORLDS
            self.step_s, self.rounds, self.data = {"euler": 1e-3, "rk4": 4e-3}[integrator], 0, None

        def reset(self):
            pass

        def state_control(self, command):
            assert command.shape == (bench_crazyflow.WORLDS, 1, 16)

        def step(self, steps):
            now.s += steps * self.step_s * (1 if self.rounds else 10)
            self.rounds += 1

    for name, names in (("jax", {"block_until_ready": lambda data: data}), ("crazyflow", {}),
                        ("crazyflow.control", {"Control": SimpleNamespace(state=0)}), ("crazyflow.sim", {"Sim": Sim})):
        module = ModuleType(name)
        vars(module).update(names)
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.setattr(bench_crazyflow, "time", SimpleNamespace(perf_counter=lambda: now.s,
                                                                 process_time=lambda: 2.0 * now.s))


def test_rates_are_of_all_worlds_and_the_round_that_compiles_does_not_count(clock, monkeypatch, capsys):
    """At 500 Hz and 1 ms a step a second of 64 worlds takes 0.5 s: 128 simulated seconds a second."""
    monkeypatch.setattr(sys, "argv", ["bench_crazyflow.py", "--seconds", "2"])
    bench_crazyflow.main()
    assert json.loads(capsys.readouterr().out) == {"euler": [128, 64], "rk4": [32, 16]}
