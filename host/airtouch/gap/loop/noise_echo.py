"""The echo of the gyro's fast noise in the commands: how strong it is, and how late.

Above FAST_HZ a vehicle hardly turns. What its gyro shows there is noise, and the controllers answer it as if it were
rotation. So of roll, pitch and yaw, in rows of the log, and with both signals high-passed and of rms 1,

    command(t) = sum over k of c_k rate(t - k rows) + other noise,    k = 0 .. LAGS - 1

by least squares: an autoregression with an exogenous input of one block (Ljung, System Identification, 2nd ed. 1999,
chapter 4). The coefficients c, the *echo*, belong to the control loop and to how it is logged; mass, motors and air
hardly change them. Sensors that are late do: noise that the controllers see later than the log has it has its echo in
another row, or in none where the loop runs faster than the log.

**How sure.** The c of a flight differ from those of nominal flights by chance, with a covariance of at most G^-1 / n
(G: correlations of the rate, n: independent samples of white noise), and by as much more as nominal flights differ
among each other. How much that is, m nominal flights tell with 9 (m - 1) degrees of freedom, for each of the LAGS
coefficients of three axes; PRIOR_FREEDOM more stand for what other baselines showed. So c follows Student's law. Its
centre on each axis is the nominal echo times the factor within SCALES that fits best: other gains, and other noise in
the commands, scale an echo. Another echo is anywhere: each coefficient normal, of mean 0 and standard deviation
ANYWHERE. `changed_nats` is the log likelihood of this over that.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import lgamma

import numpy as np

from airtouch.gap.flights.contact import within
from airtouch.gap.flights.filters import both_ways, highpass
from airtouch.gap.flights.flight import GROUND, PERIOD_S, Flight
from airtouch.gap.loop.command_spectra import PADDING, commands
from airtouch.vehicle import Vehicle

FAST_HZ = 20.0  #: above it the gyro shows noise rather than turns; chosen
LAGS = 3  #: rows, from the command's own on, that may hold an echo; chosen: a loop that is 20 ms late hardly flies
MARGIN_S = 0.2  #: next to what is no evidence that is left out as well, as the filter spreads it; chosen
LEAST_SAMPLES = 200  #: that a flight needs, 2 s; chosen
ANYWHERE = 0.5  #: standard deviation of a coefficient of an unknown echo; chosen
SCALES = (0.5, 2.0)  #: factors by which an echo may be weaker or stronger and still be the same; chosen
#: degrees of freedom of a variance that is chance alone, as two more nominal flights: in each of seven simulated
#: baselines of two to eight flights the variance was no more than chance (host/docs/looks.md, 2026-11-28 08:18)
PRIOR_FREEDOM = 18.0
#: factor by which the rms of the fast rates may differ from that of nominal flights for the axis to count; chosen. What
#: else shakes the vehicle or its gyro need not have the same echo
SAME_NOISE = 1.15
LEAST_RMS = 1e-9  #: of fast rates and commands, below which they are rounding errors
RIDGE = 1e-3  #: added to the correlations of the rate, so that a pure tone does no harm; chosen
INDEPENDENT = 1.0 - 2.0 * PERIOD_S * FAST_HZ  #: of the samples of white noise, those that the high-pass leaves


@dataclass(frozen=True)
class Echo:
    """The echo in one flight, or the mean of several.

    coefficients (3, LAGS): c of roll, pitch and yaw; correlations (3, LAGS, LAGS): G; rms_radps (3,): of the fast
    rates; samples: n, independent ones.
    """

    coefficients: np.ndarray
    correlations: np.ndarray
    rms_radps: np.ndarray
    samples: float


@dataclass(frozen=True)
class NominalEcho:
    """The echo in nominal flights: its mean, and how they differ.

    excess: their variance over that of chance, 1 at least; freedom: degrees of freedom that it is known with.
    """

    mean: Echo
    excess: float
    freedom: float


def echo_of(flight: Flight, vehicle: Vehicle) -> Echo | None:
    """The echo in a flight; None without a gyro, for less than LEAST_SAMPLES in the air, and without any noise."""
    return flight.workspace.cached("noise echo", vehicle, lambda: None if flight.rates is None else echo_in(
        flight.rates, commands(flight, vehicle)[:, 1:], (flight.phase != GROUND) & flight.usable))


def echo_in(rates: np.ndarray, torque_commands: np.ndarray, valid: np.ndarray) -> Echo | None:
    """The echo of rates in commands, or None as for `echo_of`.

    rates (n, 3), rad/s; torque_commands (n, 3): of roll, pitch and yaw, in any unit; valid (n,): samples that are
    evidence, bool.
    """
    if valid.sum() < LEAST_SAMPLES:
        return None
    rows = np.flatnonzero(~within(~valid, MARGIN_S))
    rows = rows[rows >= LAGS]
    if len(rows) < LEAST_SAMPLES:
        return None
    section, pad = highpass(FAST_HZ * 2.0 * PERIOD_S), min(PADDING, len(rates) - 2)
    fast_rates, fast_commands = both_ways(section, rates, pad), both_ways(section, torque_commands, pad)
    coefficients, correlations, rms = np.zeros((3, LAGS)), np.zeros((3, LAGS, LAGS)), np.zeros(3)
    for axis in range(3):
        before = np.stack([fast_rates[rows - k, axis] for k in range(LAGS)], axis=1)
        command = fast_commands[rows, axis]
        rms[axis], scale = np.sqrt(np.mean(before[:, 0] ** 2)), np.sqrt(np.mean(command ** 2))
        if min(rms[axis], scale) < LEAST_RMS:
            return None
        correlations[axis] = before.T @ before / (len(rows) * rms[axis] ** 2) + RIDGE * np.eye(LAGS)
        coefficients[axis] = np.linalg.solve(correlations[axis], before.T @ command / (len(rows) * rms[axis] * scale))
    return Echo(coefficients, correlations, rms, INDEPENDENT * len(rows))


def mean_echo(echoes: Sequence[Echo]) -> Echo:
    """The mean of the echoes in one or more flights, with the samples of all."""
    samples = np.array([e.samples for e in echoes])

    def mean(values: Sequence[np.ndarray]) -> np.ndarray:
        """Their mean, each weighted with its samples."""
        return np.average(values, axis=0, weights=samples)

    return Echo(mean([e.coefficients for e in echoes]), mean([e.correlations for e in echoes]),
                mean([e.rms_radps for e in echoes]), float(samples.sum()))


def nominal_echo(flights: Sequence[Flight], vehicle: Vehicle) -> NominalEcho | None:
    """The echo in flights declared nominal; None where fewer than two of them have one."""
    echoes = [e for e in (echo_of(f, vehicle) for f in flights) if e is not None]
    if len(echoes) < 2:
        return None
    mean = mean_echo(echoes)
    freedom = mean.coefficients.size * (len(echoes) - 1) + PRIOR_FREEDOM
    off = [e.coefficients - mean.coefficients for e in echoes]
    squares = sum(e.samples * float(np.einsum("ai,aij,aj", d, mean.correlations, d))
                  for e, d in zip(echoes, off, strict=True))
    return NominalEcho(mean, max((squares + PRIOR_FREEDOM) / freedom, 1.0), freedom)


def changed_nats(nominal: NominalEcho, echoes: Sequence[Echo]) -> float:
    """Log likelihood, nats, of another echo than in nominal flights over theirs; 0 where no axis counts.

    echoes: in flights with the same vehicle, one or more.
    """
    of_flights, of_nominal = mean_echo(echoes), nominal.mean
    same_noise = np.abs(np.log(of_flights.rms_radps / of_nominal.rms_radps)) < np.log(SAME_NOISE)
    size = LAGS * int(same_noise.sum())
    if not size:
        return 0.0
    chance, expected = np.zeros((size, size)), np.zeros(size)
    for place, axis in enumerate(np.flatnonzero(same_noise)):
        part = slice(LAGS * place, LAGS * (place + 1))
        correlations, echo = of_nominal.correlations[axis], of_nominal.coefficients[axis]
        chance[part, part] = np.linalg.inv(correlations)
        along, power = echo @ correlations @ of_flights.coefficients[axis], echo @ correlations @ echo
        expected[part] = echo * np.clip(along / power, *SCALES)
    chance *= nominal.excess * (1.0 / of_flights.samples + 1.0 / of_nominal.samples)
    c, freedom = of_flights.coefficients[same_noise].ravel(), nominal.freedom
    squared = float((c - expected) @ np.linalg.solve(chance, c - expected))
    as_nominal = (lgamma(0.5 * (freedom + size)) - lgamma(0.5 * freedom) - 0.5 * size * np.log(0.5 * freedom)
                  - 0.5 * np.linalg.slogdet(chance)[1] - 0.5 * (freedom + size) * np.log1p(squared / freedom))
    wide = chance + ANYWHERE ** 2 * np.eye(size)
    anywhere = -0.5 * np.linalg.slogdet(wide)[1] - 0.5 * float(c @ np.linalg.solve(wide, c))
    return float(anywhere - as_nominal)
