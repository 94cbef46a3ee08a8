"""host/docs/port.md, followed: its lists of sources alone, for a Cortex-M0 and in C++; what the headers promise."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import airtouch as at
from airtouch import kernels, logs, vehicle
from airtouch.detector import best
from airtouch.logs.flight_log import ACC, ACC_WORLD, GYRO, PWM, FlightLog
from airtouch.simulation import scenario
from airtouch.simulation.flight import fly

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "host/docs/port.md").read_text()
LISTS = {title: block.split() for title, block in re.findall(r"^## (.+?)\nSources:\n```\n(.+?)```", PAGE, re.M | re.S)}
INCLUDES = [f"-I{ROOT / folder}" for folder in ("firmware/kernels", "firmware/link", "gap8/kernels", "gap8/model")]
FLAGS = ["-std=c11", "-Wall", "-Wextra", "-Werror", "-ffp-contract=off", *INCLUDES]
#: what the page allows a list to leave undefined; __aeabi_ and __gnu_ are the compiler's own library
LIBRARY = {"memcpy", "memset", "memmove", "sqrtf", "floorf", "ceilf", "ldexpf", "fmaxf", "memcmp"}
#: headers that sources include for themselves
INTERNAL = {"sample_guard.h", "start_up_math.h", "dot_int8.h", "xpulp.h", "requantise.h", "extensions.h",
            "airtouch_parameters.h"}
TREES = ("firmware/kernels", "firmware/link", "gap8/kernels")
PUBLIC = sorted(path for tree in TREES for path in (ROOT / tree).glob("*.h") if path.name not in INTERNAL)


def run(*command):
    process = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    assert process.returncode == 0, process.stderr[-3000:]
    return process.stdout


def test_the_page_lists_every_kernel_once_or_more():
    listed = {source for sources in LISTS.values() for source in sources}
    there = {str(path.relative_to(ROOT)) for tree in TREES for path in (ROOT / tree).glob("*.c")}
    assert len(LISTS) == 4
    assert there <= listed
    assert listed - there == {"gap8/model/airtouch_stream.c"}


@pytest.mark.parametrize("title", LISTS)
def test_a_list_builds_alone_for_a_cortex_m0(title, tmp_path):
    if shutil.which("arm-none-eabi-gcc") is None:
        pytest.skip("no arm-none-eabi-gcc: apt-get install gcc-arm-none-eabi libnewlib-arm-none-eabi")
    core = ["-mcpu=cortex-m0", "-mthumb"]
    objects = []
    for i, source in enumerate(LISTS[title]):
        objects.append(tmp_path / f"{i}.o")
        run("arm-none-eabi-gcc", *core, "-Os", *FLAGS, "-c", ROOT / source, "-o", objects[-1])
    linked = tmp_path / "whole.o"
    run("arm-none-eabi-gcc", *core, "-nostdlib", "-r", *objects, "-o", linked)
    missing = {line.split()[-1] for line in run("arm-none-eabi-nm", "--undefined-only", linked).splitlines()}
    missing = {name for name in missing if not name.startswith(("__aeabi_", "__gnu_"))}
    assert missing <= LIBRARY, missing - LIBRARY
    variables = [line for line in run("arm-none-eabi-nm", linked).splitlines() if line.split()[-2] in "bBdDcC"]
    assert variables == [], "no globals that are written"


def test_the_sizes_on_the_page_are_those_of_the_sources(tmp_path):
    """Each size and the total within 3 %, as another release of the compiler may give a few bytes more or less."""
    if shutil.which("arm-none-eabi-gcc") is None:
        pytest.skip("no arm-none-eabi-gcc: apt-get install gcc-arm-none-eabi libnewlib-arm-none-eabi")
    block, objects = PAGE.split("## ")[0], []
    flags = re.findall(r'^M0="(.+)"$', block, re.M)[0].split()
    for source in " ".join(re.findall(r'^BEST="(?:\$BEST )?(.+)"$', block, re.M)).split():
        objects.append(tmp_path / f"{Path(source).stem}.o")
        run("arm-none-eabi-gcc", *(word.replace("-I", f"-I{ROOT}/") for word in flags), "-c", ROOT / source,
            "-o", objects[-1])
    measured = {Path(row.split()[-1]).name: int(row.split()[3])
                for row in run("arm-none-eabi-size", "-t", *objects).splitlines()[1:]}
    printed = {Path(row[-1]).name: int(row[3]) for row in map(str.split, block.splitlines())
               if len(row) == 6 and row[3].isdigit()}
    assert len(printed) == 4
    for name, size in printed.items():
        assert measured[name] == pytest.approx(size, rel=0.03), name


def test_the_program_in_cpp_gives_the_detectors_bits(tmp_path):
    cc, cpp = shutil.which("cc"), shutil.which("c++")
    if cc is None or cpp is None:
        pytest.skip("no C and C++ compiler on this machine")
    title = next(title for title in LISTS if "best" in title)
    objects = []
    for i, source in enumerate(LISTS[title]):
        objects.append(tmp_path / f"{i}.o")
        run(cc, "-O2", *FLAGS, "-c", ROOT / source, "-o", objects[-1])
    program = tmp_path / "example"
    run(cpp, "-std=c++17", "-O2", "-Wall", "-Wextra", "-Werror", *INCLUDES,
        ROOT / "tests/firmware/kernels/port/example.cpp", *objects, "-lm", "-o", program)
    log = fly(scenario.load("paper-4cm"), vehicle.load(), seed=3)
    table = np.column_stack([log.stack(ACC_WORLD), log.stack(GYRO), log.stack(PWM)]).astype(np.float32)
    output = subprocess.run([program], input=table.tobytes(), capture_output=True, check=True).stdout.decode()
    rows = [line.split() for line in output.split("\n") if line]
    model = best.load(None)
    expected = kernels.stream_detector(table[:, :3], table[:, 3:6], table[:, 6:], model.int8, model.recipe.motion,
                                       model.decoder_without(()))
    logits = np.array([[int(word, 16) for word in row[1:4]] for row in rows], np.uint32).view(np.float32)
    np.testing.assert_array_equal(logits, expected.logits)
    edges = np.array([int(row[4]) for row in rows])
    np.testing.assert_array_equal(edges, expected.edge)
    assert edges.any()


def test_the_papers_program_has_the_features_probability_and_edges_of_the_detector(recorded, tmp_path):
    """Its edges come one sample later: a probability counts from the sample on that follows its window."""
    cc = shutil.which("cc")
    if cc is None:
        pytest.skip("no C compiler on this machine")
    program = ROOT / "tests/firmware/kernels/port/paper.c"
    (excerpt,) = re.findall(r"```c\n(.+?)```", PAGE, re.S)
    lines = {line.strip() for line in program.read_text().splitlines()}
    assert {line.strip() for line in excerpt.splitlines()} <= lines
    _, pipeline, network, _ = LISTS.values()
    sources = [*pipeline, *network, "gap8/model/airtouch_model.c", "gap8/model/airtouch_stream.c", program]
    built = tmp_path / "paper"
    run(cc, "-O2", *FLAGS, *(ROOT / source for source in sources), "-lm", "-o", built)
    names = (*ACC, *GYRO, *PWM, "zrange_m")  # no attitude: body axes count as level in both
    log = FlightLog({name: recorded[0][name] for name in names}, recorded[0].meta)
    table = log.stack(names[:10]).astype(np.float32)
    output = subprocess.run([built], input=table.tobytes(), capture_output=True, check=True).stdout.decode()
    rows = np.array([line.split() for line in output.splitlines()], float)
    expected = at.detect(log, "paper")
    np.testing.assert_allclose(rows[:, 1:4], expected.signals["fused"], rtol=1e-5)
    np.testing.assert_allclose(rows[:, 4], expected.probability, atol=1e-5)
    kinds = {"entry": 1, "exit": 2}
    assert [(i, rows[i, 5]) for i in np.flatnonzero(rows[:, 5])] == [
        (edge.sample + 1, kinds[edge.kind]) for edge in expected.edges] != []


def test_the_program_on_the_page_is_the_one_that_is_built_here():
    (program,) = re.findall(r"```cpp\n(.+?)```", PAGE, re.S)
    assert program == (ROOT / "tests/firmware/kernels/port/example.cpp").read_text()


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A flight as a log of body axes alone, as a recorded one may be, and its path."""
    log = fly(scenario.load("paper-4cm"), vehicle.load(), seed=3)
    log = FlightLog({n: v for n, v in log.columns.items() if n not in ACC_WORLD}, log.meta)
    path = tmp_path_factory.mktemp("one") / "recorded.csv.gz"
    logs.write(log, path)
    return log, path


def test_the_rows_of_the_page_are_level_and_its_python_prints_their_edges(recorded, tmp_path, capsys, monkeypatch):
    """Level axes as a rotation library has them; the edges as the C detector finds them in these rows."""
    rows_py, edges_py = re.findall(r"```python\n(.+?)```", PAGE, re.S)
    log, path = recorded
    process = subprocess.run([sys.executable, "-c", rows_py, path], capture_output=True)
    assert process.returncode == 0, process.stderr.decode()[-3000:]
    rows = np.frombuffer(process.stdout, np.float32).reshape(-1, 10)
    level = Rotation.from_euler("xy", log.stack(("roll_rad", "pitch_rad"))).apply(log.stack(ACC))
    np.testing.assert_allclose(rows[:, :3], level, atol=1e-5)
    np.testing.assert_allclose(rows[:, 3:], np.column_stack([log.stack(GYRO), log.stack(PWM)]), rtol=1e-6)
    model = best.load(None)
    edge = kernels.stream_detector(rows[:, :3], rows[:, 3:6], rows[:, 6:], model.int8, model.recipe.motion,
                                   model.decoder_without(())).edge
    expected = [f"{i / 100} s {'entry' if edge[i] == 1 else 'exit'}" for i in np.flatnonzero(edge)]
    (tmp_path / "one").mkdir()
    shutil.copy(path, tmp_path / "one")
    monkeypatch.chdir(tmp_path)
    exec(edges_py, {})
    assert capsys.readouterr().out.splitlines() == expected
    (printed,) = re.findall(r"```\n([\d.]+ s entry\n.+?)```", PAGE, re.S)
    assert printed.splitlines() == expected


@pytest.mark.parametrize("header", PUBLIC, ids=lambda path: path.name)
def test_a_public_header_says_what_it_needs_and_is_cpp(header, tmp_path):
    text = header.read_text()
    for word in ("Target: ", "Threads: ", "Memory: ", "Cost: "):
        assert text.split("#pragma once")[0].count(word) == 1, word
    cpp = shutil.which("c++")
    if cpp is None:
        pytest.skip("no C++ compiler on this machine")
    unit = tmp_path / "alone.cpp"
    unit.write_text(f'#include "{header.name}"\n')
    run(cpp, "-std=c++17", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", *INCLUDES, unit)
    code = re.sub(r"/\*.*?\*/|//[^\n]*", "", text, flags=re.S)
    functions = re.search(r"^[a-z][\w *]*\([^;{]*\)\s*[;{]", code, re.M)
    assert bool(functions) <= ('extern "C"' in code)


def includes(folder):
    return {(path, name) for path in (ROOT / folder).rglob("*.[ch]")
            for name in re.findall(r'^#include "(.+?)"', path.read_text(), re.M)}


def test_kernels_and_link_know_no_app_and_no_app_the_other():
    apps = {app: {path.name for path in (ROOT / app).rglob("*.h")} for app in ("firmware/app", "gap8/app")}
    models = {path.name for path in (ROOT / "gap8/model").glob("*.h")}
    for tree in TREES:
        for path, name in includes(tree):
            assert name not in apps["firmware/app"] | apps["gap8/app"] | models, f"{path} includes {name}"
    link = {name for _, name in includes("firmware/link")}
    assert link == {path.name for path in (ROOT / "firmware/link").glob("*.h")}, "the link knows itself alone"
    assert not {name for _, name in includes("gap8/kernels")} - {p.name for p in (ROOT / "gap8/kernels").glob("*.h")}
    for app, other in (("firmware/app", "gap8/app"), ("gap8/app", "firmware/app")):
        assert not {name for _, name in includes(app)} & apps[other]
