"""A cache file that is damaged is one line that names it."""

import pytest

from airtouch.errors import AirTouchError
from airtouch.twin import cache


@pytest.mark.parametrize("text", [b"", b"[{", b"{}1", b"3", b"[3]", b'[{"file": "a"}]', b"\xff"])
def test_damaged_scores_are_one_line(tmp_path, text):
    (tmp_path / "scores.json").write_bytes(text)
    with pytest.raises(AirTouchError, match="scores.json"):
        cache.scores(tmp_path / "scores.json", list)


@pytest.mark.parametrize("data", [b"", b"PK", b"no model"])
def test_a_damaged_model_is_one_line(tmp_path, data):
    (tmp_path / "model.npz").write_bytes(data)
    with pytest.raises(AirTouchError, match="model.npz"):
        cache.model(tmp_path / "model.npz", lambda: None)
