"""The test of wakes that knows when a vehicle was under another, and what the diagnosis names, on synthetic tracks."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from airtouch.errors import AirTouchError
from tools.diagnosis.recordings.wakes import false_alarms, known_seconds, tracks, with_labels, without_seconds


def window(cf="cf50", start_s=0.0, place=(0.0, 0.0, 0.5), n=1000, force=0.0):
    generator = np.random.default_rng(int(start_s) + n)
    row = {"cf": cf, "start_s": str(start_s), "flight": f"day/{cf}_01"}
    noise = generator.normal(scale=0.02, size=(3, n))
    return tracks.Track(row, np.tile(place, (n, 1)), noise[0] + force, noise[1], noise[2], np.ones(n, bool))


def test_another_vehicle_is_above_where_both_cuts_hold_the_time():
    low, high = window(), window("cf51", 4.0, (0.1, 0.0, 0.9), 300)
    assert np.flatnonzero(tracks.under(low, high)).tolist() == list(range(400, 700))
    assert not tracks.under(high, low).any()
    assert not tracks.under(low, window("cf51", 0.0, (0.2, 0.0, 0.9))).any()
    assert not tracks.under(low, window("cf51", 0.0, (0.0, 0.0, 1.2))).any()


def test_only_vehicles_of_the_same_flight_count():
    low, high = window(), window("cf51", 0.0, (0.0, 0.0, 0.9))
    assert tracks.overhead_at(low, [low, high]).all()
    high.row["flight"] = "day/cf51_02"
    assert not tracks.overhead_at(low, [low, high]).any()


def test_a_push_in_these_seconds_is_beyond_chance_and_none_is_not():
    acts = np.zeros(1000, bool)
    acts[300:400] = True
    by_chance = known_seconds.chance(acts, [window(n=1000 + i) for i in range(6)])
    push = window(n=1000, force=np.where(acts, -0.05, 0.0))
    assert known_seconds.measures(push, acts)[0] == pytest.approx(0.05, abs=0.01)
    assert known_seconds.measures(push, acts)[0] > np.quantile(by_chance[:, 0], 0.997)
    assert known_seconds.measures(window(n=1200), np.resize(acts, 1200))[0] < np.quantile(by_chance[:, 0], 0.997)


def test_a_wake_with_too_few_seconds_of_the_path_is_listed_and_counted_apart(capsys):
    here = {"file": "low.csv", "vehicle": "34 g", "manoeuvre": "hover", "s_under": "2.0"}
    low, nominal = window(), window("cf52", 50.0)
    low.row.update(here, truth="downwash")
    nominal.row.update(here, file="calm.csv", truth="none")
    for samples, words in ((40, "less than 0.5 s held"), (60, "| yes |")):
        high = window("cf51", 4.0, (0.0, 0.0, 0.9), samples)
        high.row.update(here, file="high.csv", truth="partner")
        low.force[:] = np.where(tracks.under(low, high), -0.2, low.force)
        known_seconds.show_detected([low, high, nominal], {})
        out = capsys.readouterr().out
        assert words in next(line for line in out.splitlines() if "low.csv" in line)
        assert f"{int(samples == 40)} more, for which the data hold less than 0.5 s" in out


def test_named_wakes_are_counted_by_whether_the_path_is_held(tmp_path):
    """One wake whose path is held for 3 s is named, one for 0.3 s and one without another cut are not and are."""
    def wake(name, number, seconds):
        low = window()
        low.row.update(file=name, truth="downwash", flight=f"day/cf50_{number}")
        high = window("cf51", 4.0, (0.1, 0.0, 0.9), round(100 * seconds))
        high.row.update(file=f"above {name}", flight=f"day/cf51_{number}")
        return [low, high] if seconds else [low]

    held = [*wake("long", 1, 3.0), *wake("unnamed", 2, 3.0), *wake("short", 3, 0.3), *wake("alone", 4, 0.0)]
    kept = tmp_path / "answers.jsonl"
    results = [{"row": "swarm", "flight": name, "verdict": "effect" if names else "none",
                "effects": [{"name": n} for n in names]} for name, names in (
        ("long", ["downwash", "mass"]), ("unnamed", ["mass", "downwash"]), ("short", []), ("alone", ["downwash"]))]
    kept.write_text("".join(json.dumps(result) + "\n" for result in results))
    answers = known_seconds.answers_of(kept)
    assert answers == {"long": "downwash", "unnamed": "mass", "short": "none", "alone": "downwash"}
    assert known_seconds.named_by_path(held, answers) == {True: [True, False], False: [False, True]}
    assert known_seconds.named_by_path(held, known_seconds.answers_of(None)) == {True: [False] * 2, False: [False] * 2}


@pytest.mark.parametrize(("more", "answer"), [
    ({"partner": 1}, None), ({"left_out": ["downwash"]}, "downwash"), ({"row": "nominal"}, "downwash"),
    ({"verdict": "refused"}, "downwash")])
def test_two_diagnoses_of_one_flight_are_refused_and_other_rows_left_out(tmp_path, more, answer):
    """Of runs with a partner and without, nobody knows which is asked for."""
    first = {"row": "swarm", "flight": "a.csv", "partner": 0, "left_out": [], "verdict": "effect",
             "effects": [{"name": "downwash"}]}
    results = tmp_path / "results.jsonl"
    results.write_text("".join(json.dumps(one) + "\n" for one in (first, {**first, "effects": [], **more})))
    if answer is None:
        with pytest.raises(AirTouchError, match="a.csv was diagnosed more than once, as with --partner"):
            known_seconds.answers_of(results)
    else:
        assert known_seconds.answers_of(results) == {"a.csv": answer}


def test_the_interval_of_an_area_holds_it():
    """Scores apart by one standard deviation: the area is 0.76, and 100 of each give it to 0.03."""
    rng = np.random.default_rng(0)
    low, high = without_seconds.auroc_interval(rng.normal(1.0, 1.0, 100), rng.normal(0.0, 1.0, 100))
    assert low < 0.76 < high and 0.06 < high - low < 0.2


@pytest.fixture
def stand_in(monkeypatch):
    """For a module's way from a case to its data: a flight and a study are the names of their logs."""
    def make(module):
        for name in ("ready", "read"):
            monkeypatch.setattr(module, name, lambda x, *_: x)
        monkeypatch.setattr(module, "Data", lambda study, flights: (study, flights[0].rsplit("/", 1)[-1]))
        monkeypatch.setattr(module, "vehicles", SimpleNamespace(load=lambda name: SimpleNamespace(name=name)))
        monkeypatch.setattr(module, "calibrate", SimpleNamespace(calibrated=lambda vehicle, base, **_: ("", 0)))
    return make


def case(name, truth="none", folder="neuralswarm"):
    return SimpleNamespace(flight=f"F/{folder}/flights/{name}", vehicle="34 g", truth=truth, baseline=("one", "two"))


def test_nominal_flights_are_given_the_seconds_of_wakes_of_their_vehicle(stand_in, monkeypatch, capsys, tmp_path):
    """Of three nominal flights that are tracks one gains enough, one too little, one flies another manoeuvre."""
    stand_in(false_alarms)
    low, high = window(), window("cf51", 4.0, (0.1, 0.0, 0.9), 300)
    calm = [window(f"cf{60 + i}") for i in range(3)]
    for t, name, truth in zip([low, high, *calm], ("low", "high", "a", "b", "c"), ("downwash", "", *["none"] * 3),
                              strict=True):
        t.row.update(file=name, vehicle="34 g", manoeuvre="swap" if name == "c" else "hover", truth=truth)
    seconds_overhead = []
    monkeypatch.setattr(false_alarms.overhead, "with_overhead",
                        lambda study, flight, seconds: seconds_overhead.append(seconds))
    monkeypatch.setattr(false_alarms.cases, "nominal", lambda *_: map(case, ("a", "b", "c", "no track")))
    wake = SimpleNamespace(key="", strength=None)
    monkeypatch.setattr(false_alarms.gates, "passing_effects", lambda data: {
        false_alarms.gates.KNOWN_OVERHEAD: SimpleNamespace(**vars(wake), gain=data[1])})
    monkeypatch.setattr(false_alarms, "passing_evidence",
                        lambda data, key, gain, strength: np.float64(false_alarms.PASSING_GAIN - (gain != "a")))
    for _ in range(2):  # the second run takes what the first kept
        false_alarms.show_false_alarms("F", [low, high, *calm], tmp_path / "kept.jsonl")
        *lines, last = capsys.readouterr().out.splitlines()
        assert lines == ["a: 1 of 1", "b: 0 of 1", "c: 0 of 0"] and "1 of 2" in last and last.endswith("in 1 flights")
    assert seconds_overhead == [((4.0, 7.0),)] * 2


def test_measures_without_seconds_are_held_against_nominal_flights_of_the_vehicle(stand_in, monkeypatch, capsys):
    """Of both wakes and both nominal flights the measures order all pairs, half, three of four and none."""
    stand_in(without_seconds)
    sizes = {"w1": (3.0, 1.0, 2.0, 0.0), "w2": (4.0, 3.0, 5.0, 0.0),
             "n1": (1.0, 2.0, 1.0, 1.0), "n2": (2.0, 2.0, 3.0, 1.0)}
    measures = (without_seconds.OVERHEAD, without_seconds.UNSTEADY_TORQUE, without_seconds.UNSTEADY_LIFT,
                without_seconds.DOWNWARD)
    monkeypatch.setattr(without_seconds, "passing_sizes",
                        lambda data: dict(zip(measures, sizes[data[1]], strict=True)))
    monkeypatch.setattr(without_seconds, "DRAWS", 20)
    monkeypatch.setattr(without_seconds.cases, "swarm", lambda *_: [case("w1", "downwash"), case("w2", "downwash"),
                                                                    case("ground", "ground_effect")])
    monkeypatch.setattr(without_seconds.cases, "nominal", lambda *_: [case("n1"), case("n2"),
                                                                      case("x", folder="airtouch")])
    without_seconds.show_without_seconds("F")
    rows = capsys.readouterr().out.splitlines()[2:]
    assert [row.split(" | ")[1] for row in rows] == list(measures)
    assert [row.split(" | ")[2][:4] for row in rows] == ["1.00", "0.50", "0.75", "0.00"]
    assert [row.split(" | ")[3] for row in rows] == [f"{n} of 2, of 2 |" for n in (2, 1, 1, 0)]


@pytest.mark.parametrize("learner", sorted(with_labels.LEARNERS))
def test_classifiers_detect_wakes_that_differ_and_no_others(learner):
    """Of 40 wakes half differ from nominal flights by ten deviations: those are detected, of the others hardly any."""
    rng = np.random.default_rng(3)
    wake = np.arange(80) < 40
    shift = np.where(np.arange(80) < 20, 10.0, 0.0)
    vehicle = np.where(np.arange(80) % 2 == 0, "34 g", "67 g")
    numbers = rng.normal(size=(80, 3)) + shift[:, None] + np.where(vehicle == "34 g", 0.0, 100.0)[:, None]
    relative = with_labels.relative_numbers(numbers, vehicle, wake)
    assert abs(relative[~wake].mean()) < 0.5 and relative[:20].mean() == pytest.approx(10.0, abs=0.5)
    hit = with_labels.detected(with_labels.held_out_scores(relative, wake, np.arange(80) // 4, learner), wake)
    assert hit[:20].all() and hit[20:40].sum() < 8 and not hit[40:].any()


def test_the_limit_leaves_one_nominal_flight_in_twenty_beyond_it():
    """Of 40 nominal flights with the scores 0 to 39 the limit is at 37; of the wakes those above it are detected."""
    scores, wake = np.concatenate([np.arange(40.0), [36.5, 37.5]]), np.arange(42) >= 40
    assert list(np.flatnonzero(with_labels.detected(scores, wake))) == [41]
