"""The path a log file takes through the package, with everything checked on the way that must hold."""

import importlib
import json
import math
import re
import warnings
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import TypeVar

import numpy as np
from click.testing import CliRunner

from airtouch import logs
from airtouch.cli import airtouch
from airtouch.errors import AirTouchError
from airtouch.logs.files import parse
from airtouch.logs.flight_log import FlightLog
from airtouch.logs.formats import canonical
from airtouch.logs.formats.thrust_stand import read_thrust_stand

importlib.import_module("scipy.signal")  # its import counts for no input

#: Hz to which a log is resampled
RATES = (100.0, 100.0, 50.0, 7.3, 250.0, 1000.0, 10000.0)
LONGEST_MESSAGE = 450  #: characters of an error or warning, beside the file's name
T = TypeVar("T")  #: of what `_or_refusal` returns


def walk(data: bytes, source: str, r: Random) -> str:
    """Read, check, segment, resample and now and then write again: "log" or "refused".

    Raises AssertionError for what must not be; any exception but AirTouchError passes through.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        log = _or_refusal(lambda: parse(data, source), source)
        if log is None:
            return "refused"
        _sound(log)
        _use(log)
        resampled = _or_refusal(lambda: logs.resample(log, r.choice(RATES)), source)
        if resampled is not None:
            _sound(resampled)
            assert len(resampled) <= max(100 * len(log), 10_000), (len(resampled), len(log))
            if r.random() < 0.1:
                _use(resampled)
        if r.random() < 0.03:
            written = _or_refusal(lambda: canonical.to_bytes(log), source)  # a column of Parquet may be named "a,b"
            if written is not None:
                _same(parse(written, source), log)
    return "log"


def stand(path: Path) -> str:
    """A thrust-stand run read: "log" or "refused"."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run = _or_refusal(lambda: read_thrust_stand(path), str(path))
        assert run is None or all(v.ndim == 1 and v.dtype == np.float64 for v in run.values())
    return "refused" if run is None else "log"


def command(arguments: list[str], path: Path) -> None:
    """`airtouch logs ...` on a file: exit code 0, or 2 with one line that names the file; never a traceback."""
    result = CliRunner().invoke(airtouch, ["logs", *arguments])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    assert result.exit_code in (0, 2), result.exit_code
    lines = result.stderr.splitlines()
    assert len(lines) == (2 if result.exit_code else 1), result.stderr
    if result.exit_code:
        _clear(lines[0].removeprefix("airtouch: "), str(path))


def _or_refusal(act: Callable[[], T], source: str) -> T | None:
    """The result of `act`, or None if it refuses with a well-formed AirTouchError."""
    try:
        return act()
    except AirTouchError as error:
        _clear(str(error), source)
        return None


def _clear(message: str, source: str) -> None:
    """A refusal is one printable line that begins with the file and has a remedy."""
    assert message.startswith(source), message
    assert message.isprintable() and len(message) < LONGEST_MESSAGE + len(source), message
    assert ";" in message, f"no remedy: {message}"
    assert "not a table of numbers" not in message, f"no place: {message}"


def _sound(log: FlightLog) -> None:
    """Columns (n,) float64 of one length, n >= 1, finite or NaN; metadata of the right kinds."""
    assert log.columns and len(log) >= 1
    for name, values in log.columns.items():
        assert isinstance(name, str) and values.dtype == np.float64 and values.shape == (len(log),), name
        assert not np.isinf(values).any(), name
    assert isinstance(log.meta["warnings"], list) and all(isinstance(w, str) for w in log.meta["warnings"])
    assert log.meta["acc_frame"] in ("body", "world") if "acc_frame" in log.meta else True
    period = log.meta.get("sample_period_s", 0.01)
    assert isinstance(period, (int, float)) and math.isfinite(period) and 1e-4 <= period <= 10


def _use(log: FlightLog) -> None:
    """The quality report; its phases are those of `segments` and cover the log without holes."""
    report = logs.check(log)
    json.dumps(report.as_dict())
    for warning in report.warnings:
        assert warning.isprintable() and len(warning) < LONGEST_MESSAGE, warning
    parts = report.segments or _or_refusal(lambda: logs.segments(log), log.source)
    if parts is not None:
        bounds = [0, *[part.stop for part in parts]]
        assert bounds[-1] == len(log) and [part.start for part in parts] == bounds[:-1]


def _same(back: FlightLog, log: FlightLog) -> None:
    """What was written is read back exactly."""
    assert set(back.columns) == set(log.columns)
    for name, values in log.columns.items():
        np.testing.assert_array_equal(back[name], values, err_msg=re.escape(name[:40]))
