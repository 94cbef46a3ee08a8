"""Which effect: candidates are judged one against another and added one by one while held-out data ask for them.

`none` is the hypothesis of no effect. `unknown` is a model without names (gap.unnamed.generic): it needs more
parameters, so a named effect that is right beats it; where it gains much on top of the named effects, something is left
that they do not explain.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from airtouch.gap.evidence.clock import clock_gain, clock_left
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.fit import CELL_GAIN, cell_gains, fit
from airtouch.gap.evidence.gates import TOLD, gated
from airtouch.gap.evidence.problem import GROUPS, cell_words
from airtouch.gap.flights.flight import PERIOD_S
from airtouch.gap.naming.judging import (
    FIRST_GAIN,
    LEAST_GAIN,
    ROUND_TRIP,
    Trial,
    gain_of,
    price_of,
    trial_of,
)
from airtouch.gap.naming.related import inference_of, related
from airtouch.gap.naming.rounds import round_of
from airtouch.gap.naming.selection import TEMPERATURE, UNKNOWN_ASSUMED, UNKNOWN_GAIN, Hypothesis, Judged, Selection
from airtouch.gap.relations.inference import Inference
from airtouch.gap.signals.channels import COUNT
from airtouch.gap.signatures.candidates import is_random, random_of
from airtouch.gap.signatures.nominal_scatter import size_of
from airtouch.gap.signatures.signature import CLOCK, COMPANIONS, MEAN, OVERHEAD, SHAKES
from airtouch.gap.signatures.term import Term
from airtouch.gap.unnamed.generic import generic_gain, height_gain

#: of what the effects before it have gained, that another must gain, in flights of a simulator with the same models
LEAST_SHARE, RECORDED_SHARE = 0.01, 0.1  #: and in others: no model of air is exact
#: the same of what changes the loop, beside another that does or shakes it: twice what wrong ones gained at most beside
#: right ones in 43 simulated flights; in others the loop model is no better than a quarter
ASSUMED_SHARE, LOOP_SHARE = 0.1, 0.25
#: the same of what is random, to be named: what a model is wrong by looks random. Beside weak motors and offset masses
#: motor noise gained 3 to 16 %: the yaw command of the logged instant is not that of the 10 ms around it
RANDOM_SHARE = 0.25
CERTAIN = 20.0  #: evidence beyond which more says no more
CHANCE_LOSS = 1.0  #: log likelihood that a right effect may lose in a cell by chance
#: of the evidence for the likeliest effect, that for a wake whose shape its class does not have: three simulated wakes
#: that fill a flight have 0.09 to 0.10, four motor noises that the replay took for one 0.01 to 0.02
WAKE_SHARE = 0.05
MOST_EFFECTS = 3
MOST_DEVIATIONS = 3  #: that nominal flights have as well, beside the effects named
WORTH_AGAIN = 0.25  #: of what the first effect must gain; candidates below it are not judged again beside a deviation


def select(data: Data, candidates: Mapping[str, Sequence[Hypothesis]],
           progress: Callable[[str], None] = lambda _: None, without: Sequence[str] = ()) -> Selection:
    """Judge every candidate, then add effects one by one while held-out data ask for them.

    Effects that come and go are tried first (gap.evidence.gates), but those of `without`. One that adds no more to the
    effects found after it than it does in nominal flights is taken back. Where a library of the signals' relations
    holds it decides alone (naming.related), but where it leaves something unexplained: then the replay may find a wake
    of some seconds, what else comes and goes if it is likeliest there as well, and what has more shapes than its class.
    """
    on = trial_of(data)
    alone = round_of(on, candidates, None, progress)
    need = dict.fromkeys(alone, FIRST_GAIN if data.study.controller is not None else LEAST_GAIN)
    inference = inference_of(data, list(candidates))
    by_relations = related(on, candidates, alone, inference, progress) if inference is not None else None
    if by_relations is not None and by_relations.explained:
        return by_relations
    passing = _passing(on, alone, need, without)
    if by_relations is not None and inference is not None and not _replay_may_name(passing, inference):
        return by_relations
    singles, least, steps = _steps(on, candidates, alone, need, passing, progress)
    first = next((s.name for s in steps if s.named), "")
    if by_relations is not None and inference is not None and first not in (*SHAKES, inference.likeliest):
        return by_relations
    if passing is not None and any(s.named and s.name == passing.name and news(
            on.data, passing.key, s.share, passing.strength) < LEAST_GAIN for s in steps):
        singles, least, steps = _steps(on, candidates, alone, need, None, progress)
    before = nameless(on, None)
    after = nameless(on, steps[-1]) if steps else before
    last = steps[-1].terms if steps else ()
    assumed = bool(random_of(last)) if data.study.simulated else _assumes(data, last)
    found = Selection(singles, tuple(steps), before, after, on.parts, least, data.study.nominal, assumed,
                      _nominal_gain(data), data.study.simulated, data.study.same_models,
                      clock_left(data, [t.name for t in last]))
    return replace(found, contradicted=contradicted(on, found.chosen)) if found.simulated else found


def _replay_may_name(passing: Judged | None, inference: Inference) -> bool:
    """Whether the replay may name what comes and goes, or shakes, where the relations leave something unexplained.

    A wake of some seconds it may; the relations of a whole flight dilute these. Else the relations must find the
    effect likeliest, or a wake that fills the flight a WAKE_SHARE as likely.
    """
    if passing is not None and passing.name in (OVERHEAD, inference.likeliest):
        return True
    most = inference.evidence.get(inference.likeliest, 0.0)
    return any(inference.evidence.get(name, -np.inf) > WAKE_SHARE * most for name in SHAKES)


def _steps(on: Trial, candidates: Mapping[str, Sequence[Hypothesis]], singles: Mapping[str, Judged],
           least: Mapping[str, float], passing: Judged | None, progress: Callable[[str], None],
           ) -> tuple[Mapping[str, Judged], Mapping[str, float], list[Judged]]:
    """Effects added one by one, after one that comes and goes where there is such.

    Candidates alone, the gain that each needs as the first, and the steps.
    """
    steps: list[Judged] = []
    tried, need = singles, least
    if passing is not None:
        steps, least = [passing], {**least, passing.name: LEAST_GAIN}
        singles = {**singles, passing.name: passing}
        tried, need = _beside(on, candidates, steps, singles, progress)
    while sum(s.named for s in steps) < MOST_EFFECTS:
        so_far = steps[-1].gain if steps else 0.0
        beside = any(s.named for s in steps)
        enough = {n: j for n, j in tried.items() if j.gain - so_far >= need[n]}
        if sum(not s.named for s in steps) == MOST_DEVIATIONS:
            enough = {n: j for n, j in enough.items() if j.evidence >= FIRST_GAIN}
        best = _best_of(enough)
        if best is None:
            break
        if not any(s.named for s in steps):  # what nominal flights have as well stands beside every candidate
            singles = {**singles, **{n: j for n, j in tried.items() if n not in {s.name for s in steps}}}
        left_by_another = beside and is_random(best.name) \
            and best.gain - so_far < _misfit(on, steps[-1], best, RANDOM_SHARE)
        steps.append(replace(best, named=best.evidence >= FIRST_GAIN and not left_by_another))
        if sum(s.named for s in steps) < MOST_EFFECTS:
            tried, need = _beside(on, candidates, steps,
                                  {n: replace(j, gain=j.gain - so_far) for n, j in tried.items()}, progress)
    return singles, least, _with_shares(on, steps)


def _with_shares(on: Trial, steps: list[Judged]) -> list[Judged]:
    """The steps, where several effects are named with what each adds to the others."""
    if sum(s.named for s in steps) < 2:
        return steps
    return [replace(s, share=steps[-1].gain - _gain_without(on, steps, s)) if s.named else s for s in steps]


def _gain_without(on: Trial, steps: Sequence[Judged], dropped: Judged) -> float:
    """Gain of the last step's hypothesis without one of its effects, the others fitted anew."""
    last, place = steps[-1], [s.name for s in steps].index(dropped.name)
    keep = _others(last.terms, dropped.name)
    gain = sum(clock_gain(on.data, t)[1] for t in keep if t.kind == CLOCK)
    others = [t for t in keep if t.kind != CLOCK]
    if not others:
        return gain
    for train, test in ROUND_TRIP:
        known = _others(last.fits[train].terms, dropped.name)
        start = [t.scaled(t.values) for t in known if t.kind == MEAN]
        found = fit(on.data, on.parts[train], known, np.concatenate(start) if start else None)
        gain += gain_of(on, test, found.terms)
    choice = dropped.choice - (steps[place - 1].choice if place else 0.0)
    return gain - price_of(found.terms) - (last.choice - choice)


def _others(terms: Sequence[Term], name: str) -> list[Term]:
    """The terms that are neither an effect's nor its companion's."""
    return [t for t in terms if not (t.name == name or t.companion and t.name == COMPANIONS.get(name))]


def _passing(on: Trial, singles: Mapping[str, Judged], least: Mapping[str, float], without: Sequence[str],
             ) -> Judged | None:
    """An effect that comes and goes, where it explains more than one that always acts and more than it does in

    nominal flights; None where none does. What follows the flight's own height needs no other vehicle.
    """
    if on.data.study.scatter is None:
        return None
    steady = max([height_gain(on.data, on.parts), *(j.gain for n, j in singles.items() if j.evidence >= least[n])])
    passing = [g for g in gated(on.data, without).values()
               if g.gain >= steady + LEAST_GAIN and news(on.data, g.key, g.gain, g.strength) >= LEAST_GAIN]
    if not passing:
        return None
    known = [g for g in passing if g.key == TOLD]  # its seconds are, not only likely
    best = max(known or passing, key=lambda g: g.gain)
    terms = best.fitted.terms
    gain = sum(gain_of(on, half, terms) for half in (0, 1)) - best.cost
    return Judged(best.name, terms, gain, (best.fitted, best.fitted), choice=best.cost, strength=best.strength,
                  evidence=news(on.data, best.key, best.gain, best.strength), key=best.key)


def news(data: Data, key: str, gain: float, strength: np.ndarray) -> float:
    """Evidence for an effect that comes and goes: its gain, but LEAST_GAIN where nominal flights may have as much.

    key: `Gated.key`. strength (k,): of its parameters, in natural steps.
    """
    assert data.study.scatter is not None  # nothing that comes and goes is looked for without nominal flights
    return min(gain, LEAST_GAIN + data.study.scatter.unusual(key, size_of(gain / seconds(data), strength)))


def _beside(on: Trial, candidates: Mapping[str, Sequence[Hypothesis]], steps: Sequence[Judged],
            first: Mapping[str, Judged], progress: Callable[[str], None],
            ) -> tuple[dict[str, Judged], dict[str, float]]:
    """Candidates judged beside the steps so far, and the gain that each needs.

    first: as judged before the newest step. Beside a deviation of nominal flights only those are judged again that
    gained something without it: a deviation takes gain from others, it seldom lends any.
    """
    named = any(s.named for s in steps)
    gained = {n for n, j in first.items() if j.gain > WORTH_AGAIN * FIRST_GAIN}
    worth = candidates if named else {n: v for n, v in candidates.items() if n in gained}
    sure = {n for n, j in first.items() if j.full and j.evidence >= LEAST_GAIN and not is_random(n)}
    tried = round_of(on, worth, steps[-1], progress, promising=sure)
    return tried, {n: _needed_beside(on, steps[-1], j) if named else FIRST_GAIN for n, j in tried.items()}


def seconds(data: Data) -> float:
    """How long the flights last together."""
    return sum(len(f) for f in data.flights) * PERIOD_S


def _nominal_gain(data: Data) -> float:
    """Log likelihood that a model without names gains in nominal flights as long as these."""
    scatter = data.study.scatter
    return scatter.allowed(seconds(data), UNKNOWN_GAIN) if scatter else 0.0


def _assumes(data: Data, terms: Sequence[Term]) -> bool:
    """Whether the spectrum of effects is assumed: they are random or change the loop."""
    return bool(random_of(terms)) or _changes_loop(data, terms)


def _changes_loop(data: Data, terms: Sequence[Term]) -> bool:
    law = data.study.controller
    return law is not None and any(law.changes_loop((t.active(),)) for t in terms if t.kind == MEAN)


def nameless(on: Trial, chosen: Judged | None) -> float:
    """Held-out log likelihood that a model without names adds to a hypothesis, the logged times' included."""
    fits = [f.terms for f in chosen.fits] if chosen and chosen.fits else [(), ()]
    named = [t.name for t in chosen.terms] if chosen else ()
    return max(sum(generic_gain(on.data, on.parts, fits)), 0.0) + clock_left(on.data, named)


def _needed_beside(on: Trial, held: Judged, more: Judged) -> float:
    """Held-out log likelihood that a further effect must gain: more beside one that gains much: no model is exact."""
    names = {t.name for t in held.terms}
    new = [t for t in more.terms if t.name not in names]
    share = RECORDED_SHARE if on.data.study.recorded else LEAST_SHARE
    if _assumes(on.data, held.terms) and _changes_loop(on.data, new):
        share = _assumed_share(on.data)
    return _misfit(on, held, more, share, everywhere=is_random(more.name))


def _assumed_share(data: Data) -> float:
    return ASSUMED_SHARE if data.study.same_models else LOOP_SHARE


def _misfit(on: Trial, held: Judged, more: Judged, share: float, everywhere: bool = False) -> float:
    """Log likelihood that a further effect may gain because the effects before it are wrong by a share of theirs.

    In flights of a simulator they are wrong where they act: what they gain counts in the cells where the newcomer
    gains, the axes of a channel together; everywhere: wherever they gain.
    """
    of_clock = sum(clock_gain(on.data, t)[1] for t in held.terms if t.kind == CLOCK)
    whole = max(LEAST_GAIN, share * (held.gain - of_clock))
    looked_at = not (more.full and more.fits and held.fits)
    if everywhere or on.data.study.recorded or looked_at or more.gain - held.gain >= whole:
        return whole
    before, both = (np.sum([cell_gains(on.data, on.parts[test], j.fits[train].terms) for train, test in ROUND_TRIP],
                           axis=0) for j in (held, more))
    before, own = _axes_together(before), _axes_together(both - before)
    return max(LEAST_GAIN, share * float(np.maximum(before[own > CELL_GAIN], 0.0).sum()))


def _axes_together(gains: np.ndarray) -> np.ndarray:
    """Gains (GROUPS,) of cells with those of x, y and z added up."""
    cell = np.arange(GROUPS)
    return np.bincount(cell - cell % 1000 % COUNT % 3, gains, GROUPS)


def _best_of(judged: Mapping[str, Judged]) -> Judged | None:
    """The best of those that were fitted, and not only looked at; None where there is none.

    Likelihoods of real flights are too sure of themselves (TEMPERATURE): of two that gain nearly as much, that whose
    strength is the rarer in nominal flights.
    """
    return max((j for j in judged.values() if j.full), default=None,
               key=lambda j: j.gain / TEMPERATURE + min(j.evidence, CERTAIN))


def contradicted(on: Trial, chosen: Judged | None) -> tuple[float, str]:
    """Held-out log likelihood that effects lose where they say what the flights do not show, and the worst cell."""
    if chosen is None or not chosen.fits:
        return 0.0, ""
    gains = np.sum([cell_gains(on.data, on.parts[test], chosen.fits[train].terms) for train, test in ROUND_TRIP],
                   axis=0)
    lost = losses(gains)
    return float(lost.sum()), cell_words(int(np.argmin(np.where(lost[_channel()] > 0.0, gains, np.inf))))


def losses(gains: np.ndarray) -> np.ndarray:
    """Log likelihood (GROUPS,) that each channel of each view loses beyond chance, from the gains (GROUPS,) of cells.

    Where a hypothesis is right, the likelihood ratio of none over it has the mean 1 in every cell, so that a loss
    beyond x nats has a chance of at most exp(-x) (Markov): one of CHANCE_LOSS is none. In a channel that it explains,
    its detail may be wrong by a share of that.
    """
    lost = np.bincount(_channel(), np.maximum(-gains - CHANCE_LOSS, 0.0), GROUPS)
    return np.maximum(lost - UNKNOWN_ASSUMED * np.bincount(_channel(), np.maximum(gains, 0.0), GROUPS), 0.0)


def _channel() -> np.ndarray:
    """A number (GROUPS,) of the channel and view that each cell belongs to."""
    cell = np.arange(GROUPS)
    return cell - cell % 1000 + cell % 1000 % COUNT
