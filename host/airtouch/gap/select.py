"""Which effect: every candidate fitted on some blocks and judged on others, one against another.

Two halves of the flights (of the blocks, for a few flights) take turns at fitting and
judging. `none` is the hypothesis of no effect. `unknown` is a model without names
(gap.generic): it needs more parameters, so a named effect that is right beats it; where it gains
much on top of the named effects, something is left that they do not explain.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from airtouch.gap.candidates import CLOCK, COMPANIONS, MEAN, SPECTRUM, Term, twins_of
from airtouch.gap.clock import clock_gain, clock_left
from airtouch.gap.data import Data
from airtouch.gap.fit import Fit, fit, judge, left_over
from airtouch.gap.generic import generic_gain
from airtouch.gap.problem import Part
from airtouch.gap.screen import Screen, first_order
from airtouch.gap.spectra import AIR, REST
from airtouch.gap.twin import COMMAND_ONLY

GROUP = 3  #: neighbouring blocks that stay on one side of the split: 5 s
LEAST_GAIN = 12.0  #: held-out log likelihood that an effect must add
FIRST_GAIN = 8.0  #: the same for the first effect, against a floor from nominal flights
LOOP_GAIN = 20.0  #: of one that changes a loop faster than the log, as nominal flights seem to by a tenth now and then
PRICE = 0.9  #: of each further parameter of an effect
LEAST_SHARE = 0.01  #: and as a share of what the effects before it have added
LOOP_SHARE = 0.25  #: the same of what changes the loop, beside another that does or shakes it: its model is no better
#: gain of a nameless model over the effects named, for `unknown`, where many nominal flights gave the floor, and else
UNKNOWN_GAIN, UNKNOWN_ALONE = 12.0, 25.0
#: and as a share of what the effects named gain, as no model is exact; larger where one of them is random or
UNKNOWN_SHARE, UNKNOWN_ASSUMED = 0.1, 0.2  #: changes the loop, since its spectrum is assumed, not measured
MOST_EFFECTS = 3
HOPELESS = 0.5  #: gain of a random effect below which its other variants are not tried
FULL = 5  #: candidates that are fitted in full, after a first look at all
TEMPERATURE = 6.0  #: of probabilities: log likelihoods of real flights are too sure of themselves
BELOW = 0.9  #: of the probability of the first effect named, that of `unknown` where the verdict is not that
Hypothesis = tuple[Term, ...]


@dataclass(frozen=True)
class Judged:
    """A hypothesis with its gain in held-out log likelihood over no effect, and its fits of both halves."""

    name: str
    terms: Hypothesis
    gain: float
    fits: tuple[Fit, ...] = ()
    full: bool = True  #: fitted in full, not to first order only
    choice: float = 0.0  #: of the gain, what the choice of the effects' variants has cost


@dataclass(frozen=True)
class Selection:
    """singles: the best variant of every candidate; steps: effects added one after another;

    free_before, free_after: gain of the nameless model over no effect and over the last step;
    parts: the two halves that they were fitted and judged on; nominal: how many flights gave the floor;
    assumed: whether a chosen effect is random or changes the loop.
    """

    singles: Mapping[str, Judged]
    steps: tuple[Judged, ...]
    free_before: float
    free_after: float
    parts: tuple[Part, Part]
    least: Mapping[str, float]  #: gain that each candidate needs as the first
    nominal: int
    assumed: bool

    @property
    def chosen(self) -> Judged | None:
        """The effects named, as one hypothesis; None where none is."""
        return self.steps[-1] if self.steps else None

    @property
    def allowed(self) -> float:
        """Log likelihood that a nameless model may gain on top of the effects named where they are right.

        The fewer nominal flights there are, the farther off may another one lie.
        """
        if self.nominal < 2:
            return max(UNKNOWN_ALONE, UNKNOWN_ASSUMED * self.free_before)
        share = UNKNOWN_ASSUMED if self.assumed else UNKNOWN_SHARE
        gained = self.chosen.gain if self.chosen else 0.0
        return max(UNKNOWN_GAIN * (self.nominal + 1) / (self.nominal - 1), share * gained)

    @property
    def explained(self) -> bool:
        """Whether what is left is the floor, or close to it."""
        return self.free_after < self.allowed


def halves(data: Data) -> tuple[Part, Part]:
    """Two halves: by flight where there are four or more, else alternating groups of blocks."""
    first, second = [], []
    for i, f in enumerate(data.first):
        for regime in (AIR, REST):
            n = len(f[regime])
            if not n:
                continue
            if len(data.flights) >= 4:
                (first if i % 2 == 0 else second).append((i, regime, np.ones(n, bool)))
            else:
                even = (np.arange(n) // max(min(GROUP, n // 2), 1)) % 2 == 0
                first.append((i, regime, even))
                second.append((i, regime, ~even))
    return Part(tuple(first)), Part(tuple(second))


def select(data: Data, candidates: Mapping[str, Sequence[Hypothesis]],
           progress: Callable[[str], None] = lambda _: None) -> Selection:
    """Judge every candidate, then add effects one by one while held-out data ask for them."""
    parts = halves(data)
    base = [[judge(data, p, (), wide) for p in parts] for wide in (False, True)]  # none, as sure of the commands' floor
    screen = Screen(data)
    singles = _round(data, parts, base, screen, candidates, None, progress)
    steps: list[Judged] = []
    least = {name: needed(data, j.terms) for name, j in singles.items()}
    best = _best_of({name: j for name, j in singles.items() if j.gain >= least[name]})
    while best is not None and len(steps) < MOST_EFFECTS:
        steps.append(best)
        best = None
        if len(steps) < MOST_EFFECTS:
            more = _round(data, parts, base, screen, candidates, steps[-1], progress)
            enough = {n: j for n, j in more.items() if j.gain - steps[-1].gain >= _needed_beside(data, steps[-1], j)}
            best = _best_of(enough)
    before = _nameless(data, parts, None)
    after = _nameless(data, parts, steps[-1]) if steps else before
    last = steps[-1].terms if steps else ()
    return Selection(singles, tuple(steps), before, after, parts, least, data.study.nominal, _assumes(data, last))


def _assumes(data: Data, terms: Sequence[Term]) -> bool:
    """Whether the spectrum of effects is assumed: they are random or change the loop."""
    return any(t.kind == SPECTRUM for t in terms) or _changes_loop(data, terms)


def _changes_loop(data: Data, terms: Sequence[Term]) -> bool:
    law = data.study.controller
    return law is not None and any(law.changes_loop((t.active(),)) for t in terms if t.kind == MEAN)


def _nameless(data: Data, parts: tuple[Part, Part], chosen: Judged | None) -> float:
    """Held-out log likelihood that a model without names adds to a hypothesis, the logged times' included."""
    fits = [f.terms for f in chosen.fits] if chosen and chosen.fits else [(), ()]
    named = [t.name for t in chosen.terms] if chosen else ()
    return max(sum(generic_gain(data, parts, fits)), 0.0) + clock_left(data, named)


def needed(data: Data, terms: Sequence[Term]) -> float:
    """Held-out log likelihood that a first effect must gain: less where nominal flights gave the floor."""
    if data.study.controller is None:
        return LEAST_GAIN
    return LOOP_GAIN if data.study.controller.by_firmware and _changes_loop(data, terms) else FIRST_GAIN


def _needed_beside(data: Data, held: Judged, more: Judged) -> float:
    """Held-out log likelihood that a further effect must gain: more beside one that gains much, no model being exact."""
    names = {t.name for t in held.terms}
    new = [t for t in more.terms if t.name not in names]
    of_clock = sum(clock_gain(data, t)[1] for t in held.terms if t.kind == CLOCK)
    share = LOOP_SHARE if _assumes(data, held.terms) and _changes_loop(data, new) else LEAST_SHARE
    return max(LEAST_GAIN, needed(data, new), share * (held.gain - of_clock))


def _best_of(judged: Mapping[str, Judged]) -> Judged | None:
    """The best of those that were fitted, and not only looked at; None where there is none."""
    return max((j for j in judged.values() if j.full), key=lambda j: j.gain, default=None)


def _round(data: Data, parts: Sequence[Part], base: Sequence[Sequence[float]], screen: Screen,
           candidates: Mapping[str, Sequence[Hypothesis]], chosen: Judged | None,
           progress: Callable[[str], None]) -> dict[str, Judged]:
    """Every candidate on top of what is chosen: a first look at all, the most promising in full."""
    before = chosen.gain if chosen else 0.0
    held = chosen.terms if chosen else ()
    have = {(t.name, t.values.get("rotor")) for t in held if not t.companion}
    twins = {n for t in held if not t.companion and (group := twins_of(t.name)) for n in group[0] if n != t.name}
    left, added = [], []
    for k, part in enumerate(parts):
        problem, values, power = left_over(data, part, chosen.fits[1 - k].terms if chosen and chosen.fits else ())
        left.append(values)
        added.append(power - problem.power)
    looked, sure = [], []
    for name, variants in candidates.items():
        progress(name)
        hopeless = False
        for terms in _middle_first(variants):
            if hopeless or name in twins or any((t.name, t.values.get("rotor")) in have for t in terms):
                continue
            choice = np.log(sum(len(v) == len(terms) for v in variants))  # among so many; else many would beat one
            if all(t.kind == MEAN and t.name not in COMMAND_ONLY for t in terms):
                gain, _ = first_order(screen, parts, left, added, terms, held)
                gain += before - _price(terms) - choice
                looked.append(Judged(name, (*held, *terms), gain, full=False, choice=choice))
            else:
                sure.append(_crossed(data, parts, base, name, held, terms, chosen, choice))
                hopeless = len(terms) == 1 and terms[0].kind == SPECTRUM and sure[-1].gain - before < HOPELESS
    looked = _best_variants(looked)
    worth = [j for i, j in enumerate(looked) if i < FULL and (j.gain - before > 0.5 * FIRST_GAIN)]
    fitted = [_crossed(data, parts, base, j.name, held, j.terms[len(held):], chosen, j.choice) for j in worth]
    best: dict[str, Judged] = {}
    for j in (*sure, *fitted, *(j for j in looked if j not in worth)):
        old = best.get(j.name)
        need = LEAST_GAIN if old is not None and len(j.terms) > len(old.terms) else 0.0
        if old is None or (j.full, j.gain) > (old.full, old.gain + need):
            best[j.name] = j
    for name, other in COMPANIONS.items():
        both, alone = best.get(name), best.get(other)
        if both and alone and len(both.terms) > len(held) + 1 and both.gain < alone.gain + LEAST_GAIN:
            best[name] = replace(both, gain=min(both.gain, alone.gain - LEAST_GAIN))  # it is the companion that gains
    return best


def _price(terms: Sequence[Term]) -> float:
    """Held-out log likelihood that parameters beyond an effect's first must earn."""
    return PRICE * sum(len(t.free) - 1 for t in terms if t.kind != CLOCK)


def _middle_first(variants: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Variants with the middle one of a random effect's three first: where that is hopeless all are."""
    if len(variants) > 2 and variants[1][0].kind == SPECTRUM:
        return [variants[1], variants[0], *variants[2:]]
    return list(variants)


def _best_variants(looked: Sequence[Judged]) -> list[Judged]:
    """The best of each candidate's variants of one length, best first."""
    kept: dict[tuple[str, int], Judged] = {}
    for j in sorted(looked, key=lambda j: -j.gain):
        kept.setdefault((j.name, len(j.terms)), j)
    return list(kept.values())


def _crossed(data: Data, parts: Sequence[Part], base: Sequence[Sequence[float]], name: str, held: Hypothesis,
             terms: Hypothesis, chosen: Judged | None, choice: float) -> Judged:
    """Fit on each half, judge on the other; choice: what the choice of this variant costs."""
    every = (*held, *terms)
    timed = [t for t in terms if t.kind == CLOCK]
    paid = choice + (chosen.choice if chosen else 0.0)
    gain, fits = 0.0, []
    if chosen and not [t for t in terms if t.kind != CLOCK]:
        gain, fits = chosen.gain, list(chosen.fits)
    else:
        others = [t for t in every if t.kind != CLOCK]
        gain += sum(clock_gain(data, t)[1] for t in held if t.kind == CLOCK)
        against = base[any(t.kind == SPECTRUM for t in others)]
        for train, test in ((0, 1), (1, 0)):
            found = _refined(data, parts[train], fit(data, parts[train], others, _start(chosen, others, train)))
            gain += judge(data, parts[test], found.terms) - against[test] if others else 0.0
            fits.append(found)
        gain -= _price(found.terms if others else ()) + paid
    fitted = list(fits[0].terms) if fits else []
    for t in (t for t in every if t.kind == CLOCK):
        made, more = clock_gain(data, t)
        fitted.append(made)
        gain += more if t in timed else 0.0
    return Judged(name, tuple(fitted), gain, tuple(fits), choice=paid)


def _refined(data: Data, part: Part, found: Fit) -> Fit:
    """A fit with the parameters free too that only a fit close to the truth can find."""
    terms = [t.refined() for t in found.terms]
    if all(a.free == b.free for a, b in zip(terms, found.terms, strict=True)):
        return found
    return fit(data, part, terms, np.concatenate([t.scaled(t.values) for t in terms if t.kind == MEAN]))


def _start(chosen: Judged | None, terms: Sequence[Term], train: int) -> np.ndarray | None:
    """The parameters found before, and a little of every new effect; None to begin anew."""
    if chosen is None or not chosen.fits or any(t.name in COMMAND_ONLY for t in terms):
        return None
    known = chosen.fits[train].scaled
    size = sum(len(t.free) for t in terms if t.kind == MEAN)
    return np.concatenate([known, np.full(size - len(known), 0.05)])


def _against_none(gain: float, least: float, many: int = 1) -> float:
    """Score of one of many candidates beside 0 for `none`: what is missing counts in full, what is over little."""
    if gain < least:
        return TEMPERATURE * (gain - least - np.log(many))
    return gain - least


def probabilities(selection: Selection) -> dict[str, float]:
    """Of every single candidate, `none` and `unknown`; they sum to 1.

    `unknown` has one half where as much is left as is allowed, and odds that grow with its square.
    """
    names = list(selection.singles)
    singles = selection.singles
    score = np.array([_against_none(singles[n].gain, selection.least[n], len(names)) for n in names] + [0.0])
    weight = np.exp((score - score.max()) / TEMPERATURE)
    odds = (np.logaddexp(selection.free_after, 0.0) / selection.allowed) ** 2
    unknown = odds / (1.0 + odds)
    if selection.chosen is not None and selection.explained:  # not above the effect that is the answer
        share = weight[names.index(selection.steps[0].name)] / weight.sum()
        unknown = min(unknown, BELOW * share / (1.0 + BELOW * share))
    known = (1.0 - unknown) * weight / weight.sum()
    return dict(zip([*names, "none", "unknown"], [*known, unknown], strict=True))
