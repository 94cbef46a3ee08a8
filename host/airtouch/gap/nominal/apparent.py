"""How strong every effect seems to be in nominal flights, which have none: the scatter that others must exceed."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.flights.evenly import evenly_spaced
from airtouch.gap.flights.fitness import log_kind
from airtouch.gap.flights.flight import Flight
from airtouch.gap.naming.evidence import random_variance
from airtouch.gap.naming.judging import at_bound, trial_of
from airtouch.gap.naming.records import Hypothesis
from airtouch.gap.naming.rounds import every_strength
from airtouch.gap.naming.select import nameless_nats
from airtouch.gap.nominal.consistency import of_one_trim
from airtouch.gap.passing.gates import passing_effects
from airtouch.gap.passing.one_sided import DOWNWARD, downward
from airtouch.gap.passing.unsteadiness import log_entropies
from airtouch.gap.second_process import map_on_two_cores
from airtouch.gap.signatures.candidates import all_candidates, strength_term
from airtouch.gap.signatures.scatter import ApparentStrengths, Scatter, size_of
from airtouch.gap.signatures.scatter_estimates import scatter_of
from airtouch.gap.signatures.signature import CLOCK, PASSING, SPECTRUM
from airtouch.gap.study import Study

FLIGHTS = 4  #: nominal flights to which every effect is fitted; chosen: more adds time, and the table knows the rest
NEUTRAL = 1e-6  #: scaled strength of an effect that only has one sign, below which it is at its bound of none
#: standard deviation, natural steps, from which on a flight shows nothing of a parameter; chosen: that of ground effect
#: is 0.02 to 0.4 where flights pass over a platform, 1.5 and more where they do not
HIDDEN_DEVIATION = 1.0
NOBODY_KNOWS = 1e6  #: standard deviation of a scaled parameter of which the data say nothing
#: kinds of logs that only a vehicle or its ground station writes, never a simulator
RECORDERS = frozenset({"authors", "crazypad", "imrclab", "usd"})


def baseline_scatter(study: Study, flights: Sequence[Flight], without: Sequence[str] = ()) -> Scatter:
    """How far the apparent strengths of every effect but those of `without` scatter among the nominal flights.

    It is measured in FLIGHTS of them, each held against the study of all.
    """
    chosen = evenly_chosen(flights)
    # the longer work of each flight first, so that two processes end together
    work = [(look, flight) for look in (_strengths, _beside_strengths) for flight in chosen]

    def done(piece: tuple[Callable[[Data, Sequence[str]], Any], Flight]) -> Any:
        """One look at one flight."""
        look, flight = piece
        return look(Data(study, [flight]), without)

    looks = map_on_two_cores(done, work)
    apparent = [_together(*parts) for parts in zip(looks[:len(chosen)], looks[len(chosen):], strict=True)]
    return scatter_of(apparent, any(is_recorded(f) for f in flights), study.vehicle.name,
                      of_one_trim(study.vehicle, flights), calibrated_on=len(flights))


def apparent_strengths(data: Data, without: Sequence[str] = ()) -> ApparentStrengths:
    """How strong every effect but those of `without` seems to be in flights that have none."""
    return _together(_strengths(data, without), _beside_strengths(data, without))


class _Strengths(NamedTuple):
    """The first part of `ApparentStrengths`, which comes from fits of every effect."""

    strengths: dict[str, np.ndarray]
    errors: dict[str, np.ndarray]
    hidden: frozenset[str]


class _BesideStrengths(NamedTuple):
    """The other part: of the nameless model, and of effects that come and go."""

    rate: float
    passing: dict[str, float]


def _together(one: _Strengths, other: _BesideStrengths) -> ApparentStrengths:
    """Both parts of one flight."""
    return ApparentStrengths(one.strengths, one.errors, other.rate, other.passing, one.hidden)


def _strengths(data: Data, without: Sequence[str]) -> _Strengths:
    """The strengths of every effect but those of `without`."""
    singles = every_strength(trial_of(data), all_candidates(without))
    known = {name: candidate for name, candidate in singles.items() if len(candidate.strength.mean)}
    return _Strengths({name: candidate.strength.mean for name, candidate in known.items()},
                      {name: _strength_error(data, candidate) for name, candidate in known.items()},
                      frozenset(name for name, candidate in known.items() if _is_hidden(candidate)))


def _beside_strengths(data: Data, without: Sequence[str]) -> _BesideStrengths:
    """The rate of the nameless model, and the sizes of every passing effect but those of `without`."""
    return _BesideStrengths(nameless_nats(trial_of(data), None) / data.seconds, passing_sizes(data, without))


def passing_sizes(data: Data, without: Sequence[str] = ()) -> dict[str, float]:
    """Size of each passing effect but those of `without`; how unsteady flights are and how far pushes point down."""
    passing = passing_effects(data, without)
    sizes = {n: size_of(passing[n].gain / data.seconds, passing[n].strength) if n in passing else 0.0 for n in PASSING}
    return {**sizes, **log_entropies(data), DOWNWARD: downward(data)}


def evenly_chosen(flights: Sequence[Flight]) -> list[Flight]:
    """At most FLIGHTS of the flights, evenly spaced; none where there is only one, which shows no scatter."""
    if len(flights) < 2:
        return []
    return evenly_spaced(flights, FLIGHTS)


def is_recorded(flight: Flight) -> bool:
    """Whether the flight's log is of one of the kinds RECORDERS."""
    return log_kind(flight.log) in RECORDERS


def _is_hidden(judged: Hypothesis) -> bool:
    """Whether the flight shows nothing of an effect that acts near surfaces alone, as it stays away from them."""
    return strength_term(judged.terms).signature.near_surfaces \
        and float(np.sqrt(judged.strength.variance.min())) > HIDDEN_DEVIATION


def _strength_error(data: Data, judged: Hypothesis) -> np.ndarray:
    """Standard deviation (k,) by chance of the strength of a candidate's best hypothesis."""
    term, strength = strength_term(judged.terms), judged.strength
    if term.shows_in == CLOCK:
        return np.zeros(len(strength.mean))
    if term.shows_in == SPECTRUM:
        return np.sqrt(random_variance(data, judged, term))
    low, _ = (term.among_all(b, -np.inf) for b in term.bounds())
    pressed = (low == 0.0) & (strength.mean < NEUTRAL)  # the data would have it below none: how far, nobody knows
    return np.where(at_bound(term, strength.mean) | pressed, NOBODY_KNOWS,
                    np.minimum(np.sqrt(strength.variance), NOBODY_KNOWS))
