"""The thrust of a calibrated vehicle where logged commands are noisy: the truth is the declared one, as simulated."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.gap.flights.flight import GROUND, ready
from airtouch.gap.nominal.calibrate import calibrated
from airtouch.gap.signals.spectra import REST, starts
from airtouch.logs.flight_log import PWM
from gap_flights import VEHICLE, fly

NOISE_PWM = 4000.0  #: rms of what is logged beside the commands that the motors followed
#: samples at rest that are kept of each log; a block at rest has 24 usable ones, and blocks overlap by half
AT_REST = {"all of it": [10 ** 6] * 4, "four blocks": [70, 0, 0, 0], "three blocks": [58, 0, 0, 0], "none": [0] * 4}


@pytest.fixture(scope="module")
def nominal():
    return fly(4, seed=91)


def kept(flight, at_rest=10 ** 6, noise_pwm=0.0, acceleration=lambda z: z, seed=0):
    """The flight's log from so many samples before take-off to the landing, with noisy commands while motors turn.

    acceleration: of the logged vertical acceleration, m/s^2.
    """
    air = (flight.phase != GROUND).nonzero()[0]
    rows = slice(max(air[0] - at_rest, 0), None if at_rest > len(flight) else air[-1] + 1)
    columns, generator = {k: v[rows] for k, v in flight.log.columns.items()}, np.random.default_rng(seed)
    columns |= {c: columns[c] + (columns[c] > 0.0) * generator.normal(0.0, noise_pwm, len(columns[c])) for c in PWM}
    return ready(replace(flight.log, columns={**columns, "acc_z_mps2": acceleration(columns["acc_z_mps2"])}), VEHICLE)


def losses(calibration):
    return [calibration.parameters[f"weak_motor {rotor} thrust_loss"] for rotor in (1, 2, 3, 4)]


@pytest.mark.parametrize("at_rest", AT_REST)
def test_thrust_is_right_where_logged_commands_are_noisy(nominal, at_rest):
    """Regression dilution: the noise makes the slope of lift over thrust a fifth too small; a bias fills in."""
    noisy = [kept(nominal[i], rows, NOISE_PWM, seed=i) for i, rows in enumerate(AT_REST[at_rest])]
    blocks = sum(len(starts(f, REST)) for f in noisy)
    assert blocks == {"none": 0, "three blocks": 3, "four blocks": 4}.get(at_rest, blocks)
    _, calibration = calibrated(VEHICLE, noisy, scatter=False)
    assert np.mean([q.value for q in losses(calibration)]) == pytest.approx(0.0, abs=0.006)
    assert ("imu_bias acc_z" in calibration.parameters) == (at_rest in ("all of it", "four blocks"))


def test_intervals_hold_a_bias_that_no_flight_shows(nominal):
    """0.3 m/s^2 are 1.5 standard deviations of the bias, and look like 3 % more thrust."""
    _, calibration = calibrated(VEHICLE, [kept(f, 0, acceleration=lambda z: z + 0.3) for f in nominal], scatter=False)
    assert np.mean([q.value for q in losses(calibration)]) == pytest.approx(-0.3 / 9.81, abs=0.005)
    assert all(q.low < 0.0 < q.high and q.high - q.low < 0.1 for q in losses(calibration))


@pytest.mark.parametrize(("factor", "word"), [(1.35, "little"), (1.0, None)])
def test_a_note_says_where_the_vehicle_cannot_carry_its_mass(nominal, factor, word):
    """Thrust may grow by 30 % at most, so that of a vehicle that is 35 % too weak some lift is left."""
    flights = [kept(f, 0, acceleration=lambda z: factor * z) for f in nominal]
    _, calibration = calibrated(VEHICLE, flights, scatter=False)
    notes = [n for n in calibration.notes if "thrust for its mass" in n]
    assert len(notes) == (word is not None) and all(word in n for n in notes)
