"""The thrust of a vehicle's rotors together, from the mean of flights declared nominal.

Logged commands are aliased: the log has every fifth of them. What thrust does from moment to moment therefore makes the
rotors too weak (regression dilution), and where nothing else shows the accelerometer's vertical bias, a false one makes
up for that in the mean. neural-swarm's rotors came out 8 to 21 % too weak, with a bias of 0.6 to 1.4 m/s^2. The mean of
the commands is not diluted. Take-off and landing are left out of it: there a lag shows that is fitted too long, for the
same reason.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from airtouch.gap.evidence.fit import FittedTerms, mean_parameters
from airtouch.gap.flights.flight import Flight
from airtouch.gap.signals.channels import COLUMN, ReplayedFlight
from airtouch.gap.signals.spectra import REST, starts
from airtouch.gap.signatures.term import Term, Terms
from airtouch.logs.segments import KINDS
from airtouch.vehicle import Vehicle

SEEN_AT_REST = "acc_z"  #: parameter of `imu_bias` that in the air looks like thrust
BIAS_STD = 0.2  #: standard deviation of an accelerometer's bias, m/s^2; BMI088: 20 mg
#: blocks at rest, of all flights together, from which on the bias is known; chosen: in simulated flights with noisy
#: commands one was too few, two were enough
FEWEST_AT_REST = 4
NOT_IN_MEAN = [KINDS.index(kind) for kind in ("ground", "take-off", "landing")]  #: phases that the mean leaves out
SCALE_STEP = 0.01  #: fraction by which thrust is changed to see what lift that makes; chosen
#: mean lift, m/s^2, that the calibrated vehicle may leave before a note says so; chosen. A larger number says less
MOST_LIFT_LEFT = 0.1


def rest(flights: Sequence[Flight]) -> bool:
    """Whether flights rest long enough for SEEN_AT_REST to be fitted."""
    return sum(len(starts(f, REST)) for f in flights) >= FEWEST_AT_REST


def with_mean_thrust(vehicle: Vehicle, flights: Sequence[Flight], fitted: FittedTerms, known_bias: bool) -> FittedTerms:
    """The fit with the thrust of all rotors scaled alike, so that the mean of the flights in the air leaves no lift.

    flights: each counts alike; fitted: terms with their values, fitted to the flights, `weak_motor` of each rotor among
    them; known_bias: whether SEEN_AT_REST is. The covariance grows by the scatter of the flights' means, and by a bias
    of BIAS_STD where it is not known. Some lift is left where a loss is at its bound (`lift_note`).
    """
    in_air, stronger = _in_air(vehicle, flights), _times(1.0 + SCALE_STEP, fitted.terms)
    lift = np.array([_mean_lift(f, fitted.terms) for f in in_air])
    by_step = float(np.mean(lift - [_mean_lift(f, stronger) for f in in_air])) if in_air else 0.0
    if by_step <= 0.0:  # no motor turns, or every loss is at its bound
        return fitted
    scaled = _times(1.0 + SCALE_STEP * float(lift.mean()) / by_step, fitted.terms)
    variance = (lift.var(ddof=1) / len(lift) if len(lift) > 1 else 0.0) + (0.0 if known_bias else BIAS_STD ** 2)
    step = mean_parameters(stronger) - mean_parameters(fitted.terms)
    error = step * np.sqrt(variance) / by_step
    return replace(fitted, terms=scaled, scaled=mean_parameters(scaled),
                   covariance=fitted.covariance + np.outer(error, error))


def lift_note(vehicle: Vehicle, flights: Sequence[Flight], terms: Terms) -> list[str]:
    """A note where the vehicle with these terms leaves a mean lift of more than MOST_LIFT_LEFT in flights."""
    lift = float(np.mean([_mean_lift(f, terms) for f in _in_air(vehicle, flights)] or [0.0]))
    if abs(lift) <= MOST_LIFT_LEFT:
        return []
    return [f"the vehicle as declared has far too {'little' if lift > 0.0 else 'much'} thrust for its mass in the "
            f"baseline flights ({lift:+.2f} m/s^2 are left): check mass_kg and the thrust in the vehicle file"]


class _InAir(NamedTuple):
    """A flight for its replay, and the samples (n,) at which it is in the air, after take-off and before landing."""

    flight: ReplayedFlight
    samples: np.ndarray


def _in_air(vehicle: Vehicle, flights: Sequence[Flight]) -> list[_InAir]:
    """The flights that are in the air for longer than take-off and landing."""
    replayed = [_InAir(ReplayedFlight(f, vehicle), f.usable & ~np.isin(f.phase, NOT_IN_MEAN)) for f in flights]
    return [f for f in replayed if f.samples.any()]


def _mean_lift(in_air: _InAir, terms: Sequence[Term]) -> float:
    """Mean lift of a flight in the air that the vehicle with these terms does not explain, m/s^2."""
    residual = in_air.flight.residual([t.active() for t in terms])
    return float(residual[in_air.samples, COLUMN["force_z"]].mean())


def _times(factor: float, terms: Terms) -> Terms:
    """Terms with the thrust of every rotor times a factor, within the bounds of the loss."""
    return tuple(t.fitted(t.scaled({"thrust_loss": 1.0 - factor * (1.0 - t.values["thrust_loss"])}))
                 if t.name == "weak_motor" else t for t in terms)
