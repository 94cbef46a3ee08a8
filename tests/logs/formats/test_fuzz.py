"""A short run of `tools/fuzz_logs.py`: mutated files of every format, always the same ones."""

import pytest

from airtouch import logs
from airtouch.logs.files import parse
from tools import fuzz_logs
from tools.fuzzing.log_fuzzing import sound, walk

COUNT = 80  #: inputs of each format; `tools/fuzz_logs.py` runs more


@pytest.mark.parametrize("name", sound.FORMATS)
def test_mutated_files_are_logs_or_refused_in_one_line(name, tmp_path):
    if name == "parquet":
        pytest.importorskip("pyarrow")
    count = fuzz_logs.fuzz(name, 12, 0, COUNT, tmp_path)
    assert not count.failures
    assert min(count.log, count.refused) > COUNT / 20  # mutations that are all refused, or none, test little


@pytest.mark.parametrize("name", sound.FORMATS)
def test_sound_files_are_read_without_a_fault(name, tmp_path):
    """The generators are right: what they make is a log of the expected format, complete."""
    if name == "parquet":
        pytest.importorskip("pyarrow")
    path = tmp_path / "flight"
    for data, (rows, _) in zip(sound.files(name), sound.SIZES, strict=True):
        path.write_bytes(data)
        if name == "thrust-stand":
            assert walk.stand(path) == "log"
            continue
        log = parse(data, "flight")
        kind = {"imrclab": "crazyflie-csv", "canonical-gz": "canonical"}.get(name, name)
        assert len(log) == rows and log.meta["format"] == kind
        if rows == 160 and log.has("zrange_m", "m1_pwm"):
            assert [edge.kind for edge in logs.true_edges(log)] == ["entry", "exit"]
        walk.command(["check", str(path)], path)


def test_a_failure_is_counted_with_the_number_that_repeats_it(tmp_path, monkeypatch):
    def broken(data, source):
        raise IndexError("no such place")

    walk = fuzz_logs.walk.walk
    monkeypatch.setattr(fuzz_logs.walk, "parse", broken)
    monkeypatch.setattr(fuzz_logs.walk, "walk", lambda *a, w=walk: "log" if a[1] == "usd-2" else w(*a))
    count = fuzz_logs.fuzz("usd-2", 1, 5, 3, tmp_path)
    ((failure, numbers),) = count.failures.items()
    assert "IndexError" in failure and numbers == [5, 6, 7] and count.failed == 3


def test_inputs_are_the_same_each_time():
    for name in ("canonical", "usd-1"):
        first, repeat, another_seed = (fuzz_logs.mutate(name, seed, 17)[0] for seed in (3, 3, 4))
        assert first == repeat != another_seed
