"""The vehicle's parameters from flights declared nominal.

A fit to flights can hide an effect that all of them have: a diagnosis is therefore made in two
arms, with the vehicle as declared and as calibrated here. Only the vehicle is calibrated
(rotors, lag, delay, drag, IMU), never its surroundings, each with a prior; lag and delay by
what thrust does, as aliases of the commands drown the torque (gap.signals.response). Inertia shows
in the torque alone: it stays as declared.

The thrust of all rotors together is that of the mean (`mean_thrust` says why), and a vertical bias of the accelerometer
is fitted only where flights rest, which shows it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.fit import FittedTerms, fit
from airtouch.gap.evidence.problem import whole_of
from airtouch.gap.features.flight_features import features
from airtouch.gap.flights.flight import Flight
from airtouch.gap.nameless.model import nameless_floor
from airtouch.gap.nominal.apparent import baseline_scatter, is_recorded
from airtouch.gap.nominal.build_study import declared_study, study_of
from airtouch.gap.nominal.consistency import FAR, FAR_SIMULATED, MOST_LEFT_OUT, odd_flights, of_one_trim, split_unlike
from airtouch.gap.nominal.kept_scatter import kept_scatter
from airtouch.gap.nominal.mean_thrust import BIAS_STD, SEEN_AT_REST, lift_note, rest, with_mean_thrust
from airtouch.gap.relations.library import Library, library_for
from airtouch.gap.result import Quantity
from airtouch.gap.signatures.candidates import all_candidates, terms
from airtouch.gap.signatures.scatter import Scatter
from airtouch.gap.signatures.term import Term
from airtouch.gap.study import ScatterOnDemand, Study
from airtouch.simulation.effects import Active
from airtouch.vehicle import Vehicle

#: effect, its variant, and the prior's standard deviation of each free parameter in its own unit: chosen, what two
#: vehicles of one kind may differ by; no measurement
PRIORS: tuple[tuple[str, dict[str, float], dict[str, float]], ...] = (
    *(("weak_motor", {"rotor": float(i)}, {"thrust_loss": 0.1}) for i in (1, 2, 3, 4)),
    ("motor_lag", {}, {"factor": 0.5}),
    ("actuator_delay", {}, {"delay": 0.005}),
    ("rotor_drag", {}, {"horizontal": 0.01, "vertical": 0.01}),
    ("imu_bias", {}, {**{f"acc_{a}": BIAS_STD for a in "xyz"}, **{f"gyro_{a}": 0.02 for a in "xyz"}}),
)
VEHICLE_FITS = 2  #: fits of the vehicle, the second against the floor that the first leaves; chosen


@dataclass(frozen=True)
class Calibration:
    """Fitted effects that make the declared vehicle the nominal one; intervals are 90 %.

    vehicle: as declared; flights: the nominal ones that were used, without those left out.
    """

    vehicle: Vehicle
    active: tuple[Active, ...]
    parameters: dict[str, Quantity]
    notes: tuple[str, ...]
    flights: tuple[Flight, ...]

    @cached_property
    def declared(self) -> Study:
        """The study of the flights with the vehicle as declared."""
        return declared_study(self.vehicle, self.flights)


def calibrated(vehicle: Vehicle, flights: Sequence[Flight], *, scatter: bool = True, without: Sequence[str] = (),
               ) -> tuple[Study, Calibration]:
    """The study of a vehicle fitted to nominal flights, and the calibration.

    Flights that cannot be nominal like the others (a touch of the ground, a swapped propeller) are left out and named,
    as long as most agree. scatter: the study says as well how strong every effect but those of `without` seems to be in
    them. To measure that takes seconds a flight. It is done at once; where a library of relations holds for simulated
    flights, when it is first asked for.
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
    study = _with_own_effects(study, without)
    notes = (*left_out, *lift_note(vehicle, nominal, measured.fitted.terms), *odd_flights(study, nominal))
    return study, Calibration(vehicle, study.calibration, _quantities(measured.fitted), notes, tuple(nominal))


class _Measured(NamedTuple):
    """Nominal flights with the study of the vehicle fitted to them, and the fit."""

    flights: Sequence[Flight]
    study: Study
    fitted: FittedTerms


def _measured(vehicle: Vehicle, flights: Sequence[Flight], scatter: bool, without: Sequence[str]) -> _Measured:
    """A vehicle fitted to nominal flights, with how they scatter. scatter, without: see `calibrated`."""
    study, fitted = _fitted_vehicle(vehicle, flights)
    study = replace(study, nameless_floor=nameless_floor(Data(study, flights)))
    return _Measured(flights, _with_scatter(study, vehicle, flights, without) if scatter else study, fitted)


def _with_scatter(study: Study, vehicle: Vehicle, flights: Sequence[Flight], without: Sequence[str]) -> Study:
    """The study with how nominal flights scatter, and with whether they are simulated.

    Where a library of relations holds they are, and nothing is measured yet. vehicle: as declared.
    """
    measure = partial(kept_scatter, vehicle, flights, without, partial(baseline_scatter, study, flights, without))
    library = _library(vehicle, flights)
    if library is None:
        return study.with_scatter(measure())
    return replace(study, simulated=True, relations=library, on_demand=ScatterOnDemand(partial(_exact, measure)))


def _exact(measure: Callable[[], Scatter]) -> Scatter:
    """The scatter of flights for which a library of relations holds, so that they come from the models of effects."""
    return replace(measure(), exact=True)


def _library(vehicle: Vehicle, flights: Sequence[Flight]) -> Library | None:
    """The library of relations that holds for flights of a vehicle.

    None where none does: for recorded flights, those that differ in trim, and a single one, which does not show it.
    """
    if len(flights) < 2 or any(is_recorded(f) for f in flights) or not of_one_trim(vehicle, flights):
        return None
    return library_for(vehicle, [features(f, vehicle) for f in flights])


def _fitted_vehicle(vehicle: Vehicle, flights: Sequence[Flight]) -> tuple[Study, FittedTerms]:
    """The study of the vehicle with the parameters of PRIORS fitted to nominal flights, and their fit."""
    known_bias = rest(flights)
    chosen, prior = _terms_and_priors(known_bias)
    calibration: tuple[Active, ...] = ()
    for _ in range(VEHICLE_FITS):
        floor = study_of(vehicle, calibration, flights, identified=False)
        data = Data(replace(floor, calibration=()), flights)
        start = np.concatenate([_scaled(t, calibration) for t in chosen])
        fitted = fit(data, whole_of(data), chosen, start, prior)
        fitted = with_mean_thrust(vehicle, flights, fitted, known_bias)
        calibration = tuple(t.active() for t in fitted.terms)
    return study_of(vehicle, calibration, flights), fitted


def _with_own_effects(study: Study, without: Sequence[str]) -> Study:
    """The study, its library of relations completed by what the user's own effects do.

    without: effects that are no candidates.
    """
    names = all_candidates(without)
    if study.relations is None or study.relations.effects.issuperset(names):
        return study
    from airtouch.gap.relations.own_effect import completed  # a second of imports, which few need

    return replace(study, relations=completed(study.relations, study.vehicle, names))


def _terms_and_priors(at_rest: bool) -> tuple[list[Term], np.ndarray]:
    """The terms of PRIORS, and the standard deviation (k,) of each of their free parameters, in natural steps.

    at_rest: whether flights rest, so that a vertical bias of the accelerometer can be told from thrust.
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
