"""What `airtouch gap` says of inputs and outputs that it cannot use."""

import json
import shlex

import pytest
from click.testing import CliRunner

import made_diagnosis
from airtouch import logs
from airtouch.cli.gap import files
from airtouch.cli.gap.blind import blind_run
from airtouch.cli.gap.diagnose import diagnose_command
from airtouch.cli.gap.measure import measure_command
from airtouch.cli.gap.progress import StepLines
from airtouch.cli.shared.typed import typed
from airtouch.errors import AirTouchError
from airtouch.gap import diagnosis


def test_baseline_before_the_flights_is_told():
    result = CliRunner().invoke(diagnose_command, ["--baseline", "nominal.csv", "real.csv"])
    assert result.exit_code == 2 and "give REAL before --baseline" in result.output


def test_a_place_that_no_one_can_write_to_is_told_before_the_work(tmp_path):
    with pytest.raises(AirTouchError, match="cannot be written to"):
        CliRunner().invoke(diagnose_command, [str(tmp_path / "absent.csv"), "--report", "/proc/which.html"],
                           catch_exceptions=False, standalone_mode=False)


@pytest.mark.parametrize("words", [["--baseline", "a.csv", "b.csv"], ["--baseline=a.csv", "b.csv"],
                                   ["--baseline=", "a.csv", "b.csv"], ["--baseline=a.csv", "--baseline=b.csv"]])
def test_each_name_after_baseline_is_of_the_baseline(words):
    context = diagnose_command.make_context("diagnose", ["real.csv", *words, "--each"])
    assert context.params["real"] == ("real.csv",) and context.params["baseline"] == ("a.csv", "b.csv")


@pytest.mark.parametrize("words", [["--baseline"], ["--baseline="], ["--baseline", "--each"]])
def test_a_baseline_without_a_name_is_told(words):
    result = CliRunner().invoke(diagnose_command, ["real.csv", *words])
    assert result.exit_code == 2 and "requires an argument" in result.output


def test_a_partner_needs_a_baseline():
    result = CliRunner().invoke(diagnose_command, ["real.csv", "--partner", "high.csv"])
    assert result.exit_code == 2 and "--partner needs --baseline" in result.output


@pytest.fixture
def unreadable(tmp_path):
    """Two files that are no logs."""
    for name in ("bad_1.csv", "bad_2.csv"):
        (tmp_path / name).write_text("")
    return tmp_path


def test_partners_that_cannot_be_read_are_told(generated, unreadable, monkeypatch):
    monkeypatch.setattr(diagnosis, "diagnose", lambda *_, **__: made_diagnosis.diagnosis())
    result = CliRunner().invoke(diagnose_command, [
        str(generated / "f0.csv.gz"), "--baseline", str(generated / "f1.csv.gz"),
        "--partner", str(unreadable / "bad_1.csv"), "--partner", str(unreadable / "bad_2.csv")])
    assert result.exit_code == 0, result.output + str(result.exception)
    assert result.output.count("left out: ") == 2 and "bad_2.csv: the file is empty" in result.output


def test_each_that_diagnoses_nothing_is_an_error(unreadable, tmp_path):
    result = CliRunner().invoke(diagnose_command, [str(unreadable), "--each", "--json", str(tmp_path / "out.json")])
    assert isinstance(result.exception, AirTouchError) and "none of 2 flights" in str(result.exception)
    assert "bad_1.csv: the file is empty" in result.output and not (tmp_path / "out.json").exists()


def test_each_tells_a_flight_that_is_in_its_baseline_too(generated, monkeypatch):
    monkeypatch.setattr(diagnosis, "diagnose", lambda *_, **__: made_diagnosis.diagnosis())
    flight = str(generated / "f0.csv.gz")
    result = CliRunner().invoke(diagnose_command, [flight, "--each", "--baseline", flight])
    assert "cannot differ from itself" in result.output


def test_each_names_the_flight_that_is_diagnosed_and_keeps_what_is_done(generated, tmp_path, monkeypatch):
    """The third flight is broken off: it is the one that the progress names last, and two are in the JSON."""
    steps, out, done = [], tmp_path / "out.json", []

    def diagnose(flights, **_):
        done.append(flights)
        if len(done) == 3:
            raise KeyboardInterrupt
        return made_diagnosis.diagnosis()

    monkeypatch.setattr(diagnosis, "diagnose", diagnose)
    monkeypatch.setattr(StepLines, "__call__", lambda _, text: steps.append(text))
    names = [str(generated / f"f{i}.csv.gz") for i in range(3)]
    CliRunner().invoke(diagnose_command, [*names, "--each", "--json", str(out)])
    assert steps[-1] == "diagnosing f2.csv.gz, step 2 of 3" and len(json.loads(out.read_text())["cases"]) == 2


def test_a_copy_of_a_baseline_flight_under_another_name_is_told(generated, tmp_path, monkeypatch):
    copy = tmp_path / "real.csv.gz"
    copy.write_bytes((generated / "f1.csv.gz").read_bytes())
    monkeypatch.setattr(diagnosis, "diagnose", lambda *_, **__: made_diagnosis.diagnosis())
    result = CliRunner().invoke(diagnose_command, [str(copy), str(generated / "f0.csv.gz"),
                                                   "--baseline", str(generated / "f1.csv.gz")])
    assert "real.csv.gz: is a baseline flight as well" in result.output and "(1 of 2 flights)" in result.output


def test_the_command_in_a_report_can_be_pasted_and_long_lists_are_counted(monkeypatch):
    words = ["gap", "diagnose", "my flight.csv", "--partner", "high.csv", "--without", "wind", "--baseline", *"abcdef"]
    monkeypatch.setattr("sys.argv", ["/usr/bin/airtouch", *words])
    assert shlex.split(typed()) == ["airtouch", *words]
    assert typed(4).endswith("--baseline a b c d [and 2 more]") and "--without wind" in typed(4)


def test_the_figures_of_a_check_are_not_replaced(tmp_path):
    (tmp_path / "mine.json").write_text("mine")
    for out, option in (("check", ["--json", str(tmp_path / "mine.json")]), ("", [])):
        (tmp_path / "figures.json").write_text("mine")
        result = CliRunner().invoke(blind_run, [str(tmp_path / out), *option])
        assert "exists already" in str(result.exception)
    assert {p.read_text() for p in tmp_path.glob("*.json")} == {"mine"} and not (tmp_path / "check").exists()


def renamed(source, path, **meta):
    """A copy of a log with other metadata."""
    logs.write(logs.read(source).with_columns({}, **meta), path)
    return str(path)


@pytest.mark.parametrize("command, call", [
    (diagnose_command, "FIRST SECOND"), (diagnose_command, "FIRST SECOND --each"),
    (diagnose_command, "UNNAMED FIRST --baseline SECOND"), (measure_command, "FIRST SECOND"),
    (measure_command, "FIRST --baseline SECOND")])
def test_flights_of_two_vehicles_need_one_to_be_named(generated, tmp_path, command, call):
    source = generated / "f0.csv.gz"
    names = {"FIRST": renamed(source, tmp_path / "a.csv", vehicle="crazyflie-2.1-flow"),
             "SECOND": renamed(source, tmp_path / "b.csv", vehicle="crazyflie-2.1-brushless"),
             "UNNAMED": renamed(source, tmp_path / "c.csv", vehicle="")}
    with pytest.raises(AirTouchError) as error:
        CliRunner().invoke(command, [names.get(w, w) for w in call.split()], catch_exceptions=False,
                           standalone_mode=False)
    message = str(error.value)
    assert "crazyflie-2.1-flow flew " in message and "crazyflie-2.1-brushless flew " in message
    assert "--vehicle" in message
    assert "a.csv" in message and "b.csv" in message and "\n" not in message


@pytest.mark.parametrize("meta", [{"vehicle": ""}, {"vehicle": "crazyflie-2.1", "assumed_vehicle": "crazyflie-2.1"}])
def test_a_log_without_a_name_of_its_own_goes_with_any_vehicle(generated, tmp_path, meta):
    named = renamed(generated / "f0.csv.gz", tmp_path / "a.csv", vehicle="crazyflie-2.1-brushless")
    other = renamed(generated / "f0.csv.gz", tmp_path / "b.csv", **meta)
    assert files.vehicle_of(None, files.Flights([named]), files.Flights([other])).name == "crazyflie-2.1-brushless"


def test_a_named_vehicle_is_taken_for_logs_of_two(generated, tmp_path):
    both = [renamed(generated / "f0.csv.gz", tmp_path / f"{name}.csv", vehicle=name)
            for name in ("crazyflie-2.1", "crazyflie-2.1-flow")]
    assert files.vehicle_of("crazyflie-2.1-brushless", files.Flights(both)).name == "crazyflie-2.1-brushless"
