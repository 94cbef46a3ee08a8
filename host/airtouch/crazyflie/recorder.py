"""Recording of a flight. Each row is written to `NAME.part` at once, and the whole log to `NAME` at the end.

`NAME.part` is a canonical CSV that `airtouch logs` reads, also when it is truncated. Its rows are in order of
arrival; those of the finished file are sorted. A full disk ends the writing, not the flight.
"""

import fcntl
import json
import os
import stat
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from airtouch import logs
from airtouch.crazyflie.connection.ticks import gaps, in_order
from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import COLUMNS, FlightLog

SUFFIX, PART = ".csv.gz", ".part"
LEAST_FREE_BYTES = 50 * 2**20  #: a minute of flight takes about 2 MB while it is recorded


def flight_path(folder: Path, name: str, number: int) -> Path:
    """The file of a flight."""
    return folder / f"{name}_{number:04d}{SUFFIX}"


def next_number(folder: Path, name: str) -> int:
    """The number after the highest of all flights of this name in the folder, finished or not; at least 1."""
    numbers = [0]
    for path in folder.glob(f"{name}_*"):
        number = path.name.removeprefix(f"{name}_").removesuffix(PART).removesuffix(SUFFIX)
        numbers += [int(number)] if number.isdigit() else []
    return max(numbers) + 1


class Recorder:
    """The file of one flight. Raises AirTouchError if it cannot be opened.

    error: why writing stopped, else None. Rows stay in memory in any case.
    """

    def __init__(self, path: Path, names: list[str], meta: Mapping[str, Any], force: bool = False) -> None:
        if path.exists() and not force:
            raise AirTouchError(f"{path}: exists already; use --force to replace it")
        self.path, self.part = path, path.with_name(path.name + PART)
        self.names = [name for name in COLUMNS if name in names]
        self.meta = dict(meta)
        self.error: str | None = None
        self._rows: list[np.ndarray] = []
        self._times: list[np.ndarray] = []
        try:
            self._file = _open_locked(self.part)
        except OSError as error:
            raise AirTouchError(f"{self.part}: cannot be written: {error.strerror}; is another flight being "
                                "recorded there?") from None
        header = [f"# {key}: {json.dumps(value, default=str)}" for key, value in self.meta.items()]
        self._write("\n".join([*header, ",".join(self.names)]) + "\n")

    def add(self, times_ms: np.ndarray, columns: Mapping[str, np.ndarray]) -> None:
        """Append rows: the drone's clock (n,) in ms and SI columns (n,). Never raises."""
        columns = {**columns, "t_s": times_ms / 1000.0}
        table = np.column_stack([columns[name] for name in self.names])
        self._rows.append(table)
        self._times.append(np.asarray(times_ms, dtype=np.int64))
        if self.error is None:
            self._write("".join(",".join(f"{v:.10g}" for v in row) + "\n" for row in table))

    def log(self, **meta: Any) -> FlightLog:
        """All rows so far, sorted by time, with the gaps in the metadata."""
        times = np.concatenate([np.empty(0, np.int64), *self._times])
        table = np.concatenate([np.empty((0, len(self.names))), *self._rows])
        order = in_order(times)
        missing = gaps(times[order])
        counted = {"lost_samples": sum(g.lost for g in missing),
                   "longest_gap_s": max((g.seconds for g in missing), default=0.0),
                   "doubled_samples": int(len(times) - len(order))}
        return FlightLog({name: table[order, i] for i, name in enumerate(self.names)},
                         {"source": str(self.path), "format": "canonical", **self.meta, **counted, **meta})

    def finish(self, **meta: Any) -> FlightLog:
        """Write the whole log and remove the unfinished file. Without rows only remove it.

        Raises AirTouchError if the log cannot be written; the unfinished file then stays.
        """
        log = self.log(**meta)
        if len(log):
            try:
                logs.write(log, self.path, force=True)
            except AirTouchError as error:
                self._close()
                raise AirTouchError(f"{error}; what was received is in {self.part}: make room, then "
                                    "airtouch collect --recover") from None
        self._close()
        self.part.unlink(missing_ok=True)
        return log

    def _write(self, text: str) -> None:
        data = text.encode()
        try:
            whole = os.lseek(self._file, 0, os.SEEK_END)
            while data:
                data = data[os.write(self._file, data):]
        except OSError as error:
            self.error = f"{self.part}: {error.strerror}"
            try:
                os.ftruncate(self._file, whole)
            except (OSError, UnboundLocalError):
                pass  # the reader drops a truncated last line

    def _close(self) -> None:
        os.close(self._file)


def _open_locked(part: Path) -> int:
    """A descriptor of the empty, locked file.

    Raises OSError if another process holds the lock, and AirTouchError if the file holds what a killed flight left.
    """
    file = os.open(part, os.O_WRONLY | os.O_CREAT, 0o644)
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        status = os.fstat(file)
        if stat.S_ISREG(status.st_mode) and status.st_size:
            raise AirTouchError(f"{part}: an unfinished flight; finish it with airtouch collect --recover, or remove "
                                "it")
    except (OSError, AirTouchError):
        os.close(file)
        raise
    return file


def _free_path(part: Path) -> Path:
    """The file that an unfinished file becomes: that of its own number, or of the next free one if there is such."""
    path = part.with_name(part.name.removesuffix(PART))
    if not path.exists():
        return path
    name = path.name.removesuffix(SUFFIX).rpartition("_")[0] or "flight"
    return flight_path(part.parent, name, next_number(part.parent, name))


def recover(folder: Path) -> tuple[list[Path], list[str]]:
    """Finish the unfinished files that killed runs left in a folder. Returns the files, and a line for each failure.

    Where the number has a finished flight, as after a kill under --force, it gets the next free one. Files that
    another process still writes are skipped. Files that cannot be read stay as they are.
    """
    finished, unreadable = [], []
    for part in sorted(folder.glob(f"*{SUFFIX}{PART}")):
        try:
            file = part.open("rb")
        except OSError as error:  # a folder, a link to nothing
            unreadable.append(f"{part}: cannot be read: {error.strerror}")
            continue
        with file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                continue
        path = _free_path(part)
        try:
            log = logs.read(part)
            timed = np.flatnonzero(np.isfinite(log["t_s"]))
            if not len(timed):
                raise AirTouchError(f"{part}: no row has a time; correct t_s")
            order = timed[in_order(np.round(log["t_s"][timed] * 1000.0).astype(np.int64))]
            whole = FlightLog({name: values[order] for name, values in log.columns.items()}, dict(log.meta))
            missing = gaps(np.round(whole["t_s"] * 1000.0))
            whole.meta |= {"ended": "the process was killed", "lost_samples": sum(g.lost for g in missing),
                           "longest_gap_s": max((g.seconds for g in missing), default=0.0)}
        except AirTouchError as error:
            unreadable.append(str(error))
            continue
        try:
            logs.write(whole, path)
        except AirTouchError as error:
            unreadable.append(f"{part}: {error}")
            continue
        finished.append(path)
        part.unlink()
    return finished, unreadable
