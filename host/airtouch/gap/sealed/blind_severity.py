"""The weakest strength of an effect that could be detected at all, by the test that no other can beat.

Neyman and Pearson: among tests with a given rate of false alarms, the likelihood ratio of
"this effect, this strength" against "none" misses least. It knows what the diagnosis has to
find out. Its ratio is taken here on flights with and without the effect, each a normal
variable with the mean and deviation seen; the strength is found by halving. A diagnosis
that may raise 2 % false alarms asks about every effect at once, so that each test gets its
share of them only. Deviations of so few flights come out too small by chance, and halving
finds where they do; so the means alone must be as far apart as such normal variables are.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import norm

import airtouch.gap.measure as measure
from airtouch.gap.evidence.clock import clock_gain
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.fit import judge
from airtouch.gap.evidence.problem import whole_of
from airtouch.gap.signals.study import Study
from airtouch.gap.signatures import candidates
from airtouch.gap.signatures.random_draws import KINDS, Kind
from airtouch.gap.signatures.signature import CLOCK
from airtouch.gap.signatures.term import Term
from airtouch.logs.flight_log import FlightLog
from airtouch.simulation.batch import flights as flown
from airtouch.simulation.effects import Active

FALSE_ALARMS, MISSES = 0.02, 0.05  #: of all tests of a flight together, and of the one that should answer
FALSE_ALARM, POWER = float(norm.isf(FALSE_ALARMS / len(KINDS))), float(norm.isf(MISSES))  #: deviations
#: nats, half of what the means of two log ratios differ by whose deviations are these, as those of normal variables are
APART = 0.5 * (FALSE_ALARM + POWER) ** 2
SEEN = 0.5 * FALSE_ALARM ** 2  #: log ratio that chance exceeds in so many flights (Wilks 1938)
TRIES = 8  #: flights with and without the effect; chosen
FEWEST = 3  #: of them that must fly to the end, else the effect is so strong that it is seen anyhow; chosen
RANGE = 300.0  #: highest plausible strength over the weakest that is tried; chosen
HALVINGS = 6  #: of the logarithm of that range, so that the strength is known to a tenth; chosen
FACTORS = (1.0, 2.0, 4.0)  #: severities, times the weakest; the last at most the highest plausible
FIRST = 900_000  #: number of the first flight, beyond those of any set


def weakest(kind: Kind, study: Study, scenario: str, without: Sequence[Data], seed: int,
            seen: Callable[[FlightLog], FlightLog]) -> float | None:
    """Strength that is just detected on such flights; None where the highest plausible one is not.

    without: flights free of effects, other than those that the study was calibrated on.
    seen: what the diagnosis gets to see of a log.
    """
    rng_seed = [seed, sum(map(ord, kind.effect)), int(1e6 * kind.highest)]
    if not _seen(kind, kind.highest, study, scenario, without, rng_seed, seen):
        return None
    low, high = np.log(kind.highest / RANGE), np.log(kind.highest)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if _seen(kind, float(np.exp(middle)), study, scenario, without, rng_seed, seen):
            high = middle
        else:
            low = middle
    return float(np.exp(high))


def _seen(kind: Kind, strength: float, study: Study, scenario: str, without: Sequence[Data],
          seed: list[int], seen: Callable[[FlightLog], FlightLog]) -> bool:
    """Whether the likelihood ratio tells flights with the effect from those without; the arguments are `weakest`'s."""
    with_effect, without_effect = [], []
    for i in range(TRIES):
        active = kind.active(strength, np.random.default_rng([*seed, i]))
        log = next(iter(flown(scenario, [FIRST + i], vehicle=study.vehicle, effects=[active], workers=1)))
        if not isinstance(log, FlightLog):
            continue
        flights = list(measure.usable([seen(log)], study.vehicle, []))
        if not flights:
            continue
        with_effect.append(log_ratio(Data(study, flights), active))
        without_effect.append(log_ratio(without[i % len(without)], active))
    if len(with_effect) < FEWEST:
        return True  # so strong that it cannot fly
    yes, no = np.array(with_effect), np.array(without_effect)
    alarm = no.mean() + FALSE_ALARM * no.std(ddof=1)
    told_apart = yes.mean() - POWER * yes.std(ddof=1) > alarm or yes.min() > alarm  # strong ones scatter widely
    return bool(told_apart and 0.5 * (yes.mean() - no.mean()) > APART)


def log_ratio(data: Data, active: Active) -> float:
    """Log likelihood of the flights under an effect with these values over that under none."""
    term = term_of(active)
    if term.shows_in == CLOCK:
        return clock_gain(data, term)[1]
    whole = whole_of(data)
    return judge(data, whole, (term,)) - judge(data, whole, ())


def term_of(active: Active) -> Term:
    """The hypothesis of exactly these values."""
    first = candidates.terms(active.effect.name)[0]
    return replace(first, values=dict(active.values))


def three_severities(low: float, highest: float) -> tuple[float, ...]:
    """Three strengths: the weakest that can be detected, twice and four times that, or up to the highest."""
    top = min(FACTORS[2] * low, highest)
    return (low, float(np.sqrt(low * top)), top) if top < FACTORS[2] * low else tuple(f * low for f in FACTORS)
