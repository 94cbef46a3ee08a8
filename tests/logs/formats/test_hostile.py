"""Files that once ended in a traceback, or took time or memory beyond their size: now a log or one clear line."""

import gzip
import json
import os
import struct
import sys
import warnings

import numpy as np
import pytest

from airtouch import logs
from airtouch.cli import main
from airtouch.crazyflie.recorder import recover
from airtouch.errors import AirTouchError, printable
from airtouch.logs import public
from airtouch.logs.files import parse
from airtouch.logs.flight_log import FlightLog
from tools.fuzzing.log_fuzzing.hostile import HOSTILE, table
from tools.fuzzing.log_fuzzing.sound import META, canonical, motion, pack_log, parquet, si_columns


def flying(n=200, **changed):
    return table({**si_columns(motion(n, 0.01, 0)), **changed})


# the table


@pytest.mark.parametrize("blank", [b"\x0b", b" ", b"\t \x0c", b"\r\x0b"])
def test_a_last_line_of_white_space_without_its_end_is_blank(blank):
    """It was refused without its place."""
    log = parse(flying() + blank, "made")
    assert len(log) == 200 and log.meta["warnings"] == parse(flying(), "made").meta["warnings"]


# values and names


def test_a_log_is_columns_of_one_length():
    for column in (np.zeros((3, 2)), np.zeros(()), np.zeros(2)):
        with pytest.raises(AirTouchError, match="made: columns of unequal length.*; give each one value a sample"):
            FlightLog({"t_s": np.zeros(3), "x_m": column}, {"source": "made"})


def test_values_that_no_sensor_reads_are_missing_and_said_so():
    values = np.arange(200.0)
    values[[7, 9, 11]] = np.inf, -1e300, 3e38
    log = parse(flying(vx_mps=values), "made")
    assert np.flatnonzero(np.isnan(log["vx_mps"])).tolist() == [7, 9] and log["vx_mps"][11] == 3e38
    assert "vx_mps: no sensor reads inf (sample 7); 2 of 200 values were taken as missing" in log.meta["warnings"]
    variables = [(f"acc.{a}", "d") for a in "xyz"]
    data = pack_log(2, [(1, "fixedFrequency", variables)], [(1, 1000 * i, [1e308, 0.0, 1.0]) for i in range(5)])
    assert np.isnan(parse(data, "log00")["acc_x_mps2"]).all()


def test_slow_logs_have_edges_without_a_warning():
    """A row every 0.3 s, over a platform of 0.6 m after each ten rows; NumPy warns of nothing, or the test fails."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        report = logs.check(FlightLog(
            {"t_s": 0.3 * np.arange(60), "zrange_m": np.where(np.arange(60) % 20 < 10, 0.8, 0.2),
             **{f"m{i}_pwm": np.full(60, 4e4) for i in range(1, 5)}}, {"source": "made"}))
    assert [(e.sample, e.kind) for e in report.edges] == [
        (10, "entry"), (20, "exit"), (30, "entry"), (40, "exit"), (50, "entry")]


def test_names_from_a_file_can_be_printed(tmp_path, capsys):
    """Lone surrogates in stored warnings, and file names that are no UTF-8, ended `logs check` in a traceback."""
    assert printable("a\ud800\x1b[2J\u202e\n") == "a\\ud800\\x1b[2J\\u202e\\n" and len(printable("n" * 999)) == 40
    header = b'# warnings: ["\\ud800 \\u001b[2J", "a\\nb"]\n# condition: "\\ud800"\n'
    path = tmp_path / os.fsdecode(b"flight\xff.csv")
    path.write_bytes(header + flying())
    for arguments in (["check"], ["check", "--json"], ["info"]):
        assert _command(arguments[0], path, *arguments[1:]) == 0
        out, err = capsys.readouterr()
        assert "Traceback" not in err and "\x1b" not in out and "flight" in out
    with pytest.raises(AirTouchError, match=r"column 2 is not printable \('\\x1b\[31m'\)"):
        parse(b"t_s,\x1b[31m\n0,1\n", "made")


@pytest.mark.parametrize("name", ["n" * 300, "none.csv", "."])
def test_what_is_no_file_is_said_in_one_line(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "locked").mkdir()
    code = _command("check", name)
    lines = capsys.readouterr().err.splitlines()
    assert code == 2 and len(lines) == 2


def test_a_device_is_read_no_further_than_a_log_can_be_long(monkeypatch):
    monkeypatch.setattr("airtouch.logs.files.LARGEST_BYTES", 1 << 20)
    with pytest.raises(AirTouchError, match="too large for a flight log; split it"):
        logs.read("/dev/zero")


@pytest.mark.parametrize("header", [b"timestamp_ms,gyro.x,gyro.x", b"timestamp_ms,stateEstimate.ax,", b"t_s,t_s",
                                    b"timestamp_ms,gyro.x," + b"n" * 5000])
def test_names_that_repeat_or_lack_are_refused_in_every_csv(header):
    with pytest.raises(AirTouchError, match=r"made:2: column [23] .*; give each its own short name"):
        parse(b"\n" + header + b"\n1,2,3\n", "made")


def test_text_of_another_encoding_names_the_remedy():
    with pytest.raises(AirTouchError, match="UTF-16; save it as UTF-8"):
        parse(flying().decode().encode("utf-16"), "made")


@pytest.mark.parametrize("blank", [b"", b"  ", b"\t", b"\x0c", b"\r", b" \r\n"])
def test_lines_of_blanks_are_skipped_and_errors_name_the_line_after_them(blank):
    text = b"t_s,x_m\n" + blank + b"\n1,2\n" + blank + b"\n3,4\n"
    assert parse(text, "made")["x_m"].tolist() == [2, 4]
    line = (text.replace(b"\r\n", b"\n").replace(b"\r", b"\n")).count(b"\n") + 1
    with pytest.raises(AirTouchError, match=f"made:{line}: cell 2 holds 'x', not a number; correct or delete"):
        parse(text + b"5,x\n7,8\n", "made")


# uSD logs


def test_damaged_usd_headers_are_refused_with_the_remedy():
    variables = [(f"acc.{a}", "f") for a in "xyz"]
    twice = pack_log(2, [(1, "fixedFrequency", variables), (1, "other", variables[:1])], [])
    with pytest.raises(AirTouchError, match="two events have the number 1; copy it from the card again"):
        parse(twice, "log00")
    oversized = pack_log(2, [(1, "fixedFrequency", variables * 100)], [])
    with pytest.raises(AirTouchError, match="300 variables in one event.*; copy it"):
        parse(oversized, "log00")
    odd = pack_log(2, [(1, "fixedFrequency", [("a\nb" * 3000, "f")])], [(1, 0, [0.0])])
    with pytest.raises(AirTouchError, match="none of its variables is known") as error:
        parse(odd, "log00")
    assert str(error.value).isprintable() and len(str(error.value)) < 200


# Parquet


def _parquet(meta=b"{}", **columns):
    import io

    import pyarrow
    from pyarrow import parquet as writer

    sink = io.BytesIO()
    table = pyarrow.table({"t_s": [0.0, 0.01], **columns}).replace_schema_metadata({b"airtouch": meta})
    writer.write_table(table, sink)
    return sink.getvalue()


def test_parquet_columns_that_are_no_numbers_are_refused_not_guessed():
    """Text of digits was read as numbers, and dates as nanoseconds since 1970."""
    import datetime

    dates = [datetime.datetime(2026, 1, 1)] * 2
    for values in (["1.5", "2.5"], dates, [[1.0], [2.0]], [{"a": 1.0}] * 2, [b"1", b"2"]):
        with pytest.raises(AirTouchError, match="made: column 'zrange_m' holds .*, not numbers; leave it out"):
            parse(_parquet(zrange_m=values), "made")
    log = parse(_parquet(zrange_m=[None, 1], vbat_V=[True, None], x_m=[None, None]), "made")
    assert np.isnan(log["zrange_m"][0]) and log["vbat_V"][0] == 1 and np.isnan(log["x_m"]).all()
    log["zrange_m"][0] = 3.0  # a log's arrays can be written, whatever file they came from


def test_parquet_is_measured_before_it_is_unpacked(monkeypatch):
    monkeypatch.setattr("airtouch.logs.formats.parquet.LARGEST_BYTES", 1 << 20)
    with pytest.raises(AirTouchError, match="100000 rows of 2 columns are more than 1 GiB; split the log"):
        parse(HOSTILE["constant Parquet"](100_000), "made")
    footer = parquet(motion(40, 0.01, 0))
    claimed = footer[:-8] + struct.pack("<I", 2**31) + footer[-4:]
    with pytest.raises(AirTouchError, match="damaged Parquet file .*; copy or write it again"):
        parse(claimed, "made")


@pytest.mark.parametrize("meta", [b"\xff", b"[" * 5000, b"{", b"9" * 5000, b"[]", b'{"sample_period_s": 1e-300}'])
def test_odd_metadata_are_left_out_or_refused(meta):
    try:
        log = parse(_parquet(meta), "made")
        assert "sample_period_s" not in log.meta
    except AirTouchError as error:
        assert "damaged Parquet file" in str(error)


# packed files, and the commands that read raw logs elsewhere


def test_damaged_packed_data_in_the_public_flights_are_no_traceback(tmp_path):
    """A right gzip header before damaged data raises zlib.error, which is no ValueError."""
    path = tmp_path / "f.csv.gz"
    path.write_bytes(gzip.compress(b"1,2\n" * 100)[:10] + b"\xff" * 40)
    assert public.from_folder(tmp_path)("f.csv.gz", "0") is None


def test_recovery_leaves_out_rows_without_a_time_and_keeps_a_file_without_any(tmp_path):
    (tmp_path / "a_0001.csv.gz.part").write_bytes(b"t_s,zrange_m\n0,1\n,1\n0.01,1\n1e300,1\n0.02,1\n")
    (tmp_path / "b_0001.csv.gz.part").write_bytes(b"t_s,zrange_m\n,1\n,1\n")
    (recovered,), (unreadable,) = recover(tmp_path)
    assert logs.read(recovered)["t_s"].tolist() == [0, 0.01, 0.02]
    assert "b_0001.csv.gz.part: no row has a time" in unreadable and (tmp_path / "b_0001.csv.gz.part").exists()


# shapes, as long as is wanted


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_shapes_cost_no_more_than_their_size(name):
    """Work is bounded by the samples: no result is longer than 100 times the log (or 10,000 samples)."""
    try:
        log = parse(HOSTILE[name](3000), "made")
        logs.check(log)
        for rate in (50.0, 1000.0):
            assert len(logs.resample(log, rate)) <= max(100 * len(log), 10_000)
    except AirTouchError as error:
        assert str(error).startswith("made") and ";" in str(error) and len(str(error)) < 300


def test_metadata_of_a_file_are_kept_and_can_be_written_as_json():
    log = parse(canonical(motion(70, 0.01, 0)), "made")
    assert {key: log.meta[key] for key in META} == META | {"warnings": log.meta["warnings"]}
    assert log.meta["warnings"] == ["windy", "columns not in the schema, kept as they are: humidity"]
    json.dumps(logs.check(log).as_dict())


def _command(*arguments):
    """`airtouch logs ...` in this process through its entry point; the exit code."""
    before, sys.argv = sys.argv, ["airtouch", "logs", *map(str, arguments)]
    try:
        main()
    except SystemExit as ended:
        return ended.code or 0
    finally:
        sys.argv = before
    return 0
