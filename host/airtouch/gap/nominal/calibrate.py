"""The vehicle's parameters from flights declared nominal.

A fit to flights can hide an effect that all of them have: a diagnosis is therefore made in two
arms, with the vehicle as declared and as calibrated here. Only the vehicle is calibrated
(rotors, lag, delay, drag, IMU), never its surroundings, each with a prior; lag and delay by
what thrust does, as aliases of the commands drown the torque (gap.signals.response). Inertia shows
in the torque alone: it stays as declared.

Logged commands are aliased, so what thrust does from moment to moment makes the rotors too weak (regression dilution):
neural-swarm's by 7 to 16 %, with an accelerometer's bias of up to 1.4 m/s^2 to make up for it in the mean. All rotors
together are therefore scaled to the mean, and a vertical bias is fitted only where a flight rests, which shows it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.fit import FittedTerms, fit, mean_parameters
from airtouch.gap.evidence.problem import whole_of
from airtouch.gap.features.flight_features import features
from airtouch.gap.flights.flight import GROUND, Flight
from airtouch.gap.nameless.model import nameless_floor
from airtouch.gap.nominal.apparent import baseline_scatter
from airtouch.gap.nominal.build_study import declared_study, study_of
from airtouch.gap.nominal.consistency import FAR, FAR_SIMULATED, MOST_LEFT_OUT, odd_flights, split_unlike
from airtouch.gap.nominal.kept_scatter import kept_scatter
from airtouch.gap.relations.library import library_for
from airtouch.gap.result import Quantity
from airtouch.gap.signals.channels import COLUMN, ReplayedFlight
from airtouch.gap.signatures.candidates import all_candidates, terms
from airtouch.gap.signatures.term import Term, Terms
from airtouch.gap.study import Study
from airtouch.simulation.effects import Active
from airtouch.vehicle import Vehicle

#: effect, its variant, and the prior's standard deviation of each free parameter in its own unit: chosen, what two
#: vehicles of one kind may differ by; no measurement
PRIORS: tuple[tuple[str, dict[str, float], dict[str, float]], ...] = (
    *(("weak_motor", {"rotor": float(i)}, {"thrust_loss": 0.1}) for i in (1, 2, 3, 4)),
    ("motor_lag", {}, {"factor": 0.5}),
    ("actuator_delay", {}, {"delay": 0.005}),
    ("rotor_drag", {}, {"horizontal": 0.01, "vertical": 0.01}),
    ("imu_bias", {}, {**{f"acc_{a}": 0.2 for a in "xyz"}, **{f"gyro_{a}": 0.02 for a in "xyz"}}),
)
SEEN_AT_REST = "acc_z"  #: parameter of `imu_bias` that in the air looks like thrust
SCALE_STEP = 0.01  #: fraction by which thrust is changed to see what its scale does to the lift; chosen
VEHICLE_FITS = 2  #: fits of the vehicle, the second against the floor that the first leaves; chosen


@dataclass(frozen=True)
class Calibration:
    """Fitted effects that make the declared vehicle the nominal one; intervals are 90 %.

    flights: the nominal ones that were used, without those left out; declared: their study with the vehicle as
    declared.
    """

    active: tuple[Active, ...]
    parameters: dict[str, Quantity]
    notes: tuple[str, ...]
    flights: tuple[Flight, ...]
    declared: Study


def calibrated(vehicle: Vehicle, flights: Sequence[Flight], *, scatter: bool = True, without: Sequence[str] = (),
               ) -> tuple[Study, Calibration]:
    """The study of a vehicle fitted to nominal flights, and the calibration.

    Flights that cannot be nominal like the others (a touch of the ground, a swapped propeller) are left out and named,
    as long as most agree. scatter: measure as well how strong every effect but those of `without` seems to be in them
    (seconds a flight; naming effects needs it, a map does not).
    """
    alike, left_out = split_unlike(vehicle, flights, FAR)
    measured = _measured(vehicle, alike, scatter, without)
    while measured.study.simulated:
        alike, unlike = split_unlike(vehicle, measured.flights, FAR_SIMULATED)
        if not unlike:
            break
        alike, far = split_unlike(vehicle, alike, FAR)  # from the median of those that are left
        if len(flights) - len(alike) > len(flights) // MOST_LEFT_OUT:  # they disagree
            break
        left_out = [*left_out, *unlike, *far]
        measured = _measured(vehicle, alike, scatter, without)
    study, nominal = measured.study, measured.flights
    if study.simulated:
        study = _as_simulated(study, nominal, without)
    return study, Calibration(study.calibration, _quantities(measured.fitted),
                              (*left_out, *odd_flights(study, nominal)), tuple(nominal), measured.declared)


class _Measured(NamedTuple):
    """Nominal flights with what they say: of the vehicle as declared, as fitted to them, and the fit."""

    flights: Sequence[Flight]
    declared: Study
    study: Study
    fitted: FittedTerms


def _measured(vehicle: Vehicle, flights: Sequence[Flight], scatter: bool, without: Sequence[str]) -> _Measured:
    """A vehicle fitted to nominal flights, with how they scatter. scatter, without: see `calibrated`."""
    declared = declared_study(vehicle, flights)
    study, fitted = _fitted_vehicle(declared, flights)
    study = replace(study, nameless_floor=nameless_floor(Data(study, flights)))
    if scatter:
        measure = partial(baseline_scatter, study, flights, without)
        study = replace(study, scatter=kept_scatter(vehicle, flights, without, measure))
    return _Measured(flights, declared, study, fitted)


def _fitted_vehicle(declared: Study, flights: Sequence[Flight]) -> tuple[Study, FittedTerms]:
    """The study of the vehicle with the parameters of PRIORS fitted to nominal flights, and their fit."""
    chosen, prior = _terms_and_priors(at_rest=any(f.on_ground.any() for f in flights))
    study = declared
    for _ in range(VEHICLE_FITS):
        data = Data(replace(study, calibration=(), loop=None, response=None), flights)
        start = np.concatenate([_scaled(t, study.calibration) for t in chosen])
        fitted = with_mean_thrust(declared.vehicle, flights, fit(data, whole_of(data), chosen, start, prior))
        study = study_of(declared.vehicle, tuple(t.active() for t in fitted.terms), flights)
    return study, fitted


def with_mean_thrust(vehicle: Vehicle, flights: Sequence[Flight], fitted: FittedTerms) -> FittedTerms:
    """The fit with the thrust of all rotors scaled alike, so that the mean of the flights in the air leaves no lift.

    flights: each counts alike; fitted: PRIORS' terms with their values, fitted to the flights.
    """
    replayed = [(ReplayedFlight(f, vehicle), f.usable & (f.phase != GROUND)) for f in flights]
    in_air = [(flight, air) for flight, air in replayed if air.any()]

    def lift(of_terms: Terms) -> float:
        active = [t.active() for t in of_terms]
        return float(np.mean([flight.residual(active)[air, COLUMN["force_z"]].mean() for flight, air in in_air]))

    if not in_air:
        return fitted
    left = lift(fitted.terms)
    per_step = left - lift(_with_thrust_times(1.0 + SCALE_STEP, fitted.terms))
    if per_step <= 0.0:  # no motor turns
        return fitted
    scaled = _with_thrust_times(1.0 + SCALE_STEP * left / per_step, fitted.terms)
    return replace(fitted, terms=scaled, scaled=mean_parameters(scaled))


def _with_thrust_times(factor: float, of_terms: Terms) -> Terms:
    """Terms with the thrust of every rotor times a factor, within the bounds of the loss."""
    return tuple(t.fitted(t.scaled({"thrust_loss": 1.0 - factor * (1.0 - t.values["thrust_loss"])}))
                 if t.name == "weak_motor" else t for t in of_terms)


def _as_simulated(study: Study, flights: Sequence[Flight], without: Sequence[str]) -> Study:
    """The study of simulated flights: with the relations of their signals, where a library holds for them.

    without: effects that are no candidates; of the others the library learns those that it lacks.
    """
    relations = library_for(study.vehicle, [features(f, study.vehicle) for f in flights])
    names = all_candidates(without)
    if relations is not None and not relations.effects.issuperset(names):
        from airtouch.gap.relations.own_effect import completed  # a second of imports, which few need

        relations = completed(relations, study.vehicle, names)
    return replace(study, relations=relations)


def _terms_and_priors(at_rest: bool) -> tuple[list[Term], np.ndarray]:
    """The terms of PRIORS, and the standard deviation (k,) of each of their free parameters, in natural steps.

    at_rest: whether a flight rests, so that a vertical bias of the accelerometer can be told from thrust.
    """
    chosen, prior = [], []
    for name, variant, spread in PRIORS:
        term = next(t for t in terms(name) if all(t.values[k] == v for k, v in variant.items()))
        if not at_rest:
            term = replace(term, free=tuple(p for p in term.free if p != SEEN_AT_REST))
        chosen.append(term)
        prior += [spread[p] / term.step(p) for p in term.free]
    return chosen, np.array(prior)


def _scaled(term: Term, calibration: Sequence[Active]) -> np.ndarray:
    """Scaled parameters (k,) of a term in a calibration; 0 where it is not in it."""
    for a in calibration:
        if a.effect.name == term.name and all(a.values[k] == v for k, v in term.values.items()
                                              if k not in term.free):
            return term.scaled(a.values)
    return np.zeros(len(term.free))


def _quantities(fitted: FittedTerms) -> dict[str, Quantity]:
    """The calibrated parameters with unit and interval, by effect, rotor and parameter: `weak_motor 3 thrust_loss`."""
    out = {}
    for term in fitted.terms:
        part = fitted.slice_of(term)
        rotor = "" if term.identity[1] is None else f" {term.identity[1]:.0f}"
        quantities = term.quantities(fitted.scaled[part], fitted.covariance[part, part])
        out |= {f"{term.name}{rotor} {p}": q for p, q in quantities.items() if p in term.free}
    return out
