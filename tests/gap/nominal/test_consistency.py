"""Baseline flights of known trim: which are left out, which a note names, when it is said that they differ."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.gap.flights.flight import ready
from airtouch.gap.nominal import consistency
from airtouch.gap.nominal.consistency import (
    FAR,
    FAR_SIMULATED,
    differences,
    logged_unlike,
    odd_flights,
    of_one_trim,
    split_unlike,
    trims,
)
from airtouch.simulation import batch
from gap_flights import VEHICLE, flight, study


def baseline(*lifts):
    """Hovers of one second whose mean force along the thrust is off by so much, m/s^2."""
    return [flight(1.0, np.tile([0.0, 0.0, lift], (100, 1)), name=f"lift {lift}") for lift in lifts]


def left_out(flights, far=FAR):
    """Names of the flights that are left out, each in a note."""
    same, notes = split_unlike(VEHICLE, flights, far)
    missing = [f.name for f in flights if not any(f is s for s in same)]
    assert [n.split(":")[0] for n in notes] == missing
    return missing


def test_the_trim_is_the_mean_residual_of_usable_samples_in_the_air():
    (one,) = baseline(0.3)
    assert trims([one], VEHICLE)[0, :3] == pytest.approx([0.0, 0.0, 0.3])
    half = np.arange(100) < 50
    pushed = replace(one, acceleration=one.acceleration + np.where(half, 5.0, 0.0)[:, None])
    assert trims([replace(pushed, usable=~half)], VEHICLE)[0, 2] == pytest.approx(0.3)
    assert trims([replace(pushed, phase=np.where(half, 0, one.phase).astype(np.int8))],
                 VEHICLE)[0, 2] == pytest.approx(0.3)


def test_a_flight_is_left_out_where_its_trim_is_odd_and_far_off():
    assert left_out(baseline(0.0, 0.01, -0.01, 0.5)) == ["lift 0.5"]
    assert not left_out(baseline(0.0, 0.01, -0.01, 0.35))  # odd, but no more than nominal flights may differ
    assert not left_out(baseline(0.0, 0.2, -0.2, 0.9))  # far, but not beyond six deviations of the others


def test_simulated_flights_may_differ_by_a_tenth():
    assert left_out(baseline(0.0, 0.001, -0.001, 0.045), FAR_SIMULATED) == ["lift 0.045"]
    assert not left_out(baseline(0.0, 0.001, -0.001, 0.035), FAR_SIMULATED)


@pytest.mark.parametrize(("scene", "one_trim"), [("diagnosis", True), ("hover", True), ("paper-low", False),
                                                 ("steps", False)])
def test_scenarios_that_draw_each_flights_rotors_have_trims_of_their_own(scene, one_trim):
    logs = batch.flights(scene, 4, vehicle=VEHICLE, seed=511, workers=1)
    assert of_one_trim(VEHICLE, [ready(log, VEHICLE) for log in logs]) == one_trim


def test_one_odd_flight_of_many_leaves_the_others_of_one_trim():
    assert of_one_trim(VEHICLE, baseline(0.0, 0.001, -0.001, 0.002, -0.002, 5.0))
    assert not of_one_trim(VEHICLE, baseline(0.0, 0.2))


@pytest.mark.parametrize(("offset", "told"), [((0.0, 0.0, 0.5), "lift +0.5"),
                                              ((0.0, -0.9, 0.5), "sideways force -0.9")])
def test_the_note_tells_the_channel_that_is_farthest_off(offset, told):
    odd = flight(1.0, np.tile(offset, (100, 1)), name="logs/odd.csv")
    (note,) = split_unlike(VEHICLE, [*baseline(0.0, 0.0, 0.0), odd], FAR)[1]
    assert note == f"odd.csv: declared nominal, yet unlike the others ({told} m/s^2); left out"


def test_two_flights_cannot_say_which_is_unlike():
    assert not left_out(baseline(0.0, 5.0))
    assert left_out(baseline(0.0, 0.0, 5.0)) == ["lift 5.0"]


def test_flights_stay_where_more_than_one_in_three_is_unlike():
    assert len(left_out(baseline(0.0, 0.01, -0.01, 0.0, 5.0, -5.0))) == 2
    assert not left_out(baseline(0.0, 0.01, -0.01, 5.0, -5.0))


def test_a_note_names_the_channel_in_which_a_flight_is_odd():
    """The distance by Student's t of three degrees of freedom, whose two tails beyond 18.7 hold 1 % over 30 trims."""
    (note,) = odd_flights(study(), baseline(0.0, 0.01, -0.01, 0.02, 0.45))
    assert note == "lift 0.45: declared nominal, yet far from the others' mean (lift +0.45 m/s^2)"
    assert not odd_flights(study(), baseline(0.0, 0.01, -0.01, 0.02, 0.35))  # no more than nominal flights may differ
    assert not odd_flights(study(), baseline(0.0, 0.1, -0.1, 0.2, 0.5))  # far, but within chance
    assert not odd_flights(study(), baseline(0.0, 5.0))


@pytest.mark.parametrize("flights", [3, 4, 5, 6])
def test_of_a_hundred_sets_of_normal_trims_one_gets_a_note(monkeypatch, flights):
    """Six independent channels that scatter by ten times the least distance, so that chance alone decides."""
    rng, noted = np.random.default_rng(flights), 0
    nominal = baseline(*np.zeros(flights))
    for _ in range(2000):
        trim = rng.normal(0.0, 10.0 * FAR, (flights, 6))
        monkeypatch.setattr(consistency, "trims", lambda *_, trim=trim: trim)
        noted += bool(odd_flights(study(), nominal))
    assert 0.004 < noted / 2000 < 0.016  # 1 % and three standard errors, less for two odd ones in a set


def test_differences_beyond_what_nominal_flights_may_differ_are_said():
    (note,) = differences(study(), baseline(0.0, 0.25))
    assert note.startswith("the baseline flights are not consistent: among themselves they differ by 0.25 m/s^2 in "
                           "lift;")
    assert not differences(study(), baseline(0.0, 0.15)) and not differences(study(), [])
    assert "not known" in differences(study(), baseline(0.0))[0]


def test_differences_within_six_standard_errors_are_chance():
    """Gusts of one second whose means differ by chance."""
    steps = np.repeat(np.random.default_rng(1).normal(0.0, 1.0, 8), [13, 13, 13, 13, 12, 12, 12, 12])
    gusty = [flight(1.0, np.outer(sign * steps + 0.3 * (sign > 0), [0.0, 0.0, 1.0])) for sign in (1, -1)]
    assert abs(np.ptp(trims(gusty, VEHICLE)[:, 2])) > 0.2 and not differences(study(), gusty)


@pytest.mark.parametrize(("meta", "baseline", "unlike"), [
    ({"format": "usd"}, [{"format": "authors-12"}, {"format": "authors-13"}], True),
    ({"format": "authors-14"}, [{"format": "authors-12"}], False),
    ({"format": "canonical", "origin_format": "usd"}, [{"format": "usd"}, {"format": "px4"}], False),
    ({"format": "usd"}, [], False)])
def test_a_log_of_another_kind_than_the_baselines_is_told(meta, baseline, unlike):
    test, *others = (flight(1.0, name=f"flight {i}") for i in range(1 + len(baseline)))
    for one, of_log in zip((test, *others), (meta, *baseline), strict=True):
        one.log.meta.update(of_log)
    notes = logged_unlike([test], others)
    assert bool(notes) == unlike and all("flight 0" in n and "(usd)" in n and "(authors)" in n for n in notes)


@pytest.mark.parametrize(("meta", "baseline", "words"), [
    ({"resampled": {"from_hz": 199.6}}, [{}, {}], "logged at 200 Hz, the baseline at 100 Hz"),
    ({}, [{"resampled": {"from_hz": 500.0}}, {"resampled": {"from_hz": 200.0}}], "the baseline at 200, 500 Hz"),
    ({"resampled": {"from_hz": 125.1}}, [{"resampled": {"from_hz": 124.9}}], ""),
    ({"resampled": {"from_hz": 200}}, [{}], "logged at 200 Hz"),
    ({"resampled": "by hand"}, [{"resampled": {"from_hz": float("nan")}}], ""),
    ({"resampled": {"from_hz": 200.0}}, [], "")])
def test_a_log_of_another_rate_than_the_baselines_is_told(meta, baseline, words):
    test, *others = (flight(1.0, name=f"flight {i}") for i in range(1 + len(baseline)))
    for one, of_log in zip((test, *others), (meta, *baseline), strict=True):
        one.log.meta.update(of_log)
    notes = logged_unlike([test], others)
    assert len(notes) == bool(words) and all("flight 0" in n and words in n for n in notes)
