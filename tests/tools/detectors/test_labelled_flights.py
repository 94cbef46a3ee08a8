"""The table of labelled flights: no flight scored is known, a run goes on, draws add up."""

import sys

import pytest

from airtouch import logs
from airtouch.detector import best
from airtouch.detector.evaluation import evaluate
from airtouch.detector.evaluation.data.dataset import Condition
from airtouch.detector.evaluation.score import EdgeScore, FlightScore
from airtouch.errors import AirTouchError
from airtouch.twin import adapt
from made_flight import SMALL, made_flight
from tools.detectors import labelled_flights
from tools.detectors.labelled import training


@pytest.fixture
def house(tmp_path, monkeypatch):
    """A folder of four synthetic flights on two days, and a `best` that trains in a moment."""
    pytest.importorskip("tensorflow")
    monkeypatch.setattr(best, "Recipe", lambda: SMALL)
    folder = tmp_path / "flights"
    folder.mkdir()
    for i in range(4):
        logs.write(made_flight(i), folder / f"f{i}.csv")
    (folder / "manifest.csv").write_text("file,day,speed_mps\n" + "".join(f"f{i}.csv,{i % 2},0.3\n" for i in range(4)))
    return folder


def run(monkeypatch, *arguments):
    monkeypatch.setattr(sys, "argv", ["labelled_flights.py", *map(str, arguments)])
    labelled_flights.main()


def test_every_flight_is_scored_by_models_that_never_saw_it(house, tmp_path, monkeypatch, capsys):
    trained, start = [], best.fit([made_flight(9)], recipe=SMALL)
    start.save(tmp_path / "start.npz")

    def fit(flights, **_):
        """No training: which flights a model would know is what counts here."""
        trained.append({log.source for log in flights})
        return start

    monkeypatch.setattr(best, "fit", fit)
    call = (house, "--start", tmp_path / "start.npz", "--by", "day", "--out", tmp_path / "out", "--labelled", 1,
            "--draws", 2, "--seeds", 1, "--steps", SMALL.steps, "--alone-steps", SMALL.steps)
    run(monkeypatch, *call)
    assert len(trained) == 8 and all(len(names) == 1 for names in trained)
    days = [int(next(iter(names)).split("/")[-1][1]) % 2 for names in trained]
    assert days == [1, 0] * 4, "day 0 is scored by a model of a flight of day 1, and the other way round"
    rows = [line for line in capsys.readouterr().out.splitlines() if line.startswith("| ") and "---" not in line][1:]
    assert [row.split(" | ")[0] for row in rows] == ["| as it is", "| and 1 labelled", "| 1 labelled alone"]
    assert [row.split(" | ")[1:3] for row in rows] == [["1", "4 / 8"], ["2", "4 / 8"], ["2", "4 / 8"]]
    run(monkeypatch, *call)
    assert len(trained) == 8, "what is done is not done again"


@pytest.mark.parametrize("change", ["speed", "content", "version"])
def test_scores_are_made_anew_when_what_they_depend_on_changes(house, tmp_path, monkeypatch, change):
    start, scored, real = best.fit([made_flight(9)], recipe=SMALL), [], evaluate.evaluate_flight
    start.save(tmp_path / "start.npz")
    monkeypatch.setattr(best, "fit", lambda flights, **_: start)
    monkeypatch.setattr(evaluate, "evaluate_flight", lambda file, *a: scored.append(file) or real(file, *a))
    call = (house, "--start", tmp_path / "start.npz", "--by", "day", "--out", tmp_path / "out", "--labelled", 1,
            "--draws", 1, "--seeds", 1, "--alone-steps", 0)
    run(monkeypatch, *call)
    run(monkeypatch, *call)
    assert len(scored) == 8, "nothing is done twice"
    manifest = house / "manifest.csv"
    if change == "speed":
        manifest.write_text(manifest.read_text().replace("0.3", "0.6"))
    elif change == "content":
        log = logs.read(house / "f0.csv")
        log.columns["zrange_m"][50:150] -= 0.01
        logs.write(log, house / "f0.csv", force=True)
    else:
        monkeypatch.setitem(labelled_flights.scores_of.__globals__, "__version__", "another")
    run(monkeypatch, *call)
    assert len(scored) == 16


def test_flights_beside_are_learnt_with_half_of_the_crops(house, tmp_path, monkeypatch):
    """Three flights of another folder beside the one of the pool: training goes on from the model with all four."""
    beside = tmp_path / "beside"
    beside.mkdir()
    for i in range(3):
        logs.write(made_flight(20 + i), beside / f"g{i}.csv")
    best.fit([made_flight(9)], recipe=SMALL).save(tmp_path / "start.npz")
    fits, fit = [], best.fit
    monkeypatch.setattr(adapt, "STEPS", {"shipped": 3, "scratch": 3})
    monkeypatch.setattr(best, "fit", lambda flights, *a, **o: fits.append((len(flights), o)) or fit(flights, *a, **o))
    call = (house, "--start", tmp_path / "start.npz", "--by", "day", "--out", tmp_path / "out", "--labelled", 1,
            "--draws", 1, "--seeds", 1, "--alone-steps", 0, "--speed", 0.3)
    run(monkeypatch, *call, "--beside", beside)
    assert [count for count, _ in fits] == [4, 4] and all(o["start"] is not None for _, o in fits)
    assert all(o["emphasis"] == [3.0, 1.0, 1.0, 1.0] for _, o in fits)
    with pytest.raises(AirTouchError, match="no --twin"):
        run(monkeypatch, *call, "--beside", beside, "--twin", tmp_path)


def test_the_other_flights_are_learnt_without_their_labels(house, tmp_path, monkeypatch, capsys):
    """One labelled flight, the other of its day without down range; the scored day is in neither training."""
    start = best.fit([made_flight(9)], recipe=SMALL)
    start.save(tmp_path / "start.npz")
    monkeypatch.setattr(labelled_flights, "twin_flights",
                        lambda folder, pool: adapt.SimulatedFlights([made_flight(20)], [None]))
    taught, begun = [], []

    def self_train(trainer, teacher, labelled, unlabelled, progress=None):
        taught.append(([f.file.path.name for f in labelled], [f.file.path.name for f in unlabelled]))
        begun.append(trainer.start)
        assert all(not f.labelled for f in unlabelled)
        return teacher

    monkeypatch.setattr(adapt.Trainer, "self_train", self_train)
    trained = []
    monkeypatch.setattr(best, "fit", lambda flights, *_, **__: trained.append(len(flights)) or start)
    call = (house, "--start", tmp_path / "start.npz", "--by", "day", "--out", tmp_path / "out", "--labelled", 1,
            "--draws", 1, "--seeds", 1, "--alone-steps", 0, "--unlabelled")
    run(monkeypatch, *call, "--twin", tmp_path)
    late = [pair for pair in taught if pair[1]]
    assert sorted(sorted(a + b) for a, b in late) == [["f0.csv", "f2.csv"], ["f1.csv", "f3.csv"]]
    assert trained == [2, 2], "the last row goes on from the models of the row before"
    assert "| and 1 labelled, the others without labels | 1 | 4 / 8 |" in capsys.readouterr().out
    assert begun == [None] * 4, "random weights with a twin"
    beside = tmp_path / "beside"
    beside.mkdir()
    logs.write(made_flight(21), beside / "g.csv")
    run(monkeypatch, *call, "--speed", 0.3, "--beside", beside)
    assert all(x is not None for x in begun[4:]) and len(begun) == 8, "the given model's, beside other flights"
    with pytest.raises(AirTouchError, match="give --twin or --beside"):
        run(monkeypatch, *call)


def test_a_start_that_knows_a_flight_is_refused(house, tmp_path, monkeypatch):
    best.fit([made_flight(1)], recipe=SMALL).save(tmp_path / "start.npz")
    with pytest.raises(AirTouchError, match="was trained on this flight"):
        run(monkeypatch, house, "--start", tmp_path / "start.npz", "--by", "day", "--out", tmp_path / "out")


def test_each_start_has_its_twin(house, tmp_path, monkeypatch):
    best.fit([made_flight(9)], recipe=SMALL).save(tmp_path / "start.npz")
    with pytest.raises(AirTouchError, match="2 twins for 1 models"):
        run(monkeypatch, house, "--start", tmp_path / "start.npz", "--twin", "a", "--twin", "b", "--by", "day",
            "--out", tmp_path / "out")


@pytest.mark.parametrize("option", ["--twin", "--beside"])
def test_steps_are_refused_where_they_have_no_effect(tmp_path, monkeypatch, option):
    with pytest.raises(AirTouchError, match="--steps has no effect with --twin or --beside"):
        run(monkeypatch, tmp_path, option, tmp_path, "--steps", 300)
    monkeypatch.setattr(sys, "argv", ["labelled_flights.py", str(tmp_path), option, str(tmp_path), "--start", "a"])
    assert labelled_flights.arguments().steps == best.FINE_TUNING["steps"]


def test_missed_edges_are_counted_by_height():
    hit_edge, missed_edge = EdgeScore("entry", 100, 110, "entry", -0.1, -0.03), EdgeScore("exit", 200)
    low, high = (FlightScore(h, Condition(height=h), edges, (), 1, 30.0)
                 for h, edges in (("low", (hit_edge, hit_edge)), ("h82", (hit_edge, missed_edge))))
    assert labelled_flights.missed_by_height([low, high, high]) == "h82 2/4, low 0/2"
    assert labelled_flights.missed_by_height([FlightScore("a", Condition(), (missed_edge,), (), 1, 30.0)]) == "-"


def test_false_edges_are_counted_by_place():
    edges = (EdgeScore("entry", 100), EdgeScore("exit", 200))
    scores = [FlightScore("a", Condition(), edges, (20, 90, 150, 200, 300, 400), 6, 30.0),
            FlightScore("b", Condition(), edges, (), 0, 30.0), FlightScore("c", Condition(), (), (5,), 1, 30.0)]
    assert labelled_flights.false_by_place(scores) == "3 / 1 / 3"


def test_smaller_draws_lie_within_larger_ones():
    pool = [made_flight(0, 500) for _ in range(9)]
    small, large = (training.draw_flights(pool, k, draw=3) for k in (2, 5))
    assert all(any(a is b for b in large) for a in small)
    with pytest.raises(AirTouchError, match="ask for fewer"):
        training.draw_flights(pool, 10, 0)
