"""Every fuzz target over its kept seeds and some thousand mutations, and proof that the targets find what they must.

With clang the engine is libFuzzer; without it a driver of our own runs the same targets under the C compiler's
sanitizers. `make fuzz` runs them for longer: host/docs/fuzzing.md.
"""

import subprocess

import pytest

from tools import fuzz
from tools.fuzzing import fuzz_build

MUTATIONS = 300
#: Defects by target: a source, what stands there and what is put in its place.
PLANTED = {
    "parser": ("firmware/link/edge_link.c", "get(&crc, 2) != edgeLinkCrc(bytes, end) || ", ""),
    "receiver": ("firmware/link/link_receiver.c", "if (edgeLinkAfter(first, receiver->expected) > 0) {",
                 "if (false) {"),
    "fr_cfar": ("firmware/kernels/fr_cfar.c", "self->oldest + 1u == self->lag ?", "self->oldest + 1u > self->lag ?"),
    "edge_decoder": ("firmware/kernels/edge_decoder.c", "decoder->smoothedOver = SMOOTHED_AT_START;\n", "\n"),
    "networks": ("gap8/kernels/max_pool_int8.c", "value > most ? value : most", "value"),
}


@pytest.fixture(scope="module")
def engine():
    fuzzing_engine = fuzz_build.engine()
    if fuzzing_engine is None:
        pytest.skip("no C compiler with sanitizers on this machine")
    return fuzzing_engine


#: Without the chip's path of the int8 kernels, which tests/gap8 holds equal to the other one.
NAMES = [name for name in fuzz_build.targets() if fuzz_build.VARIANTS.get(name, (name,))[0] == name]


@pytest.fixture(scope="module")
def programs(engine):
    return fuzz_build.build(NAMES, engine)


@pytest.mark.parametrize("name", NAMES)
def test_fuzzing_finds_no_defect(programs, name, tmp_path):
    result = fuzz.run(name, programs[name], MUTATIONS, folder=tmp_path)
    assert result.finding is None, result.log.read_text(errors="replace")[-3000:]
    assert result.inputs >= MUTATIONS


@pytest.mark.parametrize("name", PLANTED)
def test_a_planted_defect_is_found(engine, name, tmp_path):
    path, correct, defect = PLANTED[name]
    source = fuzz_build.ROOT / path
    text = source.read_text()
    assert text.count(correct) == 1, f"{path} has changed: plant another defect"
    planted = tmp_path / source.name
    planted.write_text(text.replace(correct, defect))
    program = fuzz_build.build([name], engine, {source: planted}, tmp_path)[name]
    assert fuzz.run(name, program, 20_000, folder=tmp_path).finding is not None


def test_the_driver_of_our_own_finds_a_planted_defect(tmp_path):
    engine = fuzz_build.engine("standalone")
    if engine is None:
        pytest.skip("no C compiler with sanitizers on this machine")
    path, correct, defect = PLANTED["parser"]
    source, planted = fuzz_build.ROOT / path, tmp_path / "edge_link.c"
    planted.write_text(source.read_text().replace(correct, defect))
    program = fuzz_build.build(["parser"], engine, {source: planted}, tmp_path, only=[source])["parser"]
    result = fuzz.run("parser", program, 20_000, folder=tmp_path)
    assert result.finding is not None
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    assert subprocess.run([program, result.finding], capture_output=True, cwd=elsewhere).returncode != 0
    assert list(elsewhere.iterdir()) == [], "a replay writes no file into the folder in which it is run"


def test_a_run_that_was_ended_goes_on(programs, tmp_path, monkeypatch):
    monkeypatch.setattr(fuzz, "BATCH", 400)
    first = fuzz.run_batches("parser", programs["parser"], 900, 1, True, tmp_path)
    resumed = fuzz.run_batches("parser", programs["parser"], 2000, 1, True, tmp_path)
    lines = [line.split(",") for line in (tmp_path / "inputs.csv").read_text().splitlines()]
    assert 900 <= first.inputs < 2000 <= resumed.inputs == sum(int(line[3]) for line in lines)
    assert [int(line[2]) for line in lines] == [1 + i for i in range(len(lines))], "every batch has its own seed"
    assert sum(int(line[3]) for line in lines[:3]) == first.inputs, "what the first run did is not run again"
    anew = fuzz.run_batches("parser", programs["parser"], 400, 1, False, tmp_path)
    assert 400 <= anew.inputs < 900, "without --resume all begins anew"


def test_the_kept_seeds_are_small():
    assert sum(path.stat().st_size for path in fuzz.SEEDS.glob("*.zip")) < 200_000
