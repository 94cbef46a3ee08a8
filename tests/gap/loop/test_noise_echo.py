"""The echo of the gyro's noise in commands: against loops written here, SciPy's densities, and simulated flights."""

import numpy as np
import pytest
from scipy import stats

from airtouch import vehicle as vehicles
from airtouch.gap.flights.flight import ready_flights
from airtouch.gap.loop import noise_echo
from airtouch.gap.loop.noise_echo import (
    ANYWHERE,
    LAGS,
    LEAST_SAMPLES,
    PRIOR_FREEDOM,
    SCALES,
    Echo,
    NominalEcho,
    changed_nats,
    echo_in,
    mean_echo,
    nominal_echo,
)
from airtouch.simulation import batch
from airtouch.simulation.effects import Active, get

VEHICLE = vehicles.load("crazyflie-2.1-flow")
ROWS = 2000
SURE = 6.0  #: nats


def flown(seed, late=0, gain=1.0, other=1.0, noise=0.005, rows=ROWS):
    """The echo in a loop that answers white noise of the gyro `late` rows late, beside white noise of its own."""
    rng = np.random.default_rng(seed)
    rates = noise * rng.standard_normal((rows, 3))
    answered = np.roll(rates, late, axis=0) if late >= 0 else rng.standard_normal((rows, 3)) * noise
    commands = -gain * answered + other * noise * rng.standard_normal((rows, 3))
    return echo_in(rates, commands, np.ones(rows, bool))


def as_nominal(echoes, excess=1.0):
    mean = mean_echo(echoes)
    return NominalEcho(mean, excess, float(mean.coefficients.size * (len(echoes) - 1) + PRIOR_FREEDOM))


@pytest.mark.parametrize("late", range(LAGS))
def test_the_echo_is_in_the_row_that_the_delay_says(late):
    """Half of the command's power is echo, so that the coefficient is -sqrt(1/2) in that row, and 0 elsewhere."""
    expected = np.zeros((3, LAGS))
    expected[:, late] = -np.sqrt(0.5)
    assert flown(1, late=late).coefficients == pytest.approx(expected, abs=0.08)


def test_the_unit_of_rates_and_commands_does_not_matter():
    rng = np.random.default_rng(3)
    rates, commands = rng.standard_normal((2, ROWS, 3))
    everywhere = np.ones(ROWS, bool)
    one, other = echo_in(rates, commands, everywhere), echo_in(20.0 * rates, 300.0 * commands, everywhere)
    assert other.coefficients == pytest.approx(one.coefficients, abs=1e-9)


def test_without_enough_rows_or_noise_there_is_no_echo():
    rates = np.random.default_rng(4).standard_normal((ROWS, 3))
    few = np.zeros(ROWS, bool)
    few[:LEAST_SAMPLES] = True
    assert echo_in(rates, rates, few) is None
    assert echo_in(0.0 * rates, rates, np.ones(ROWS, bool)) is None


@pytest.mark.parametrize("nominal_flights", [2, 4])
def test_the_same_loop_never_has_another_echo(nominal_flights):
    seeds = np.arange(200 * (nominal_flights + 1)).reshape(200, -1)
    nats = [changed_nats(as_nominal([flown(s) for s in nominal]), [flown(test)]) for *nominal, test in seeds]
    assert max(nats) < 0.0


@pytest.mark.parametrize("late", [1, 2, -1], ids=["a row late", "two rows late", "between the rows"])
def test_a_late_echo_is_another_one(late):
    nats = [changed_nats(as_nominal([flown(s), flown(s + 1)]), [flown(s + 2, late=late)]) for s in range(0, 60, 3)]
    assert min(nats) > SURE


@pytest.mark.parametrize("excess", [1.0, 2.5])
def test_nats_are_those_of_scipys_densities(excess):
    """The coefficients' density under nominal flights is Student's, under another echo normal.

    The test's echo is a row late, so the nominal one fits it best at its smallest scale.
    """
    nominal, test = as_nominal([flown(5), flown(6), flown(7)], excess), flown(8, late=1)
    of_nominal = nominal.mean
    chance = np.zeros((3 * LAGS, 3 * LAGS))
    for axis in range(3):
        part = slice(LAGS * axis, LAGS * (axis + 1))
        chance[part, part] = np.linalg.inv(of_nominal.correlations[axis])
    chance *= excess * (1.0 / test.samples + 1.0 / of_nominal.samples)
    c, expected = test.coefficients.ravel(), SCALES[0] * of_nominal.coefficients.ravel()
    student = stats.multivariate_t(expected, chance, df=nominal.freedom).logpdf(c)
    normal = stats.multivariate_normal(np.zeros(len(c)), chance + ANYWHERE ** 2 * np.eye(len(c))).logpdf(c)
    assert changed_nats(nominal, [test]) == pytest.approx(normal - student, rel=1e-9)


@pytest.mark.parametrize(("gain", "other"), [(0.7, 1.0), (1.4, 1.0), (1.0, 1.4), (1.0, 0.7)])
def test_another_gain_or_other_noise_of_the_loop_is_no_other_echo_however_long_the_flight(gain, other):
    nominal = as_nominal([flown(s, rows=20_000) for s in range(4)])
    assert changed_nats(nominal, [flown(9, gain=gain, other=other, rows=20_000)]) < 0.0


def test_flights_count_as_long_as_they_are():
    """Two flights, one thirty times as long as the other, have the mean and the covariance of one that is both."""
    long, short = flown(30, rows=20_000, other=4.0), flown(31, rows=700, other=4.0)
    mean = mean_echo([long, short])
    assert mean.samples == long.samples + short.samples
    weight = short.samples / mean.samples
    assert mean.coefficients == pytest.approx((1.0 - weight) * long.coefficients + weight * short.coefficients)
    unequal = [changed_nats(as_nominal([flown(s, rows=20_000, other=4.0), flown(s + 1, rows=700, other=4.0)]),
                            [flown(s + 2, other=4.0)]) for s in range(0, 90, 3)]
    assert max(unequal) < 0.0


def test_an_axis_with_other_noise_does_not_count():
    nominal, louder = as_nominal([flown(9), flown(10)]), flown(11, late=1, noise=0.01)
    assert changed_nats(nominal, [louder]) == 0.0
    rms = nominal.mean.rms_radps.copy()
    rms[:2] *= 2.0
    yaw_alone = Echo(flown(11, late=1).coefficients, louder.correlations, rms, louder.samples)
    assert 0.0 < changed_nats(nominal, [yaw_alone]) < changed_nats(nominal, [flown(11, late=1)])


def test_nominal_flights_that_differ_make_a_change_less_sure(monkeypatch):
    """Flights of two loops, half of whose commands are echo in one and a fifth in the other, allow for either."""
    echoes = {f"{other}": flown(12 + int(other), other=other) for other in (1.0, 2.0)}
    monkeypatch.setattr(noise_echo, "echo_of", lambda flight, _: echoes[flight])
    nominal = nominal_echo(list(echoes), VEHICLE)
    assert nominal.excess > 3.0 and changed_nats(nominal, [flown(20, other=1.5)]) < 0.0
    assert nominal_echo(["1.0"], VEHICLE) is None


def test_of_simulated_flights_late_sensors_alone_have_another_echo():
    """At strengths at which most of these effects are hard to miss; seeds of their own."""
    effects = {"sensor_latency": {"delay": 0.003}, "actuator_delay": {"delay": 0.008}, "motor_lag": {"factor": 1.5},
               "inertia": {"fraction": 0.3}, "controller_gain": {"rate": 0.7}, "mass": {"fraction": 0.15},
               "weak_motor": {"rotor": 2, "thrust_loss": 0.12}, "gust": {"rms": 0.5}, "imu_noise": {"factor": 3.0},
               "com_offset": {"x": 0.001}, "ground_effect": {"strength": 1.5}}
    nominal = nominal_echo(ready_flights(list(batch.flights("diagnosis", range(4), vehicle=VEHICLE, workers=1)),
                                           VEHICLE, []), VEHICLE)
    for name, values in effects.items():
        active = [Active(get(name), get(name).values(values))]
        log = list(batch.flights("diagnosis", [77], vehicle=VEHICLE, effects=active, workers=1))
        flight, = ready_flights(log, VEHICLE, [])
        nats = changed_nats(nominal, [noise_echo.echo_of(flight, VEHICLE)])
        assert (nats > SURE) == (name == "sensor_latency"), (name, nats)
