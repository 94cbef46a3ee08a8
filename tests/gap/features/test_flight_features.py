"""Features against signals whose relation is known."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.gap.features import coherence, edge_steps, flight_features, moments
from airtouch.gap.features.feature_space import cholesky_factor
from airtouch.gap.features.flight_signals import COLUMNS, COMMAND, LIFT, signals_of
from airtouch.gap.flights.flight import ready
from airtouch.logs.flight_log import FlightLog
from gap_flights import VEHICLE, fly


@pytest.fixture(scope="module")
def flight():
    return fly(1, 41, {})[0]


def test_coherence_of_a_signal_and_its_noisy_copy(flight):
    """White noise of variance 1 beside a copy of variance 4: coherence 2 / sqrt(5) in every band, one fifth alone."""
    rng = np.random.default_rng(1)
    signals = signals_of(flight, VEHICLE)
    table = rng.normal(size=signals.table.shape)
    table[:, LIFT.start] = 2.0 * table[:, COMMAND.start] + rng.normal(size=len(table))
    values = coherence.coherence_features(replace(signals, table=table))
    coherences = dict(zip((f.name for f in coherence.declared_features()), values, strict=True))
    wide = [k for k, (a, b) in enumerate(zip(coherence.BANDS_HZ, coherence.BANDS_HZ[1:], strict=False)) if b - a > 3.0]
    real = np.mean([coherences[f"climb real command:lift {k}"] for k in wide])
    assert real == pytest.approx(2.0 / np.sqrt(5.0), abs=0.03)
    assert np.mean([coherences[f"climb imaginary command:lift {k}"] for k in wide]) == pytest.approx(0.0, abs=0.05)
    assert np.mean([np.exp(coherences[f"climb alone lift {k}"]) for k in wide]) == pytest.approx(0.2, abs=0.04)
    assert np.mean([coherences[f"climb power lift {k}"] - coherences[f"climb power command {k}"] for k in wide]) \
        == pytest.approx(np.log(5.0), abs=0.1)


@pytest.mark.parametrize(("column", "words"), [
    ("force residual z", ("force residual z", "force z follows")), ("thrust command", ("thrust command",)),
    ("speed residual x", ("speed residual x", "speed x follows")), ("range residual", ("range residual",))])
def test_a_feature_has_the_name_of_the_signal_that_moves_it(flight, column, words):
    """One column of the table gets an offset and noise: what has its name changes, and nothing else does."""
    signals = signals_of(flight, VEHICLE)
    table = signals.table.copy()
    table[:, COLUMNS.index(column)] += 1.0 + np.random.default_rng(1).normal(size=len(table))
    moved = replace(signals, table=table)
    for module, values in ((moments, lambda s: moments.moment_features(s, VEHICLE)),
                           (edge_steps, edge_steps.edge_step_features)):
        changed = {f.name for f, a, b in zip(module.declared_features(), values(signals), values(moved), strict=True)
                   if not (a == b or np.isnan([a, b]).all())}
        named = {f.name for f in module.declared_features() if any(w in f.name for w in words)}
        assert changed <= named and len(changed) > 0.9 * len(named)


def test_a_row_lost_by_chance_hardly_moves_the_relations(flight):
    """One row of a log: its block is left out; no share of power changes as bridging it would change it."""
    log = flight.log
    rows = np.delete(np.arange(len(log)), len(log) // 2)
    holed = ready(FlightLog({k: v[rows] for k, v in log.columns.items()}, log.meta), VEHICLE)
    before, after = (flight_features.features(f, VEHICLE) for f in (flight, holed))
    of_one_signal = np.array([" alone " in f.name for f in flight_features.declared_features()])
    assert np.abs(after - before)[of_one_signal].max() < 1.0


def test_battery_voltage_and_rotor_speeds_are_not_looked_at(flight):
    """A flight whose log has them has the features of one whose log has not."""
    columns = {k: v for k, v in flight.log.columns.items() if k not in flight_features.UNSEEN}
    without_them = ready(FlightLog(columns, flight.log.meta), VEHICLE)
    assert flight.log.has("vbat_V")
    with_them, without = (flight_features.features(f, VEHICLE) for f in (flight, without_them))
    assert with_them == pytest.approx(without, nan_ok=True)


def test_a_log_without_attitude_has_no_features(flight):
    columns = {k: v for k, v in flight.log.columns.items() if k != "roll_rad"}
    assert flight_features.features(ready(FlightLog(columns, flight.log.meta), VEHICLE), VEHICLE) is None


def test_whitened_nominal_flights_have_no_covariance():
    """The triangle of a covariance of known factors: whitened, fresh draws have variance 1 in every direction."""
    rng = np.random.default_rng(2)
    mix = np.eye(5) + 0.8 * rng.normal(size=(5, 5))
    draws = rng.normal(size=(20000, 5)) @ mix.T
    lower = cholesky_factor(draws, doubt=0.0)
    white = np.linalg.solve(lower, (rng.normal(size=(20000, 5)) @ mix.T).T)
    assert np.cov(white) == pytest.approx(np.eye(5), abs=0.04)


def test_a_heading_that_passes_half_a_turn_is_no_jump(flight):
    """The same flight with its logged heading turned by half a turn: what the angles have beyond the gyro stays."""
    turned = flight.log.with_columns({"yaw_rad": np.angle(np.exp(1j * (flight.log["yaw_rad"] + np.pi)))})
    assert np.abs(np.diff(turned["yaw_rad"])).max() > 6.0
    beyond_gyro = [signals_of(ready(log, VEHICLE), VEHICLE).table[:, COLUMNS.index("angle residual z")]
                   for log in (flight.log, turned)]
    np.testing.assert_allclose(*beyond_gyro, atol=1e-6)


def test_without_a_block_in_the_air_nothing_is_told(flight):
    signals = signals_of(flight, VEHICLE)
    nowhere = replace(signals.flight, usable=np.zeros(len(signals.flight), bool))
    assert np.isnan(coherence.coherence_features(replace(signals, flight=nowhere))).all()
