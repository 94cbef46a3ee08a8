"""Sealed sets: nothing leaks, the seal holds, scores are right, and a small check of the diagnosis itself."""

import json
import os
import pickle
import re
import select
import signal
import sys
import time
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.stats import chi2

from airtouch import logs
from airtouch.cli.gap import command
from airtouch.cli.gap.blind import SEVERITIES_TAKE
from airtouch.errors import AirTouchError
from airtouch.gap.flights.flight import GROUND
from airtouch.gap.sealed import answers as blind_answers
from airtouch.gap.sealed import intervals
from airtouch.gap.sealed import key as blind_key
from airtouch.gap.sealed import make as blind
from airtouch.gap.sealed import run as blind_run
from airtouch.gap.sealed import score as blind_score
from airtouch.gap.sealed import severity as blind_severity
from airtouch.gap.sealed.severity import three_severities
from airtouch.gap.signatures.random_draws import KINDS
from airtouch.report import blind_tables
from gap_flights import without_fits

ROOT = Path(__file__).parents[3]
CLEAR = {"weak_motor": (0.02, 0.04, 0.08), "imu_noise": (0.5, 1.0, 2.0), "com_offset": (5e-4, 1e-3, 2e-3),
         "rotor_drag": (0.004, 0.008, 0.016), "time_jitter": (0.002, 0.004, 0.006)}


def of_still_flights(make):
    """`make` without fits to nominal flights: a set's log ratios weigh no evidence against their scatter."""
    def making(*arguments, **options):
        with pytest.MonkeyPatch.context() as patch:
            without_fits(patch)
            return make(*arguments, **options)

    return making


@pytest.fixture(scope="module")
def blind_check(tmp_path_factory):
    """A set of 10 flights, diagnosed and scored."""
    folder = tmp_path_factory.mktemp("blind") / "set"
    patch = pytest.MonkeyPatch()
    patch.setattr(blind, "severities_of", lambda *_: CLEAR)
    calibrated, study_in = [], blind_run.study_in
    patch.setattr(blind_run, "study_in", lambda of: calibrated.append(study_in(of)) or calibrated[-1])
    patch.setattr(blind, "make", of_still_flights(blind.make))
    figures = blind_run.run(folder, 10, seed=3, workers=2, unknown=1)  # 20 s of a processor a flight
    patch.undo()
    assert len(calibrated) == 1, "a set is calibrated once"
    return folder, figures, calibrated[0]


def test_diagnosis_names_clear_effects(blind_check):
    _, figures, _ = blind_check
    assert figures["diagnosed"] == 10 and figures["top_1"]["n"] == 4 and figures["false_alarms"]["n"] == 4
    assert figures["top_1"]["hits"] >= 3 and figures["top_3"]["hits"] == 4  # by chance, of 24 names: 3 in 10,000
    assert figures["false_alarms"]["hits"] <= 1
    assert figures["pairs_one_right"]["hits"] == 2
    assert figures["parameters"]["error"]["value"] < 0.25
    assert figures["shrink"]["right"]["value"] > 0.75 and figures["shrink"]["wrong"]["value"] < 0.25


def test_the_key_is_opened_for_the_answers_to_all_flights(tmp_path, monkeypatch):
    """Also for those beyond the ten thousandth, whose names are longer."""
    names, opened = ["flight_1000", "flight_10000"], []
    (tmp_path / "sealed.json").write_text(json.dumps({"key_sha256": "", "flights": 2}))
    for name in names:
        (tmp_path / f"{name}.csv.gz").touch()

    def answer(folder, answers, cases, *_):
        answers.mkdir(exist_ok=True)
        for name, without in cases:
            blind_run._place(answers, name, without).write_text(json.dumps({"flight": name, "without": without}))

    def open_key(folder, answers, key):
        opened.append(answers)
        mass = blind_key.DrawnEffect("mass", "mass", 0, {})
        return blind_key.Key({n: blind_key.DrawnFlight((mass,)) for n in names})

    for name, stand_in in (("answer", answer), ("open_key", open_key), ("study_in", lambda _: None),
                           ("sealed_key", lambda *_: b"{}")):
        monkeypatch.setattr(blind_run, name, stand_in)
    monkeypatch.setattr(blind_run.score, "score", lambda *_: {})
    for _ in range(2):  # the second time with the answers without an effect
        blind_run.run(tmp_path)
    assert opened == 2 * [blind_key.answers_sha256([{"flight": n, "without": []} for n in names])]


def dying(case):
    """A flight's answer as it was before; the first process that is given the second flight dies."""
    first = Path(os.environ["DIED"])
    if case[0] == "flight_0001" and not first.exists():
        first.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return case[0], case[1], (Path(os.environ["ANSWERS"]) / f"{case[0]}.json").read_text()


def always_dying(_):
    os.kill(os.getpid(), signal.SIGKILL)


def test_a_process_that_dies_loses_nothing(blind_check, tmp_path, monkeypatch):
    folder, *_ = blind_check
    monkeypatch.setenv("DIED", str(tmp_path / "died"))
    monkeypatch.setenv("ANSWERS", str(folder / "answers"))
    monkeypatch.setattr(blind_run, "with_study", dying)
    names, messages = [f"flight_{i:04d}" for i in range(3)], []
    blind_run.answer(folder, tmp_path / "answers", [(n, ()) for n in names], 2, messages.append, object())
    assert (tmp_path / "died").exists() and any("died" in s for s in messages)
    for n in names:
        assert (tmp_path / "answers" / f"{n}.json").read_bytes() == (folder / "answers" / f"{n}.json").read_bytes()


def test_what_is_sent_to_a_process_fits_into_its_pipe(blind_check, tmp_path, monkeypatch):
    """Else Python 3.11 waits for ever when the process dies while it is written (CPython issue 94777)."""
    jobs = []

    def in_order(submit, cases, ahead):
        jobs.extend(cases)
        return iter(())

    monkeypatch.setattr(blind_run, "in_order", in_order)
    with pytest.raises(AirTouchError):  # nothing comes back
        blind_run.answer(blind_check[0], tmp_path / "answers", [("flight_0000", ()), ("flight_0001", ())], 2,
                         study=object())
    assert jobs and all(len(pickle.dumps(case)) < select.PIPE_BUF for case in jobs)


def test_processes_that_die_again_and_again_are_told(blind_check, tmp_path, monkeypatch):
    monkeypatch.setattr(blind_run, "with_study", always_dying)
    with pytest.raises(AirTouchError, match="4 processes died"):
        blind_run.answer(blind_check[0], tmp_path / "answers", [("flight_0000", ()), ("flight_0001", ())], 2,
                         study=object())


@pytest.mark.parametrize("deaths", [3, 4])
def test_what_the_last_pass_answers_counts(tmp_path, monkeypatch, deaths):
    """Of the four passes the last may do all that is left."""
    passes = []

    def answers_of(_, tasks, *__):
        passes.append(len(tasks))
        if len(passes) <= deaths:
            raise BrokenProcessPool
        return iter([blind_run.Answer(t.flight, t.without, "{}") for t in tasks])

    monkeypatch.setattr(blind_run, "_answers", answers_of)
    cases = [("flight_0000", ()), ("flight_0001", ())]
    if deaths == 4:
        with pytest.raises(AirTouchError, match="4 processes died"):
            blind_run.answer(tmp_path, tmp_path, cases, study=object())
    else:
        blind_run.answer(tmp_path, tmp_path, cases, study=object())
        assert len(list(tmp_path.glob("*.json"))) == 2
    assert passes == 4 * [2]


def test_answers_are_the_same_wherever_flights_are_spread(blind_check, tmp_path):
    folder, _, study = blind_check
    key = json.loads(blind_key.key_path(folder).read_text())["answers"]
    name = next(n for n in sorted(key) if len(key[n]["effects"]) == 1)  # two take longer
    jobs = []

    def spread(function, items):
        for item in items:
            jobs.append(pickle.dumps((function, item)))
            function, item = pickle.loads(jobs[-1])
            yield function(item)

    blind_run.answer(folder, tmp_path / "answers", [(name, ())], study=study, mapper=spread)
    assert len(jobs) == 1 and len(jobs[0]) < 2e6  # dask warns of 10 MB
    assert (tmp_path / "answers" / f"{name}.json").read_bytes() == (folder / "answers" / f"{name}.json").read_bytes()


def test_the_search_for_strengths_says_where_it_is(monkeypatch):
    monkeypatch.setattr(blind, "nominal", lambda *_: [])
    monkeypatch.setattr(blind, "weakest", lambda *_: None)
    steps = []
    assert blind.severities_of(SimpleNamespace(vehicle=None), 0, ["wind", "mass"], steps.append) == {}
    assert [s.partition(",")[2] for s in steps] == [" effect 1 of 2", " effect 2 of 2"]
    assert {s.partition(",")[0] for s in steps} == {"severities of wind", "severities of mass"}


def test_make_says_at_once_how_long_it_takes_and_a_line_every_two_seconds(tmp_path, monkeypatch):
    def slow(*_, progress, **__):
        progress("severities of mass, effect 1 of 26")
        time.sleep(2.0)
        return tmp_path / "key.json"

    monkeypatch.setattr(blind, "make", slow)
    result = CliRunner().invoke(command, ["blind", "make", str(tmp_path / "set"), "-n", "3"])
    first, second, *_ = result.stderr.splitlines()
    assert first.startswith("3 flights; first the strengths of every effect, which take ") and "minutes" in first
    assert second.endswith("s] severities of mass, effect 1 of 26")
    assert SEVERITIES_TAKE in (ROOT / "host/docs/gap-blind.md").read_text("utf-8")


def test_flights_say_nothing_of_their_effect(blind_check):
    folder, *_ = blind_check
    log_names = {p.name.split(".")[0] for p in folder.glob("*.gz")}
    assert log_names == {f"cal_{i}" for i in range(6)} | {f"flight_{i:04d}" for i in range(10)}
    for path in folder.glob("*.csv.gz"):
        log = logs.read(path)
        assert not {"effects", "seed", "scenario", "flight"} & set(log.meta) and not log.meta.get("condition"), path
        assert log.meta["vehicle"] == "crazyflie-2.1-flow"
    public = (folder / "sealed.json").read_text()
    assert not any(name in public for name in CLEAR)


def test_a_sealed_set_is_scored_for_one_set_of_answers_by_its_own_key(blind_check, tmp_path):
    folder, *_ = blind_check
    key = blind_key.key_path(folder)
    rescored = blind_score.score(folder, folder / "answers")  # the same answers may be scored once more
    assert rescored["top_1"]["n"] == 4
    other = tmp_path / "other.json"
    other.write_text(json.dumps({"cases": [answer(f"flight_{i:04d}", "none", [("none", 1.0)]) for i in range(10)]}))
    with pytest.raises(AirTouchError, match="opened for other answers"):
        blind_score.score(folder, other)
    edited_key = tmp_path / "key.json"
    edited_key.write_bytes(key.read_bytes() + b" ")
    with pytest.raises(AirTouchError, match="not the key that was sealed"):
        blind_score.score(folder, folder / "answers", edited_key)
    with pytest.raises(AirTouchError, match="--force"):
        blind.make(folder, 3)
    with pytest.raises(AirTouchError, match="no sealed.json"):
        blind_key.open_key(tmp_path, "")


def test_command_writes_figures(blind_check, tmp_path):
    folder, figures, _ = blind_check
    out, plot = tmp_path / "f.json", tmp_path / "f.png"
    result = CliRunner().invoke(command, ["blind", "score", str(folder), str(folder / "answers"), "--json", str(out),
                                          "--plot", str(plot)])
    assert result.exit_code == 0, result.output
    assert json.loads(out.read_text())["top_1"] == figures["top_1"] and plot.read_bytes().startswith(b"\x89PNG")
    assert "false alarms" in result.output


@pytest.mark.parametrize("name", ["score.eps", "score.jpg", "score"])
def test_a_plot_of_an_unknown_format_is_refused_before_the_work(name, blind_check, tmp_path):
    answers = tmp_path / "answers.json"
    answers.write_text("no answers, which nobody reads")
    refused = CliRunner().invoke(command, ["blind", "score", str(blind_check[0]), str(answers), "--plot",
                                           str(tmp_path / name)]).exception
    assert isinstance(refused, AirTouchError) and ".png, .svg or .pdf" in str(refused)
    assert list(tmp_path.iterdir()) == [answers]


def test_a_score_without_a_plot_needs_no_matplotlib(blind_check, monkeypatch):
    folder = blind_check[0]
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    for name in [name for name in sys.modules if name.startswith(("matplotlib.", "airtouch.report."))]:
        monkeypatch.delitem(sys.modules, name)
    score = ["blind", "score", str(folder), str(folder / "answers")]
    result = CliRunner().invoke(command, score)
    assert result.exit_code == 0 and "false alarms" in result.output, result.output
    refused = CliRunner().invoke(command, [*score, "--plot", str(folder / "p.png")]).exception
    assert isinstance(refused, AirTouchError) and "--plot needs matplotlib: pip install" in str(refused)


def test_wilson_and_auroc_in_closed_form():
    half = intervals.wilson(5, 10)
    z2 = 1.959964 ** 2
    assert half["low"] == pytest.approx(0.5 - np.sqrt(z2 * (z2 + 10)) / (2 * (10 + z2)))
    assert half["high"] == pytest.approx(1.0 - half["low"])
    assert intervals.wilson(0, 10)["low"] == pytest.approx(0.0, abs=1e-12)
    assert intervals.wilson(0, 10)["high"] == pytest.approx(z2 / (10 + z2))
    pairs = intervals.share_in_groups(5 * [[True, True]] + 5 * [[False, False]])  # as sure as ten values, not twenty
    assert (pairs["hits"], pairs["n"]) == (10, 20) and pairs["low"] == half["low"] and pairs["high"] == half["high"]
    assert intervals.auroc([2, 3], [1, 1]) == 1.0 and intervals.auroc([1], [1]) == 0.5
    assert intervals.auroc([0.0, 2.0], [1.0]) == 0.5


def answer(name, verdict, ranking, effects=(), withheld=(), before=2.0, after=1.1):
    return {"flights": [name], "verdict": verdict, "ranking": [{"name": n, "probability": p} for n, p in ranking],
            "effects": [{"name": n, "parameters": q} for n, q in effects], "without": list(withheld),
            "gap": {"before": before, "after": after}, "control": {"before": before, "after": before}}


def test_scores_in_closed_form():
    def truth(name, value, level=0):
        return {"effects": [{"name": name, "kind": name, "level": level, "values": value}], "nats": 3.0 + 6.0 * level}

    key = {"answers": {
        "a": truth("mass", {"fraction": 0.1}), "b": truth("inertia", {"fraction": 0.5}, 1), "c": {"effects": []},
        "d": {"effects": truth("mass", {})["effects"] + truth("inertia", {})["effects"]}, "e": {"effects": []}}}
    quantity = {"fraction": {"value": 0.6, "low": 0.4, "high": 0.8, "unit": "1"}}
    cases = [
        answer("a", "effect", [("thrust_coefficient", 0.9), ("none", 0.1)], [("thrust_coefficient", {})]),
        answer("b", "effect", [("inertia", 0.8), ("none", 0.2), ("unknown", 0.0)], [("inertia", quantity)]),
        answer("c", "none", [("none", 1.0)]), answer("e", "unknown", [("unknown", 0.7), ("none", 0.3)]),
        answer("d", "effect", [("inertia", 0.8)], [("inertia", {}), ("gust", {})]),
        answer("b", "unknown", [("unknown", 0.6), ("gust", 0.4)], withheld=["inertia"])]
    key = blind_key.key_from(key)
    figures = blind_score.figures(key, cases)
    assert (figures["top_1"]["hits"], figures["top_1"]["n"]) == (2, 2)  # mass and thrust_coefficient are one
    assert (figures["false_alarms"]["hits"], figures["false_alarms"]["n"]) == (1, 2)
    assert figures["pairs_exact"]["hits"] == 0 and figures["pairs_one_right"]["hits"] == 1
    assert figures["parameters"]["error"]["value"] == pytest.approx(0.2)
    assert figures["parameters"]["coverage"]["hits"] == 1
    ideal = {level: (part["ideal"]["hits"], part["ideal"]["n"]) for level, part in figures["by_severity"].items()}
    assert ideal == {"weakest": (0, 1), "2x": (1, 1)}  # chance exceeds 3 nats, not 9, in a 27th of 2 % of the flights
    assert figures["shrink"]["right"]["value"] == pytest.approx(0.9) and figures["shrink"]["wrong"]["value"] == 0.0
    left_out = figures["unknown"]["all"]
    assert left_out["auroc"] == left_out["auroc_told_apart"] == 1.0 and left_out["wrong_name"]["hits"] == 0
    assert figures["confusion"]["none"] == {"none": 1, "unknown": 1}
    with pytest.raises(AirTouchError, match="not a flight of this set"):
        blind_score.figures(key, [answer("z", "none", [("none", 1.0)])])


def test_a_wrong_rotor_or_loop_is_told_beside_the_right_name():
    """Rotor 1 called 3, the rate's gain called the height's, and each rightly; mass has no variants."""
    free, fixed = {"value": 0.2, "low": 0.1, "high": 0.3, "unit": "1"}, {"value": 1.0, "unit": "1"}

    def truth(name, kind, values):
        return {"effects": [{"name": name, "kind": kind, "level": 0, "values": values}]}

    def motor(rotor):
        return {"thrust_loss": free, "rotor": {"value": rotor, "unit": "1"}}

    def gain(loop):
        return {name: free if name == loop else fixed for name in ("rate", "attitude", "position", "height")}

    weak = truth("weak_motor", "weak_motor", {"rotor": 1.0, "thrust_loss": 0.2})
    rate = truth("controller_gain", "controller_gain rate", {"rate": 1.2})
    flights = {"a": (weak, motor(3.0)), "b": (weak, motor(1.0)), "c": (rate, gain("height")),
               "d": (rate, gain("rate")), "e": (truth("mass", "mass", {"fraction": 0.1}), {"fraction": free})}
    key = blind_key.key_from({"answers": {n: true for n, (true, _) in flights.items()}})
    cases = [answer(n, "effect", [(name, 1.0)], [(name, q)]) for n, (true, q) in flights.items()
             for name in [true["effects"][0]["name"]]]
    figures = blind_score.figures(key, cases)
    assert figures["top_1"]["hits"] == 5
    assert (figures["right_variant"]["hits"], figures["right_variant"]["n"]) == (2, 4)
    error, coverage = (figures["parameters"][f"{which}_with_variant"] for which in ("error", "coverage"))
    assert (coverage["hits"], coverage["n"]) == (2, 5)  # the mass, 0.1 answered 0.2, and motor b are within theirs
    assert error["n"] == 5 and error["value"] == pytest.approx(1.0)  # 1, 0, 1, 5 (rate 1.2 answered 0.2), 1
    assert ("right rotor or loop, where the first answer is right", "4") in {
        (name, n) for name, _, n, _ in blind_tables.score_rows(figures)}


@pytest.mark.parametrize(("name", "drawn", "answered", "error"), [
    ("battery_sag", {"strength": 0.1, "charge": 0.8, "capacity": 1.0}, {"strength": 0.2}, 1.0),
    ("battery_sag", {"strength": 0.1, "charge": 0.8, "capacity": 1.0}, {"strength": 0.0}, 1.0),
    ("battery_sag", {"strength": 0.1, "charge": 0.8, "capacity": 1.0}, {"charge": 0.4, "capacity": 0.2}, 0.0),
    ("slung_load", {"load": 0.002, "length": 0.2}, {"load": 0.004}, 1.0),
    ("wind", {"x": 0.3, "y": 0.0, "z": 0.0}, {"x": 0.7}, 4.0 / 3.0)])
def test_the_error_is_that_of_parameters_with_a_neutral_value(name, drawn, answered, error):
    """A strength twice too large is 100 % off, however well the charge of the battery or the length is known."""
    quantities = {k: {"value": x, "low": x, "high": x} for k, x in (drawn | answered).items()}
    key = blind_key.Key({"a": blind_key.DrawnFlight((blind_key.DrawnEffect(name, name, 0, drawn),))})
    figures = blind_score.figures(key, [answer("a", "effect", [(name, 1.0)], [(name, quantities)])])
    assert figures["parameters"]["error"]["value"] == pytest.approx(error)
    assert (figures["parameters"]["coverage"]["hits"], figures["parameters"]["coverage"]["n"]) == \
        (len(drawn) - len(answered), len(drawn))


def test_flights_are_counted_whose_kind_has_no_strength_four_times_the_weakest():
    """Mass up to 0.2 where 0.1 can be seen, and a kind with room to spare."""
    strengths = {"mass": three_severities(0.1, 0.2), "inertia": three_severities(0.1, 1.0)}
    flights = {f"{name} {level}": blind_key.DrawnFlight((blind_key.DrawnEffect(name, name, level, {"fraction": x}),))
               for name, three in strengths.items() for level, x in enumerate(three)}
    figures = blind_score.figures(blind_key.Key(flights, strengths), [])
    for level in ("2x", "4x"):
        capped = figures["by_severity"][level]["capped"]
        assert (capped["hits"], capped["n"]) == (1, 2)


def test_a_wrong_name_counts_where_the_data_tell_it_from_the_effect():
    def case(**nats):
        return {"ranking": [{"name": n, "nats": x} for n, x in nats.items()]}

    assert blind_score.separable(case(mass=50.0, wind=30.0), "mass", ["wind"])
    assert not blind_score.separable(case(mass=50.0, wind=45.0), "mass", ["wind"])
    assert not blind_score.separable(case(mass=50.0, wind=30.0, gust=15.0), "mass", ["wind", "gust"])
    assert blind_score.separable(case(mass=5.0), "mass", [])
    assert blind_score.separable({"ranking": [{"name": "mass"}]}, "mass", ["wind"])  # gains not known


def test_answers_that_are_none(tmp_path):
    (tmp_path / "x.json").write_text("{}")
    with pytest.raises(AirTouchError, match="without `flights`"):
        blind_answers.read_answers(tmp_path)
    (tmp_path / "x.json").write_text("no")
    with pytest.raises(AirTouchError, match="not the JSON"):
        blind_answers.read_answers(tmp_path)
    with pytest.raises(AirTouchError, match="gone.json: cannot be read: No such file or directory$"):
        blind_answers.read_answers(tmp_path / "gone.json")
    (tmp_path / "y.json").mkdir()
    (tmp_path / "x.json").unlink()
    with pytest.raises(AirTouchError, match="y.json: cannot be read: Is a directory$"):
        blind_answers.read_answers(tmp_path)


@pytest.mark.parametrize(("spoil", "says"), [
    (lambda cases: [answer("other_0003", "none", [("none", 0.9)]), *cases], "other_0003: diagnosed, but not a flight"),
    (lambda cases: cases[:1], "flight_0001: not diagnosed .1 of 2 flights"),
    (lambda cases: [*cases, cases[0]], "flight_0000: diagnosed 2 times"),
    (lambda cases: [cases[0], {k: v for k, v in cases[1].items() if k != "verdict"}], "flight_0001: .* without all of"),
    (lambda cases: [cases[0], {k: v for k, v in cases[1].items() if k != "gap"}], "flight_0001: .* without all of"),
    (lambda cases: [cases[0], {**cases[1], "ranking": [{"name": "mass"}]}], "flight_0001: .* without all of")])
def test_answers_that_cannot_be_scored_leave_the_key_shut(tmp_path, spoil, says):
    """The file of another set, or one that lacks a field, was the one that the key was opened for."""
    folder, mass = tmp_path / "set", blind_key.DrawnEffect("mass", "mass", 0, {"fraction": 0.1})
    folder.mkdir()
    names = ("flight_0000", "flight_0001")
    for name in names:
        (folder / f"{name}.csv.gz").touch()
    flights = {names[0]: blind_key.DrawnFlight(()), names[1]: blind_key.DrawnFlight((mass,))}
    blind_key.seal(folder, blind_key.key_path(folder), blind_key.Key(flights), 0)
    cases = [answer(names[0], "none", [("none", 1.0)]), answer(names[1], "effect", [("mass", 1.0)], [("mass", {})])]
    wrong, right = tmp_path / "wrong.json", tmp_path / "right.json"
    wrong.write_text(json.dumps({"cases": spoil(cases)}))
    right.write_text(json.dumps({"cases": cases}))
    with pytest.raises(AirTouchError, match=says):
        blind_score.score(folder, wrong)
    assert blind_score.score(folder, right)["top_1"]["hits"] == 1


@pytest.mark.parametrize(("without", "counts"), [(["wind"], 0), (["mass"], 1), (["wind", "thrust_coefficient"], 1)])
def test_unknown_is_right_only_where_the_true_effect_was_left_out(without, counts):
    """A mass in a diagnosis without wind is a right name; mass and thrust_coefficient are one."""
    mass = blind_key.DrawnFlight((blind_key.DrawnEffect("mass", "mass", 0, {"fraction": 0.1}),))
    diagnosis = answer("a", "effect", [("mass", 1.0)], [("mass", {})], without)
    out = blind_score.figures(blind_key.Key({"a": mass}), [diagnosis])["unknown"]
    assert out.get("all", {}).get("wrong_name", {}).get("n", 0) == counts


def test_a_diagnosis_of_several_flights_together_is_refused():
    """It was scored as one of the first of them alone."""
    flights = {n: blind_key.DrawnFlight(()) for n in "ab"}
    together = {**answer("a", "none", [("none", 1.0)]), "flights": ["a", "b"]}
    for score in (lambda: blind_score.figures(blind_key.Key(flights), [together]),
                  lambda: blind_answers.check_answers([together], ["a", "b"])):
        with pytest.raises(AirTouchError, match="2 flights.*--each"):
            score()


@pytest.mark.parametrize(("standing_s", "lost_s", "flown"), [(2.5, 0.0, True), (4.0, 0.0, False), (0.0, 9.0, True)])
def test_a_vehicle_that_comes_to_stand_on_the_platform_has_crashed(standing_s, lost_s, flown):
    """A flight of 10 s with 5 s on the ground before it, which do not count; lost rows are no contact."""
    phase = np.where(np.arange(1500) < 500, GROUND, GROUND + 1)
    lost = np.arange(1500) >= 1500 - round(100 * lost_s)
    usable = (phase != GROUND) & (np.arange(1500) >= 500 + round(100 * standing_s)) & ~lost
    flight = SimpleNamespace(phase=phase, usable=usable, not_logged=lost)
    assert blind_severity.all_flown([flight]) == flown and not blind_severity.all_flown([])
    calm = SimpleNamespace(phase=phase, usable=phase != GROUND, not_logged=np.zeros(1500, bool))
    assert blind_severity.all_flown([flight, calm]) == flown


def test_the_weakest_of_normal_log_ratios_is_seen_as_often_as_said():
    """Two normal variables whose log ratios have means 2 x APART apart: the test has its false alarms and its power."""
    distance = np.sqrt(2.0 * blind_severity.APART)
    none, there = (distance * np.random.default_rng(k).normal(m, 1.0, 400_000) - 0.5 * distance ** 2
                   for k, m in enumerate((0.0, distance)))
    assert 0.5 * (there.mean() - none.mean()) == pytest.approx(blind_severity.APART, rel=0.01)
    alarm = none.mean() + blind_severity.FALSE_ALARM * none.std()
    assert np.mean(none > alarm) == pytest.approx(0.02 / len(KINDS), rel=0.15)
    assert np.mean(there > alarm) == pytest.approx(0.95, abs=0.002)
    assert blind_severity.SEEN == pytest.approx(0.5 * chi2.isf(2.0 * 0.02 / len(KINDS), 1))  # one-sided


def test_severities_are_in_equal_ratios_and_strengths_within_bounds():
    assert three_severities(0.1, 1.0) == pytest.approx((0.1, 0.2, 0.4))
    assert three_severities(0.1, 0.2) == pytest.approx((0.1, np.sqrt(0.02), 0.2))
    for kind in KINDS.values():
        rng = np.random.default_rng(0)
        active = kind.active(kind.highest, rng)
        assert all(p.low <= active.values[p.name] <= p.high for p in active.effect.parameters), kind


def test_a_set_is_balanced():
    levels = {k: (1.0, 2.0, 4.0) for k in ("mass", "thrust_coefficient", "wind", "gust")}
    cases = blind.draw(100, levels, np.random.default_rng(0))
    sizes = [len(c) for c in cases]
    assert (sizes.count(1), sizes.count(0), sizes.count(2)) == (42, 42, 16)
    assert not any({n for n, _ in c} == {"mass", "thrust_coefficient"} for c in cases)
    counts = [sum(c == [(n, level)] for c in cases) for n in levels for level in range(3)]
    assert max(counts) - min(counts) <= 1


@pytest.mark.parametrize(("kinds", "says"), [([], "no effect is strong enough"), (["mass"], "make a pair"),
                                             (["mass", "thrust_coefficient"], "make a pair")])
def test_a_set_that_cannot_be_drawn_is_refused(kinds, says):
    with pytest.raises(AirTouchError, match=says):
        blind.draw(100, {k: (1.0, 2.0, 4.0) for k in kinds}, np.random.default_rng(0))


def test_the_goals_are_those_of_the_page_and_of_figures_of_a_score(blind_check):
    page = (ROOT / "host/docs/gap-blind.md").read_text()
    table = re.search(r"^\| figure \| seed .*\| goal \|\n\|[-|]*\n((?:\|.*\n)+)", page, re.M).group(1)
    on_page = [re.findall(r"0\.\d+|\d+", line.split("|")[-2]) for line in table.splitlines()]
    goals = dict.fromkeys(goal for text in blind_score.GOALS.values() for goal in re.findall(r"0\.\d+|\d+", text))
    assert [goal for row in on_page for goal in row] == list(goals)
    shown = [place for _, place in blind_tables.figures_shown(["all", *blind_score.SEVERITIES])]
    assert set(blind_score.GOALS) <= set(shown)
    rows = {name: (value, n, goal) for name, value, n, goal in blind_tables.score_rows(blind_check[1])}
    assert rows["top-1, single effects"][1:] == ("4", "at least 95 %")
    assert rows["pairs: exact set"][1:] == ("2", "at least 85 %")


def test_an_auroc_has_the_number_of_its_own_flights():
    """Of flights that the data can tell apart, where there are fewer of them: 3 of 10."""
    of_all = {"auroc": 0.9, "auroc_told_apart": 0.99, "wrong_name": {"value": 0.3, "low": 0.1, "high": 0.5, "n": 10},
              "wrong_name_told_apart": {"value": 0.1, "low": 0.0, "high": 0.4, "n": 3}}
    rows = {name: n for name, _, n, _ in blind_tables.score_rows({"unknown": {"all": of_all}})}
    assert sorted(n for name, n in rows.items() if "AUROC" in name) == ["10", "3"]
