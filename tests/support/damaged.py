"""Logs that were damaged on their way."""

import numpy as np
from hypothesis import strategies as st

from airtouch.errors import AirTouchError
from airtouch.logs.files import parse


def is_read_or_refused(whole: bytes, data: st.DataObject) -> None:
    """With a few bytes changed and its end cut off, as `data` draws, a log is read or refused in one line.

    What is read has rows, one value of each column in each, and no infinity; a refusal names the file.
    """
    damaged = bytearray(whole)
    for _ in range(data.draw(st.integers(1, 6))):
        damaged[data.draw(st.integers(0, len(damaged) - 1))] = data.draw(st.integers(0, 255))
    try:
        log = parse(bytes(damaged[: data.draw(st.integers(1, len(damaged)))]), "log00")
    except AirTouchError as error:
        assert str(error).startswith("log00") and "\n" not in str(error)
        return
    assert len(log) > 0
    for name, values in log.columns.items():
        assert values.shape == (len(log),) and not np.isinf(values).any(), name
