"""Every script of tools refuses a missing input and options that do not fit in one line, before it does anything."""

import json
import os
import subprocess
import sys

import pytest

from .test_help import MODULES, SCRIPTS, TOOLS

NONE = "no-such-folder"  #: which is not there
LESS = "no whole number from"  #: what is said of a number that is too small
#: script, arguments after it, what is said. Where a script needs recorded flights, it finds none (`refusals`)
REFUSED = [
    ("bench.py", "--flights 0", LESS),
    ("bench_simulation.py", "--workers 0", LESS),
    ("bench_simulation.py", "--json full/file", "exists already; use --force"),
    ("bench_simulation.py", f"--crazyflow {NONE}", "no such program"),
    ("benchmarks/bench_crazyflow.py", "--rounds 0", "--rounds at least 1"),
    ("benchmarks/bench_diagnosis.py", "--runs 0", LESS),
    ("calibration/days_apart.py", NONE, "no such file or folder"),
    ("calibration/days_apart.py", f"{NONE} --fewest 0", LESS),
    ("calibration/nominal_scatter.py", NONE, "has no manifest.csv"),
    ("calibration/nominal_scatter.py", "--jobs 0", LESS),
    ("calibration/rotor_inertia.py", NONE, "cannot be read"),
    ("calibration/rotor_inertia.py", f"{NONE} --vehicle no-such", "no-such"),
    ("detectors/choose_decoder.py", NONE, "no models of `best`"),
    ("detectors/choose_decoder.py", f"{NONE} --count 0", LESS),
    ("detectors/edge_readings.py", NONE, "no such file or folder"),
    ("detectors/edge_readings.py", f"{NONE} --fold -1", LESS),
    ("detectors/edge_readings.py", f"empty --twin {NONE}", f"{NONE}/scenario.toml"),
    ("detectors/half_of_best.py", NONE, "has no manifest.csv"),
    ("detectors/high_edges.py", NONE, "no such file or folder"),
    ("detectors/high_edges.py", f"{NONE} --fold x", LESS),
    ("detectors/high_edges.py", f"empty --twin {NONE}", f"{NONE}/scenario.toml"),
    ("detectors/labelled_flights.py", NONE, "no such file or folder"),
    ("detectors/labelled_flights.py", f"{NONE} --draws 0", LESS),
    ("detectors/labelled_flights.py", f"{NONE} --unlabelled", "give --twin or --beside"),
    ("detectors/labelled_flights.py", f"{NONE} --beside a", "give --start"),
    ("detectors/sensor_figures.py", f"all={NONE}=out", NONE),
    ("detectors/sensor_figures.py", "all", "is not NAME=JSON=WHERE"),
    ("detectors/train_without_acceleration.py", f"empty --twin {NONE} --out b", f"{NONE}/scenario.toml"),
    ("detectors/train_without_acceleration.py", f"empty --twin {NONE} --out b --least 2", "at most 1"),
    ("detectors/train_without_acceleration.py", f"{NONE} --twin a --out full/file", "exists already; use --force"),
    ("diagnosis/gap_authors.py", NONE, "has no manifest.csv"),
    ("diagnosis/gap_crazypad.py", NONE, "has no manifest.csv"),
    ("diagnosis/gap_crazypad.py", "--corrections --json a", "leave out --keep"),
    ("diagnosis/gap_crazypad.py", "--corrections --leave-one-out", "leave out --keep"),
    ("diagnosis/gap_crazypad_balance.py", NONE, "has no manifest.csv"),
    ("diagnosis/gap_crazypad_ideal.py", NONE, "has no manifest.csv"),
    ("diagnosis/gap_fan.py", NONE, "has no manifest.csv"),
    ("diagnosis/gap_lift.py", NONE, "has no manifest.csv"),
    ("diagnosis/gap_peers.py", NONE, "has no manifest.csv"),
    ("diagnosis/gap_training.py", "--diagnose", "empty"),
    ("diagnosis/gap_training.py", "--groups 012", "give two or more"),
    ("diagnosis/gap_training.py", "--groups 012,23", "in one group only"),
    ("diagnosis/gap_training.py", "--groups 012,", "in one group only"),
    ("diagnosis/gap_training.py", "--seeds 0", LESS),
    ("diagnosis/gap_wakes.py", NONE, "has no manifest.csv"),
    ("diagnosis/gap_wakes.py", "--keep a", "--keep is of --false-alarms"),
    ("diagnosis/gap_wakes.py", "--false-alarms --answers a", "leave it out"),
    ("firmware/firmware_sizes.py", NONE, "no checkout of bitcraze/crazyflie-firmware"),
    ("firmware/stack.py", f"{NONE} appMain", "no appMain in any .ci file"),
    ("fuzz.py", "no-such", "no target no-such"),
    ("fuzz.py", "--runs 0", "at least 1"),
    ("fuzz.py", f"--replay {NONE}", "no such file"),
    ("fuzz.py", "--minimise --coverage", "not allowed with"),
    ("fuzz_logs.py", "--count 0", LESS),
    ("fuzz_logs.py", "--only 1", "give that with --format"),
    ("fuzz_logs.py", "--only 1 --shapes 2", "not allowed with"),
    ("gap_real.py", NONE, "has no manifest.csv"),
    ("gap_real.py", "--jobs 0", LESS),
    ("gap_real.py", "--most-baseline -1", LESS),
    *(("gap_real.py", f"--quick {option}", f"leave out {option.split()[0]}")
      for option in ("--part view", "--rows swarm", "--partner", "--leave-out", "--most-baseline 0")),
    ("gap_real.py", "--quick --rows swarm --partner", "leave out --rows, --partner"),
    ("gap_real.py", "--rows authors --partner", "add swarm or nominal"),
    ("mutate.py", "no-such", "no group no-such"),
    ("mutate.py", "--sample 0", "at least 1"),
    ("mutate.py", "--show --sample 3", "leave out --sample"),
    ("pages/gallery.py", "--gap", "expected one argument"),
    ("pages/picture.py", "", "no flights in this folder"),
    ("power/power.py", f"measure {NONE}", "cannot be read"),
    ("power/power.py", f"estimate --budget {NONE}", "cannot be read"),
    ("repeat.py", "--times 0", "at least 1"),
    ("repeat.py", f"{NONE} --times 1", "no such file or folder"),
    ("repeat.py", f"full/file {NONE}::test_it", f"no such file or folder: {NONE}::test_it"),
    ("simulation/gap_example.py", "full/file", "cannot be made"),
    ("simulation/gap_scenes.py", "--scenes no-such", "no-such"),
    ("simulation/gap_scenes.py", "--jobs 0", LESS),
    ("simulation/rotorpy_flights.py", "full/file", "cannot be made"),
    ("simulation/rotorpy_flights.py", "new --nominal -1", "whole number from 0"),
    ("simulation/rotorpy_flights.py", "new --slow-error nan", "no number from 0 on"),
    ("simulation/simulated_training.py", "", "empty"),
    ("simulation/simulated_training.py", "--without no-such", "no-such"),
    ("simulation/simulated_training.py", "--steps 0", LESS),
    ("tools.firmware_emulation", f"{NONE} {NONE}", "cannot be read"),
    ("tools.firmware_emulation", f"{NONE} --seeds 2", "leave it out"),
    ("tools.instruction_counts.compare_fft", f"--sdist {NONE}", "no such file"),
    ("tools.instruction_counts.count", f"--flights {NONE}", "has no manifest.csv"),
    ("tools.instruction_counts.count", "--core no-such", "invalid choice"),
    ("tools.instruction_counts.gap8_figures", NONE, NONE)]
#: runs scripts one after another in one process, as each of them imports much of the same
RUN = """
import io, json, runpy, sys, traceback
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
root, commands = sys.argv[1], json.load(sys.stdin)
own = list(sys.path)
for command in commands:
    name = command[0]
    sys.argv, stderr = list(command), io.StringIO()
    sys.path[0] = str(Path(name).parent) if name.endswith(".py") else root  # as Python does
    code = 0
    with redirect_stderr(stderr), redirect_stdout(io.StringIO()):
        try:
            (runpy.run_path if name.endswith(".py") else runpy.run_module)(name, run_name="__main__")
        except SystemExit as stop:
            code = stop.code
            if isinstance(code, str):  # as Python does
                print(code, file=sys.stderr)
                code = 1
        except BaseException:
            traceback.print_exc()
            code = 1
    sys.path[:] = own
    print(json.dumps([code, stderr.getvalue()]), flush=True)
"""


def command_of(name: str, arguments: str) -> tuple[str, ...]:
    """The command line of a script, by its path in tools or its module, and of arguments."""
    return (str(TOOLS / name) if name.endswith(".py") else name, *arguments.split())


@pytest.fixture(scope="module")
def refusals(tmp_path_factory):
    """Command -> its exit code and stderr, in a folder with an empty folder of flights and a file `full/file`."""
    folder = tmp_path_factory.mktemp("refusals")
    (folder / "empty").mkdir()
    (folder / "full").mkdir()
    (folder / "full/file").touch()
    commands = [*(command_of(name, arguments) for name, arguments, _ in REFUSED),
                *((name, "--no-such-option") for name in (*SCRIPTS, *MODULES))]
    run = subprocess.run([sys.executable, "-c", RUN, str(TOOLS.parent)], input=json.dumps(commands), cwd=folder,
                         capture_output=True, text=True, env={**os.environ, "AIRTOUCH_FLIGHTS": str(folder / "empty")})
    answers = [json.loads(line) for line in run.stdout.splitlines()]
    assert len(answers) == len(commands), run.stderr[-1000:]
    return dict(zip(commands, answers, strict=True))


def one_line(stderr: str) -> str:
    """What a program says on stderr after the usage, which must be one line."""
    lines = stderr.splitlines()
    first = next((i for i, line in enumerate(lines) if ": error: " in line or line.startswith("Error: ")), 0)
    assert len(lines) == first + 1, stderr
    return lines[first]


@pytest.mark.parametrize(("name", "arguments", "reason"), REFUSED)
def test_a_script_refuses_what_it_cannot_do_in_one_line(name, arguments, reason, refusals):
    code, stderr = refusals[command_of(name, arguments)]
    assert reason in one_line(stderr)
    assert code == (1 if name == "firmware/stack.py" else 2)


@pytest.mark.parametrize("name", [*SCRIPTS, *MODULES])
def test_a_script_refuses_an_option_that_it_has_not(name, refusals):
    code, stderr = refusals[name, "--no-such-option"]
    assert code == 2 and one_line(stderr)


def test_every_script_with_an_input_is_in_the_table():
    """Those that are not have neither inputs nor options."""
    assert {command_of(name, "")[0] for name, *_ in REFUSED} == {*SCRIPTS, *MODULES} - {
        str(TOOLS / "pages/api_page.py"), str(TOOLS / "simulation/replay_error.py")}
