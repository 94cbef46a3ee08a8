"""Notes of a diagnosis: what the flights leave open of the effects named, and the candidates that they do not show."""

from collections.abc import Sequence

from airtouch.gap.answer.reasons import only_in_relations
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.sensing import changed_echo_nats
from airtouch.gap.loop.noise_echo import FAST_HZ
from airtouch.gap.naming.judging import NEAR_BOUND, at_bound
from airtouch.gap.naming.records import Selection
from airtouch.gap.result import NamedEffect
from airtouch.gap.signatures.candidates import term_of
from airtouch.gap.signatures.signature import RELATIONS_ONLY
from airtouch.gap.signatures.term import parameter_of
from airtouch.simulation.effects import get


def at_end_of_range(effects: Sequence[NamedEffect]) -> list[str]:
    """A note on each fitted parameter that lies at the end of its range, where the model stretches."""
    notes = []
    for effect in effects:
        term = term_of(effect)
        ends = at_bound(term, term.among_all(term.scaled(term.values)))
        notes += [f"{effect.name}: {name} is at the end of its range ({effect.parameters[name].value:.4g}): the true"
                  " one lies beyond it, or something else is behind the gap"
                  for name, end in zip(term.signature.free, ends, strict=True) if end]
    return notes


def mostly_random(effects: Sequence[NamedEffect]) -> list[str]:
    """A note on each effect whose strength `with_random_part` raised, as its mean is too small for its random part."""
    notes = []
    for effect in effects:
        turbulence = effect.parameters.get("turbulence")
        if turbulence is None:
            continue
        most = parameter_of(get(effect.name), "turbulence").high
        if turbulence.value >= NEAR_BOUND * most:
            notes.append(f"{effect.name}: it shakes at least {most:g} times as much as it pushes, the most that a"
                         " simulator can be given; its strength is the least that shakes as much as the flights do")
    return notes


def cannot_be_replayed(selection: Selection) -> list[str]:
    """What these logs cannot tell where the replay names the effects: the candidates that it does not show."""
    names = [n for n in RELATIONS_ONLY if n in selection.single_effects]
    if selection.inference is not None or not names:
        return []
    return [f"{' and '.join(names)} cannot be seen: {only_in_relations(selection, 'them')}"]


def signs_not_shown(selection: Selection) -> list[str]:
    """A note on each effect named by the relations of signals whose parameter may have the other sign as well."""
    if selection.inference is None:
        return []
    names = {s.name for s in selection.named_steps}
    return [f"{name}: the flights do not show the sign of its strength; it may be the other one"
            for name in selection.inference.without_sign if name in names]


def noise_echoed_otherwise(data: Data) -> list[str]:
    """A note where the gyro's noise has another echo in the commands than in nominal flights (`loop.noise_echo`)."""
    nats = changed_echo_nats(data)
    return [f"the echo of the gyro's noise above {FAST_HZ:g} Hz in the commands is another one than in the baseline"
            f" flights ({nats:.0f} nats): the controllers see later, or the log is timed otherwise"] if nats else []
