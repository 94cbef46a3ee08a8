"""Recording of a session's rows as one flight log."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from airtouch.logs import files
from airtouch.logs.flight_log import COLUMNS, FlightLog
from airtouch.sitl.faults import Fault

DECIMALS = 6


class Recorder:
    """The recording: `add` each row (33,), `write` at the end. Raises AirTouchError if it cannot be written."""

    def __init__(self, path: Path, meta: Mapping[str, Any], force: bool) -> None:
        """meta: the log's metadata without its `source` and `faults`."""
        files.check_free(path, force)
        self._path, self._force = path, force
        self._rows: list[np.ndarray] = []
        self._faults: list[dict[str, Any]] = []
        self._meta = {**meta, "faults": self._faults}

    def add(self, row: np.ndarray) -> None:
        """Append a row (33,) of 10 ms."""
        self._rows.append(row.copy())

    def add_fault(self, fault: Fault, now_s: float) -> None:
        """Name a fault that begins now in the metadata `faults`: kind, t_s and, if it has them, its other values."""
        values = {"amount": fault.amount, "all_packets": fault.all_packets}
        begun = {"kind": fault.kind, "t_s": round(now_s, DECIMALS)}
        self._faults.append(begun | {name: value for name, value in values.items() if value})

    def write(self) -> None:
        """Write the file, whole or not at all. Without rows no file is written."""
        if not self._rows:
            return
        table = np.round(np.array(self._rows), DECIMALS)
        meta = {"source": self._path.name, **self._meta}
        log = FlightLog({c: table[:, i] for i, c in enumerate(COLUMNS)}, meta)
        files.write(log, self._path, force=self._force)
