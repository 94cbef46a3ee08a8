"""The file to which a long run appends: what was appended is read again, and anything else is refused with its line."""

import pytest

from airtouch.errors import AirTouchError
from airtouch.logs import json_lines


def test_what_was_appended_is_read_again(tmp_path):
    path = tmp_path / "kept.jsonl"
    assert json_lines.read(path) == [] and json_lines.read(None) == []
    json_lines.append(path, [{"flight": "a"}, {"flight": "\u00fc", "share": 0.1}])
    json_lines.append(path, [{"flight": "c"}])
    json_lines.append(None, [{"flight": "d"}])
    assert json_lines.read(path) == [{"flight": "a"}, {"flight": "\u00fc", "share": 0.1}, {"flight": "c"}]


@pytest.mark.parametrize("line", ['{"flight": "b"', "3", "[1, 2]", ""])
def test_a_line_that_is_no_object_is_named(line, tmp_path):
    path = tmp_path / "kept.jsonl"
    path.write_text('{"flight": "a"}\n' + line + "\n")
    with pytest.raises(AirTouchError, match="line 2 is no JSON object; remove"):
        json_lines.read(path)


@pytest.mark.parametrize("cut", range(1, len('{"flight": "b", "share": 0.1}\n')))
def test_a_run_that_was_killed_in_mid_line_goes_on(cut, tmp_path):
    """Read back, then append what was missing: each object is there once, wherever the kill cut the last line."""
    path = tmp_path / "kept.jsonl"
    last = {"flight": "b", "share": 0.1}
    json_lines.append(path, [{"flight": "a"}, last])
    whole = path.read_bytes()
    path.write_bytes(whole[:len(whole) - cut])
    there = json_lines.read(path)
    assert there == [{"flight": "a"}, *([last] if cut == 1 else [])]  # without its end alone it is whole
    json_lines.append(path, [one for one in (last,) if one not in there])
    assert path.read_bytes() == whole and json_lines.read(path) == [{"flight": "a"}, last]


@pytest.mark.parametrize("line", ["3", "x", '{"flight": "b"'])
def test_a_line_without_an_end_is_refused_where_no_kill_made_it(line, tmp_path):
    path = tmp_path / "kept.jsonl"
    path.write_text('{"flight": "a"}\n' + (line if line[0] != "{" else line + "\n"))
    with pytest.raises(AirTouchError, match="line 2 is no JSON object"):
        json_lines.read(path)


def test_bytes_that_are_no_text_are_one_line(tmp_path):
    path = tmp_path / "kept.jsonl"
    path.write_bytes(b'{"flight": "a"}\n{"flight": "\xff"}\n')
    with pytest.raises(AirTouchError, match="kept.jsonl: no text in UTF-8 .at byte 28"):
        json_lines.read(path)
