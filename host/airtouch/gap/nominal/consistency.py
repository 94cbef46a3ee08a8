"""Whether the baseline flights agree: which are left out, which a note names, by how much all of them differ.

What is compared is each flight's trim: the mean force and torque in the air that the model leaves. Of other flights it
is said when they are flown unlike the baseline.
"""

from collections.abc import Sequence
from functools import partial

import numpy as np
from scipy.special import stdtrit

from airtouch.gap.flights.fitness import log_kind, logged_hz
from airtouch.gap.flights.flight import GROUND, Flight
from airtouch.gap.flights.hardness import hardness_of, tilt_degrees
from airtouch.gap.signals.channels import CHANNEL_WORDS, CHANNELS, COLUMN, TORQUE, residual
from airtouch.gap.signals.spectra import AIR, LENGTH, starts
from airtouch.gap.study import Study
from airtouch.robust import deviation
from airtouch.simulation.effects import Active
from airtouch.vehicle import Vehicle

TRIM = slice(0, TORQUE.stop)  #: channels of force and torque, m/s^2 and rad/s^2
FEWEST_FLIGHTS = 3  #: flights of which one can be unlike the others
#: robust standard deviations off the others' median beyond which a flight's trim is odd; chosen
ODD = 6.0
FALSE_NOTES = 0.01  #: share of sets of normal trims in which a flight is called odd, at most; chosen
MOST_LEFT_OUT = 3  #: at most one flight in so many is left out; where more are odd, the flights disagree and all count
#: distance off the median, m/s^2 and rad/s^2, from which an odd flight is left out; chosen
FAR = np.array([0.3, 0.3, 0.4, 5.0, 5.0, 5.0])
#: the same of simulated flights, which have no trim of their own: six standard deviations of 60 nominal flights of the
#: scenario `diagnosis` and more. With FAR a flight that lands on an edge hid masses of 5 % (gap-blind-record.md, seed
#: 112233)
FAR_SIMULATED = 0.1 * FAR
#: range of the baseline flights' trims that a note mentions, m/s^2 and rad/s^2 (host/docs/gap-floor.md); chosen
APART = np.array([0.2, 0.2, 0.2, 4.0, 4.0, 4.0])
SURE = 6.0  #: standard errors of a flight's trim that this range must exceed as well; chosen
PARTS = 8  #: equal parts of a flight, whose means give the trim's standard error
SAME_RATE = 0.05  #: relative difference up to which two logs have one rate; chosen


def split_unlike(vehicle: Vehicle, flights: Sequence[Flight], far: np.ndarray) -> tuple[list[Flight], list[str]]:
    """The flights whose trim under the declared vehicle agrees with the others', and a note on each one left out.

    far (6,): distance from the median that a trim left out has at least, m/s^2 and rad/s^2. Fewer than FEWEST_FLIGHTS,
    or flights of which more than one in MOST_LEFT_OUT is unlike the others, all stay.
    """
    if len(flights) < FEWEST_FLIGHTS:
        return list(flights), []
    trim = trims(flights, vehicle)
    median = np.median(trim, axis=0)
    distance = (trim - median) / np.maximum(ODD * deviation(trim), far)
    unlike = (np.abs(distance) > 1.0).any(axis=1)
    if unlike.sum() > len(flights) // MOST_LEFT_OUT:
        return list(flights), []
    notes = [f"{f.file_name}: declared nominal, yet unlike the others ({_farthest(t - median, d)}); left out"
             for f, t, d, out in zip(flights, trim, distance, unlike, strict=True) if out]
    return [f for f, out in zip(flights, unlike, strict=True) if not out], notes


def _farthest(offset: np.ndarray, distance: np.ndarray) -> str:
    """The channel of the largest distance (6,) in words, with its offset (6,), m/s^2 and rad/s^2."""
    channel = CHANNELS[TRIM][int(np.argmax(np.abs(distance)))]
    return f"{CHANNEL_WORDS[channel.name]} {offset[COLUMN[channel.name]]:+.2g} {channel.unit}"


def of_one_trim(vehicle: Vehicle, flights: Sequence[Flight]) -> bool:
    """Whether the trims of two flights or more scatter no more than those of simulated flights drawn with one trim.

    The robust standard deviation of each channel is then FAR_SIMULATED at most. In units of a sixth of that, sets of
    four and six flights of the scenarios `diagnosis` and `hover` have 0.4 to 2.4 in the channel where it is largest,
    sets of paper-low, paper-mixed, steps and zigzag, which draw each flight's rotors and battery, 44 to 198.
    """
    return bool((deviation(trims(flights, vehicle)) <= FAR_SIMULATED).all())


def odd_flights(study: Study, flights: Sequence[Flight]) -> list[str]:
    """A note on each flight whose trim under the calibrated vehicle is odd, with the channel in which it is most so.

    Its distance from the others' mean is beyond what a further normal one has, in FALSE_NOTES of such sets, and beyond
    FAR (of simulated flights FAR_SIMULATED).
    """
    n = len(flights)
    if n < FEWEST_FLIGHTS:
        return []
    trim = trims(flights, study.vehicle, study.calibration)
    limit = float(stdtrit(n - 2, 1.0 - 0.5 * FALSE_NOTES / trim.size))
    least = (FAR_SIMULATED if study.simulated else FAR) / limit
    notes = []
    for i, f in enumerate(flights):
        others = np.delete(trim, i, axis=0)
        error = others.std(axis=0, ddof=1) * np.sqrt(1.0 + 1.0 / (n - 1))  # of the difference to their mean
        offset = trim[i] - others.mean(axis=0)
        distance = np.abs(offset) / np.maximum(error, least)
        if distance.max() > limit:
            notes.append(f"{f.file_name}: declared nominal, yet far from the others' mean "
                         f"({_farthest(offset, distance)})")
    return notes


def differences(study: Study, flights: Sequence[Flight]) -> list[str]:
    """A note on the channels in which the trims of the flights range by more than APART and chance; or on one flight.

    The floor rises by what they differ, and the diagnosis goes on.
    """
    if len(flights) == 1:
        return ["one baseline flight: how much nominal flights differ among themselves is not known"]
    if not flights:
        return []
    in_air = [_in_air(f, study.vehicle, study.calibration) for f in flights]
    parts = [np.array([p.mean(axis=0) for p in np.array_split(x, PARTS)]) for x in in_air]
    spread = np.ptp([x.mean(axis=0) for x in in_air], axis=0)
    errors = [p.std(axis=0, ddof=1) / np.sqrt(PARTS) for p in parts]
    error = np.sqrt(np.mean(np.square(errors), axis=0))
    apart = [f"{spread[i]:.2g} {CHANNELS[i].unit} in {CHANNEL_WORDS[CHANNELS[i].name]}"
             for i in np.argsort(-spread / APART) if spread[i] > APART[i] and spread[i] > SURE * error[i]]
    return ["the baseline flights are not consistent: among themselves they differ by " + ", ".join(apart)
            + "; the floor is that much higher"] if apart else []


def flown_unlike(study: Study, flights: Sequence[Flight]) -> list[str]:
    """A note on each flight that is flown harder or calmer than every baseline flight: its floor is extrapolated."""
    slopes = study.floor.slopes
    if slopes is None:
        return []
    notes = []
    for f in flights:
        hardness = hardness_of(f, starts(f, AIR), LENGTH[AIR])
        middle = float(np.median(hardness)) if len(hardness) else slopes.mean
        if slopes.calmest <= middle <= slopes.hardest:
            continue
        word, end, limit = (("harder", slopes.hardest, "at most") if middle > slopes.hardest
                            else ("calmer", slopes.calmest, "at least"))
        own, theirs = (tilt_degrees(x) for x in (middle, end))
        notes.append(f"{f.file_name}: flown {word} than any baseline flight (its tilt varies by {own:.1f} degrees, "
                     f"theirs by {limit} {theirs:.1f}): the floor is extrapolated; fly the baseline like the test")
    return notes


def logged_unlike(flights: Sequence[Flight], baseline: Sequence[Flight]) -> list[str]:
    """A note on each flight whose log is of another kind, or of another rate, than every baseline log."""
    kinds, rates = {log_kind(f.log) for f in baseline}, {logged_hz(f.log) for f in baseline}
    known_kinds, known_rates = ", ".join(sorted(kinds)), ", ".join(sorted({f"{r:.0f}" for r in rates}))
    of_kind = [f"{f.file_name}: a log of another kind ({log_kind(f.log)}) than the baseline's ({known_kinds}): what "
               "differs may be the logs; take a baseline that was logged like the test"
               for f in flights if kinds and log_kind(f.log) not in kinds]
    rate_by_flight = [(f.file_name, logged_hz(f.log)) for f in flights]
    other_rate = [(name, hertz) for name, hertz in rate_by_flight
                  if rates and min(abs(hertz / r - 1.0) for r in rates) > SAME_RATE]
    return of_kind + [f"{name}: logged at {hertz:.0f} Hz, the baseline at {known_rates} Hz: less folds into the band "
                      "of a faster log, which may look like a delay or slow motors; log both at one rate"
                      for name, hertz in other_rate]


def trims(flights: Sequence[Flight], vehicle: Vehicle, calibration: Sequence[Active] = ()) -> np.ndarray:
    """Trim (flights, 6) of each flight, m/s^2 and rad/s^2; worked out once for a flight and a vehicle."""
    key = vehicle, tuple(a.key for a in calibration)
    return np.array([f.workspace.cached("trim", key, partial(_trim, f, vehicle, calibration)) for f in flights])


def _trim(flight: Flight, vehicle: Vehicle, calibration: Sequence[Active]) -> np.ndarray:
    """Trim (6,) of a flight."""
    return _in_air(flight, vehicle, calibration).mean(axis=0)


def _in_air(flight: Flight, vehicle: Vehicle, calibration: Sequence[Active]) -> np.ndarray:
    """Residual force and torque (samples, 6) of a flight's usable samples in the air."""
    return residual(flight, vehicle, calibration)[(flight.phase != GROUND) & flight.usable][:, TRIM]
