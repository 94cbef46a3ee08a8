"""Which of many flights are judged, and which effects recorded flights may name beside others."""

from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
import pytest

import short_flights
from airtouch.errors import AirTouchError
from airtouch.gap import diagnosis
from airtouch.gap.diagnosis import MOST_SECONDS, flights_to_judge
from airtouch.gap.result import FITTED, HELD_OUT, Closure, Diagnosis, NamedEffect, Quantity
from airtouch.gap.signatures.candidates import terms
from gap_flights import VEHICLE
from hovers import FLOOR, hover


@dataclass(frozen=True)
class PartOfSelection:
    """As much of a selection as is asked for here."""

    named_steps: list
    named_hypothesis: SimpleNamespace
    single_effects: dict
    least_nats: dict
    halves: tuple = field(default=())
    policy: SimpleNamespace = field(default_factory=lambda: SimpleNamespace(must_close_gap=True))


@pytest.mark.parametrize(("count", "seconds", "chosen"), [
    (1, 500.0, [0]), (5, 40.0, [0, 1, 2, 3, 4]), (10, 42.0, [0, 2, 4, 6, 9]), (6, 300.0, [0, 1, 3, 5]),
    (3, 300.0, [0, 1, 2])])
def test_flights_of_210_s_are_judged_and_no_fewer_than_four(count, seconds, chosen):
    flights = [np.full(round(100.0 * seconds), i) for i in range(count)]
    judged = flights_to_judge(flights)
    assert [int(f[0]) for f in judged] == chosen
    assert sum(len(f) for f in judged) * 0.01 <= MOST_SECONDS or len(judged) <= 4


def test_of_flights_that_differ_in_length_no_more_than_210_s_are_judged():
    """Two of 60 s and 18 of 10 s, 300 s in all."""
    long_first = [np.zeros(6000)] * 2 + [np.zeros(1000)] * 18
    judged = flights_to_judge(long_first)
    assert 4 < len(judged) < 20 and sum(len(f) for f in judged) * 0.01 <= MOST_SECONDS


@pytest.mark.parametrize(("effects", "judged_on"), [
    ([("downwash", (("a.csv", 1.0, 2.0),))], FITTED), ([("downwash", ())], HELD_OUT), ([], HELD_OUT),
    ([("downwash", (("a.csv", 1.0, 2.0),)), ("mass", ())], HELD_OUT)])
def test_a_passing_effect_alone_is_measured_on_what_it_was_fitted_to(monkeypatch, effects, judged_on):
    named = [NamedEffect(name, {}, seconds) for name, seconds in effects]
    closure = Closure(3.0, 1.0, Quantity(1.0))
    for name, value in (("verdict_of", "effect" if named else "none"), ("named_effects", named), ("ranking_of", ()),
                        ("alike_of", ()), ("control_of", None)):
        monkeypatch.setattr(diagnosis, name, lambda *_, value=value: value)
    assert diagnosis._answer(None, None, SimpleNamespace(closure=closure)).judged_on == judged_on


@pytest.mark.parametrize(("alone", "names"), [(0.5, ["downwash"]), (0.2, ["motor_lag", "downwash"])])
def test_a_loop_effect_beside_others_closes_a_quarter_of_a_recorded_gap_or_is_left_out(monkeypatch, alone, names):
    """With slow motors 0.6 of the gap closes; without them as much of it as `alone`.

    Of a gap that is measured in cells of its own the others close another part.
    """
    def of(*effects):
        steps = [SimpleNamespace(name=n, passing_key=None) for n in effects]
        hypothesis = SimpleNamespace(terms=tuple(replace(terms(n)[0], gate=((0, 1),) if n == "downwash" else ())
                                                 for n in effects))
        return PartOfSelection(steps, hypothesis, dict.fromkeys(effects), dict.fromkeys(effects))

    monkeypatch.setattr(diagnosis, "select", lambda data, candidates, say, without, *_: of(
        *(n for n in ("motor_lag", "downwash") if n in candidates)))
    gaps = {2: SimpleNamespace(closure=SimpleNamespace(before=1.4, shrink=Quantity(0.6))),
            1: SimpleNamespace(closure=SimpleNamespace(before=1.2, shrink=Quantity(0.8 - alone)))}
    monkeypatch.setattr(diagnosis, "gap_of", lambda data, halves, hypothesis: gaps[len(hypothesis.terms)])
    monkeypatch.setattr(diagnosis, "closure_of", lambda data, halves, hypothesis, gap: SimpleNamespace(
        shrink=Quantity(alone if gap is gaps[2] else 0.0)))
    loop = SimpleNamespace(changes_loop=lambda active: True)
    data = SimpleNamespace(study=SimpleNamespace(simulated=False, loop=loop, nominal_count=4))
    selection, gap = diagnosis.selection_and_gap(data, ())
    assert gap is gaps[len(names)]
    assert [s.name for s in selection.named_steps] == names
    assert "motor_lag" in selection.single_effects and "motor_lag" in selection.least_nats, "it is in the ranking"


@pytest.mark.parametrize(("lengths", "enough"), [
    ((3.9,), True), ((3.7,), False), ((2.6, 2.6, 2.6, 2.6), True), ((2.6, 2.6, 2.6), False)])
def test_flights_are_too_short_where_the_error_says_so(lengths, enough):
    flights = [hover(k, length_s=s) for k, s in enumerate(lengths)]
    if enough:
        assert diagnosis._data(FLOOR, flights).flights == flights
        return
    with pytest.raises(AirTouchError, match=r"3\.84 s of a flight .* or 2\.56 s of each of 4 flights"):
        diagnosis._data(FLOOR, flights)


@pytest.mark.parametrize(("changes", "refused"), [
    ({}, False), ({"vehicle": replace(VEHICLE, mass_kg=0.04)}, True), ({"baseline": ("b",)}, True),
    ({"baseline": ("namesake",)}, True), ({"baseline": ("copy",)}, False), ({"without": ("mass",)}, True)])
def test_a_calibration_is_used_again_for_the_same_vehicle_baseline_and_effects_alone(monkeypatch, changes, refused):
    """Each call is made for one calibration: a second one of other inputs would be an answer to another question."""
    logs = {name: replace(log, meta={**log.meta, "source": name}) for name, log in zip("ab", short_flights.fly(2),
                                                                                       strict=True)}
    logs["namesake"] = replace(logs["b"], meta=logs["a"].meta)  # another flight of the same name
    logs["copy"] = replace(logs["a"], columns={k: v.copy() for k, v in logs["a"].columns.items()})  # as if read again
    calibrations = []

    def calibrated(vehicle, nominal, without):
        calibrations.append(nominal)
        return FLOOR, None

    empty = SimpleNamespace(effects=())
    monkeypatch.setattr(diagnosis, "_calibrated", calibrated)
    monkeypatch.setattr(diagnosis, "selection_and_gap", lambda *_: (None, None))
    monkeypatch.setattr(diagnosis, "signs_not_shown", lambda _: [])
    monkeypatch.setattr(diagnosis, "_answer", lambda *_: empty)
    monkeypatch.setattr(diagnosis, "_explained", lambda *_: Diagnosis("none", (), (), (), (), {}, None, None))

    def diagnose(vehicle=VEHICLE, baseline=("a",), without=("wind",), before=None):
        return diagnosis.diagnose([logs["a"]], vehicle, [logs[n] for n in baseline], without=without, before=before)

    first = diagnose()
    if refused:
        with pytest.raises(AirTouchError, match="another vehicle, baseline or effects left out"):
            diagnose(**changes, before=first)
    else:
        diagnose(**changes, before=first)
    assert len(calibrations) == 1


def test_effects_left_out_stay_left_out_without_those_of_the_loop(monkeypatch):
    """They are no passing effects either, which `select` looks for beside its candidates."""
    searched_without = []

    def chosen(data, candidates, say, without, *_):
        searched_without.append(set(without))
        effects = [n for n in ("motor_lag", "mass") if n in candidates]
        return PartOfSelection([SimpleNamespace(name=n, passing_key=None) for n in effects],
                               SimpleNamespace(terms=tuple(terms(n)[0] for n in effects)), {}, {})

    closes = SimpleNamespace(before=1.4, shrink=Quantity(0.6))
    monkeypatch.setattr(diagnosis, "select", chosen)
    monkeypatch.setattr(diagnosis, "gap_of", lambda *_: SimpleNamespace(closure=closes))
    monkeypatch.setattr(diagnosis, "closure_of", lambda *_: closes)
    loop = SimpleNamespace(changes_loop=lambda active: any(a.effect.name == "motor_lag" for a in active))
    data = SimpleNamespace(study=SimpleNamespace(simulated=False, loop=loop, nominal_count=4))
    diagnosis.selection_and_gap(data, ("downwash", "wind"))
    first, second = searched_without
    assert first == {"downwash", "wind"}
    assert {"downwash", "wind", "motor_lag"} <= second and "mass" not in second


@pytest.mark.parametrize(("nominal", "a_candidate"), [(0, False), (1, True), (4, True)])
def test_a_wake_is_no_candidate_without_nominal_flights(monkeypatch, nominal, a_candidate):
    """As a vehicle that shakes by itself looks like one in a wake that fills the flight."""
    tried = []
    nothing = PartOfSelection([], SimpleNamespace(terms=()), {}, {})
    monkeypatch.setattr(diagnosis, "select", lambda data, candidates, *_: tried.append(set(candidates)) or nothing)
    monkeypatch.setattr(diagnosis, "gap_of", lambda *_: SimpleNamespace(closure=SimpleNamespace(
        before=1.0, shrink=Quantity(0.0))))
    study = SimpleNamespace(simulated=False, loop=None, nominal_count=nominal)
    diagnosis.selection_and_gap(SimpleNamespace(study=study), ("mass",))
    (candidates,) = tried
    assert ("downwash" in candidates) is a_candidate
    assert "mass" not in candidates and {"motor_noise", "gust", "ground_effect"} <= candidates
