"""`airtouch logs`, as a user calls it."""

import gzip
import json

import numpy as np
import pytest
from click.testing import CliRunner

from airtouch import logs
from airtouch.cli.gap import files as gap_files
from airtouch.cli.logs import command
from airtouch.detector.evaluation.data import dataset
from airtouch.errors import AirTouchError
from airtouch.logs import files
from airtouch.logs.flight_log import PWM, FlightLog


@pytest.fixture
def folder(tmp_path):
    n = 600
    height = np.r_[np.full(300, 0.8), np.full(300, 0.05)]
    columns = {"t_s": np.arange(n) * 0.002, "zrange_m": height}
    columns |= {m: np.full(n, 4e4) + np.arange(n) for m in PWM}
    logs.write(FlightLog(columns, {"source": "made", "condition": "calm"}), tmp_path / "good.csv")
    (tmp_path / "empty.csv.gz").write_bytes(b"")
    (tmp_path / "manifest.csv").write_text("file,use\n")
    return tmp_path


def call(*arguments):
    return CliRunner().invoke(command, [str(a) for a in arguments])


def test_help_teaches_with_an_example():
    for sub in ("info", "check", "convert"):
        result = call(sub, "--help")
        assert result.exit_code == 0 and f"airtouch logs {sub}" in result.output


def test_info_goes_on_past_bad_files_and_sums_up(folder):
    result = call("info", folder, folder / "absent.csv")
    assert result.exit_code == 2
    assert "good.csv" in result.stdout and "calm" in result.stdout
    assert "empty.csv.gz: the file is empty" in result.stderr
    assert "1 flight read, 2 left out" in result.stderr
    assert call("info", folder / "good.csv").exit_code == 0


def test_a_check_as_json_holds_rate_edges_and_files_left_out(folder):
    result = call("check", folder, "--json")
    assert result.exit_code == 2
    report = json.loads(result.stdout)
    assert report["flights"][0]["rate_hz"] == pytest.approx(500)
    assert report["flights"][0]["edges"][0]["kind"] == "entry"
    assert report["left_out"][0]["file"].endswith("empty.csv.gz")
    text = call("check", folder / "good.csv").stdout
    assert "entry at 300 (0.80 to 0.05 m)" in text


def test_every_command_takes_the_same_files_of_a_folder_for_flights(tmp_path, capsys):
    """`evaluate` once saw no flight in a folder of ULog files, and `logs info` passed over uSD logs."""
    taken = ["A.CSV", "a.ulg", "b.usd", "c.bin", "d.csv", "e.csv.gz", "f.parquet", "log00", "log01", "log02"]
    beside = ("manifest.csv", "run.json", "diverged.jsonl")  # that AirTouch itself puts there
    for name in (*taken, *beside, "notes.txt", "map.geojson", "LICENSE", "blank"):
        (tmp_path / name).write_text("file\n" if name != "blank" else "")
    (tmp_path / "log00").write_bytes(b"\xbc\x02")  # Bitcraze's card writes no ending
    (tmp_path / "log01").write_bytes(b"\x02tick(I),acc.x(f),")  # firmware of 2019
    (tmp_path / "log02").write_bytes(b"ULog\x01\x12\x35")
    (tmp_path / "g.csv").mkdir()
    expected = [tmp_path / name for name in taken]
    assert files.in_folder(tmp_path) == expected
    assert [f.path for f in dataset.collect([tmp_path])] == expected
    assert gap_files.files_of([str(tmp_path)]) == expected
    result = call("info", tmp_path, "--json")
    assert [f["file"] for f in json.loads(result.stdout)["left_out"]] == [str(p) for p in expected]
    for message in (result.stderr, capsys.readouterr().err):  # of `logs` and of `gap`
        assert f"{tmp_path}: 4 other files in this folder" in message


def test_a_folder_without_flights_is_the_same_error_everywhere(folder):
    """`logs info` had nothing to say of it and ended with 0."""
    empty, notes = folder / "none", folder / "notes"
    for place in (empty, notes):
        place.mkdir()
    (notes / "README").write_text("flights are on the card\n")
    for place in (empty, notes):
        for command_line in (("info", place), ("check", place), ("convert", place, "--out", folder / "out")):
            result = call(*command_line)
            assert result.exit_code == 2 and f"{place}: no flights in this folder" in result.stderr
        for collect in (dataset.collect, gap_files.files_of):
            with pytest.raises(AirTouchError, match=f"{place}: no flights in this folder"):
                collect([str(place)])
    result = call("info", empty, folder / "good.csv")
    assert result.exit_code == 2 and "1 flight read, 1 left out" in result.stderr and "good.csv" in result.stdout


def test_a_name_in_capitals_is_converted_to_one_with_the_new_ending(folder):
    (folder / "good.csv").rename(folder / "GOOD.CSV")
    assert call("convert", folder / "GOOD.CSV", "--out", folder / "out", "--format", "csv").exit_code == 0
    assert len(logs.read(folder / "out" / "GOOD.csv")) == 600


def test_convert_keeps_samples_unless_a_rate_is_asked_for(folder):
    out = folder / "out"
    assert call("convert", folder / "good.csv", "--out", out).exit_code == 0
    back = logs.read(out / "good.csv.gz")
    np.testing.assert_array_equal(back["t_s"], np.arange(600) * 0.002)
    repeat = call("convert", folder / "good.csv", "--out", out, "--rate", 100)
    assert repeat.exit_code == 2 and "--force" in repeat.stderr
    assert call("convert", folder / "good.csv", "--out", out, "--rate", 100, "--force").exit_code == 0
    assert len(logs.read(out / "good.csv.gz")) == 120


def test_convert_leaves_no_empty_folder_after_a_refusal(tmp_path):
    (tmp_path / "bad.csv").write_text("1,2\n")
    assert call("convert", tmp_path / "bad.csv", "--out", tmp_path / "new" / "out").exit_code == 2
    assert not (tmp_path / "new").exists()


def test_convert_never_replaces_its_input_or_another_result(folder):
    result = call("convert", folder / "good.csv", "--out", folder, "--format", "csv", "--force")
    assert result.exit_code == 2 and "a file to convert" in result.stderr
    result = call("convert", folder / "good.csv", folder / "good.csv", "--out", folder / "o", "--force")
    assert result.exit_code == 2 and "1 flight written" in result.stderr
    with pytest.raises(AirTouchError, match="cannot be made"):
        CliRunner().invoke(command, ["convert", str(folder / "good.csv"), "--out", str(folder / "good.csv")],
                           catch_exceptions=False)


def test_convert_replaces_no_later_input(folder):
    data = (folder / "good.csv").read_bytes()
    both = [folder / "x.csv", folder / "x.csv.gz"]
    both[0].write_bytes(data)
    both[1].write_bytes(other := gzip.compress(data[:len(data) // 2]))
    for names in (both, [folder]):
        result = call("convert", *names, "--out", folder, "--format", "csv.gz", "--force")
        assert result.exit_code == 2 and "a file to convert" in result.stderr
        assert both[1].read_bytes() == other
