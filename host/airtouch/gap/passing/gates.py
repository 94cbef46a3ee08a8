"""Passing effects: what each explains within its gate.

An effect is tried in the gate of the blocks that it explains best (`gate_search`) and in those of bursts and pushes,
which are shorter than a block (`bursts`). A gate may lie in one half of a split, so a passing effect is judged on what
it is fitted on, at the cost of half the logarithm of the number of blocks for each parameter (Schwarz 1978), and of
the choice of its gate.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.fit import FittedTerms, fit
from airtouch.gap.evidence.judge import judge
from airtouch.gap.evidence.problem import BlockSet, whole_of
from airtouch.gap.passing.bursts import FORCE_BURSTS, YAW_BURSTS, burst_gate, push_gate
from airtouch.gap.passing.gate_search import LEAST_BLOCKS, GateTrial, block_gate, block_log_likelihoods
from airtouch.gap.signatures import candidates
from airtouch.gap.signatures.candidates import random_of
from airtouch.gap.signatures.signature import OVERHEAD
from airtouch.gap.signatures.term import Term
from airtouch.simulation.effects.effect import Gate

#: nats of each parameter over the logarithm of the number of blocks: one half (Schwarz 1978). A larger number asks more
#: of effects with several parameters
PARAMETER_COST = 0.5
KNOWN_OVERHEAD = "known overhead"  #: a wake in seconds in which another vehicle is known to be overhead


@dataclass(frozen=True)
class PassingEffect:
    """An effect as fitted within its gate.

    gain: nats after all costs; cost: nats, of the choice of the gate; key: entry of `Scatter.passing` with what nominal
    flights have of it: the effect's name, or KNOWN_OVERHEAD.
    """

    name: str
    fitted: FittedTerms
    gain: float
    cost: float
    key: str

    @property
    def strength(self) -> np.ndarray:
        """Scaled parameters (k,) of all its terms."""
        return np.concatenate([t.scaled(t.values) for t in self.fitted.terms])


@dataclass(frozen=True)
class NoEffect:
    """Flights without any effect, against which a passing one is held.

    whole: all their blocks; block_log_likelihoods (b,): of every block in the air; log_likelihood: of the flights, with
    the commands' floor as certain as without (False) and as uncertain as with (True) random effects.
    """

    data: Data
    whole: BlockSet
    block_log_likelihoods: np.ndarray
    log_likelihood: Mapping[bool, float]


def no_effect(data: Data) -> NoEffect | None:
    """Flights without any effect; None where they are too short to say when an effect acts."""
    whole = whole_of(data)
    of_blocks = block_log_likelihoods(data, whole, ())
    if len(of_blocks) < LEAST_BLOCKS:
        return None
    of_flights = {uncertain: judge(data, whole, (), uncertain) for uncertain in (False, True)}
    return NoEffect(data, whole, of_blocks, of_flights)


def passing_effects(data: Data, without: Sequence[str] = ()) -> dict[str, PassingEffect]:
    """Passing effects, each within the gate in which it explains most; not those that never act.

    without: names that are left out. Where another vehicle is known to be overhead, what it does there is one more,
    KNOWN_OVERHEAD.
    """
    base = no_effect(data)
    if base is None:
        return {}
    short_gates = [*(burst_gate(data, signal) for signal in (FORCE_BURSTS, YAW_BURSTS)), push_gate(data)]
    out: dict[str, PassingEffect] = {}
    for name, variants in candidates.passing_variants(without).items():
        if name == OVERHEAD and data.study.overhead:
            out[KNOWN_OVERHEAD] = replace(_best_variant(base, name, variants, data.study.overhead), key=KNOWN_OVERHEAD)
        effects = [_fitted_in_gate(base, name, trial) for v in variants for trial in _trials(base, v, short_gates)]
        if effects:
            out[name] = max(effects, key=lambda effect: effect.gain)
    return out


def _trials(base: NoEffect, terms: Sequence[Term], short_gates: Sequence[tuple[Gate, float]]) -> list[GateTrial]:
    """An effect in the blocks that it explains best, in bursts and in pushes, as far as there are any."""
    trials = [block_gate(base.data, base.whole, base.block_log_likelihoods, terms),
              *(GateTrial(terms, gate, cost) for gate, cost in short_gates)]
    return [trial for trial in trials if trial.gate]


def effect_within(data: Data, name: str, gate: Gate) -> PassingEffect | None:
    """An effect that acts within a gate that nobody chose; None in a flight that is too short to say."""
    base = no_effect(data)
    return _best_variant(base, name, candidates.passing_variants()[name], gate) if base is not None else None


def _best_variant(base: NoEffect, name: str, variants: Sequence[Sequence[Term]], gate: Gate) -> PassingEffect:
    """The variant of an effect that gains most within a gate that costs nothing, as nobody chose it."""
    trials = [GateTrial(variant, gate, 0.0) for variant in variants]
    return max((_fitted_in_gate(base, name, trial) for trial in trials), key=lambda effect: effect.gain)


def _fitted_in_gate(base: NoEffect, name: str, trial: GateTrial) -> PassingEffect:
    """An effect fitted within the gate in which it is tried."""
    acting = [replace(t, gate=trial.gate) for t in trial.terms]
    fitted = fit(base.data, base.whole, acting)
    free = sum(len(t.free) for t in acting)
    null_log_likelihood = base.log_likelihood[bool(random_of(acting))]
    cost_of_parameters = PARAMETER_COST * free * np.log(len(base.block_log_likelihoods))
    gain = judge(base.data, base.whole, fitted.terms) - null_log_likelihood - trial.cost - cost_of_parameters
    return PassingEffect(name, fitted, gain, trial.cost, name)
