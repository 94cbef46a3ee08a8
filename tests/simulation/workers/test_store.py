"""A folder of simulated flights whose own files are damaged."""

import json

import pytest

from airtouch.errors import AirTouchError
from airtouch.simulation.workers import store


def test_a_damaged_request_is_another_one(tmp_path):
    """Bytes that are no text in `run.json` ended in a traceback."""
    request = {"scenario": "paper-low", "seed": 1}
    store.open_folder(tmp_path, request)
    store.open_folder(tmp_path, request)
    (tmp_path / store.REQUEST).write_bytes(b"\xff\xfe{}")
    with pytest.raises(AirTouchError, match="another request; choose another --out, or --force"):
        store.open_folder(tmp_path, request)
    store.open_folder(tmp_path, request, force=True)
    assert json.loads((tmp_path / store.REQUEST).read_text()) == request


def test_a_damaged_list_of_diverged_flights_is_one_line(tmp_path):
    (tmp_path / store.FAILED).write_bytes(b"\xff\n")
    with pytest.raises(AirTouchError, match="diverged.jsonl: no text in UTF-8"):
        store.failures(tmp_path)
