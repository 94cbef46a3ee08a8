"""Tables of numbers against Python's own csv module and float()."""

import csv
import io

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from airtouch.errors import AirTouchError
from airtouch.logs.files import parse
from airtouch.logs.table import check_names, named_table, names_of, parse_table, sheet

CELL = st.one_of(st.floats(allow_nan=False).map(repr), st.integers(-10**9, 10**9).map(str), st.just(""),
                 st.sampled_from(["nan", "-inf", " 1.5 ", "1e-7", "+2", ".5", "3."]))
ROWS = st.integers(1, 6).flatmap(lambda k: st.lists(st.lists(CELL, min_size=k, max_size=k), min_size=1, max_size=8))


@settings(max_examples=300, deadline=None)
@given(ROWS)
def test_numbers_are_those_of_csv_and_float(rows):
    if len(rows[0]) == 1:  # a line of one empty cell is a blank line
        rows = [row for row in rows if row != [""]] or [["1"]]
    body = "".join(",".join(row) + "\n" for row in rows)
    expected = [[float(cell) if cell else np.nan for cell in row] for row in csv.reader(io.StringIO(body))]
    np.testing.assert_array_equal(parse_table(body.encode(), "a.csv", len(rows[0]), 1, []), expected)


@settings(max_examples=200, deadline=None)
@given(ROWS, st.data())
def test_a_bad_cell_is_named_with_its_line(rows, data):
    columns = len(rows[0])
    rows = [[cell or "0" for cell in row] for row in rows] + [["1"] * columns]  # the last line may be cut off
    line, cell = data.draw(st.integers(0, len(rows) - 2)), data.draw(st.integers(0, columns - 1))
    rows[line][cell] = data.draw(st.sampled_from(["x", "1_0", "--1", "0x10", "1,2"]))
    body = "".join(",".join(row) + "\n" for row in rows)
    with pytest.raises(AirTouchError, match=f"^a.csv:{5 + line}: ") as error:
        parse_table(body.encode(), "a.csv", columns, 5, [])
    assert "correct or delete that line" in str(error.value)


@settings(max_examples=200, deadline=None)
@given(st.lists(st.lists(st.integers(0, 999).map(str), min_size=3, max_size=3), min_size=2, max_size=6), st.data())
def test_a_cut_table_loses_its_last_line_at_most(rows, data):
    """Whatever is missing at the end of the file: the whole lines are read as they stand."""
    body = "".join(",".join(row) + "\n" for row in rows)
    last = len(",".join(rows[-1])) + 1
    cut = data.draw(st.integers(0, last))
    beginning = body[:len(body) - cut]
    warnings = []
    values = parse_table(beginning.encode(), "a.csv", 3, 7, warnings)
    np.testing.assert_array_equal(values, np.array(rows[:-1] if cut else rows, float))
    assert warnings == ([f"line {6 + len(rows)} is cut off and was dropped"] if 0 < cut < last else [])


@settings(max_examples=200, deadline=None)
@given(st.lists(st.sampled_from(["# vehicle: x", "#", "", "  ", "   # deep"]), max_size=5),
       st.sampled_from(["a,b", "1,2", ""]), st.lists(st.sampled_from(["3,4", "", "# late"]), max_size=3))
def test_the_parts_of_a_sheet_are_its_lines(head, first, other_lines):
    text = "\n".join([*head, first, *other_lines])
    lines = text.split("\n")
    begin = next((k for k, line in enumerate(lines) if line.strip() and not line.strip().startswith("#")), None)
    parts = sheet(text.encode())
    if begin is None:
        assert parts.first == b"" and not parts.rest.strip(b"\n# late")
        return
    assert parts.first.decode() == lines[begin] and parts.line == begin + 1
    assert parts.rest.decode() == "\n".join(lines[begin + 1:])
    assert [c.decode() for c in parts.comments] == [s.strip() for s in lines[:begin] if s.strip().startswith("#")]


@pytest.mark.parametrize(("header", "message"), [
    (b"a,,c", "column 2 has no name"), (b"a,b,a", "column 3 has another one's name"),
    (b"a,b\x07", "column 2 is not printable"), (b"a," + b"x" * 101, "column 2 has too long a name"),
    (b",".join([b"n"] * 400), "more than 256 columns")])
def test_bad_names_are_refused(header, message):
    with pytest.raises(AirTouchError, match=message):
        check_names(names_of(header), "a.csv:1")


def test_columns_have_the_headers_names_and_empty_cells_are_nan():
    table = named_table(sheet(b"# c\nx, y\n1,2\n3,\n"), "a.csv", [])
    assert list(table) == ["x", "y"]
    np.testing.assert_array_equal(table["x"], [1, 3])
    np.testing.assert_array_equal(table["y"], [2, np.nan])


def test_a_first_column_without_a_name_is_left_out():
    """pandas' to_csv writes its row numbers so; the file was taken for one without a header."""
    frame = pandas_csv({"t_s": [0.0, 0.01], "acc_x_mps2": [1.5, 2.5]})
    assert frame.startswith(b",t_s,")
    log = parse(frame, "made.csv")
    assert log.meta["format"] == "canonical" and log.meta["warnings"] == []
    assert {name: values.tolist() for name, values in log.columns.items()} == {"t_s": [0.0, 0.01],
                                                                               "acc_x_mps2": [1.5, 2.5]}
    with pytest.raises(AirTouchError, match="column 3 has another one's name"):
        parse(frame.replace(b"acc_x_mps2", b"t_s"), "made.csv")
    with pytest.raises(AirTouchError, match="unknown header"):
        parse(pandas_csv({"time": [0.0, 0.01], "ax": [1.5, 2.5]}), "made.csv")


def pandas_csv(columns):
    pandas = pytest.importorskip("pandas")
    return pandas.DataFrame(columns).to_csv().encode()
