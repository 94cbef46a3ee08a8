"""The candidates of a diagnosis: every effect of the registry in its variants, each as terms of a hypothesis."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from airtouch.gap.result import NamedEffect
from airtouch.gap.signatures.signature import (
    ALWAYS_RANDOM,
    COMPANIONS,
    MEAN,
    PASSING,
    SIGNATURES,
    SPECTRUM,
    signature_of,
)
from airtouch.gap.signatures.term import Term, Terms
from airtouch.simulation import signals as at
from airtouch.simulation.effects import EFFECTS, Active, Effect, get

PROBE_SAMPLES = 50  #: of PROBE; chosen
#: signals, by their columns, of a small drone that flies level 0.1 m high at 0.5 m/s; SI units; chosen
PROBE: tuple[tuple[int | slice, float], ...] = (
    (at.STEP, 0.01), (at.MASS, 0.03), (at.GRAVITY, 9.81), (at.HOVER_SPEED, 2000.0),
    (slice(at.ROTOR_SPEED, at.ROTOR_SPEED + 4), 2000.0), (slice(at.THRUST, at.THRUST + 4), 0.08),
    (at.ROTATION, 1.0), (at.ROTATION + 4, 1.0), (at.ROTATION + 8, 1.0), (at.VELOCITY, 0.5),
    (slice(at.LOWER_HEIGHT, at.UPPER_HEIGHT + 4), 0.1), (at.HEIGHT, 0.1))


def all_candidates(without: Iterable[str] = ()) -> dict[str, list[Terms]]:
    """The variants of every effect of the registry but those of `without`, by name and in its order.

    Moving air acts through the rotors' drag, and drag that acts on the air's velocity acts
    on the vehicle's own: a variant of `wind` and `gust` has drag of its own beside it.
    """
    without = set(without)
    out: dict[str, list[Terms]] = {name: [(t,) for t in terms(name)] for name in EFFECTS if name not in without}
    for name, signature in SIGNATURES.items():
        if name in out and signature.without_random is not None:
            random: list[Terms] = [(*v, part) for part in random_parts_of(name) for v in out[name]]
            out[name] = random if name in ALWAYS_RANDOM else out[name] + random
    for name, companion in COMPANIONS.items():
        if name in out and companion not in without:
            beside = [replace(t, companion=True) for t in terms(companion)]
            out[name] += [(*v, *beside) for v in out[name]]
    return out


def passing_variants(without: Iterable[str] = ()) -> dict[str, list[Terms]]:
    """The variants of passing effects, by name; `passing.gates` sets their gates."""
    without, out = set(without), {}
    for name in PASSING:
        if name in EFFECTS and name not in without:
            random: list[Terms] = [()] if SIGNATURES[name].without_random is None else \
                [(part,) for part in random_parts_of(name)]
            out[name] = [(_passing(t), *part) for part in random for t in terms(name)]
    return out


def _passing(term: Term) -> Term:
    """The term with the parameters free that a passing effect frees; its gate is that of the term."""
    return replace(term, free=term.signature.free_if_passing or term.free)


def terms(name: str) -> list[Term]:
    """The hypotheses of one effect, one for each variant, with all free parameters at neutral."""
    effect = get(name)
    signature, where = signature_of(effect), shows_in(effect)
    neutral = effect.scaled(effect.values(), 0.0) | dict(signature.without_random or {})
    together = [Term(effect, where, signature.free, neutral | dict(v)) for v in signature.variants]
    return together + ([Term(effect, where, (p,), neutral) for p in signature.free] if signature.alone_too else [])


def shows_in(effect: Effect) -> str:
    """How an effect shows: as its record says; without one, in the spectrum where its force is random."""
    if effect.name not in SIGNATURES and _random(effect):
        return SPECTRUM
    return signature_of(effect).shows_in


def random_part_of(name: str) -> Term:
    """The first variant of the random part of an effect."""
    return random_parts_of(name)[0]


def random_parts_of(name: str) -> list[Term]:
    """The variants of the random part of an effect, where and when its mean part acts."""
    effect, signature = get(name), SIGNATURES[name]
    return [Term(effect, SPECTRUM, ("turbulence",),
                 effect.values({"strength": 1.0, **(signature.without_random or {}), **variant}), True)
            for variant in signature.random_variants]


def strength_term(hypothesis: Sequence[Term]) -> Term:
    """The term whose strength is that of the effect: the random part of one that is ALWAYS_RANDOM, else the first."""
    return hypothesis[-1] if hypothesis[0].name in ALWAYS_RANDOM else hypothesis[0]


def mean_of(hypothesis: Sequence[Term]) -> list[Term]:
    """The terms that change the mean of the gap."""
    return [t for t in hypothesis if t.shows_in == MEAN]


def random_of(hypothesis: Sequence[Term]) -> list[Term]:
    """The terms that add power, whose phase is not known."""
    return [t for t in hypothesis if t.shows_in == SPECTRUM]


def is_random(name: str) -> bool:
    """Whether an effect's strength is that of a random force, which no strength below 0 has."""
    return name in ALWAYS_RANDOM or name in EFFECTS and shows_in(get(name)) == SPECTRUM


def term_of(effect: NamedEffect) -> Term:
    """The term of an effect that a diagnosis named, with its values: its own variant, or the nearest.

    Of an effect whose parameters are also tried alone (`Signature.alone_too`), the term in which all of them are free.
    """
    values = {k: q.value for k, q in effect.parameters.items()}

    def distance(term: Term) -> float:
        """How far the values that a fit of the term leaves alone are from the named ones."""
        return sum(abs(values.get(k, v) - v) for k, v in term.values.items() if k not in term.free)

    nearest = min(terms(effect.name), key=distance)
    nearest = _passing(nearest) if effect.seconds else nearest
    return replace(nearest, values={**nearest.values, **values}, gate=effect.seconds)


def terms_of(effect: NamedEffect) -> list[Term]:
    """The terms of an effect that a diagnosis named: that of its mean and, where it has one, that of its random part.

    The random part is one of strength 1, as it is fitted: the inverse of `named_effects.with_random_part`.
    """
    term = term_of(effect)
    without = term.signature.without_random
    if without is None or all(term.values[k] == v for k, v in without.items()):
        return [term]
    (strength,), part = term.signature.free, random_part_of(effect.name)
    at_strength_1 = {k: term.values[strength] * term.values[k] for k in part.free}
    of_variant = {k: term.values[k] for k in term.signature.random_variant_parameters}
    return [replace(term, values={**term.values, **without}),
            replace(part, values={**part.values, **of_variant, **at_strength_1}, gate=effect.seconds)]


def _random(effect: Effect) -> bool:
    """Whether two seeds give two forces on the same signals, those of PROBE."""
    if effect.wrench is None:
        return False
    from airtouch.simulation import replay
    signals = np.zeros((PROBE_SAMPLES, at.COUNT))
    for columns, value in PROBE:
        signals[:, columns] = value
    active = Active(effect, effect.values())
    first, second = (replay.wrench_of(active, signals, seed) for seed in (1, 2))
    return not np.allclose(first, second)
