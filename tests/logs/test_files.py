"""Files as they are written: rights, links and devices, against what the system says of them."""

import os
import stat
import subprocess
import sys

import pytest

from airtouch.errors import AirTouchError
from airtouch.logs.files import check_free, write_bytes


@pytest.mark.parametrize("mask", [0o022, 0o077, 0o002])
def test_a_new_file_has_the_rights_that_any_program_gives(tmp_path, mask):
    before = os.umask(mask)
    try:
        write_bytes(b"ours", tmp_path / "ours")
        (tmp_path / "theirs").write_bytes(b"theirs")
    finally:
        os.umask(before)
    assert (tmp_path / "ours").stat().st_mode == (tmp_path / "theirs").stat().st_mode


@pytest.mark.parametrize("there", [True, False])
def test_a_link_stays_and_its_file_is_written(tmp_path, there):
    (tmp_path / "far").mkdir()
    target, link = tmp_path / "far" / "flight.csv", tmp_path / "link.csv"
    if there:
        target.write_bytes(b"old")
    link.symlink_to(target)
    if there:
        with pytest.raises(AirTouchError, match="exists already"):
            write_bytes(b"new", link)
    check_free(link, force=True)
    write_bytes(b"new", link, force=True)
    assert link.is_symlink() and target.read_bytes() == b"new" and not target.is_symlink()
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["far", "flight.csv", "link.csv"]


def test_a_name_that_is_too_long_is_one_line(tmp_path):
    with pytest.raises(AirTouchError, match="cannot be written: File name too long"):
        write_bytes(b"x", tmp_path / ("n" * 300))


@pytest.mark.parametrize("force", [False, True])
def test_what_is_no_file_is_never_replaced(tmp_path, force):
    """With --force root would have had a file for a device."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for place, reason in ((pipe, "device or a pipe"), (tmp_path, "is a folder")):
        for refuse in (lambda p: check_free(p, force), lambda p: write_bytes(b"x", p, force)):
            with pytest.raises(AirTouchError, match=reason):
                refuse(place)
    assert stat.S_ISFIFO(pipe.stat().st_mode) and os.listdir(tmp_path) == ["pipe"]


def test_null_and_the_standard_output_are_written_to(tmp_path):
    code = ("import pathlib; from airtouch.logs.files import check_free, write_bytes as w; print('first', flush=True); "
            "[check_free(pathlib.Path(p), False) or w(b'data', pathlib.Path(p)) "
            "for p in ('/dev/null', '/dev/stdout')]")
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, check=True).stdout == b"first\ndata"
    with (tmp_path / "out").open("wb") as out:
        subprocess.run([sys.executable, "-c", code], stdout=out, check=True)
    assert (tmp_path / "out").read_bytes() == b"first\ndata"
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode)
