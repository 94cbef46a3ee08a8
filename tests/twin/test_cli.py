"""`airtouch twin`, from the outside."""

import json
import shutil

import pytest
from click.testing import CliRunner

from airtouch import logs, vehicle
from airtouch.cli import airtouch
from airtouch.logs.flight_log import FlightLog
from airtouch.report import twin_report
from airtouch.simulation import batch, scenario
from airtouch.twin.comparison import compare
from airtouch.twin.fitting import edge_fit
from airtouch.twin.recorded.course import course
from skips import needs

pytestmark = needs("sklearn")


def run(*arguments):
    return CliRunner().invoke(airtouch, [str(a) for a in arguments])


@pytest.fixture(scope="module")
def folder(sweeps, tmp_path_factory):
    """Six recorded flights, of a simulator."""
    out = tmp_path_factory.mktemp("recorded")
    for i, (_, log, _) in enumerate(sweeps[:6]):
        logs.write(log, out / f"flight_{i}.csv.gz")
    return out


@pytest.fixture(scope="module")
def twin(folder, tmp_path_factory):
    """A fit of one round; how well edges are fitted is the matter of fitting/test_edge_fit.py."""
    out = tmp_path_factory.mktemp("twin") / "mine"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(edge_fit, "FLIGHTS", 16)
        result = run("twin", folder, "--out", out, "--rounds", 1, "--batch", 40, "--workers", 1)
    assert result.exit_code == 0, result.output + str(result.exception)
    return out, result.output


def test_files_are_those_that_simulate_takes(twin):
    out, output = twin
    scene, craft = scenario.load(out / "scenario.toml"), vehicle.load(out / "vehicle.toml")
    logs = [f for f in batch.flights(scene, 4, vehicle=craft, workers=1) if isinstance(f, FlightLog)]
    assert len(logs) >= 2
    assert 0.6 < course(logs[0]).cruise_m < 1.0
    assert "AUROC" in output and "largest differences:" in output


def test_report_shows_all_of_it(twin):
    out, _ = twin
    page = (out / "report.html").read_text()
    for text in ("Can a classifier tell?", "What stays different, largest first",
                 "Around the edges, medians and quartiles",
                 "Spectra in free air", "One flight and its twin", "ground_effect.strength"):
        assert text in page
    summary = json.loads((out / "twin.json").read_text())
    assert len(summary["flights"]) == 6 and summary["gaps"]
    sizes = [abs(g["scatters"]) for g in summary["gaps"]]
    assert sizes == sorted(sizes, reverse=True)


def test_it_does_not_overwrite_and_it_goes_on(twin, folder, tmp_path, monkeypatch):
    paths = []
    monkeypatch.setattr(twin_report, "write_report", lambda path, *_, **__: paths.append(path))  # drawn for `twin`
    # and what does not depend on which rounds were flown before
    monkeypatch.setattr(compare, "two_sample", lambda *_: [])
    monkeypatch.setattr(edge_fit, "refine", lambda aim, craft, levers, values, **_: edge_fit.EdgeFit(values, []))
    out = tmp_path / "mine"
    shutil.copytree(twin[0], out)
    repeat = run("twin", folder, "--out", out, "--rounds", 1, "--batch", 40)
    assert repeat.exit_code != 0 and "--resume" in str(repeat.exception)
    result = run("twin", folder, "--out", out, "--rounds", 2, "--batch", 40, "--resume", "--workers", 1)
    assert result.exit_code == 0, result.output + str(result.exception)
    assert len(json.loads((out / "twin.json").read_text())["history"]) == 2 and paths == [out / "report.html"]


def test_bad_input_is_one_line_with_what_to_fly(sweeps, folder, tmp_path):
    def refusal(name, sweeps):
        place = tmp_path / name
        place.mkdir()
        for i, log in enumerate(sweeps):
            logs.write(log, place / f"{i}.csv")
        result = run("twin", place, "--out", tmp_path / "out")
        assert result.exit_code != 0
        message = str(result.exception)
        assert "\n" not in message
        return message

    flights = [log for _, log, _ in sweeps[:5]]
    assert "4 are needed: fly straight over" in refusal("few", flights[:2])
    blind = [FlightLog({k: v for k, v in log.columns.items() if k != "zrange_m"}, log.meta) for log in flights]
    assert "no down range in this log; log range.zrange" in refusal("blind", blind)
    assert "hover 5 s" in refusal("hurried", [log.slice(course(log).entry - 100, len(log)) for log in flights])
    other = FlightLog(flights[0].columns, {**flights[0].meta, "vehicle": "quadrotor-450"})
    assert "two vehicles" in refusal("two", [*flights, other])


def test_force_keeps_the_old_fit_until_the_inputs_are_read(folder, tmp_path):
    fit = tmp_path / "fit.json"
    fit.write_text("a fit of hours")
    assert "no such file or folder" in str(run("twin", tmp_path / "absent", "--out", tmp_path, "--force").exception)
    assert "no such vehicle" in str(run("twin", folder, "--vehicle", "absent.toml", "--out", tmp_path,
                                        "--force").exception)
    assert fit.read_text() == "a fit of hours"


@pytest.mark.parametrize("option", [[], ["--resume"]])
@pytest.mark.parametrize("name", ["vehicle.toml", "scenario.toml", "twin.json", "report.html"])
def test_files_of_the_user_are_not_replaced(folder, tmp_path, name, option):
    (tmp_path / name).write_text("mine")
    result = run("twin", folder, "--out", tmp_path, *option)
    assert f"{name}: exists already" in str(result.exception)
    assert (tmp_path / name).read_text() == "mine" and len(list(tmp_path.iterdir())) == 1


def test_a_refused_call_leaves_no_folder(tmp_path):
    assert "no such file or folder" in str(run("twin", tmp_path / "absent", "--out", tmp_path / "new").exception)
    assert not (tmp_path / "new").exists()


def test_the_help_of_twin_says_what_to_fly_and_how_to_go_on():
    output = run("twin", "--help").output
    for text in ("What to fly", "airtouch simulate twin/scenario.toml", "0.5 is closed"):
        assert text in output
