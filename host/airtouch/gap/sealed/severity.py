"""The weakest strength of an effect that could be detected at all, by the test that no other can beat.

Neyman and Pearson: among tests with a given rate of false alarms, the likelihood ratio of
"this effect, this strength" against "none" misses least. It knows what the diagnosis has to
find out. Its ratio is taken here on flights with and without the effect, each a normal
variable with the mean and standard deviation seen; the strength is found by bisection. A diagnosis
that may raise 2 % false alarms asks about every effect at once, so that each test gets its
share of them only. Standard deviations of so few flights come out too small by chance, and a search
finds where they do; so the means alone must be as far apart as such normal variables are.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm

from airtouch.gap.evidence.clock import measured_clock_term
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.judge import judge
from airtouch.gap.evidence.problem import whole_of
from airtouch.gap.flights.flight import GROUND, Flight, ready_flights
from airtouch.gap.signatures import candidates
from airtouch.gap.signatures.random_draws import KINDS, Kind
from airtouch.gap.signatures.signature import CLOCK
from airtouch.gap.signatures.term import Term
from airtouch.gap.study import Study
from airtouch.logs.flight_log import FlightLog
from airtouch.simulation.batch import flights as flown
from airtouch.simulation.effects import Active

FALSE_ALARMS, MISSES = 0.02, 0.05  #: of all tests of a flight together, and of the one that should answer
FALSE_ALARM, POWER = float(norm.isf(FALSE_ALARMS / len(KINDS))), float(norm.isf(MISSES))  #: standard deviations
#: nats, half of what the means of two normal log ratios differ by whose standard deviations are these
APART = 0.5 * (FALSE_ALARM + POWER) ** 2
#: nats; a normal log ratio of two exact hypotheses (mean -d^2/2, variance d^2 under none) exceeds it by chance in a
#: share FALSE_ALARMS / len(KINDS) of flights at most, whatever d
SEEN = 0.5 * FALSE_ALARM ** 2
TRIES = 8  #: flights with and without the effect; chosen
FEWEST_FLOWN = 3  #: of them that must fly to the end, else the effect is so strong that it is seen anyhow; chosen
#: largest fraction of the time in the air in which a vehicle may touch something; chosen. Of 1,440 flights of two sets
#: (seeds 905176 and 905177) 13 do so in 35 % or more, each with a `range_step`, and the others in 25 % at most
MOST_TOUCHING = 0.3
RANGE = 300.0  #: highest plausible strength over the weakest that is tried; chosen
BISECTIONS = 6  #: of the logarithm of that range, so that the strength is known to a tenth; chosen
FACTORS = (1.0, 2.0, 4.0)  #: severities, times the weakest; the last at most the highest plausible
FIRST = 900_000  #: number of the first flight, beyond those of any set


@dataclass(frozen=True)
class Conditions:
    """What the test is made on.

    study: of the vehicle; scenario: in which it flies; without: flights free of effects, other than those that the
    study was calibrated on; part_seen: what the diagnosis gets to see of a log.
    """

    study: Study
    scenario: str
    without: Sequence[Data]
    part_seen: Callable[[FlightLog], FlightLog]


def weakest(kind: Kind, conditions: Conditions, seed: int) -> float | None:
    """Strength that is just detected under the conditions; None where the highest plausible one is not."""
    seeds = [seed, sum(map(ord, kind.effect)), int(1e6 * kind.highest)]

    def detected(strength: float) -> bool:
        """Whether the test tells flights with the effect at a strength from those without."""
        return detectable(*_log_ratios(
            [kind.active(strength, np.random.default_rng([*seeds, i])) for i in range(TRIES)], conditions))

    if not detected(kind.highest):
        return None
    low, high = np.log(kind.highest / RANGE), np.log(kind.highest)
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if detected(float(np.exp(middle))) else (middle, high)
    return float(np.exp(high))


def _log_ratios(actives: Sequence[Active], conditions: Conditions) -> tuple[np.ndarray, np.ndarray]:
    """Log ratios, nats, of a flight with each of these effects and of one without, for those that fly to the end."""
    study, free = conditions.study, conditions.without
    with_effect, without_effect = [], []
    for i, active in enumerate(actives):
        # flown with the default seed, not the set's: the same manoeuvres for every set, of numbers that no set has
        log = next(iter(flown(conditions.scenario, [FIRST + i], vehicle=study.vehicle, effects=[active], workers=1)))
        if not isinstance(log, FlightLog):
            continue
        flights = list(ready_flights([conditions.part_seen(log)], study.vehicle, []))
        if all_flown(flights):
            with_effect.append(log_ratio(Data(study, flights), active))
            without_effect.append(log_ratio(free[i % len(free)], active))
    return np.array(with_effect), np.array(without_effect)


def all_flown(flights: Sequence[Flight]) -> bool:
    """Whether there is a flight, and each is flown: but for MOST_TOUCHING of it the vehicle touches nothing.

    A vehicle that takes a platform for lower than it is comes to stand on it, its motors running.
    """
    def touching(flight: Flight) -> float:
        """Fraction of a flight between take-off and landing in which the vehicle touches something."""
        flying = flight.phase != GROUND
        return float(np.mean((~flight.usable & ~flight.not_logged)[flying]))

    return bool(flights) and all(touching(f) < MOST_TOUCHING for f in flights)


def detectable(with_effect: np.ndarray, without_effect: np.ndarray) -> bool:
    """Whether log ratios (n,) of flights with an effect, nats, stand over those of as many without.

    True for fewer than FEWEST_FLOWN: an effect so strong that it cannot fly.
    """
    if len(with_effect) < FEWEST_FLOWN:
        return True
    alarm = without_effect.mean() + FALSE_ALARM * without_effect.std(ddof=1)
    most_over = with_effect.mean() - POWER * with_effect.std(ddof=1) > alarm
    apart = most_over or with_effect.min() > alarm  # strong ones scatter widely
    return bool(apart and 0.5 * (with_effect.mean() - without_effect.mean()) > APART)


def log_ratio(data: Data, active: Active) -> float:
    """Log likelihood of the flights under an effect with these values over that under none."""
    term = exact_term(active)
    if term.shows_in == CLOCK:
        return measured_clock_term(data, term).gain
    whole = whole_of(data)
    return judge(data, whole, (term,)) - judge(data, whole, ())


def exact_term(active: Active) -> Term:
    """The hypothesis of exactly these values."""
    first = candidates.terms(active.effect.name)[0]
    return replace(first, values=dict(active.values))


def three_severities(low: float, highest: float) -> tuple[float, ...]:
    """Three strengths: the weakest that can be detected, twice and four times that, or up to the highest."""
    top = min(FACTORS[2] * low, highest)
    return (low, float(np.sqrt(low * top)), top) if top < FACTORS[2] * low else tuple(f * low for f in FACTORS)
