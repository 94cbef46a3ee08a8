"""What is written is read back exactly; any bytes give a log or one clear line."""

import gzip
import sys
import time
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from airtouch import logs
from airtouch.errors import AirTouchError
from airtouch.logs.files import parse
from airtouch.logs.flight_log import COLUMNS, FlightLog
from airtouch.logs.formats import canonical, parquet

NAMES = st.lists(st.sampled_from([*COLUMNS, "extra", "my column"]), min_size=1, max_size=6, unique=True)
LARGEST = float(np.finfo(np.float32).max)  # more than that is no reading
VALUES = st.floats(-LARGEST, LARGEST, width=64) | st.just(np.nan)
TIMES = st.floats(0, 2.5, width=64) | st.just(np.nan)  # within reach of one another, however few
META = st.dictionaries(st.sampled_from(["vehicle", "condition", "note_2", "seed"]),
                       st.one_of(st.text(), st.integers(), st.booleans(),
                                 st.lists(st.floats(allow_nan=False))))


@st.composite
def flight_logs(draw):
    rows = draw(st.integers(1, 8))
    columns = {n: draw(arrays(np.float64, rows, elements=TIMES if n == "t_s" else VALUES)) for n in draw(NAMES)}
    if not set(columns) & set(COLUMNS):
        columns["t_s"] = np.arange(rows, dtype=float)
    return FlightLog(columns, {"source": "a.csv", "format": "made", **draw(META)})


def assert_same(back, log):
    assert set(back.columns) == set(log.columns)
    for name, values in log.columns.items():
        np.testing.assert_array_equal(back[name], values)
        finite = ~np.isnan(values)
        np.testing.assert_array_equal(np.signbit(back[name])[finite], np.signbit(values)[finite])
    for key, value in log.meta.items():
        if key not in ("source", "format"):
            assert back.meta[key] == value
    assert back.meta["origin"] == "a.csv"


@settings(deadline=None)
@given(flight_logs(), st.booleans())
def test_a_canonical_file_gives_the_log_back(log, compress):
    assert_same(parse(canonical.to_bytes(log, compress), "b.csv"), log)


@settings(deadline=None, max_examples=50)
@given(flight_logs())
def test_a_parquet_file_gives_the_log_back(log):
    pytest.importorskip("pyarrow")
    assert_same(parse(parquet.to_bytes(log), "b.parquet"), log)


def test_parquet_without_pyarrow_names_the_remedy(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(AirTouchError, match=r"pip install airtouch\[parquet\]"):
        parquet.to_bytes(FlightLog({"t_s": np.zeros(2)}))


def test_write_is_whole_or_not_at_all(tmp_path):
    log = FlightLog({"t_s": np.arange(3.0)}, {"source": "x"})
    for name in ("a.csv", "a.csv.gz"):
        logs.write(log, tmp_path / name)
        with pytest.raises(AirTouchError, match="force=True"):
            logs.write(log, tmp_path / name)
        logs.write(log, tmp_path / name, force=True)
        np.testing.assert_array_equal(logs.read(tmp_path / name)["t_s"], log["t_s"])
    assert gzip.decompress((tmp_path / "a.csv.gz").read_bytes()) == (tmp_path / "a.csv").read_bytes()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.csv", "a.csv.gz"]
    for place, message in ((tmp_path / "a.txt", "unknown kind"),
                           (tmp_path / "no" / "a.csv", "cannot be written")):
        with pytest.raises(AirTouchError, match=message):
            logs.write(log, place)
    with pytest.raises(AirTouchError, match="without columns"):
        logs.write(FlightLog({}), tmp_path / "b.csv")


def test_missing_file_and_folder_say_so(tmp_path):
    for path in (tmp_path / "none.csv", tmp_path, "bad\0name"):
        with pytest.raises(AirTouchError, match="cannot be read"):
            logs.read(path)


HEADERS = st.sampled_from([b"", b"\x1f\x8b", b"PAR1", b"\xbc\x02\x00", b"\xbc\x01\x00\x01\x00", b"# a: [[\n",
                           b"t_s,zrange_m\n", b"timestamp_ms,stateEstimate.ax\n", b"timestamp_ms,gyro.x\n",
                           b"1,2,3,4,5,6\n", b"0,0,1,0,0,0,0,1\n", b",t_s\n", b"t_s,t_s\n1,2\n"])
TABLES = st.text(alphabet="0123456789.,-+e\n\r nainfNAx_#:\u00b2\u0661", max_size=200).map(str.encode)


@settings(max_examples=400, deadline=None)
@given(HEADERS, st.one_of(st.binary(max_size=300), TABLES), st.booleans())
def test_any_bytes_give_a_log_or_one_line(head, tail, zipped):
    data = gzip.compress(head + tail) if zipped else head + tail
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            log = parse(data, "fuzz")
        except AirTouchError as error:
            assert str(error).startswith("fuzz") and "\n" not in str(error)
            return
        assert len(log) >= 1 and log.columns
        logs.check(log)


@pytest.mark.parametrize("data", [
    b"\n" * 1_000_000 + b"t_s,zrange_m\n0,1\n",
    b"# a\n" * 300_000 + b"t_s,zrange_m\n0,1\n",
    b"# a: b\n\ntimestamp_ms,gyro.x,gyro.y,gyro.z\n0,1,2,3\n",
    b"t_s," + b",".join(b"c%d" % i for i in range(100_000)) + b"\n",
    b"1," * 500_000,
    b"[" * 100_000,
    b"# a: " + b"[" * 100_000 + b"\nt_s\n1\n",
], ids=["blank lines", "comments", "comments before variables", "columns", "cells", "no line", "deep meta"])
def test_odd_shapes_are_read_or_refused_at_once(data):
    start = time.process_time()
    try:
        assert len(parse(data, "odd")) == 1
    except AirTouchError as error:
        assert str(error).startswith("odd") and len(str(error)) < 300
    assert time.process_time() - start < 5


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_damaged_parquet_never_crashes(data):
    pytest.importorskip("pyarrow")
    sound = FlightLog({"t_s": np.arange(50.0), "zrange_m": np.ones(50)}, {"source": "a"})
    log = bytearray(parquet.to_bytes(sound))
    for _ in range(data.draw(st.integers(1, 4))):
        log[data.draw(st.integers(4, len(log) - 1))] = data.draw(st.integers(0, 255))
    try:
        parse(bytes(log), "damaged")
    except AirTouchError as error:
        assert "\n" not in str(error)
