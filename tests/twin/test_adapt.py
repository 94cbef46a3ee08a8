"""`airtouch adapt`: stages, resuming, hold-out by flight, expected error. Training is cut to a few steps."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner

import airtouch as at
from airtouch import logs
from airtouch import vehicle as vehicles
from airtouch.cli import airtouch
from airtouch.detector import best
from airtouch.detector.best import detector
from airtouch.detector.best.model import BestModel
from airtouch.detector.evaluation.data.dataset import Condition, FlightFile
from airtouch.detector.evaluation.score import EdgeScore, FlightScore
from airtouch.detector.shared import sensors
from airtouch.detector.trace import Detection
from airtouch.logs.flight_log import FlightLog
from airtouch.simulation import scenario
from airtouch.twin import adapt, adapt_report, overlay
from airtouch.twin.fitting import calibrate
from skips import needs
from twin_courses import PLAIN

pytestmark = needs("tensorflow")


@pytest.fixture
def quick(monkeypatch):
    """Stages of a few seconds."""
    for name, value in (("TWIN_FLIGHTS", 4), ("STEPS", {"shipped": 5, "scratch": 5}), ("FOLDS", 2)):
        monkeypatch.setattr(adapt, name, value)


def flights_of(sweeps, count, down=True):
    def of(log):
        return log if down else FlightLog({k: v for k, v in log.columns.items() if k != "zrange_m"}, log.meta)
    return [adapt.LoadedFlight(FlightFile(Path(f"{i}.csv"), Condition(speed_mps=0.3)), of(log))
            for i, (_, log, _) in enumerate(sweeps[:count])]


def write(folder, flights):
    folder.mkdir()
    for i, flight in enumerate(flights):
        logs.write(flight.log, folder / f"flight_{i}.csv.gz")
    return folder


@pytest.mark.slow
def test_command_trains_says_and_goes_on(sweeps, quick, tmp_path, monkeypatch):
    """Five flights: every one is held out once; a second call trains nothing again; nothing is overwritten."""
    folder = write(tmp_path / "flights", flights_of(sweeps, 5))
    twin = tmp_path / "twin"
    twin.mkdir()
    from airtouch import vehicle
    from airtouch.twin import files
    from airtouch.twin.fitting import levers
    from airtouch.twin.recorded.course import course
    craft = vehicle.load()
    files.write(twin, craft, (), levers.starts(()), [course(log) for _, log, _ in sweeps[:5]], PLAIN)
    arguments = ["adapt", str(folder), "--twin", str(twin), "--out", str(tmp_path / "mine.npz")]
    first = CliRunner().invoke(airtouch, arguments)
    assert first.exit_code == 0, first.output + str(first.exception)
    assert "5 flights that their down range labels" in first.output
    assert "hold these flights' free air and strength of edges" in first.output
    assert "held out, all others: error" in first.output and "5 flights, 10 edges" in first.output
    repeat = CliRunner().invoke(airtouch, arguments)
    assert repeat.exit_code != 0 and "--force" in str(repeat.exception)
    monkeypatch.setattr(best, "fit", lambda *_, **__: pytest.fail("trained again"))
    monkeypatch.setattr(overlay, "_response", lambda *_: pytest.fail("simulated again"))
    resumed = CliRunner().invoke(airtouch, [*arguments, "--force"])
    assert resumed.exit_code == 0, resumed.output + str(resumed.exception)
    model = best.load(tmp_path / "mine.npz")
    assert model.metadata["adapted"]["labelled"] == 5
    assert best.run(sweeps[0][1], model).probability.shape == (len(sweeps[0][1]),)


@pytest.mark.slow
def test_flights_without_down_range_are_used_by_pseudo_labels(sweeps, quick, tmp_path, monkeypatch):
    labels = []
    fit = best.fit
    monkeypatch.setattr(best, "fit",
                        lambda flights, seed, **o: labels.append(o.get("pseudo_labels")) or fit(flights, seed, **o))
    flights = [*flights_of(sweeps, 2), *flights_of(sweeps, 5, down=False)[2:]]
    scene = scenario.load("paper-low")
    result = adapt.adapt(flights, scene, adapt_vehicle(), tmp_path / "work", start=best.load(None))
    assert not result.held_out  # two labelled flights are too few
    assert [label is None for label in labels[-1][:5]] == [True, True, False, False, False]
    adapt.adapt(flights, scene, adapt_vehicle(), tmp_path / "work", start=best.load(None), withhold=True)
    assert [label is None for label in labels[-1][:5]] == [False] * 5
    assert result.model.metadata["adapted"]["pseudo_labelled"] == 3


@pytest.mark.slow
def test_flights_without_acceleration_train_a_detector_without(sweeps, quick, tmp_path):
    """The simulated flights beside them have none either, and the shipped model for such logs is gone on from."""
    flights = [replace(f, log=sensors.without(f.log, ("acceleration",))) for f in flights_of(sweeps, 4)]
    folder, out = write(tmp_path / "flights", flights), tmp_path / "mine.npz"
    result = CliRunner().invoke(airtouch, ["adapt", str(folder), "--out", str(out), "--no-hold-out"])
    assert result.exit_code == 0, result.output + str(result.exception)
    assert "no twin: it needs 4 flights" in result.output and "here are 0" in result.output
    assert "nothing was held out, as asked" in result.output
    model = best.load(out)
    assert set(sensors.CHANNELS_OF["acceleration"]) <= set(model.recipe.muted)
    assert best.run(flights[0].log, model).probability.shape == (len(flights[0].log),)


@pytest.mark.slow
def test_more_flights_are_a_new_twin_and_the_same_ones_are_not_fitted_again(sweeps, quick, tmp_path, monkeypatch):
    from airtouch.cli.shared.progress import Bar
    from airtouch.twin.fitting import calibrate, edge_fit
    monkeypatch.setattr(calibrate, "ROUNDS", 1)
    monkeypatch.setattr(calibrate, "BATCH", 40)
    monkeypatch.setattr(edge_fit, "FLIGHTS", 16)
    flights, work = flights_of(sweeps, 5), tmp_path / "work"
    folder = write(tmp_path / "flights", flights)
    listed = [replace(f, file=replace(f.file, path=folder / f"flight_{i}.csv.gz")) for i, f in enumerate(flights)]

    def courses(some):
        twin = calibrate.of_flights([f.file.path for f in some], vehicles.load(), work, bar=Bar)
        assert f"fitted to {len(some)} of them" in twin.what
        return twin.scenario.table["values"]["course"]["choice"]

    first, refine = courses(listed[:4]), edge_fit.refine
    monkeypatch.setattr(edge_fit, "refine", lambda *_, **__: pytest.fail("fitted again"))
    assert courses(listed[:4]) == first and len(first) == 4
    monkeypatch.setattr(edge_fit, "refine", refine)
    assert len(courses(listed)) == 5


def test_a_twin_and_a_vehicle_are_one_too_many(tmp_path):
    result = CliRunner().invoke(airtouch, ["adapt", str(tmp_path), "--twin", str(tmp_path), "--vehicle", "mine.toml",
                                           "--out", str(tmp_path / "mine.npz")])
    assert result.exit_code != 0 and "leave --vehicle out" in str(result.exception)


def adapt_vehicle():
    from airtouch import vehicle
    return vehicle.load()


def test_a_fold_without_flights_is_named_with_those_that_there_are(tmp_path):
    (tmp_path / "f.csv").write_text("")
    (tmp_path / "manifest.csv").write_text("file,use,fold\nf.csv,clean,2\n")
    result = CliRunner().invoke(airtouch, ["adapt", str(tmp_path), "--fold", "9", "--out", str(tmp_path / "m.npz")])
    assert str(result.exception) == "no flight is in fold 9 of the manifest; its folds are 2"


def test_no_flight_is_in_training_and_held_out_at_once(sweeps, tmp_path, monkeypatch):
    """Each held-out flight is scored once, by a model whose training flights lack it."""
    scored = []
    monkeypatch.setattr(adapt.Trainer, "fit_all",
                        lambda self, twin, flights, progress: frozenset(str(f.file.path) for f in flights))
    monkeypatch.setattr(adapt.cache, "model", lambda path, make: make())
    monkeypatch.setattr(adapt.cache, "scores", lambda path, make: make())
    monkeypatch.setattr(adapt, "score_flights", lambda flights, model: scored.append(
        ({str(f.file.path) for f in flights}, model)) or [str(f.file.path) for f in flights])
    flights = flights_of(sweeps, 8)
    scores, half_scores = adapt.held_out_scores(adapt.Trainer(None, None, 0, ""), None, flights, tmp_path, "key")
    assert sorted(scores) == sorted(half_scores) == sorted(str(f.file.path) for f in flights)
    for test, train in scored:
        assert not test & train and train
    sizes = [len(train) for _, train in scored]
    assert max(sizes[1::2]) <= min(sizes[0::2]) // 2 + 1


def trained(number, lag_s=0.2):
    """A model without a network: `number` of its training."""
    return BestModel(best.Recipe(), {}, {}, b"", {"lag_s": lag_s, "number": number})


@pytest.fixture
def trainings(monkeypatch):
    """What every training is asked for. Its model labels every second flight in full, and detects edges 0.3 s late."""
    calls = []

    def fit(flights, seed, **options):
        calls.append({**options, "flights": flights})
        return best.with_lag(trained(len(calls)), options["lag_of"])

    def labels(flights, model):
        if flights:
            calls.append(model)
        edge = [logs.Edge(100 * (i + 1), kind, np.nan, np.nan) for i, kind in enumerate(("entry", "exit", "entry"))]
        return [(edge[:2], [], edge)[i % 3] for i in range(len(flights))]

    def run(log, model):
        true = logs.true_edges(log) if "zrange_m" in log.columns else ()
        return SimpleNamespace(edges=[Detection(e.sample + 30, e.kind) for e in true])

    for name, value in (("fit", fit), ("pseudo_labels", labels)):
        monkeypatch.setattr(best, name, value)
    monkeypatch.setattr(detector, "run", run)
    return calls


def test_labelled_flights_are_half_of_what_is_learnt(sweeps, trainings):
    """From `start`, with the twin's flights beside them, and with the lag of the recorded flights."""
    simulated = adapt.SimulatedFlights([log for _, log, _ in sweeps[3:8]], [None] * 5)
    labelled, start, twin = flights_of(sweeps, 2), object(), object()
    model = adapt.Trainer(start, simulated, 0, "").fit_all(twin, labelled)
    (training,) = trainings
    assert model.metadata == {"number": 1, "lag_s": pytest.approx(0.3)}
    assert training["start"] is start and len(training["flights"]) == 7 and training["pseudo_labels"] == [None] * 7
    assert sum(training["emphasis"][:2]) == pytest.approx(sum(training["emphasis"][2:]))
    assert adapt.Trainer(start, simulated, 0, "").fit_all(twin, []) is twin


def test_flights_without_labels_get_those_of_the_twins_detector(sweeps, trainings):
    """Three flights, the second without an edge that it sees, the third with an entry alone: the first is learnt."""
    simulated = adapt.SimulatedFlights([log for _, log, _ in sweeps[3:8]], [None] * 5)
    start, twin = object(), object()
    adapt.Trainer(start, simulated, 0, "").fit_all(twin, flights_of(sweeps, 3, down=False))
    teacher, training, student, *_ = trainings
    assert teacher is twin and training["start"] is start and student.metadata["number"] == 2
    assert [len(x) if x else x for x in training["pseudo_labels"]] == [2] + [None] * 5
    assert training["emphasis"] == [5.0] + [1.0] * 5


def test_a_detector_of_labelled_flights_labels_the_others(sweeps, trainings):
    """Of five flights without labels those in which it sees an entry without exit, or nothing, are left out."""
    simulated = adapt.SimulatedFlights([log for _, log, _ in sweeps[:4]], [None] * 4)
    flights = [*flights_of(sweeps, 3), *flights_of(sweeps, 8, down=False)[3:]]
    model = adapt.Trainer(None, simulated, 0, "").fit_all(object(), flights)
    first, teacher, second, better, third = trainings
    assert len(first["flights"]) == 3 + 4 and teacher.metadata["number"] == 1 and better.metadata["number"] == 3
    assert model.metadata["number"] == 5 and third["flights"] == second["flights"]
    assert second["flights"][3:5] == [flights[3].log, flights[6].log] and len(second["flights"]) == 3 + 2 + 4
    assert [len(x) if x else x for x in second["pseudo_labels"]] == [None] * 3 + [2, 2] + [None] * 4
    thirds = [sum(second["emphasis"][i:k]) for i, k in ((0, 3), (3, 5), (5, 9))]
    assert thirds == pytest.approx([thirds[0]] * 3)


def test_a_teacher_that_sees_nothing_is_the_detector(sweeps, trainings, monkeypatch):
    monkeypatch.setattr(best, "pseudo_labels", lambda flights, model: [[] for _ in flights])
    simulated = adapt.SimulatedFlights([sweeps[0][1]], [None])
    flights = [*flights_of(sweeps, 2), *flights_of(sweeps, 4, down=False)[2:]]
    model = adapt.Trainer(None, simulated, 0, "").fit_all(object(), flights)
    assert model.metadata["number"] == len(trainings) == 1


def test_the_lag_is_that_of_recorded_flights(sweeps, trainings):
    """Down range and pseudo-labels alike; a model that detects none of their edges keeps its own."""
    log = sweeps[0][1]
    edges = logs.true_edges(log)
    early = [replace(e, sample=e.sample - 10) for e in edges]
    assert best.with_lag(trained(0), ([log], [None])).metadata["lag_s"] == pytest.approx(0.3)
    assert best.with_lag(trained(0), ([log], [early])).metadata["lag_s"] == pytest.approx(0.4)
    assert best.with_lag(trained(0, 0.7), ([log], [[]])).metadata["lag_s"] == 0.7
    assert best.with_lag(trained(0), ([log], [[]]), ([log], [early])).metadata["lag_s"] == pytest.approx(0.4)


@pytest.mark.parametrize("of_scenario", [False, True])
def test_stages_with_another_firmware_or_version_are_made_anew(sweeps, tmp_path, monkeypatch, of_scenario):
    path = tmp_path / "mine.toml"
    scene, craft = scenario.load(calibrate.PLAIN), vehicles.load("crazyflie-2.1-flow")
    if of_scenario:
        scene = replace(scene, table={**scene.table, "firmware": str(path)})
    else:
        craft = replace(craft, firmware=str(path))
    flights, names = flights_of(sweeps, 2), []

    class Stopped(Exception):
        pass

    def responses(*of):
        names[-1].append(of[-1].name)
        raise Stopped

    monkeypatch.setattr(overlay, "simulate_responses", responses)
    for version, command in (("1", 36000), ("1", 46000), ("1", 36000), ("2", 36000)):
        path.write_text(f'base = "2026.08"\n[controller]\nthrust_base = {command}\n')
        monkeypatch.setattr("airtouch.twin.cache.__version__", version)
        names.append([adapt._key(flights, scene, craft, None, 0)])
        with pytest.raises(Stopped):
            adapt.simulated_flights(flights, scene, craft, 0, None, tmp_path)
    for a, b, c, d in zip(*names, strict=True):
        assert a == c and len({a, b, d}) == 3


def score(error_m):
    edges = (EdgeScore("entry", 100, 100, "entry", 0.1, error_m), EdgeScore("exit", 200, 200, "exit", 0.1, error_m))
    return FlightScore("a", Condition(speed_mps=0.3), edges, (), 2, 20.0)


def test_the_expected_error_is_a_power_law_that_never_promises_worse_or_a_miracle():
    def of(now, before):
        return adapt_report.expected_error(adapt.Adapted(None, [score(now)] * 4, [score(before)] * 4, []), 10, 5)
    assert of(0.02, 0.04)["then_m"] == pytest.approx(0.02 * 10 / 15)  # halved by twice the flights: exponent 1
    assert of(0.02, 0.02 * 2**0.5)["then_m"] == pytest.approx(0.02 * (10 / 15) ** 0.5)
    assert of(0.02, 0.01)["then_m"] == pytest.approx(0.02)
    assert of(0.02, 0.2)["exponent"] == 1.0
    assert adapt_report.expected_error(adapt.Adapted(None, [], [], []), 10) is None


def test_readable_takes_the_speed_from_the_log(sweeps, tmp_path):
    _, log, _ = sweeps[0]
    logs.write(log, tmp_path / "good.csv.gz")
    logs.write(replace(log, columns={k: v[:50] for k, v in log.columns.items()}), tmp_path / "short.csv.gz")
    files = [FlightFile(tmp_path / n, Condition()) for n in ("good.csv.gz", "short.csv.gz")]
    usable, left_out = adapt_report.readable(files)
    assert len(usable) == 1 and len(left_out) == 1
    assert usable[0].file.condition.speed_mps == pytest.approx(np.hypot(log["vx_mps"], log["vy_mps"])[-800:].max(),
                                                               abs=0.3)


def test_the_result_says_what_was_done():
    model = best.load(None)
    model = replace(model, metadata={**model.metadata, "adapted": {"twin": {}, "labelled": 3, "pseudo_labelled": 1}})
    left_out = [("bad.csv", "bad.csv: no gyro")]
    result = adapt.Adapted(model, [], [], [], left_out)
    assert result.plain() == {"twin": {}, "labelled": 3, "pseudo_labelled": 1,
                              "left_out": [["bad.csv", "bad.csv: no gyro"]],
                              "twin_only": None, "held_out_half": None, "held_out": None}
    assert len(repr(result)) < 200 and "3 flights labelled" in repr(result) and "1 left out" in repr(result)


@pytest.mark.parametrize("given", [False, True])
def test_python_fits_a_twin_as_the_command_does(sweeps, tmp_path, monkeypatch, given):
    """Unless it is given one. What is trained is the test of the stages above: here a stub stands for it."""
    folder = write(tmp_path / "flights", flights_of(sweeps, 5))
    fitted = calibrate.Twin(replace(scenario.load(calibrate.PLAIN), name="fitted"), vehicles.load(), "fitted")
    asked, seen = [], []
    monkeypatch.setattr(calibrate, "of_folder", lambda path: asked.append(path) or fitted)
    monkeypatch.setattr(calibrate, "of_flights", lambda paths, *of, **_: asked.append(sorted(paths)) or fitted)
    monkeypatch.setattr(adapt, "adapt", lambda flights, scene, *of, **_: seen.append((len(flights), scene.name))
                        or adapt.Adapted(best.load(None), [], [], []))
    at.adapt(folder, tmp_path / "mine.npz", twin=tmp_path / "twin" if given else None)
    assert seen == [(5, "fitted")]
    assert asked == [tmp_path / "twin" if given else sorted(folder.iterdir())]


def test_python_refuses_a_twin_beside_a_vehicle(sweeps, tmp_path):
    with pytest.raises(at.AirTouchError, match="vehicle"):
        at.adapt(tmp_path, tmp_path / "mine.npz", twin=tmp_path, vehicle="crazyflie-2.1-flow")
