"""The flight's file: there after a kill, after a full disk, never silently replaced."""

import os
import signal
import subprocess
import sys

import numpy as np
import pytest

from airtouch import logs
from airtouch.crazyflie import recorder
from airtouch.crazyflie.recorder import Recorder
from airtouch.errors import AirTouchError

NAMES = ["t_s", "zrange_m", "m1_pwm"]


def rows(times):
    return np.asarray(times, dtype=np.int64), {"zrange_m": np.asarray(times) / 1e4,
                                               "m1_pwm": np.arange(len(times)) * 1.0}


def test_rows_are_on_the_disk_at_once_and_sorted_at_the_end(tmp_path):
    book = Recorder(tmp_path / "a_0001.csv.gz", NAMES, {"mission": "a"})
    book.add(*rows([1000, 1010, 1040]))
    book.add(*rows([1030, 1040]))
    part = logs.read(book.part)
    assert list(part["t_s"]) == [1.0, 1.01, 1.04, 1.03, 1.04] and part.meta["mission"] == "a"
    log = book.finish(ended="as planned")
    stored = logs.read(book.path)
    assert list(stored["t_s"]) == [1.0, 1.01, 1.03, 1.04] == list(log["t_s"])
    assert stored.meta["lost_samples"] == stored.meta["doubled_samples"] == 1
    assert stored.meta["ended"] == "as planned"
    assert not book.part.exists()


def test_nothing_is_replaced_unasked(tmp_path):
    path = tmp_path / "a_0001.csv.gz"
    path.write_bytes(b"mine")
    with pytest.raises(AirTouchError, match="use --force"):
        Recorder(path, NAMES, {})
    path.unlink()
    book = Recorder(path, NAMES, {})
    with pytest.raises(AirTouchError, match="being recorded"):
        Recorder(path, NAMES, {})
    book.finish()
    assert list(tmp_path.iterdir()) == []  # a flight without a row leaves nothing


def test_force_does_not_touch_a_flight_that_is_being_recorded(tmp_path):
    path, files = tmp_path / "a_0001.csv.gz", len(os.listdir("/proc/self/fd"))
    book = Recorder(path, NAMES, {"mission": "a"})
    book.add(*rows([1000, 1010]))
    with pytest.raises(AirTouchError, match="another flight being recorded there.$"):
        Recorder(path, NAMES, {}, force=True)
    assert list(logs.read(book.part)["t_s"]) == [1.0, 1.01]
    book.finish()
    assert len(os.listdir("/proc/self/fd")) == files


def test_what_a_run_killed_under_force_left_gets_the_next_number(tmp_path):
    path = tmp_path / "a_0001.csv.gz"
    Recorder(path, NAMES, {}).finish()
    for times in ([0, 10], [1000, 1010, 1020]):  # a finished flight, then one that is to replace it and is killed
        book = Recorder(path, NAMES, {}, force=True)
        book.add(*rows(times))
        if len(times) == 2:
            book.finish()
    os.close(book._file)  # as by a kill
    received = book.part.read_bytes()
    with pytest.raises(AirTouchError, match="a_0001.csv.gz.part: an unfinished flight; .* --recover"):
        Recorder(path, NAMES, {}, force=True)
    assert book.part.read_bytes() == received
    assert recorder.recover(tmp_path) == ([tmp_path / "a_0002.csv.gz"], [])
    assert [len(logs.read(tmp_path / f"a_000{k}.csv.gz")) for k in (1, 2)] == [2, 3] and not book.part.exists()


def test_a_recovery_that_cannot_be_written_names_the_unfinished_file(tmp_path, monkeypatch):
    def full(log, path):
        raise AirTouchError(f"{path}: no room")

    (tmp_path / "a_0001.csv.gz.part").write_text("t_s,zrange_m\n0,1\n0.01,1\n")
    monkeypatch.setattr(logs, "write", full)
    (line,) = recorder.recover(tmp_path)[1]
    assert line.startswith(str(tmp_path / "a_0001.csv.gz.part: ")) and line.endswith("no room")
    assert (tmp_path / "a_0001.csv.gz.part").exists()


def test_the_next_number_is_above_those_in_the_folder(tmp_path):
    assert recorder.next_number(tmp_path, "edge") == 1
    for name in ("edge_0003.csv.gz", "edge_0007.csv.gz.part", "edge_x_0009.csv.gz", "manifest.csv"):
        (tmp_path / name).write_text("x")
    assert recorder.next_number(tmp_path, "edge") == 8


def test_a_full_disk_stops_the_file_and_not_the_flight(tmp_path):
    os.symlink("/dev/full", tmp_path / "a_0001.csv.gz.part")
    book = Recorder(tmp_path / "a_0001.csv.gz", NAMES, {}, force=True)
    assert "No space left" in book.error
    book.add(*rows([0, 10]))
    assert len(book.log()) == 2
    assert len(logs.read((book.finish(), book.path)[1])) == 2  # room elsewhere: the memory's copy is written whole


def test_a_killed_process_leaves_a_file_that_is_read_and_recovered(tmp_path):
    code = f"""
import sys, time, numpy as np
from pathlib import Path
from airtouch.crazyflie.recorder import Recorder
book = Recorder(Path({str(tmp_path)!r}) / "k_0001.csv.gz", {NAMES!r}, {{"mission": "k", "acc_frame": "body"}})
i = 0
while True:
    t = np.arange(i, i + 5)[::-1] * 10
    book.add(t, {{"zrange_m": t / 1e4, "m1_pwm": t * 1.0}})
    i += 6
    print(i, flush=True)
    time.sleep(0.005)
"""
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    for _ in range(40):
        rows_written = int(process.stdout.readline())
    assert recorder.recover(tmp_path) == ([], [])  # it is still being written
    process.send_signal(signal.SIGKILL)
    process.wait()
    part = next(tmp_path.glob("*.part"))
    with part.open("ab") as file:
        file.write(b"9.99,0.1")  # cut off in the middle of a row
    assert len(logs.read(part)) >= rows_written // 6 * 5 - 5
    ((path,), _) = recorder.recover(tmp_path)
    log = logs.read(path)
    assert not part.exists() and log.meta["mission"] == "k" and "killed" in log.meta["ended"]
    assert (np.diff(log["t_s"]) > 0).all() and log.meta["lost_samples"] == pytest.approx(len(log) / 5, abs=2)


def test_recovery_says_what_it_cannot_read_and_leaves_it(tmp_path):
    (tmp_path / "b_0001.csv.gz.part").write_text("")
    recovered, unreadable = recorder.recover(tmp_path)
    assert recovered == [] and "b_0001.csv.gz.part" in unreadable[0] and (tmp_path / "b_0001.csv.gz.part").exists()


def test_recovery_says_what_is_no_file(tmp_path):
    (tmp_path / "b_0001.csv.gz.part").mkdir()
    (tmp_path / "b_0002.csv.gz.part").symlink_to("nowhere")
    recovered, unreadable = recorder.recover(tmp_path)
    assert recovered == [] and ["_0001.csv.gz.part: cannot be read: Is a directory" in unreadable[0],
                                "_0002.csv.gz.part: cannot be read: No such file" in unreadable[1]] == [True, True]


def test_a_log_that_cannot_be_finished_stays_as_it_is(tmp_path):
    book = Recorder(tmp_path / "a_0001.csv.gz", NAMES, {})
    book.add(*rows([0, 10]))
    book.path.mkdir()
    with pytest.raises(AirTouchError, match="what was received is in .*a_0001.csv.gz.part: make room"):
        book.finish()
    assert len(logs.read(book.part)) == 2
