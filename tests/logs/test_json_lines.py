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


def test_bytes_that_are_no_text_are_one_line(tmp_path):
    path = tmp_path / "kept.jsonl"
    path.write_bytes(b'{"flight": "a"}\n{"flight": "\xff"}\n')
    with pytest.raises(AirTouchError, match="kept.jsonl: no text in UTF-8 .at byte 28"):
        json_lines.read(path)
