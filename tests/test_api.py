"""`import airtouch as at` from the outside: quick to import, and each function on a file, a log and a pandas table."""

import operator
import re
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

import airtouch as at
import short_flights
from airtouch import api
from airtouch.errors import AirTouchError, python_words

NEVER = ("numba", "scipy", "pandas", "matplotlib", "tensorflow", "keras", "sklearn", "jinja2", "numpy", "cffi", "click")


@pytest.fixture(scope="module")
def log():
    return short_flights.fly(1)[0]


@pytest.fixture(scope="module")
def path(log, tmp_path_factory):
    path = tmp_path_factory.mktemp("api") / "flight.csv.gz"
    at.write(log, path)
    return path


def test_the_import_itself_brings_nothing_heavy():
    code = ("import sys, airtouch; "
            f"print([m for m in {NEVER!r} if m in sys.modules], sorted(airtouch.__all__) == dir(airtouch))")
    process = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert process.stdout == "[] True\n"


def test_everything_promised_is_there():
    for name in at.__all__:
        value = getattr(at, name)
        assert value is not None and (callable(value) or name in ("__version__", "gap", "logs"))
    promised = re.findall(r"`at\.([\w.]+)`", api.__doc__)
    assert set(promised) >= {name for name in at.__all__ if name.islower() and name not in ("gap", "logs")} - {
        "__version__"}
    for name in promised:
        assert callable(operator.attrgetter(name)(at)), name
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        _ = at.nonsense


@pytest.mark.parametrize("text, words", [
    ("use --detector paper, or --force", 'use detector="paper", or force=True'),
    ("--detector paper-stream.", 'detector="paper-stream".'),
    ("give the speed: --speed 0.2", "give the speed: speed_mps=0.2"),
    ("give --speed, or speed_mps", "give speed_mps, or speed_mps")])
def test_options_in_messages_are_arguments(text, words):
    assert python_words(text) == words


def test_detect_and_evaluate_take_a_file_a_log_and_a_table(log, path):
    table = at.to_pandas(path)
    assert list(table.columns) == list(at.read(path).columns) and len(table) == len(log)
    edges = [at.detect(flight, "baseline").edges for flight in (path, str(path), at.read(path), table)]
    assert edges[0] == edges[1] == edges[2] == edges[3]
    scores = [at.evaluate(f, "baseline", speed_mps=0.3) for f in (path, [at.read(path)], table)]
    assert len({s["edges"] for s in scores}) == 1 and scores[0]["flights"] == 1 and scores[0]["edges"] >= 2
    assert len({s["missed_count"] for s in scores}) == 1


def test_a_table_of_every_second_row_has_the_period_of_its_clock(log, tmp_path):
    half = at.to_pandas(log).iloc[::2]
    assert half.attrs["sample_period_s"] == 0.01
    with pytest.raises(AirTouchError, match="logged at 50 Hz, the detectors need 100 Hz"):
        at.detect(half, "baseline")
    at.write(half, tmp_path / "half.csv")
    assert not at.read(tmp_path / "half.csv").meta["warnings"]


@pytest.mark.parametrize("late_s, kept", [(0.35, 1.0), (0.0, 0.7)])
def test_a_table_with_late_bursts_or_lost_rows_keeps_its_stated_period(log, late_s, kept):
    table = at.to_pandas(log)
    due = table["t_s"].to_numpy()
    bursts = np.arange(len(due)) % 200 < 40  # 0.4 s in which packets wait, to come together
    table["t_s"] = np.maximum.accumulate(np.where(bursts, due + late_s, due))
    table = table[np.random.default_rng(0).random(len(due)) < kept]
    assert at.from_pandas(table).meta["sample_period_s"] == 0.01


@pytest.mark.parametrize("clock, remark", [
    (lambda t: t[::-1], "the clock runs backwards"),
    (lambda t: t[np.random.default_rng(0).permutation(len(t))], "runs back"),
    (lambda t: t + 5.0 * (np.arange(len(t)) >= 1000), r"no sample in 5\.01 s before sample 1000;")])
def test_detect_warns_of_a_clock_that_is_not_that_of_the_rows(log, clock, remark):
    table = at.to_pandas(log)
    table["t_s"] = clock(table["t_s"].to_numpy())
    with pytest.warns(UserWarning, match=remark):
        at.detect(table, "baseline")
    (lines,) = at.evaluate(table, "baseline")["remarks"].values()
    assert re.search(remark, lines[0])


def test_the_speed_of_a_simulated_flight_is_known(log):
    speed = log.meta["condition"]["speed"]
    assert at.evaluate(log, "baseline")["per_flight"] == at.evaluate(log, "baseline", speed_mps=speed)["per_flight"]


@pytest.mark.parametrize("speed", [float("nan"), float("inf"), 0.0, -0.3, 101.0, "0.3"])
def test_a_speed_that_none_flies_is_refused(log, speed):
    with pytest.raises(AirTouchError, match="speed_mps must be above 0 and at most 100 m/s, not"):
        at.evaluate(log, "baseline", speed_mps=speed)


@pytest.mark.parametrize("function", [at.evaluate, at.gap.diagnose, at.gap.measure])
def test_nothing_is_no_flight(function):
    with pytest.raises(AirTouchError, match="flights are file names, .* not NoneType"):
        function(None)


def test_messages_name_the_arguments_of_python_not_the_options_of_the_command_line(log, path, tmp_path):
    for write in (at.write, at.logs.write):
        with pytest.raises(at.AirTouchError, match=r"exists already; use force=True to replace it$"):
            write(log, path)
    command = [sys.executable, "-m", "airtouch", "evaluate", str(path), "--json", str(path)]
    assert "use --force to replace it" in subprocess.run(command, capture_output=True, text=True).stderr
    at.write(at.FlightLog(log.columns, {}), tmp_path / "no_speed.csv")
    (left_out,) = at.evaluate(tmp_path / "no_speed.csv", "baseline")["left_out"]
    assert left_out["reason"].endswith("give speed_mps, or speed_mps in a manifest.csv beside the flight")
    with pytest.raises(at.AirTouchError, match='leave model out$'):
        at.detect(log, "baseline", model="m.npz")


def test_a_table_goes_there_and_back(log):
    back = at.from_pandas(at.to_pandas(log).assign(more=1.0))
    assert back.meta["vehicle"] == log.meta["vehicle"] and set(back.columns) == set(log.columns)
    for name in log.columns:
        np.testing.assert_array_equal(back[name], log[name])
    with pytest.raises(at.AirTouchError, match="no column of this table"):
        at.from_pandas(at.to_pandas(log)[["t_s"]].rename(columns={"t_s": "seconds"}))


def test_simulate_is_what_the_command_flies():
    (flight,) = at.simulate("hover", effects={"wind": {"x": 0.3}}, seed=3)
    (again,) = at.simulate("hover", effects=[("wind", {"x": 0.3})], seed=3)
    np.testing.assert_array_equal(flight["gyro_x_radps"], again["gyro_x_radps"])
    with pytest.raises(at.AirTouchError, match="wind has no parameter"):
        at.simulate("hover", effects={"wind": {"speed": 0.3}})


def test_gap_is_called_by_name_and_stays_a_module(log, path, tmp_path):
    from airtouch.gap.measurement import Measurement, measure

    assert isinstance(at.gap.measure(path), Measurement) and callable(measure)
    from airtouch.gap.diagnosis import diagnose  # the import of a module must not hide the function

    assert callable(diagnose) and callable(at.gap.diagnose)
    with pytest.raises(at.AirTouchError, match="no flight to diagnose|too short|no flight in it"):
        at.gap.diagnose(log.slice(0, 150))


@pytest.mark.parametrize("without, words", [(["magic"], "no effect 'magic'"),
                                            ("wind", r"a list of effects: \['wind'\]")])
def test_effects_to_leave_out_are_checked(log, without, words):
    with pytest.raises(AirTouchError, match=words):
        at.gap.diagnose(log, without=without)


def test_a_report_that_is_there_is_told_before_the_diagnosis(log, tmp_path, monkeypatch):
    monkeypatch.setattr("airtouch.gap.diagnosis.diagnose", lambda *_, **__: pytest.fail("diagnosed first"))
    (tmp_path / "report.html").write_text("mine")
    with pytest.raises(AirTouchError, match="use force=True to replace it"):
        at.gap.diagnose(log, report=tmp_path / "report.html")


def test_a_log_of_an_unknown_vehicle_is_measured_with_a_warning(log):
    of_unknown = log.with_columns({}, vehicle="my-drone")
    with pytest.warns(UserWarning, match="'my-drone', of which no file is known; crazyflie-2.1-flow is used, vehicle "
                                         "names another") as warned:
        at.gap.measure(of_unknown)
    assert warned[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        at.gap.measure(of_unknown, "crazyflie-2.1-flow")


def test_adapt_takes_files_alone(log, tmp_path):
    pytest.importorskip("tensorflow")
    for flights, kind in (([log], "FlightLog"), (log, "FlightLog"), ([tmp_path, at.to_pandas(log)], "DataFrame")):
        with pytest.raises(AirTouchError, match=f"files or folders, not {kind}"):
            at.adapt(flights, tmp_path / "mine.npz")


def test_plots_of_a_result_are_figures_to_restyle_and_save(path, tmp_path):
    """Drawn anew at each call; to ask for them changes nothing else."""
    pytest.importorskip("matplotlib")
    measured = at.gap.measure(path, plots=True)
    plots = at.gap.plots(measured)
    assert list(plots) == ["signal", "spectra", "commands"]
    for name, figure in plots.items():
        assert figure.axes[-1].get_xlabel() == ("time, s" if name == "signal" else "frequency, Hz")
        figure.axes[0].set_title("of a paper")
        figure.savefig(tmp_path / f"{name}.svg")
        assert "of a paper" in (tmp_path / f"{name}.svg").read_text()  # a comment beside the glyphs
    assert at.gap.plots(measured)["signal"].axes[0].get_title() == ""
    assert len(plots["spectra"].axes) == len(measured.curves.spectra) > 0
    without = at.gap.measure(path)
    assert without == measured
    with pytest.raises(AirTouchError, match="plots=True"):
        at.gap.plots(without)


@pytest.mark.parametrize("function", [at.gap.measure, at.gap.diagnose])
def test_logs_of_two_vehicles_need_one_to_be_named(log, function):
    other = log.with_columns({}, vehicle="crazyflie-2.1-brushless")
    for flights, baseline in (([log, other], ()), ([log], [other])):
        with pytest.raises(AirTouchError, match="two vehicles: .* flew .*, crazyflie-2.1-brushless flew .*, or vehi"):
            function(flights, baseline=baseline)


def test_a_log_without_a_vehicle_is_measured_as_the_default_with_a_warning(log):
    with pytest.warns(UserWarning, match="names no vehicle; crazyflie-2.1-flow is assumed, vehicle names another"):
        at.gap.measure(log.with_columns({}, vehicle=""))


def test_types_are_marked():
    from importlib import resources

    assert (resources.files("airtouch") / "py.typed").is_file()


def test_a_folder_stands_for_its_flights_and_a_list_is_no_flight(tmp_path):
    (tmp_path / "flown").mkdir()
    for number in range(2):
        at.write(at.simulate("hover", seed=number)[0], tmp_path / "flown" / f"{number}.csv")
    (tmp_path / "flown" / "manifest.csv").write_text("file,use\n0.csv,clean\n")
    gap = at.gap.measure(tmp_path / "flown")
    assert [Path(f).name for f in gap.flights] == ["0.csv", "1.csv"]
    (tmp_path / "empty").mkdir()
    with pytest.raises(at.AirTouchError, match="no flights in this folder"):
        at.gap.measure(tmp_path / "empty")
    with pytest.raises(at.AirTouchError, match="a pandas table, not list"):
        at.detect([])
    with pytest.raises(at.AirTouchError, match="no flight to score"):
        at.evaluate([])


@pytest.mark.parametrize("arguments, message", [
    ({"scenario": 3}, "a scenario is a name, a .toml file or an object, not 3"), ({"scenario": None}, "not None"),
    ({"vehicle": 3}, "a vehicle is a name, a .toml file or an object, not 3"),
    ({"without": "gust"}, r"without is a list of effects: \['gust'\]"), ({"without": 3}, "a list of effects, not 3"),
    ({"without": [3]}, "given by its name, not 3"), ({"effects": "wind"}, "or pairs of both, not 'wind'"),
    ({"effects": 3}, "or pairs of both, not 3"), ({"effects": ["wind"]}, "is a pair of its name and .*, not 'wind'"),
    ({"effects": [3]}, "is a pair of its name"), ({"effects": {"wind": 3}}, "is a pair of its name"),
    ({"effects": {3: {}}}, "given by its name, not 3")])
def test_arguments_of_another_kind_are_refused_in_one_line(arguments, message):
    with pytest.raises(AirTouchError, match=message):
        at.simulate(**{"scenario": "hover", **arguments})


def test_a_mission_is_simulated_by_its_name():
    (log,) = at.simulate("sweep")
    assert log.meta["scenario"] == "sweep" and log["zrange_m"].max() > 0.7


def test_text_in_a_column_and_numbers_out_of_range_are_named():
    pandas = pytest.importorskip("pandas")
    with pytest.raises(AirTouchError, match="column zrange_m of this table"):
        at.read(pandas.DataFrame({"t_s": [0.0, 0.01], "zrange_m": [0.5, "high"]}))
    for wrong, message in (({"seed": -1}, "seed must be"), ({"flights": -1}, "flights must be"),
                           ({"flights": 1.5}, "flights must be")):
        with pytest.raises(AirTouchError, match=message):
            at.simulate("paper-low", **wrong)
