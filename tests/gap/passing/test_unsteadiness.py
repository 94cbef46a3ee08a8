"""How unsteady torque and lift are, in logarithms: by SciPy's filters, and in closed form for two levels of power."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from airtouch.gap.evidence.data import Data
from airtouch.gap.flights.flight import GROUND, PERIOD_S
from airtouch.gap.passing import bursts
from airtouch.gap.passing.bursts import SHAKE_BAND_HZ, SHAKE_PIECE_S
from airtouch.gap.passing.gate_search import ENDS
from airtouch.gap.passing.unsteadiness import (
    COLUMNS,
    UNSTEADY_LIFT,
    UNSTEADY_TORQUE,
    log_entropies,
    rms_over_median,
)
from gap_flights import fly

PIECE = round(SHAKE_PIECE_S / PERIOD_S)
HERTZ = 25.0  #: of what is put in, in the middle of the band


@pytest.fixture(scope="module")
def nominal_flight():
    return fly(1, 62)[0]


def counted(flight):
    """Pieces (pieces,) all of whose samples are in the air, as logged, and no take-off or landing."""
    in_the_air = ~(flight.on_ground | flight.bridged | np.isin(flight.phase, ENDS))
    return in_the_air[:len(in_the_air) // PIECE * PIECE].reshape(-1, PIECE).all(axis=1)


def with_residual(monkeypatch, columns):
    """Flights whose residual has these columns, by their number, and 0 elsewhere."""
    values = np.zeros((len(next(iter(columns.values()))), 6))
    for c, x in columns.items():
        values[:, c] = x
    monkeypatch.setattr(bursts, "residual", lambda *_: values)


def shaken(flight, begin_s, end_s, ratio, phase=0.0):
    """A sine of amplitude 1, and of the root of a ratio from one second to another, (n,)."""
    t = np.arange(len(flight)) * PERIOD_S
    return np.where((t >= begin_s) & (t < end_s), np.sqrt(ratio), 1.0) * np.sin(2.0 * np.pi * HERTZ * t + phase)


@pytest.mark.parametrize("ratio", [4.0, 20.0])
def test_it_is_the_log_of_the_arithmetic_over_the_geometric_mean(study, nominal_flight, monkeypatch, ratio):
    """Two levels of power, one of them in a share s: log(1 + s (ratio - 1)) - s log(ratio). Scales do not matter."""
    whole = counted(nominal_flight)
    first = np.flatnonzero(whole)[np.count_nonzero(whole) // 2]
    signal = shaken(nominal_flight, first * SHAKE_PIECE_S, (first + 8) * SHAKE_PIECE_S, ratio)
    share = whole[first:first + 8].sum() / whole.sum()
    expected = np.log(1.0 + share * (ratio - 1.0)) - share * np.log(ratio)
    with_residual(monkeypatch, {2: 0.1 * signal, 3: 3.0 * signal, 4: signal, 5: 0.01 * signal})
    of_flight = log_entropies(Data(study, [nominal_flight]))
    assert of_flight == dict.fromkeys(COLUMNS, pytest.approx(np.log(expected), abs=0.15))


def test_one_torque_that_is_shaken_counts_a_third_of_three_that_are(study, nominal_flight, monkeypatch):
    """Of powers over their geometric mean g = ratio^s the mean of three is taken, of which two are 1 all along."""
    ratio, whole = 20.0, counted(nominal_flight)
    first = np.flatnonzero(whole)[np.count_nonzero(whole) // 2]
    steady = shaken(nominal_flight, 0.0, 0.0, 1.0)
    yaw = shaken(nominal_flight, first * SHAKE_PIECE_S, (first + 8) * SHAKE_PIECE_S, ratio)
    with_residual(monkeypatch, {2: steady, 3: steady, 4: steady, 5: yaw})
    share = whole[first:first + 8].sum() / whole.sum()
    low, high = ((2.0 + level / ratio ** share) / 3.0 for level in (1.0, ratio))
    expected = np.log(share * high + (1.0 - share) * low) - share * np.log(high) - (1.0 - share) * np.log(low)
    of_flight = log_entropies(Data(study, [nominal_flight]))
    assert of_flight[UNSTEADY_TORQUE] == pytest.approx(np.log(expected), abs=0.15)
    assert of_flight[UNSTEADY_LIFT] < np.log(0.01)


def test_it_is_that_of_scipys_filtered_lift(study, nominal_flight, monkeypatch):
    lift = np.random.default_rng(1).normal(size=len(nominal_flight)) * np.linspace(0.3, 3.0, len(nominal_flight))
    with_residual(monkeypatch, {2: lift})
    flight, samples = nominal_flight, np.arange(len(lift))
    counts = ~(flight.on_ground | flight.bridged | np.isin(flight.phase, ENDS))
    fast = np.interp(samples, samples[counts], lift[counts])
    for hertz, kind in zip(SHAKE_BAND_HZ, ("highpass", "lowpass"), strict=True):
        fast = sosfiltfilt(butter(2, hertz * 2.0 * PERIOD_S, kind, output="sos"), fast)
    pieces = len(fast) // PIECE
    power = np.square(fast[:pieces * PIECE]).reshape(pieces, PIECE).mean(axis=1)[counted(flight)]
    expected = np.log(power.mean()) - np.log(power).mean()
    assert log_entropies(Data(study, [flight]))[UNSTEADY_LIFT] == pytest.approx(np.log(expected), abs=0.02)
    ratio = rms_over_median(study, flight, 2)
    assert np.array_equal(np.isfinite(ratio), counted(flight))
    assert np.nanmax(ratio) == pytest.approx(np.sqrt(power.max() / np.median(power)), rel=0.02)


def test_a_long_rest_on_the_ground_makes_no_flight_unsteady(study, nominal_flight, monkeypatch):
    values = shaken(nominal_flight, 0.0, 0.0, 1.0)
    standing = np.arange(len(values)) < 0.6 * len(values)
    resting = replace(nominal_flight, phase=np.where(standing, GROUND, nominal_flight.phase),
                      pwm=np.where(standing[:, None], 0.0, nominal_flight.pwm))
    with_residual(monkeypatch, dict.fromkeys(range(6), np.where(standing, 0.001, 1.0) * values))
    assert max(log_entropies(Data(study, [resting])).values()) < np.log(0.1)


def test_a_flight_that_only_takes_off_says_nothing(study, nominal_flight):
    taking_off = replace(nominal_flight, phase=np.full(len(nominal_flight), ENDS[0]))
    assert log_entropies(Data(study, [taking_off])) == {}
    assert np.isnan(rms_over_median(study, taking_off, 2)).all()


def test_two_flights_that_differ_in_power_alone_are_steady(study, nominal_flight, monkeypatch):
    """Each is held against itself: one that is shaken ten times as much all along makes none unsteady."""
    steady = shaken(nominal_flight, 0.0, 0.0, 1.0)
    levels = iter(np.repeat([1.0, 10.0], 6))
    monkeypatch.setattr(bursts, "residual", lambda *_: np.repeat(steady[:, None], 6, axis=1) * next(levels))
    assert max(log_entropies(Data(study, [nominal_flight, nominal_flight])).values()) < np.log(0.05)
