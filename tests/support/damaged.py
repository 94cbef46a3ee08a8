"""Logs that were damaged on their way."""

from hypothesis import strategies as st

from airtouch.errors import AirTouchError
from airtouch.logs.files import parse


def is_read_or_refused(log: bytes, data: st.DataObject) -> None:
    """With a few bytes changed and its end cut off, as `data` draws, a log is read or refused in one line."""
    damaged = bytearray(log)
    for _ in range(data.draw(st.integers(1, 6))):
        damaged[data.draw(st.integers(0, len(damaged) - 1))] = data.draw(st.integers(0, 255))
    try:
        parse(bytes(damaged[: data.draw(st.integers(1, len(damaged)))]), "log00")
    except AirTouchError as error:
        assert "\n" not in str(error)
