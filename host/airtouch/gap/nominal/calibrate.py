"""The vehicle's parameters from flights declared nominal.

"System identification can manufacture agreement": a diagnosis is therefore made in two
arms, with the vehicle as declared and as calibrated here. Only the vehicle is calibrated
(rotors, lag, delay, drag, IMU), never its surroundings, each with a prior; lag and delay by
what thrust does, as aliases of the commands drown the torque (gap.signals.response). Inertia shows
in the torque alone: it stays as declared.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from airtouch.gap.evidence.data import Data, Study
from airtouch.gap.evidence.fit import fit
from airtouch.gap.evidence.problem import whole_of
from airtouch.gap.flights.flight import Flight
from airtouch.gap.loop import closed_loop, identify
from airtouch.gap.loop.disturbed import disturbed
from airtouch.gap.nominal.apparent import apparent
from airtouch.gap.relations.features import features
from airtouch.gap.relations.library import library_for
from airtouch.gap.result import Quantity
from airtouch.gap.second_process import shared
from airtouch.gap.signals.channels import COUNT, TORQUE, angular_acceleration, residual
from airtouch.gap.signals.lost_rows import bridging_power
from airtouch.gap.signals.response import Response, TorqueSpectra, response_of
from airtouch.gap.signals.spectra import AIR, REST, Floor, blocks, floor_of, frequencies, sensor_power, starts
from airtouch.gap.signatures.candidates import terms
from airtouch.gap.signatures.nominal_scatter import Apparent
from airtouch.gap.signatures.scatter_estimates import scatter_of
from airtouch.gap.signatures.term import Term
from airtouch.gap.unnamed.generic import unnamed_floor
from airtouch.robust import deviation
from airtouch.simulation.effects import Active
from airtouch.simulation.flight import prepare
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
#: a nominal flight is left out where its mean lies off the others' median by ODD of their deviations, and by FAR at
#: least, m/s^2 and rad/s^2; chosen
ODD = 6.0
FAR = np.array([0.3, 0.3, 0.4, 5.0, 5.0, 5.0])
#: the same of simulated flights, which have no trim of their own: six of the deviations of 60 nominal flights of
#: `diagnosis` and more; one landing on an edge hid masses of 5 % from six baseline flights
FAR_SIMULATED = 0.1 * FAR
SCATTER_FLIGHTS = 4  #: nominal flights to which every effect is fitted; more adds time, the table knows the rest
#: half of the deviations from the others' median beyond which a note names a baseline flight; chosen
SENSITIVE = 3.0


@dataclass(frozen=True)
class Calibration:
    """Fitted effects that make the declared vehicle the nominal one; intervals are 90 %."""

    active: tuple[Active, ...]
    parameters: dict[str, Quantity]
    notes: tuple[str, ...]
    declared: Study | None = None  #: with the vehicle as declared; None where flights were left out


def declared(vehicle: Vehicle, flights: Sequence[Flight]) -> Study:
    """The study with the vehicle as its file declares it."""
    return _study(vehicle, (), flights)


def calibrated(vehicle: Vehicle, flights: Sequence[Flight], *, scatter: bool = True, without: Sequence[str] = (),
               ) -> tuple[Study, Calibration]:
    """The study of a vehicle fitted to nominal flights, and the calibration.

    scatter: measure as well how strong every effect but those of `without` seems to be in them (seconds a flight;
    naming effects needs it, a map does not).

    Flights that cannot be nominal like the others (a touch of the ground, a swapped
    propeller) are left out and named, as long as most agree.
    """
    flights, odd = _alike(vehicle, flights, FAR)
    study = as_declared = declared(vehicle, flights)
    chosen, prior = _terms()
    for _ in range(2):
        data = Data(replace(study, calibration=(), controller=None, response=None), flights, slow=True)
        start = np.concatenate([_scaled(t, study.calibration) for t in chosen])
        found = fit(data, whole_of(data), chosen, start, prior)
        study = _study(vehicle, tuple(t.active() for t in found.terms), flights)
    study = replace(study, unnamed_floor=unnamed_floor(Data(study, flights)))
    if scatter:
        strengths = shared(partial(_apparent, study, without), _some(flights))
        study = replace(study, scatter=scatter_of(strengths, any(_recorded(f) for f in flights), vehicle.name))
        if study.simulated:  # where every flight has the same trim: chance is in the lowest bin already
            alike, unlike = _alike(vehicle, flights, FAR_SIMULATED)
            if unlike:
                study, again = calibrated(vehicle, alike, without=without)
                return study, replace(again, notes=(*odd, *unlike, *again.notes), declared=None)
            study = replace(study, floor=replace(study.floor, offset=study.floor.offset_beyond),
                            relations=library_for(vehicle, [features(f, vehicle) for f in flights]))
    return study, Calibration(study.calibration, _quantities(chosen, found.scaled, found.covariance),
                              (*odd, *_inconsistent(study, flights)), None if odd else as_declared)


def _apparent(study: Study, without: Sequence[str], flight: Flight) -> Apparent:
    """How strong every effect seems to be in one nominal flight."""
    return apparent(Data(study, [flight]), without)


def _recorded(flight: Flight) -> bool:
    """Whether the log's format is one that only drones and their ground stations write."""
    formats = {str(flight.log.meta.get(key, "")).split("-")[0] for key in ("format", "origin_format")}
    return bool(formats & {"authors", "crazypad", "imrclab", "usd"})


def _some(flights: Sequence[Flight]) -> list[Flight]:
    """At most SCATTER_FLIGHTS of the flights, evenly chosen; none where there is only one."""
    chosen = np.unique(np.linspace(0, len(flights) - 1, SCATTER_FLIGHTS).astype(int))
    return [flights[i] for i in chosen] if len(flights) > 1 else []


def sensor_noise(vehicle: Vehicle) -> np.ndarray:
    """White noise (COUNT,) that the vehicle's sensors are declared to have, rms at 100 Hz."""
    acc = vehicle.acc_noise_rms_mps2 * np.array(vehicle.acc_noise_ratio)
    gyro = vehicle.gyro_noise_rms_radps * np.array(vehicle.gyro_noise_ratio)
    return np.concatenate([acc, gyro, gyro, np.zeros(COUNT - 9)])


def _study(vehicle: Vehicle, calibration: tuple[Active, ...], flights: Sequence[Flight]) -> Study:
    least = sensor_noise(vehicle)
    if not flights:
        power = {r: 2.0 * sensor_power(least, r) for r in (AIR, REST)}
        for table in power.values():
            table[:, 9:] = 1e12
            table[:, 6:9] = 1e6
        return Study(vehicle, calibration, None, Floor(power, {AIR: 8, REST: 8}, np.zeros(COUNT), 0.0, 0.0))
    law = identify.identify(flights, vehicle, calibration)
    left = [np.nan_to_num(residual(f, vehicle, calibration)) for f in flights]
    first = [{r: starts(f, r) for r in (AIR, REST)} for f in flights]
    made = [{r: blocks(x, s[r], r) for r in s} for x, s in zip(left, first, strict=True)]
    answer, quiet = _response(vehicle, calibration, law, flights, first, made)
    lost = [bridging_power(f, vehicle, calibration, s[AIR], q, answer)
            for f, s, q in zip(flights, first, quiet, strict=True)]
    floor = floor_of(flights, left, first, made, least, lost)
    if law is not None and answer is not None and answer.stepped is not None:
        over = answer.stepped.power / np.maximum(answer.steady.power, 1e-30)
        law = law.with_steps(answer.stepped.coherent, over, frequencies(AIR))
    return Study(vehicle, calibration, law, floor, answer, nominal=len(flights))


def _response(vehicle: Vehicle, calibration: tuple[Active, ...], law: closed_loop.ClosedLoop | None,
              flights: Sequence[Flight], first: Sequence[dict[str, np.ndarray]], made: Sequence[dict[str, np.ndarray]],
              ) -> tuple[Response | None, Sequence[np.ndarray | None]]:
    """How the gyro follows the commands, taken off `made` in place, and where no set-point stepped (`Data.quiet`).

    None, and for every flight None, without gyro or loop model.
    """
    nothing = [None] * len(flights)
    if law is None or any(f.rates is None for f in flights):
        return None, nothing
    loop = disturbed(law.controllers, prepare(vehicle, calibration)[0][0], frequencies(AIR))
    turning = [blocks(angular_acceleration(f), s[AIR], AIR) for f, s in zip(flights, first, strict=True)]
    answer = response_of(turning, [m[AIR][:, :, TORQUE] for m in made], loop)
    if answer is None:
        return None, nothing
    quiet = [answer.quiet(t - m[AIR][:, :, TORQUE]) for t, m in zip(turning, made, strict=True)]
    for q, measured, m in zip(quiet, turning, made, strict=True):
        m[AIR] = answer.with_residual(m[AIR], q, TorqueSpectra(measured, m[AIR][:, :, TORQUE]))
    return answer, quiet


def _terms() -> tuple[list[Term], np.ndarray]:
    chosen, prior = [], []
    for name, variant, spread in PRIORS:
        term = next(t for t in terms(name) if all(t.values[k] == v for k, v in variant.items()))
        chosen.append(term)
        for p in term.free:
            prior.append(spread[p] / term.step(p))
    return chosen, np.array(prior)


def _scaled(term: Term, calibration: Sequence[Active]) -> np.ndarray:
    for a in calibration:
        if a.effect.name == term.name and all(a.values[k] == v for k, v in term.values.items()
                                              if k not in term.free):
            return term.scaled(a.values)
    return np.zeros(len(term.free))


def _quantities(chosen: Sequence[Term], scaled: np.ndarray, covariance: np.ndarray) -> dict[str, Quantity]:
    out, place = {}, 0
    for term in chosen:
        part = slice(place, place + len(term.free))
        place += len(term.free)
        variant = f" {int(term.values['rotor'])}" if term.name == "weak_motor" else ""
        for key, q in term.quantities(scaled[part], covariance[part, part]).items():
            if key in term.free:
                out[f"{term.name}{variant} {key}"] = q
    return out


def _alike(vehicle: Vehicle, flights: Sequence[Flight], least: np.ndarray) -> tuple[list[Flight], list[str]]:
    """The flights whose mean force and torque agree with most others', and words on the rest.

    least (6,): by which they must differ at least, m/s^2 and rad/s^2.
    """
    if len(flights) < 3:
        return list(flights), []
    means = _means(flights, vehicle)
    odd = (np.abs(means - np.median(means, axis=0)) > np.maximum(ODD * deviation(means), least)).any(axis=1)
    if odd.sum() > len(flights) // 3:
        return list(flights), []
    words = [f"{f.name}: declared nominal, yet unlike the others (lift {m[2] - np.median(means[:, 2]):+.2g} m/s^2); "
             "left out" for f, m, o in zip(flights, means, odd, strict=True) if o]
    return [f for f, o in zip(flights, odd, strict=True) if not o], words


def _means(flights: Sequence[Flight], vehicle: Vehicle, calibration: Sequence[Active] = ()) -> np.ndarray:
    """Mean force and torque (flights, 6) in the air that the model leaves, m/s^2 and rad/s^2."""
    return np.array([residual(f, vehicle, calibration)[(f.phase > 0) & f.usable][:, :6].mean(axis=0) for f in flights])


def _inconsistent(study: Study, flights: Sequence[Flight]) -> list[str]:
    """Which nominal flights differ from the rest by more than chance and how much."""
    if len(flights) < 3:
        return []
    notes = []
    names = ("forward force", "sideways force", "lift", "roll torque", "pitch torque", "yaw torque")
    means = _means(flights, study.vehicle, study.calibration)
    spread = deviation(means)
    for f, row in zip(flights, means, strict=True):
        far = np.abs(row - np.median(means, axis=0)) / np.maximum(spread, 1e-9)
        i = int(np.argmax(far))
        if far[i] > 2.0 * SENSITIVE:
            notes.append(f"{f.name}: declared nominal, yet its {names[i]} is {far[i]:.0f} deviations from the others'")
    return notes
