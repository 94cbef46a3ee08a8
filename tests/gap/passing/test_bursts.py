"""Bursts in made signals."""

from dataclasses import replace

import numpy as np
import pytest

import airtouch as at
from airtouch.gap import diagnosis
from airtouch.gap.evidence.data import Data
from airtouch.gap.flights.flight import GROUND, PERIOD_S
from airtouch.gap.passing import bursts as passing_bursts
from airtouch.gap.passing.bursts import FORCE_BURSTS, YAW_BURSTS, burst_gate, push_gate
from airtouch.gap.passing.gate_search import ENDS
from airtouch.gap.signals.channels import inside
from airtouch.logs.flight_log import FlightLog
from gap_flights import VEHICLE, fly

HERTZ = 25.0  #: of the torque that is put in, in the middle of YAW_BURSTS' band


@pytest.fixture(scope="module")
def nominal_flight():
    return fly(1, 62)[0]


def with_residual(monkeypatch, values):
    """Flights whose residual has `values` (n,) in the columns of both signals."""
    columns = np.zeros((len(values), 6))
    columns[:, [FORCE_BURSTS.column, YAW_BURSTS.column]] = values[:, None]
    monkeypatch.setattr(passing_bursts, "residual", lambda *_: columns)


def shaken(flight, begin_s, end_s, ratio):
    """A sine of amplitude 1, and of the root of a ratio from one second to another, (n,)."""
    t = np.arange(len(flight)) * PERIOD_S
    return np.where((t >= begin_s) & (t < end_s), np.sqrt(ratio), 1.0) * np.sin(2.0 * np.pi * HERTZ * t)


@pytest.mark.parametrize("signal", [FORCE_BURSTS, YAW_BURSTS])
def test_bursts_are_where_the_power_is(study, nominal_flight, monkeypatch, signal):
    begin_s = round(10.0 / signal.piece_s) * signal.piece_s
    end_s = begin_s + 4 * signal.piece_s
    rng = np.random.default_rng(0)
    noise = 0.3 * rng.normal(size=len(nominal_flight))
    with_residual(monkeypatch, shaken(nominal_flight, begin_s, end_s, 30.0) + noise)
    gate, cost = burst_gate(Data(study, [nominal_flight]), signal)
    assert [(name, pytest.approx(begin_s), pytest.approx(end_s)) for name, *_ in gate] == list(gate)
    assert len(gate) == 1 and cost > 0.0


def test_a_flight_that_is_shaken_alike_all_along_has_no_bursts(study, nominal_flight, monkeypatch):
    with_residual(monkeypatch, shaken(nominal_flight, 0.0, 0.0, 1.0))
    assert burst_gate(Data(study, [nominal_flight]), YAW_BURSTS) == ((), 0.0)


def test_bursts_that_fill_what_counts_are_none(study, nominal_flight, monkeypatch):
    """Two pieces in five are far stronger, to the end: no rest is left, but for the ground, take-off and landing."""
    piece = np.arange(len(nominal_flight)) // round(FORCE_BURSTS.piece_s / PERIOD_S)
    level = np.where(piece % 5 < 2, np.sqrt(30.0), 1.0)
    with_residual(monkeypatch, level * np.random.default_rng(0).normal(size=len(piece)))
    assert burst_gate(Data(study, [nominal_flight]), FORCE_BURSTS) == ((), 0.0)


def test_pushes_are_those_of_half_the_strongest_at_least(study, nominal_flight, monkeypatch):
    """A bell of height h and width sigma is over 1.5 within sigma sqrt(2 log(h / 1.5)) of its middle.

    One of a third of the strongest is none, nor is one that points up.
    """
    t, sigma_s = np.arange(len(nominal_flight)) * PERIOD_S, 0.2
    bells = [height * np.exp(-0.5 * ((t - at_s) / sigma_s) ** 2) for at_s, height in
             ((10.0, -3.0), (12.0, -2.5), (14.0, -1.0), (16.0, 2.0))]
    noise = 0.05 * np.random.default_rng(0).normal(size=len(t))
    with_residual(monkeypatch, sum(bells) + noise)
    gate, cost = push_gate(Data(study, [nominal_flight]))
    expected = [[at_s - half_s, at_s + half_s] for at_s, half_s in
                ((at_s, sigma_s * np.sqrt(2.0 * np.log(height / 1.5))) for at_s, height in ((10.0, 3.0), (12.0, 2.5)))]
    np.testing.assert_allclose([ends for _, *ends in gate], expected, atol=0.05)
    assert cost > 0.0


def test_noise_and_nothing_and_a_vehicle_that_only_takes_off_have_no_pushes(study, nominal_flight, monkeypatch):
    taking_off = replace(nominal_flight, phase=np.full(len(nominal_flight), ENDS[0]))
    noise = np.random.default_rng(0).normal(size=len(nominal_flight))
    for values in (noise, np.zeros(len(nominal_flight))):
        with_residual(monkeypatch, values)
        for one in (nominal_flight, taking_off):
            assert push_gate(Data(study, [one])) == ((), 0.0)


def test_what_stands_on_the_ground_is_no_part_of_the_median(study, nominal_flight, monkeypatch):
    """A long rest with hardly any torque does not make the whole flight a burst."""
    values = shaken(nominal_flight, 0.0, 0.0, 1.0)
    standing = np.arange(len(values)) < 0.6 * len(values)
    resting = replace(nominal_flight, phase=np.where(standing, GROUND, nominal_flight.phase),
                      pwm=np.where(standing[:, None], 0.0, nominal_flight.pwm))
    with_residual(monkeypatch, np.where(standing, 0.001, 1.0) * values)
    assert burst_gate(Data(study, [resting]), YAW_BURSTS) == ((), 0.0)


def test_a_flight_that_only_takes_off_says_nothing(study, nominal_flight):
    taking_off = replace(nominal_flight, phase=np.full(len(nominal_flight), ENDS[0]))
    assert burst_gate(Data(study, [taking_off]), FORCE_BURSTS) == ((), 0.0)


def test_a_burst_in_one_of_two_tables_is_none_in_the_other(monkeypatch):
    """All tables have one source, by which no gate could tell their flights."""
    class Selected(Exception):
        """The data on which candidates would be judged."""

    def stop(data, *_):
        raise Selected(data)

    logs = [f.log for f in fly(2, 62)]
    t = logs[0]["t_s"]
    acts = (t >= 10.0) & (t < 10.5)
    shaken_log = logs[0].with_columns({"acc_z_mps2": logs[0]["acc_z_mps2"] + 8.0 * acts * np.sin(60.0 * t)})
    monkeypatch.setattr(diagnosis, "select", stop)
    with pytest.raises(Selected) as stopped:
        at.gap.diagnose([FlightLog(log.columns, {"source": "pandas table"}) for log in (shaken_log, logs[1])], VEHICLE)
    data = stopped.value.args[0]
    gate, _ = burst_gate(data, FORCE_BURSTS)
    first, second = (inside(gate, f) for f in data.flights)
    assert first[1000:1050].all() and not second.any()


def test_idle_motors_on_the_ground_are_no_burst_and_no_calm(nominal_flight, study):
    """Props that turn slowly on the ground, as after arming: the samples count neither in the air nor at rest."""
    idle = nominal_flight.on_ground & (np.arange(len(nominal_flight)) < len(nominal_flight) // 2)
    waits = replace(nominal_flight, pwm=np.where(idle[:, None], 5000.0, nominal_flight.pwm))
    assert idle.sum() > 50
    for one in (nominal_flight, waits):
        counts = passing_bursts.residual_in_band(study, one, YAW_BURSTS.column, YAW_BURSTS.band_hz)[1]
        assert counts.any() and not counts[idle].any()
