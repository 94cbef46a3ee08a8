"""A folder of simulated flights keeps what the simulator did not write, and may hold damaged files of its own."""

import csv
import json
import re
from importlib import resources
from unittest import mock

import pytest
from click.testing import CliRunner

import airtouch
from airtouch import logs
from airtouch.cli.simulate import command
from airtouch.errors import AirTouchError
from airtouch.simulation.flight import Diverged
from airtouch.simulation.workers import cluster, store
from short_scenario import SHORT

REQUEST = {"scenario": "short", "seed": 3}


def hold(folder, *names):
    """Make files in a folder, each with its name as content."""
    folder.mkdir(exist_ok=True)
    for name in names:
        (folder / name).write_text(name)


@pytest.mark.parametrize("name", ["mine.csv.gz", "notes.jsonl", "short_3_000000.csv.gz"])
def test_force_removes_nothing_where_no_simulation_ran(tmp_path, name):
    hold(tmp_path, name)
    with pytest.raises(AirTouchError, match=r"no run\.json of a simulation"):
        store.open_folder(tmp_path, REQUEST, force=True)
    assert (tmp_path / name).exists() and not (tmp_path / "run.json").exists()


def test_force_removes_the_flights_of_the_old_request_alone(tmp_path):
    store.open_folder(tmp_path, REQUEST)
    own = ["short_3_000000.csv.gz", "short_3_1000000.csv.gz", "diverged.jsonl"]
    users = ["mine.csv.gz", "notes.jsonl", "short_4_000000.csv.gz", "short_3_0.csv.gz", "short_3_000000_cut.csv.gz"]
    hold(tmp_path, *own, *users)
    with pytest.raises(AirTouchError, match="another request"):
        store.open_folder(tmp_path, {**REQUEST, "seed": 4})
    store.open_folder(tmp_path, {**REQUEST, "seed": 4}, force=True)
    assert {p.name for p in tmp_path.iterdir()} == {"run.json", *users}


def test_a_run_json_of_something_else_is_no_leave_to_remove(tmp_path):
    hold(tmp_path, "run.json", "short_3_000000.csv.gz")
    with pytest.raises(AirTouchError, match="not the request of a simulation"):
        store.open_folder(tmp_path, REQUEST, force=True)
    assert (tmp_path / "run.json").read_text() == "run.json"


@pytest.mark.parametrize("text", ["file,use\nmine.csv,clean\n", store.HEAD + "\nmine.csv.gz,clean,0,,,,\n",
                                  store.HEAD + "\n" + "x" * 200_000 + "\n"])
def test_a_manifest_of_the_user_stays(tmp_path, text):
    (tmp_path / "manifest.csv").write_text(text)
    (tmp_path / "short.toml").write_text(SHORT)
    for force in ([], ["--force"]):
        result = CliRunner().invoke(command, [str(tmp_path / "short.toml"), "--out", str(tmp_path), *force])
        assert "not written by a simulation" in str(result.exception)
    assert (tmp_path / "manifest.csv").read_text() == text
    assert not (tmp_path / "run.json").exists() and not list(tmp_path.glob("*.csv.gz"))


def test_fewer_flights_of_the_same_request_leave_all_of_them_listed(tmp_path):
    (tmp_path / "short.toml").write_text(SHORT)
    out = tmp_path / "out"
    for count in ("2", "1"):
        result = CliRunner().invoke(command, [str(tmp_path / "short.toml"), "--out", str(out), "-n", count])
        assert result.exit_code == 0, result.output + str(result.exception)
    with open(out / "manifest.csv") as file:
        listed = [row["file"] for row in csv.DictReader(file)]
    assert listed == [p.name for p in logs.files.in_folder(out)] and len(listed) == 2


def test_a_manifest_that_cannot_be_read_is_one_line(tmp_path):
    (tmp_path / "manifest.csv").mkdir()
    with pytest.raises(AirTouchError, match="manifest.csv: cannot be read"):
        store.open_folder(tmp_path, {})


def run(folder, version=airtouch.__version__):
    """Fly the folder's short scenario into its folder `out`, by an AirTouch of a version; the refusal or None."""
    with mock.patch.object(store, "__version__", version):
        result = CliRunner().invoke(command, [str(folder / "short.toml"), "--out", str(folder / "out")])
    return result.exception and str(result.exception)


def test_another_firmware_file_or_version_is_another_request(tmp_path):
    firmware = tmp_path / "mine.toml"
    firmware.write_text('base = "2026.08"\n')
    (tmp_path / "short.toml").write_text(f"firmware = '{firmware}'\n" + SHORT)
    assert run(tmp_path) is None and run(tmp_path) is None
    assert "(other or not known: airtouch)" in run(tmp_path, "0.0.1")
    firmware.write_text('base = "2026.08"\n[controller]\ntilt_limit_deg = 10\n')
    assert "another request (other or not known: firmware_digest)" in run(tmp_path)
    firmware.write_text('base = "2026.08"\nsummary = "the same settings"\n')
    assert run(tmp_path) is None


def test_flights_of_which_no_version_is_known_are_not_continued(tmp_path):
    (tmp_path / "short.toml").write_text(SHORT)
    assert run(tmp_path) is None
    path = tmp_path / "out" / "run.json"
    request = json.loads(path.read_text())
    path.write_text(json.dumps({k: v for k, v in request.items() if k not in ("airtouch", "firmware_digest")}))
    assert "not known: airtouch, firmware_digest)" in run(tmp_path)
    assert list((tmp_path / "out").glob("*.csv.gz"))


def test_a_name_with_a_comma_fills_and_continues_a_folder(tmp_path):
    (tmp_path / "short.toml").write_text(SHORT.replace('"short"', "'a, \"b\"'"))
    assert run(tmp_path) is None and run(tmp_path) is None
    with open(tmp_path / "out" / "manifest.csv") as file:
        rows = list(csv.DictReader(file))
    assert [row["file"] for row in rows] == ['a, "b"_0_000000.csv.gz'] and rows[0]["wind"] == "none"


def test_rows_of_the_manifest_that_the_user_edited_stay(tmp_path):
    (tmp_path / "short.toml").write_text(SHORT)
    request = [str(tmp_path / "short.toml"), "--out", str(tmp_path / "out"), "-n"]
    CliRunner().invoke(command, [*request, "2"])
    manifest = tmp_path / "out" / "manifest.csv"
    edited = manifest.read_text().replace("000000.csv.gz,clean,0", "000000.csv.gz,messy,4")
    manifest.write_text(edited)
    CliRunner().invoke(command, [*request, "3"])
    after = manifest.read_text()
    assert ",messy,4" in edited and after.startswith(edited) and len(after.splitlines()) == 4


@pytest.mark.parametrize("force", [False, True])
def test_a_damaged_request_is_no_request(tmp_path, force):
    store.open_folder(tmp_path, REQUEST)
    store.open_folder(tmp_path, REQUEST)
    (tmp_path / store.REQUEST).write_bytes(b"\xff\xfe{}")
    with pytest.raises(AirTouchError, match="not the request of a simulation"):
        store.open_folder(tmp_path, REQUEST, force=force)


def test_a_damaged_list_of_diverged_flights_is_one_line(tmp_path):
    (tmp_path / store.FAILED).write_bytes(b"\xff\n")
    with pytest.raises(AirTouchError, match="diverged.jsonl: no text in UTF-8"):
        store.failures(tmp_path)


@pytest.mark.parametrize("line", ["{}\n", "3\n", "null\n", '{"flight": 1}\n', '["a"]\n', '{"scenario": "sho', "{"])
def test_a_line_that_is_no_record_hides_none(tmp_path, line):
    (tmp_path / store.FAILED).write_text(line)
    store.save(tmp_path, "short", Diverged("short", 3, 7, "it fell", 1.5))
    assert [f["flight"] for f in store.failures(tmp_path)] == [7]


def heavy(folder):
    """A vehicle file of 1 kg, which a Crazyflie's motors do not lift."""
    text = (resources.files("airtouch") / "vehicles" / "crazyflie-2.1-flow.toml").read_text()
    (folder / "heavy.toml").write_text(re.sub(r"(?m)^mass_kg\s*=.*$", "mass_kg = 1.0", text))
    return ["--vehicle", str(folder / "heavy.toml")]


@pytest.mark.parametrize("refused", [heavy, lambda folder: ["--dask", "tcp://127.0.0.1:1"]])
def test_a_refused_request_leaves_the_folder_as_it_is(tmp_path, refused, monkeypatch):
    monkeypatch.setattr(cluster, "connect", dead_scheduler)
    (tmp_path / "short.toml").write_text(SHORT)
    request = [str(tmp_path / "short.toml"), "--out", str(tmp_path / "out")]
    bad = CliRunner().invoke(command, [*request, *refused(tmp_path)])
    assert isinstance(bad.exception, AirTouchError)
    good = CliRunner().invoke(command, request)  # no run.json of the refused one is in its way
    assert good.exit_code == 0, good.output + str(good.exception)
    before = {p.name: p.read_bytes() for p in (tmp_path / "out").iterdir()}
    bad = CliRunner().invoke(command, [*request, "--seed", "1", "--force", *refused(tmp_path)])
    assert isinstance(bad.exception, AirTouchError)
    assert {p.name: p.read_bytes() for p in (tmp_path / "out").iterdir()} == before


def dead_scheduler(address):
    raise AirTouchError(f"no dask scheduler answers at {address}")
