"""What the evidence says: how probable each name is, which is the answer, which compete, what parameters they have."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from airtouch.gap.balance.hover_balance import Evidence
from airtouch.gap.balance.hover_hypotheses import Hypothesis
from airtouch.gap.result import NamedEffect, Quantity, RotorSet
from airtouch.gap.signatures.alike import names_alike
from airtouch.simulation.effects import Parameter, get

LOW, HIGH = 0.05, 0.95  #: quantiles between which the 90 % intervals lie
LEAST_SHIFT = 0.9  #: posterior probability of an off-centre weight's side, for com_offset to be named; chosen
COMPETES = 0.5  #: of the answer's probability, from which on another name counts as one that fits alike; chosen
WEAK_MOTOR = "weak_motor"  #: the name of hypotheses that differ in their rotors
#: the two names of a weight: on the vehicle; so far off centre that its own mass does not show
WEIGHT, OFF_CENTRE = "mass", "com_offset"
OTHER_WEIGHT = {WEIGHT: OFF_CENTRE, OFF_CENTRE: WEIGHT}  #: the other name of each


@dataclass(frozen=True)
class Likeliest:
    """The likeliest hypothesis of one name, and the posterior weight (samples,) of its samples, of sum 1."""

    hypothesis: Hypothesis
    weight: np.ndarray

    @property
    def change(self) -> np.ndarray:
        """Posterior mean (4,) of the change of the balance."""
        return self.weight @ self.hypothesis.change


def likeliest_of(name: str, candidates: Sequence[Hypothesis], evidence: Evidence) -> Likeliest:
    """The likeliest hypothesis of a name, by the evidence of the candidates."""
    best = max((i for i, h in enumerate(candidates) if h.name == name), key=evidence.log.__getitem__)
    return Likeliest(candidates[best], evidence.weights[best])


def probabilities(evidence: Evidence, candidates: Sequence[Hypothesis]) -> dict[str, float]:
    """Posterior probability of each name, all its hypotheses together, by the evidence of the candidates."""
    chance = np.exp(evidence.log - evidence.log.max())
    chance /= chance.sum()
    return {name: float(sum(c for c, h in zip(chance, candidates, strict=True) if h.name == name))
            for name in dict.fromkeys(h.name for h in candidates)}


def rotor_sets_of(evidence: Evidence, candidates: Sequence[Hypothesis], probability: float) -> tuple[RotorSet, ...]:
    """The probability of each set of weak rotors, likeliest first; they add up to `probability`, that of weak_motor."""
    log_of = {tuple(int(drawn["rotor"][0]) for _, drawn in h.effects): log
              for h, log in zip(candidates, evidence.log, strict=True) if h.name == WEAK_MOTOR}
    chance = {rotors: np.exp(log - max(log_of.values())) for rotors, log in log_of.items()}
    return tuple(RotorSet(rotors, float(probability * c / sum(chance.values())))
                 for rotors, c in sorted(chance.items(), key=lambda item: -item[1]))


def answer_of(probability_of: Mapping[str, float]) -> tuple[str, float]:
    """The likeliest name, and the probability that other names are held against.

    A weight on the vehicle and one off centre count as one; of the two the likelier is the answer. The probability is
    that of both for the one on the vehicle, its own for the one off centre, with which the other may compete.
    """
    family = dict(probability_of)
    if WEIGHT in family:
        family[WEIGHT] += family.get(OFF_CENTRE, 0.0)
    first = max(family, key=family.__getitem__)
    if first == WEIGHT and probability_of.get(OFF_CENTRE, 0.0) > probability_of[WEIGHT]:
        first = OFF_CENTRE
    return first, family[first]


def alike(effects: Iterable[str], probability_of: Mapping[str, float], first: str, probability: float,
          ) -> tuple[tuple[str, ...], ...]:
    """Sets of names that the flights cannot tell apart: names of one thing, and those that COMPETE with the answer.

    effects: names of the answer's; first, probability: `answer_of`. With `unknown` nothing competes: it is no effect
    that further flights would tell from the others.
    """
    sets = [tuple(sorted(group[0])) for name in effects if (group := names_alike(name))]
    others = [n for n in probability_of if n not in (first, "unknown") and probability_of[n] > COMPETES * probability]
    if others and first != "unknown":
        sets.append(tuple(sorted({first, *others})))
    return tuple(dict.fromkeys(sets))


def effects_of(likeliest: Likeliest) -> list[NamedEffect]:
    """The effects, posterior means with 90 % intervals; a weight's com_offset only where its side is sure."""
    out = []
    for name, drawn in likeliest.hypothesis.effects:
        alone = len(likeliest.hypothesis.effects) == 1
        if name == OFF_CENTRE and not alone and not any(side_is_sure(v, likeliest.weight) for v in drawn.values()):
            continue
        out.append(NamedEffect(name, {p.name: _quantity(drawn[p.name], likeliest.weight, p)
                                      for p in get(name).parameters if p.name in drawn}))
    return out


def side_is_sure(samples: np.ndarray, weight: np.ndarray) -> bool:
    """Whether samples (n,) with weights (n,) lie to one side of zero with a probability above LEAST_SHIFT."""
    return bool(max(weight @ (samples > 0), weight @ (samples < 0)) > LEAST_SHIFT)


def quantile(values: np.ndarray, weight: np.ndarray, q: float) -> float:
    """The q-quantile of samples (n,) with weights (n,) that add up to 1."""
    order = np.argsort(values)
    return float(np.interp(q, np.cumsum(weight[order]), values[order]))


def _quantity(samples: np.ndarray, weight: np.ndarray, parameter: Parameter) -> Quantity:
    """Mean and 90 % interval of a parameter; an integer, as a rotor's number, is the same in all samples."""
    if parameter.integer:
        return Quantity(float(samples[0]), unit=parameter.unit)
    return Quantity(float(weight @ samples), quantile(samples, weight, LOW), quantile(samples, weight, HIGH),
                    parameter.unit)
