"""The passing effect, tried before those that always act, and its evidence."""

from collections.abc import Mapping, Sequence

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.nameless.model import height_gain
from airtouch.gap.naming.forward import Search
from airtouch.gap.naming.judging import Trial, gain_of
from airtouch.gap.naming.policy import PASSING_GAIN
from airtouch.gap.naming.records import Charges, Hypothesis, OutgainedPassing, Step, Strength, UnsteadinessRarity
from airtouch.gap.passing.gates import KNOWN_OVERHEAD, PassingEffect, passing_effects
from airtouch.gap.passing.one_sided import DOWNWARD, downward
from airtouch.gap.passing.unsteadiness import log_entropies
from airtouch.gap.signatures.scatter import UNSTEADY_TORQUE, Scatter, size_of
from airtouch.gap.signatures.signature import OVERHEAD


def unusual_passing_effects(search: Search, without: Sequence[str]) -> list[PassingEffect]:
    """Passing effects that gain PASSING_GAIN more than what follows the flight's own height and have it as evidence.

    What follows the height needs no other vehicle. Evidence: `passing_evidence`. without: names that are left out.
    """
    trial, data = search.trial, search.trial.data
    if data.study.scatter is None:
        return []
    least = height_gain(data, trial.halves) + PASSING_GAIN
    return [e for e in passing_effects(data, without).values()
            if e.gain >= least and passing_evidence(data, e.key, e.gain, e.strength) >= PASSING_GAIN]


def passing_effect(search: Search, unusual: Sequence[PassingEffect]) -> Hypothesis | None:
    """The passing effect that explains most, as a hypothesis; None where none gains enough.

    It must gain PASSING_GAIN more than what always acts (`_best_steady`). Seconds in which another vehicle is known to
    be overhead go before others, which are only likely. unusual: `unusual_passing_effects`.
    """
    effects = [e for e in unusual if not _is_outgained(e, _best_steady(search, e.name))]
    if not effects:
        return None
    overhead = [e for e in effects if e.key == KNOWN_OVERHEAD]
    return _hypothesis_of(search.trial, max(overhead or effects, key=lambda e: e.gain))


def outgained(search: Search, unusual: Sequence[PassingEffect]) -> dict[str, OutgainedPassing]:
    """Passing effects, by name, that gain less than PASSING_GAIN more than an effect that always acts.

    unusual: `unusual_passing_effects`.
    """
    beside_steady = [(e, _best_steady(search, e.name)) for e in sorted(unusual, key=lambda e: e.gain)]
    return {e.name: OutgainedPassing(e.gain, steady.name, steady.gain) for e, steady in beside_steady
            if steady is not None and _is_outgained(e, steady)}


def _is_outgained(effect: PassingEffect, steady: Hypothesis | None) -> bool:
    """Whether a passing effect gains less than PASSING_GAIN more than the best that always acts; None for none."""
    return effect.gain < (steady.gain if steady else 0.0) + PASSING_GAIN


def _best_steady(search: Search, passing_name: str) -> Hypothesis | None:
    """The effect that gains most of those that always act and have enough evidence; None where there is none.

    The passing effect that they are compared with, `passing_name`, counts among them if it acts all along, whatever its
    evidence: the trims of nominal flights differ as by a wind, and a wind that gains little by its seconds is no news.
    A wake does not count, as no nominal flight is under another vehicle.
    """
    own = passing_name if passing_name != OVERHEAD else ""
    counting = [h for name, h in search.single_effects.items() if name == own or h.evidence >= search.least_nats[name]]
    return max(counting, key=lambda h: h.gain, default=None)


def _hypothesis_of(trial: Trial, effect: PassingEffect) -> Hypothesis:
    """A passing effect as a hypothesis; it is fitted on both halves, as it may act in one alone."""
    terms = effect.fitted.terms
    gain = sum(gain_of(trial, half, terms) for half in (0, 1)) - effect.cost
    evidence = passing_evidence(trial.data, effect.key, effect.gain, effect.strength)
    return Hypothesis(effect.name, terms, gain, (effect.fitted, effect.fitted),
                     charges=Charges().with_effect(effect.cost), strength=Strength(effect.strength), evidence=evidence,
                     passing_key=effect.key)


def as_in_nominal_flights(data: Data, passing: Hypothesis, steps: Sequence[Step]) -> bool:
    """Whether a passing effect adds no more to the effects beside it than in nominal flights."""
    key = passing.passing_key
    assert key is not None  # it is a passing effect
    return any(passing_evidence(data, key, s.leave_one_out_gain, passing.strength.mean) < PASSING_GAIN
               for s in steps if s.name == passing.name and s.is_named and s.leave_one_out_gain is not None)


def passing_evidence(data: Data, key: str, gain: float, strength: np.ndarray) -> float:
    """Evidence, nats, for a passing effect: its gain, but no more than nominal flights leave it.

    They leave it PASSING_GAIN and the nats by which its size is beyond theirs.

    key: `PassingEffect.key`; gain: nats; strength (k,): its scaled parameters.
    """
    assert data.study.scatter is not None  # no passing effect is looked for without nominal flights
    sizes = {key: size_of(gain / (data.air_seconds if key == KNOWN_OVERHEAD else data.seconds), strength)}
    if key == OVERHEAD:
        of_torque = {name: size for name, size in log_entropies(data).items() if name == UNSTEADY_TORQUE}
        of_wakes = {**of_torque, DOWNWARD: downward(data)}
        sizes |= _of_known_scatter(data.study.scatter, of_wakes)
    return min(gain, PASSING_GAIN + data.study.scatter.unusual(sizes))


def unsteadiness_rarity(data: Data) -> UnsteadinessRarity:
    """How much less steady flights are than nominal ones; 0 nats where it is not known how steady those are."""
    scatter = data.study.scatter
    entropies = {} if scatter is None else _of_known_scatter(scatter, log_entropies(data))
    if scatter is None or not entropies:
        return UnsteadinessRarity()
    rarest = max(entropies, key=lambda name: scatter.rarity({name: entropies[name]})[0])
    return UnsteadinessRarity(*scatter.rarity(entropies), rarest)


def _of_known_scatter(scatter: Scatter, sizes: Mapping[str, float]) -> dict[str, float]:
    """The sizes whose scatter in nominal flights is known."""
    return {name: size for name, size in sizes.items() if name in scatter.passing}
