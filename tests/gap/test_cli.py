"""`airtouch gap` from the outside: files, folders, patterns, JSON, report, exit codes."""

import json
import math

import pytest
from click.testing import CliRunner

import short_flights
from airtouch import logs
from airtouch.cli.gap import command
from airtouch.cli.gap.files import Flights, files_of, vehicle_of
from airtouch.errors import AirTouchError
from airtouch.simulation.effects import EFFECTS, unregister

KEPT = ("wind", "mass", "imu_bias")  #: candidates; the others take time


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two simulated flights with a forward push that no baseline flight has, and two without."""
    folder = tmp_path_factory.mktemp("gap")
    for i, log in enumerate(short_flights.fly(4)):
        if i < 2:
            log = log.with_columns({"acc_x_mps2": log["acc_x_mps2"] + 0.8})
        logs.write(log, folder / f"{'real' if i < 2 else 'nominal'}_{i}.csv.gz")
    (folder / "manifest.csv").write_text("file,effect\n")
    (folder / "notes.md").write_text("not a log")
    return folder


def run(*arguments):
    return CliRunner().invoke(command, [str(a) for a in arguments])


def no_constant(name):
    raise ValueError(name)


def test_measure_writes_json_and_report(folder, tmp_path):
    out, page = tmp_path / "out.json", tmp_path / "out.html"
    result = run("measure", f"{folder}/real_*", "--json", out, "--report", page)
    assert result.exit_code == 0, result.output
    table = json.loads(out.read_text(), parse_constant=no_constant)
    assert len(table["flights"]) == 2 and len(table["where"]) >= 10 and "2 flights against crazyflie" in result.output
    assert all({"channel", "band_hz", "phase", "gap", "floor", "unit"} <= set(c) for c in table["where"])
    assert page.read_text().startswith("<!DOCTYPE html>")
    repeat = run("measure", f"{folder}/real_*", "--json", out)
    assert isinstance(repeat.exception, AirTouchError) and "--force" in str(repeat.exception)
    assert run("measure", f"{folder}/real_0*", "--json", out, "--force").exit_code == 0


def test_plots_are_the_pages_as_vector_files(folder, tmp_path):
    """One file a plot of the page and format; what is there is not replaced, and told before the work."""
    page, plots = tmp_path / "out.html", tmp_path / "new" / "plots"
    result = run("measure", folder / "real_0.csv.gz", "--report", page, "--plots", plots)
    assert result.exit_code == 0, result.output
    files = sorted(plots.iterdir())
    assert len(files) == 2 * page.read_text().count("<img ") == 6
    assert all(file.read_bytes().startswith(b"%PDF" if file.suffix == ".pdf" else b"<?xml") for file in files)
    assert all(f"written: {file}" in result.output.splitlines() for file in files)
    for command_name in ("measure", "diagnose"):
        repeat = run(command_name, folder / "absent.csv", "--plots", plots)
        assert isinstance(repeat.exception, AirTouchError) and "use --force" in str(repeat.exception)
    assert isinstance(run("measure", folder / "absent.csv", "--plots", tmp_path / "none").exception, AirTouchError)
    assert not (tmp_path / "none").exists()
    each = run("diagnose", folder / "real_0.csv.gz", "--each", "--plots", tmp_path / "each")
    assert "leave --each out" in str(each.exception)


def test_folders_files_and_patterns(folder):
    names = [p.name for p in files_of([str(folder)])]
    assert names == ["nominal_2.csv.gz", "nominal_3.csv.gz", "real_0.csv.gz", "real_1.csv.gz"]
    assert len(files_of([f"{folder}/real_0.csv.gz", f"{folder}/real*"])) == 2
    with pytest.raises(AirTouchError, match="no such flight log"):
        files_of([f"{folder}/nothing*"])


def test_baseline_takes_every_file_up_to_the_next_option(folder, tmp_path):
    out = tmp_path / "out.json"
    left_out = [word for name in EFFECTS if name not in KEPT for word in ("--without", name)]
    result = run("diagnose", folder / "real_0.csv.gz", "--baseline", folder / "nominal_2.csv.gz",
                 folder / "nominal_3.csv.gz", "--json", out, *left_out)
    assert result.exit_code == 0, result.output
    table = json.loads(out.read_text(), parse_constant=no_constant)
    assert table["verdict"] == "effect" and len(table["flights"]) == 1
    assert table["effects"][0]["name"] in ("imu_bias", "wind"), "a push forward"
    assert {"effects", "ranking", "indistinguishable", "where", "gap", "advice"} <= set(table)
    assert math.isclose(sum(r["probability"] for r in table["ranking"]), 1.0, abs_tol=1e-3)
    names = [r["name"] for r in table["ranking"]]
    assert set(names) == {"none", "unknown", *KEPT}
    assert [r["probability"] for r in table["ranking"]] == sorted((r["probability"] for r in table["ranking"]),
                                                                  reverse=True)
    assert set(table["gap"]) >= {"before", "after", "floor"}
    assert "Ranking" in result.output


MADE_UP_PULL = '''
from airtouch.simulation import signals as at
from airtouch.simulation.effects import Effect, Parameter, wrench

@wrench
def pull(p, s, memory, stream, out):
    out[2] -= p[0] / (1.0 + (s[at.HEIGHT] / 0.2) ** 2)

EFFECT = Effect("made_up_pull", "a magnet in the floor",
                (Parameter("force", "N", 0.01, 0.0, 0.1, 0.0, "at the floor"),), wrench=pull)
'''


def test_each_flight_alone_with_an_effect_of_the_users_own(folder, tmp_path):
    mine, out = tmp_path / "made_up_pull.py", tmp_path / "out.json"
    mine.write_text(MADE_UP_PULL)
    left_out = [word for name in EFFECTS if name != "mass" for word in ("--without", name)]
    try:
        result = run("diagnose", f"{folder}/real_*", "--each", "--effect-file", mine, "--json", out, *left_out)
    finally:
        unregister("made_up_pull")
    assert result.exit_code == 0, result.output
    cases = json.loads(out.read_text(), parse_constant=no_constant)["cases"]
    assert [len(c["flights"]) for c in cases] == [1, 1]
    assert all({r["name"] for r in c["ranking"]} == {"mass", "made_up_pull", "none", "unknown"} for c in cases)
    assert "real_0.csv.gz" in result.output


def test_an_unknown_effect_or_vehicle_is_an_error(folder):
    real = folder / "real_0.csv.gz"
    for arguments, words in ((("--without", "magic"), "no effect 'magic'"), (("--vehicle", "x.toml"), "x.toml"),
                             (("--effects-file", "x.py"), "x.py"), (("--dask", "tcp://x:1"), "--each")):
        result = run("diagnose", real, *arguments)
        assert isinstance(result.exception, AirTouchError) and words in str(result.exception), result.output


def test_a_log_that_cannot_be_read_is_left_out(folder, tmp_path):
    (tmp_path / "bad.csv").write_text("")
    result = run("measure", folder / "real_0.csv.gz", tmp_path / "bad.csv")
    assert result.exit_code == 0 and "bad.csv: the file is empty" in result.output
    only_bad = run("measure", tmp_path / "bad.csv")
    assert isinstance(only_bad.exception, AirTouchError) and "the file is empty" in str(only_bad.exception)


def test_the_log_names_the_vehicle(folder, tmp_path, capsys):
    log = logs.read(folder / "real_0.csv.gz")
    flow = "crazyflie-2.1-flow"
    for in_log, name in (("crazyflie-2.1", "crazyflie-2.1"), ("mine", flow), ("", flow)):
        path = tmp_path / f"{in_log or 'none'}.csv"
        logs.write(log.with_columns({}, vehicle=in_log), path)
        assert vehicle_of(None, Flights([str(path)])).name == name
        warning = capsys.readouterr().err
        assert ("'mine'" in warning, "names no vehicle" in warning) == (in_log == "mine", in_log == "")
    assert vehicle_of("crazyflie-2.1", Flights([str(path)])).name == "crazyflie-2.1"


def test_help_lists_the_commands():
    result = run("--help")
    assert all(name in result.output for name in ("measure", "diagnose", "blind"))
    assert "make" in run("blind", "--help").output
