"""Units and signs of columns that laws of physics contradict."""

import numpy as np
import pytest

from airtouch import logs
from airtouch.errors import AirTouchError
from airtouch.gap.flights.fitness import without_bad_columns
from airtouch.logs.checks.conventions import turn_ratio, wrong_signs, wrong_units
from airtouch.logs.flight_log import ACC, ATTITUDE, GYRO, PWM, FlightLog

T = np.arange(2000) * 0.01  #: s
FLYING = (T > 2.0) & (T < 18.0)


def swaying(factors=None, without=()):
    """A flight that sways by some degrees about every axis, its rates derived by hand; columns times factors."""
    rng = np.random.default_rng(5)
    columns = {"t_s": T, "zrange_m": np.where(FLYING, 0.5, 0.01)}
    columns |= {name: np.where(FLYING, 36000.0 + 300.0 * np.sin(7.0 * T + i), 0.0) for i, name in enumerate(PWM)}
    for i, (gyro, angle) in enumerate(zip(GYRO, ATTITUDE, strict=True)):
        omega = 3.0 + i  # rad/s
        columns[angle] = np.where(FLYING, 0.08 * np.sin(omega * T), 0.0) + rng.normal(0.0, 5e-4, len(T))
        columns[gyro] = np.where(FLYING, 0.08 * omega * np.cos(omega * T), 0.0) + rng.normal(0.0, 0.02, len(T))
    lift = 9.81 * (1.0 + np.where(FLYING, 0.05 * np.sin(11.0 * T), 0.0))
    columns |= dict(zip(ACC, (rng.normal(0.0, 0.1, len(T)), rng.normal(0.0, 0.1, len(T)), lift), strict=True))
    columns = {name: values * (factors or {}).get(name, 1.0) for name, values in columns.items() if name not in without}
    return FlightLog(columns, {"source": "sway.csv", "format": "canonical", "warnings": []})


def test_a_sound_flight_has_none():
    assert not wrong_units(swaying(), FLYING) and not wrong_signs(swaying(), FLYING)
    assert turn_ratio(swaying(), GYRO[0], ATTITUDE[0], FLYING) == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize(("factors", "column", "remedy"), [
    (dict.fromkeys(ACC, 1.0 / 9.81), "acc_z_mps2", "multiplied by 9.81"),
    ({"acc_z_mps2": -1.0}, "acc_z_mps2", "to be positive"),
    (dict.fromkeys(GYRO, 180.0 / np.pi), "gyro_y_radps", "multiplied by pi/180"),
    ({"roll_rad": 180.0 / np.pi}, "roll_rad", "multiplied by pi/180"),
])
def test_wrong_units_are_a_fault_and_no_diagnosis(factors, column, remedy):
    log = swaying(factors)
    assert any(column in w and remedy in w for w in logs.check(log).warnings)
    with pytest.raises(AirTouchError, match=f"sway.csv: .*{column}.*{remedy}"):
        without_bad_columns(log)


def test_angles_and_gyro_both_in_degrees_are_told():
    """Each turns as far as the other, so that their ratio says nothing; a pitch of 4.6 rad says it all."""
    degrees = swaying(dict.fromkeys((*GYRO, *ATTITUDE), 180.0 / np.pi))
    faults = wrong_units(degrees, FLYING)
    for column in ("roll_rad is beyond", "pitch_rad is beyond", *(f"{gyro} turns 5" for gyro in GYRO)):
        assert any(line.startswith(column) and "multiplied by pi/180" in line for line in faults), column
    assert len(faults) == 5
    angles = wrong_units(swaying(dict.fromkeys(ATTITUDE, 180.0 / np.pi)), FLYING)
    assert angles and not any("gyro" in line for line in angles), "this gyro is in rad/s"
    many_turns = swaying().with_columns({"yaw_rad": swaying()["yaw_rad"] + T,  # counted on beyond one turn
                                           "gyro_z_radps": swaying()["gyro_z_radps"] + 1.0})
    upside_down = swaying().with_columns({"roll_rad": swaying()["roll_rad"] + np.pi - 0.1})
    assert not wrong_units(many_turns, FLYING) and not wrong_units(upside_down, FLYING)


def test_a_rate_of_the_wrong_sign_is_the_first_note():
    log = swaying({"gyro_y_radps": -1.0, "gyro_z_radps": 0.0})
    _, notes = without_bad_columns(log)
    assert "gyro_y_radps turns against pitch_rad" in notes[0] and "gyro_z_radps does not change" in notes[1]
    assert any("gyro_y_radps turns against pitch_rad" in w for w in logs.check(log).warnings)


def test_what_is_not_sure_is_no_fault():
    rates = np.random.default_rng(1).normal(0.0, 50.0, (3, len(T)))
    noise = swaying().with_columns(dict(zip(GYRO, rates, strict=True)))
    free = swaying().with_columns({"acc_z_mps2": 0.1 * np.sin(T)})  # no gravity in it
    for log in (noise, free, swaying(dict.fromkeys(GYRO, 57.3), without=ATTITUDE)):
        assert not wrong_units(log, FLYING) and not wrong_signs(log, FLYING)


def test_no_recorded_flight_has_any(flights):
    read = [logs.read(p) for p in sorted(flights.rglob("*.csv.gz"))[::25] if p.stat().st_size > 1000]
    assert read and not [w for log in read for w in logs.check(log).warnings if "it is to be" in w or "against" in w]
