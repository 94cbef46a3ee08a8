"""What `tools/diagnosis/gap_training.py` flies and tests, and its figures, against closed forms."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from airtouch import logs
from airtouch.detector.evaluation.data.dataset import Condition, FlightFile
from airtouch.errors import AirTouchError
from airtouch.gap.answer.named_effects import with_random_part
from airtouch.gap.result import NamedEffect, Quantity
from airtouch.gap.signatures.candidates import random_part_of
from airtouch.logs.flight_log import PWM
from airtouch.simulation import batch, effects, replay, scenario
from airtouch.simulation import signals as at
from airtouch.simulation.effects import Active
from tools.diagnosis import gap_training
from tools.diagnosis.recordings import passes


def test_nothing_added_is_the_scenario_with_everything_off(tmp_path):
    own = scenario.load("paper-mixed")
    off = batch.simulate(replace(own, table={**own.table, "effects": {}}), seeds=2, seed=3)
    without_effects = gap_training.training_flights(gap_training.scene_text([]), 2, 3, tmp_path)
    for plain, log in zip(off, without_effects, strict=True):
        assert log.meta["effects"] == []
        assert all(np.array_equal(plain[c], log[c], equal_nan=True) for c in plain.columns)


def test_effects_are_flown_as_found():
    effects = [("weak_motor", {"rotor": 2, "thrust_loss": 0.07}), ("gust", {"rms": 0.2}),
               ("weak_motor", {"rotor": 3, "thrust_loss": -0.02})]
    scene = scenario.parse(gap_training.scene_text(effects), "synthetic")
    on = scenario.draw_flight(scene, 0, 5).effects
    assert sorted(name for name, _ in on) == ["gust", "weak_motor", "weak_motor"]
    assert {v["rotor"]: v["thrust_loss"] for n, v in on if n == "weak_motor"} == {2: 0.07, 3: -0.02}


def test_effects_are_added_one_after_another_and_once():
    def effect(name, **values):
        return {"name": name, "parameters": {k: {"value": v} for k, v in values.items()}}

    diagnoses = {"all": {"effects": [effect("gust", rms=0.1), effect("weak_motor", rotor=1, thrust_loss=0.1)]},
                 "close": {"effects": [effect("gust", rms=0.9), effect("weak_motor", rotor=4, thrust_loss=0.2)]},
                 "calibration": [["weak_motor", {"rotor": 1, "thrust_loss": 0.5}], ["inertia", {"fraction": 0.1}]]}
    rows = gap_training.chain(diagnoses)
    assert [len(on) for _, on in rows] == [0, 1, 2, 3, 4]
    assert rows[-1][1] == [("gust", {"rms": 0.9}), ("weak_motor", {"rotor": 4, "thrust_loss": 0.2}),
                           ("weak_motor", {"rotor": 1, "thrust_loss": 0.1}), ("inertia", {"fraction": 0.1})]


def test_no_flight_is_in_two_groups():
    flights = {FlightFile(Path(f"{i}.csv"), Condition(fold=i % 5)): None for i in range(20)}
    group, other_group = gap_training.cut(flights, ["013", "24"])
    assert not set(group) & set(other_group) and len(group) + len(other_group) == 20
    assert {f.condition.fold for f in group} == {0, 1, 3}
    for day_groups in (["01", "123", "4"], ["01", "23"]):
        with pytest.raises(AirTouchError, match="fold"):
            gap_training.cut(flights, day_groups)


def test_half_the_swing_is_six_decibels_apart(tmp_path):
    text = gap_training.scene_text([("motor_noise", {"rms": 0.02})])
    flights = gap_training.training_flights(text, 3, 0, tmp_path)
    half = [log.with_columns({c: 0.5 * log[c] for c in log.columns if c.startswith(("acc", "gyro")) or c in PWM})
            for log in flights]
    assert passes.apart_db(half, flights) == pytest.approx([20 * np.log10(2)] * 2, abs=0.01)
    assert passes.apart_db(flights, flights) == pytest.approx([0.0, 0.0])


def test_the_pieces_of_a_pass_share_no_sample(tmp_path):
    for log in gap_training.training_flights(gap_training.scene_text([]), 3, 0, tmp_path):
        entry, leave = (e.sample for e in logs.true_edges(log))
        over, before = passes.pieces(log)
        assert before["t_s"][-1] < over["t_s"][0] < log["t_s"][entry] < log["t_s"][leave] < over["t_s"][-1]
        assert logs.airborne(before).all() and not logs.true_edges(before)
    assert passes.pieces(log.slice(0, entry)) is None


@pytest.mark.parametrize("mean", [0.0, 0.4, 1.7])
def test_an_unsteady_effect_is_reported_so_that_it_can_be_switched_on(mean):
    """Switched on as reported, the random force is the one that was fitted, whatever the mean's strength."""
    signals = np.zeros((400, at.COUNT))
    signals[:, at.STEP], signals[:, at.THRUST:at.THRUST + 4] = 0.01, 0.09
    signals[:, at.ROTOR_RADIUS], signals[:, at.ROTOR_SPACING] = 0.0235, 0.065
    signals[:, at.LOWER_HEIGHT:at.LOWER_HEIGHT + 4], signals[:, at.UPPER_HEIGHT:at.UPPER_HEIGHT + 4] = 0.04, 0.3
    for name in ("LOWER_FACTOR", "LOWER_ROUGHNESS", "UPPER_FACTOR", "UPPER_ROUGHNESS"):
        signals[:, getattr(at, name):getattr(at, name) + 4] = 1.0

    def force(values):
        return replay.wrench_of(Active(effects.get("ground_effect"), values), signals, 3)

    part = random_part_of("ground_effect")
    part = replace(part, values={**part.values, "turbulence": 0.25})
    effect = NamedEffect("ground_effect", {k: Quantity(v, 0.0, 0.1) for k, v in {**part.values, "strength": mean,
                                                                                 "turbulence": 0.0}.items()})
    reported = {k: q.value for k, q in with_random_part(effect, part).parameters.items()}
    swing = force(part.values) - force({**part.values, "turbulence": 0.0})
    assert np.abs(swing).max() > 1e-4
    assert force(reported) - force({**reported, "turbulence": 0.0}) == pytest.approx(swing, abs=1e-9)
    assert reported["strength"] == max(mean, 0.25 / 3.0)


def test_without_a_low_pass_there_is_nothing_to_diagnose(tmp_path):
    file = FlightFile(Path("high.csv"), Condition(height="h80", fold=0))
    with pytest.raises(AirTouchError, match="0 flights have the height `low`"):
        gap_training.diagnoses({file: None}, tmp_path / "diagnosis.json")


def test_a_diagnosis_is_replaced_when_the_new_one_is_there(tmp_path):
    """Here the new one fails."""
    store = tmp_path / "diagnosis.json"
    store.write_text('{"all": 1}')
    assert gap_training.diagnoses({}, store) == {"all": 1}
    with pytest.raises(AirTouchError, match="0 flights"):
        gap_training.diagnoses({}, store, force=True)
    assert store.read_text() == '{"all": 1}'


def test_how_far_a_diagnosis_closes_the_gap_is_said_in_a_line():
    effect = {"verdict": "effect", "effects": [{"name": "wind"}, {"name": "mass"}],
              "gap": {"before": 1.5, "after": 1.1}, "shrink": {"value": 0.8, "low": 0.7, "high": 0.9}}
    assert gap_training.closure_text(effect) == "wind and mass, gap 1.50 -> 1.10 floors, closed 80% [70%, 90%]"
    none = {"verdict": "none", "effects": [], "gap": {"before": 1.2, "after": 1.2}, "shrink": None}
    assert gap_training.closure_text(none) == "none, gap 1.20 -> 1.20 floors"
