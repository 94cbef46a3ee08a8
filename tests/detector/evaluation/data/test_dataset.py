"""Manifests, good and bad."""

import pytest

from airtouch.detector.evaluation.data.dataset import Condition, collect, not_taken, read_manifest
from airtouch.errors import AirTouchError

HEADER = "file,use,fold,height,angle_deg,wind,speed_mps\n"


def folder(tmp_path, text):
    (tmp_path / "manifest.csv").write_text(text)
    for name in ("a.csv", "b.csv", "c.csv.gz"):
        (tmp_path / name).write_text("1,2,3\n")
    return tmp_path


def test_files_have_the_conditions_of_their_manifest(tmp_path):
    place = folder(tmp_path, HEADER + "a.csv,clean,3,h79,-10,none,0.35\nb.csv,messy,,,,,\n")
    assert read_manifest(place / "manifest.csv")["a.csv"] == Condition("clean", 3, "h79", -10.0, "none", 0.35)
    assert [f.path.name for f in collect([place])] == ["a.csv"]
    dataset = collect([place / "a.csv", place / "b.csv", place], speed_mps=0.2)
    assert [f.path.name for f in dataset] == ["a.csv", "b.csv"]
    assert [f.condition.speed_mps for f in dataset] == [0.35, 0.2]


def test_without_manifest_every_log(tmp_path):
    place = folder(tmp_path, "")
    (place / "manifest.csv").unlink()
    assert [f.path.name for f in collect([place])] == ["a.csv", "b.csv", "c.csv.gz"]


@pytest.mark.parametrize(("text", "message"), [
    ("name,use\nx,clean\n", ":1: no column 'file'"),
    (HEADER + "a.csv,clean,three,,,,\n", ":2: fold is 'three'"),
    (HEADER + "a.csv,clean,0,,,,fast\n", ":2: speed_mps is 'fast'"),
    (HEADER + "a.csv,clean,0,,,,-1\n", "above 0"),
    (HEADER + "a.csv,clean,0,,,,nan\n", "speed_mps is 'nan', a finite number"),
    (HEADER + "a.csv,clean,0,low,nan,none,0.3\n", ":2: angle_deg is 'nan', a finite number"),
    (HEADER + "a.csv,clean,0,low,-inf,none,0.3\n", ":2: angle_deg is '-inf', a finite number"),
    (HEADER + "a.csv,clean,1.5,,,,\n", ":2: fold is '1.5', a whole number"),
    (HEADER + "a.csv,clean,0,,,,1\na.csv,clean,0,,,,1\n", ":3: a.csv is listed twice"),
    (HEADER + ",clean,0,,,,1\n", ":2: empty file name"),
    ("", "no column 'file'"),
])
def test_bad_manifest_says_where(tmp_path, text, message):
    with pytest.raises(AirTouchError, match="manifest.csv") as error:
        collect([folder(tmp_path, text)])
    assert message in str(error.value) and "\n" not in str(error.value)


def test_a_fold_as_pandas_writes_it_is_whole(tmp_path):
    place = folder(tmp_path, HEADER + "a.csv,clean,1.0,,,,\nb.csv,clean,,,,,\n")
    folds = [condition.fold for condition in read_manifest(place / "manifest.csv").values()]
    assert folds == [1, None] and isinstance(folds[0], int)


def test_a_manifest_that_is_no_text_is_refused(tmp_path):
    (tmp_path / "manifest.csv").write_bytes(b"\xff\xfe\x00file")
    with pytest.raises(AirTouchError, match="cannot be read"):
        collect([tmp_path])


@pytest.mark.parametrize("row", ["sub/c.csv", "./c.csv"])
def test_a_flight_in_a_folder_of_the_manifests_folder_has_its_condition(tmp_path, row):
    place = folder(tmp_path, HEADER + f"{row},clean,1,low,30,fan,0.3\n")
    (place / row).parent.mkdir(exist_ok=True)
    (place / row).write_bytes((place / "a.csv").read_bytes())
    (file,) = collect([place])
    assert file.path == place / row and file.condition.height == "low" and file.condition.speed_mps == 0.3
    assert not_taken([place])["not in the manifest"] == 3  # a.csv, b.csv and c.csv.gz


def test_a_missing_file_and_an_empty_folder_are_refused(tmp_path):
    with pytest.raises(AirTouchError, match="no such file"):
        collect([tmp_path / "none"])
    with pytest.raises(AirTouchError, match="no flights"):
        collect([tmp_path])
