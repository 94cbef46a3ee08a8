"""A truncated CSV read by a column map: no number that the file before the cut did not have, and a warning."""

import gzip

import pytest

from airtouch.errors import AirTouchError
from airtouch.logs.formats import mapped

MAP = '[columns.t_s]\nfrom = "t"\n[columns.acc_z_mps2]\nfrom = "a"\n[columns.zrange_m]\nfrom = "z"\n'
HEIGHTS = [0.802 + 0.001 * (k % 7) for k in range(300)]
TEXT = "t,a,z\n" + "".join(f"{0.01 * k:.2f},9.81,{height:.3f}\n" for k, height in enumerate(HEIGHTS))


def read(tmp_path, data):
    (tmp_path / "map.toml").write_text(MAP)
    (tmp_path / "theirs.csv").write_bytes(data)
    return mapped.read(tmp_path / "theirs.csv", tmp_path / "map.toml")


@pytest.mark.parametrize("cut", range(1, len("2.99,9.81,0.807\n")))
def test_a_row_that_is_cut_off_anywhere_is_dropped(tmp_path, cut):
    log = read(tmp_path, TEXT[:-cut].encode())
    assert log["zrange_m"].tolist() == pytest.approx(HEIGHTS[:-1], abs=5e-4)
    assert log.meta["warnings"] == ["line 301 is cut off and was dropped"]


@pytest.mark.parametrize("share", [0.3, 0.5, 0.7, 0.9])
def test_a_gzip_file_that_is_cut_off_is_said_to_be(tmp_path, share):
    packed = gzip.compress(TEXT.encode())
    log = read(tmp_path, packed[:int(share * len(packed))])
    assert "the gzip file is cut off; what could be unpacked was read" in log.meta["warnings"]
    assert 0 < len(log) < 300 and log["zrange_m"].tolist() == pytest.approx(HEIGHTS[:len(log)], abs=5e-4)


def test_a_whole_file_gives_no_warning(tmp_path):
    assert read(tmp_path, TEXT.encode()).meta["warnings"] == []
    assert len(read(tmp_path, TEXT.replace("\n", "\r\n").encode())) == 300


def test_rows_with_other_numbers_of_cells_are_counted(tmp_path):
    lines = TEXT.splitlines(keepends=True)
    lines[5], lines[9] = "0.04,9.81\n", "0.08,9.81,0.803,7\n"
    assert read(tmp_path, "".join(lines).encode()).meta["warnings"] == [
        "2 of 300 rows have not the header's number of cells, 3"]


@pytest.mark.parametrize("text", ["", "t,a,z", "t,a,z\n", "t,a,z\n0.00,9.81,0.80"])
def test_without_a_complete_row_there_is_no_log(tmp_path, text):
    with pytest.raises(AirTouchError, match="no header and complete rows"):
        read(tmp_path, text.encode())


def test_a_mapped_name_that_occurs_twice_is_refused(tmp_path):
    with pytest.raises(AirTouchError, match="2 columns are called 'a'"):
        read(tmp_path, TEXT.replace("t,a,z", "t,a,z,a", 1).encode())
    assert len(read(tmp_path, TEXT.replace("t,a,z", "t,a,z,x,x", 1).encode())) == 300  # no business of the map


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_rows_that_an_unclosed_quotation_mark_takes_are_told_of(tmp_path, end):
    lines = TEXT.splitlines()
    lines[200] = lines[200].replace("9.81", '"9.81')
    log = read(tmp_path, (end.join(lines) + end).encode())
    assert len(log) == 200  # of 300
    warnings = [w for w in log.meta["warnings"] if "line end" in w]
    assert len(warnings) == 1 and warnings[0].startswith("cells with a line end in them: 1, the first '9.81,")
