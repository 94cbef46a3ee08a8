"""Which effect: every candidate fitted on some blocks and judged on others, one against another.

Two halves of the flights (of the blocks, for a few flights) take turns at fitting and
judging. `none` is the hypothesis of no effect. `unknown` is a model without names
(gap.generic): it needs more parameters, so a named effect that is right beats it; where it gains
much on top of the named effects, something is left that they do not explain.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from airtouch.gap.candidates import CLOCK, COMPANIONS, GATED, MEAN, SPECTRUM, Term, every, telling, twins_of
from airtouch.gap.clock import clock_gain, clock_left
from airtouch.gap.data import Data
from airtouch.gap.fit import Fit, fit, judge, left_over, strength_variance
from airtouch.gap.flight import PERIOD_S
from airtouch.gap.gates import gated
from airtouch.gap.generic import generic_gain
from airtouch.gap.nominal_scatter import Apparent
from airtouch.gap.problem import Part, whole_of
from airtouch.gap.screen import Screen, first_order, random_look
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
MOST_DEVIATIONS = 3  #: that nominal flights have as well, beside the effects named
NOBODY_KNOWS = 1e6  #: standard deviation of a scaled parameter of which the data say nothing
#: of what the first effect must gain, below which a candidate is not judged again beside a deviation
WORTH_AGAIN = 0.25
STRETCHED = 0.999  #: of a parameter's bound, from which it is at it
HOPELESS = 0.5  #: gain below which an effect is not looked at any closer in this view
FULL = 5  #: candidates that are fitted in full, after a first look at all
TEMPERATURE = 6.0  #: of probabilities: log likelihoods of real flights are too sure of themselves
BEHIND = 1.0  #: log likelihood that others lie behind the effect that is the answer, at least
BELOW = 0.9  #: of the probability of the first effect named, that of `unknown` where the verdict is not that
Hypothesis = tuple[Term, ...]


@dataclass(frozen=True)
class Judged:
    """A hypothesis with its gain in held-out log likelihood over no effect, and its fits of both halves.

    strength: scaled parameters (k,) of its newest effect, the mean of both halves; variance: (k,) of those of a mean
    effect, by chance. evidence: what that effect gains over the hypothesis before, and no more than its strength says
    beyond the scatter of nominal flights. named: whether that is enough; if not, it is a deviation that nominal flights
    have as well, and stands beside the effects that are named.
    """

    name: str
    terms: Hypothesis
    gain: float
    fits: tuple[Fit, ...] = ()
    full: bool = True  #: fitted in full, not to first order only
    choice: float = 0.0  #: of the gain, what the choice of the effects' variants has cost
    strength: np.ndarray = field(default_factory=lambda: np.zeros(0))
    variance: np.ndarray = field(default_factory=lambda: np.zeros(0))
    evidence: float = 0.0
    named: bool = True
    share: float = np.inf  #: where several effects are named: gain over the hypothesis of the others alone


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
    usual: float  #: log likelihood that a nameless model gains in nominal flights as long as these

    @property
    def whole(self) -> Judged | None:
        """The effects named and the deviations that nominal flights have as well, as one hypothesis."""
        return self.steps[-1] if self.steps else None

    @property
    def named(self) -> tuple[Judged, ...]:
        """The steps whose effects are named, what adds most to the others first.

        What the log has done to itself is last.
        """
        def of_the_log(s):
            return any(t.name == s.name and t.kind == CLOCK for t in s.terms)
        return tuple(sorted((s for s in self.steps if s.named), key=lambda s: (of_the_log(s), -s.share)))

    @property
    def chosen(self) -> Judged | None:
        """The effects named, as fitted beside the deviations, as one hypothesis; None where none is."""
        names = {s.name for s in self.named}
        if not names:
            return None
        names |= {COMPANIONS[n] for n in names if n in COMPANIONS}
        def own(terms):
            return tuple(t for t in terms if t.name in names)
        return replace(self.whole, terms=own(self.whole.terms),
                       fits=tuple(replace(f, terms=own(f.terms)) for f in self.whole.fits))

    @property
    def allowed(self) -> float:
        """Log likelihood that a nameless model may gain on top of the effects named where they are right.

        The fewer nominal flights there are, the farther off may another one lie.
        """
        if self.nominal < 2:
            return max(UNKNOWN_ALONE, UNKNOWN_ASSUMED * self.free_before, self.usual)
        share = UNKNOWN_ASSUMED if self.assumed else UNKNOWN_SHARE
        gained = self.whole.gain if self.whole else 0.0
        return max(UNKNOWN_GAIN * (self.nominal + 1) / (self.nominal - 1), share * gained, self.usual)

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
           progress: Callable[[str], None] = lambda _: None, without: Sequence[str] = ()) -> Selection:
    """Judge every candidate, then add effects one by one while held-out data ask for them.

    Effects that come and go are tried first (gap.gates), but those of `without`. One that adds no more to the effects
    found after it than it does in nominal flights is taken back.
    """
    parts = halves(data)
    base = [[judge(data, p, (), wide) for p in parts] for wide in (False, True)]  # none, as sure of the commands' floor
    screen = Screen(data)
    alone = _round(data, parts, base, screen, candidates, None, progress)
    need = {name: needed(data, j.terms) for name, j in alone.items()}
    passing = _passing(data, parts, base, alone, need, without)
    singles, least, steps = _steps(data, parts, base, screen, candidates, alone, need, passing, progress)
    steps = _with_shares(data, parts, base, steps)
    if passing is not None and any(s.named and s.name == passing.name and s.share < least[s.name] for s in steps):
        singles, least, steps = _steps(data, parts, base, screen, candidates, alone, need, None, progress)
        steps = _with_shares(data, parts, base, steps)
    before = _nameless(data, parts, None)
    after = _nameless(data, parts, steps[-1]) if steps else before
    last = steps[-1].terms if steps else ()
    return Selection(singles, tuple(steps), before, after, parts, least, data.study.nominal, _assumes(data, last),
                     _usual(data))


def _steps(data: Data, parts: tuple[Part, Part], base: Sequence[Sequence[float]], screen: Screen,
           candidates: Mapping[str, Sequence[Hypothesis]], singles: Mapping[str, Judged], least: Mapping[str, float],
           passing: Judged | None, progress: Callable[[str], None],
           ) -> tuple[Mapping[str, Judged], Mapping[str, float], list[Judged]]:
    """Candidates, what each needs, and steps: effects added one by one, after one that comes and goes, if any."""
    steps: list[Judged] = []
    tried, need = singles, least
    if passing is not None:
        needed = data.study.scatter.passing(passing.name, _seconds(data), LEAST_GAIN)
        steps, least = [passing], {**least, passing.name: needed}
        singles = {**singles, passing.name: passing}
        tried, need = _beside(data, parts, base, screen, candidates, steps, singles, progress)
    while sum(s.named for s in steps) < MOST_EFFECTS:
        so_far = steps[-1].gain if steps else 0.0
        enough = {n: j for n, j in tried.items() if j.gain - so_far >= need[n]}
        if sum(not s.named for s in steps) == MOST_DEVIATIONS:
            enough = {n: j for n, j in enough.items() if j.evidence >= need[n]}
        best = _best_of(enough)
        if best is None:
            break
        if not any(s.named for s in steps):  # what nominal flights have as well stands beside every candidate
            singles = {**singles, **{n: j for n, j in tried.items() if n not in {s.name for s in steps}}}
        steps.append(replace(best, named=best.evidence >= need[best.name]))
        if sum(s.named for s in steps) < MOST_EFFECTS:
            tried, need = _beside(data, parts, base, screen, candidates, steps,
                                  {n: replace(j, gain=j.gain - so_far) for n, j in tried.items()}, progress)
    return singles, least, steps


def _with_shares(data: Data, parts: tuple[Part, Part], base: Sequence[Sequence[float]], steps: list[Judged],
                 ) -> list[Judged]:
    """The steps, where several effects are named with what each adds to the others."""
    if sum(s.named for s in steps) < 2:
        return steps
    return [replace(s, share=steps[-1].gain - _gain_without(data, parts, base, steps, s)) if s.named else s
            for s in steps]


def _gain_without(data: Data, parts: tuple[Part, Part], base: Sequence[Sequence[float]], steps: Sequence[Judged],
                  dropped: Judged) -> float:
    """Gain of the last step's hypothesis without one of its effects, the others fitted anew."""
    last, place = steps[-1], [s.name for s in steps].index(dropped.name)
    def own(t):
        return t.name == dropped.name or t.companion and t.name == COMPANIONS.get(dropped.name)
    keep = [t for t in last.terms if not own(t)]
    gain = sum(clock_gain(data, t)[1] for t in keep if t.kind == CLOCK)
    others = [t for t in keep if t.kind != CLOCK]
    if not others:
        return gain
    against = base[any(t.kind == SPECTRUM for t in others)]
    for train, test in ((0, 1), (1, 0)):
        known = [t for t in last.fits[train].terms if not own(t)]
        start = [t.scaled(t.values) for t in known if t.kind == MEAN]
        found = fit(data, parts[train], known, np.concatenate(start) if start else None)
        gain += judge(data, parts[test], found.terms) - against[test]
    choice = dropped.choice - (steps[place - 1].choice if place else 0.0)
    return gain - _price(found.terms) - (last.choice - choice)


def _passing(data: Data, parts: tuple[Part, Part], base: Sequence[Sequence[float]], singles: Mapping[str, Judged],
             least: Mapping[str, float], without: Sequence[str]) -> Judged | None:
    """An effect that comes and goes, where it explains more than one that always acts and more than it does in

    nominal flights; None where none does.
    """
    if data.study.scatter is None:
        return None
    steady = max((j.gain for n, j in singles.items() if j.evidence >= least[n]), default=0.0)
    nominal = {n: data.study.scatter.passing(n, _seconds(data), LEAST_GAIN) for n in GATED}
    passing = [g for g in gated(data, without).values() if g.gain >= max(nominal[g.name], steady + LEAST_GAIN)]
    if not passing:
        return None
    best = max(passing, key=lambda g: g.gain)
    shaken = any(t.kind == SPECTRUM for t in best.fitted.terms)
    gain = sum(judge(data, p, best.fitted.terms) - before for p, before in zip(parts, base[shaken], strict=True))
    return Judged(best.name, best.fitted.terms, gain - best.cost, (best.fitted, best.fitted), choice=best.cost,
                  strength=_strength(best.fitted.terms[0], best.fitted.terms, (best.fitted,))[0], evidence=best.gain)


def _beside(data: Data, parts: tuple[Part, Part], base: Sequence[Sequence[float]], screen: Screen,
            candidates: Mapping[str, Sequence[Hypothesis]], steps: Sequence[Judged], first: Mapping[str, Judged],
            progress: Callable[[str], None]) -> tuple[dict[str, Judged], dict[str, float]]:
    """Candidates judged beside the steps so far, and the gain that each needs.

    first: as judged before the newest step. Beside a deviation of nominal flights only those are judged again that
    gained something without it: a deviation takes gain from others, it seldom lends any.
    """
    named = any(s.named for s in steps)
    gained = {n for n, j in first.items() if j.gain > WORTH_AGAIN * FIRST_GAIN}
    worth = candidates if named else {n: v for n, v in candidates.items() if n in gained}
    tried = _round(data, parts, base, screen, worth, steps[-1], progress)
    need = {n: _needed_beside(data, steps[-1], j) if named else needed(data, j.terms[len(steps[-1].terms):])
            for n, j in tried.items()}
    return tried, need


def _seconds(data: Data) -> float:
    return sum(len(f) for f in data.flights) * PERIOD_S


def _usual(data: Data) -> float:
    """Log likelihood that a model without names gains in nominal flights as long as these."""
    scatter = data.study.scatter
    return scatter.allowed(_seconds(data), UNKNOWN_GAIN) if scatter else 0.0


def apparent(data: Data) -> Apparent:
    """How strong every effect seems to be in flights that have none."""
    parts = halves(data)
    base = [[judge(data, p, (), wide) for p in parts] for wide in (False, True)]
    singles = _round(data, parts, base, Screen(data), every(), None, lambda _: None, thorough=True)
    passing = gated(data)
    known = {n: j for n, j in singles.items() if len(j.strength)}
    return Apparent({n: j.strength for n, j in known.items()}, {n: _error(data, j) for n, j in known.items()},
                    _nameless(data, parts, None) / _seconds(data),
                    {n: max(passing[n].gain, 0.0) / _seconds(data) if n in passing else 0.0 for n in GATED})


def _error(data: Data, judged: Judged) -> np.ndarray:
    """Standard deviation (k,) by chance of a candidate's strength."""
    term = telling(judged.terms)
    if term.kind == CLOCK:
        return np.zeros(len(judged.strength))
    if term.kind != SPECTRUM:
        return np.where(_at_bound(term, judged.strength), NOBODY_KNOWS,
                        np.minimum(np.sqrt(judged.variance), NOBODY_KNOWS))
    fitted = judged.fits[0].terms
    same = next(t for t in fitted if t.name == term.name and t.kind == SPECTRUM)
    variance = np.diag(strength_variance(data, whole_of(data), fitted, same))[:len(term.free)]
    return np.sqrt(np.where(judged.strength > 0.0, variance, 0.0))


def _at_bound(term: Term, strength: np.ndarray) -> np.ndarray:
    """Which scaled parameters (k,) lie as far from neutral as they may: the model stretches to fit something else."""
    low, high = (term.among_all(b) for b in term.bounds())
    return (strength != 0.0) & ((strength <= STRETCHED * low) | (strength >= STRETCHED * high))


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
    """Held-out log likelihood that a further effect must gain.

    It is more beside one that gains much, as no model is exact.
    """
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
           progress: Callable[[str], None], thorough: bool = False) -> dict[str, Judged]:
    """Every candidate on top of what is chosen: a first look at all, the most promising in full.

    thorough: random effects in full, however little they promise.
    """
    before = chosen.gain if chosen else 0.0
    held = chosen.terms if chosen else ()
    have = {(t.name, t.values.get("rotor")) for t in held if not t.companion}
    twins = {n for t in held if not t.companion and (group := twins_of(t.name)) for n in group[0] if n != t.name}
    left, added = [], []
    for k, part in enumerate(parts):
        problem, values, power = left_over(data, part, chosen.fits[1 - k].terms if chosen and chosen.fits else ())
        left.append(values)
        added.append(power - problem.power)
    looked, sure, shaken = [], [], []
    for name, variants in candidates.items():
        progress(name)
        if name in twins:
            continue
        for terms in variants:
            if any((t.name, t.values.get("rotor")) in have for t in terms):
                continue
            choice = np.log(sum(len(v) == len(terms) for v in variants))  # among so many; else many would beat one
            if all(t.kind == MEAN and t.name not in COMMAND_ONLY for t in terms):
                gain, fitted, variances = first_order(screen, parts, left, added, terms, held)
                gain += before - _price(terms) - choice
                if gain < before + HOPELESS and _only_in_commands(data, screen, terms):
                    sure.append(_crossed(data, parts, base, name, held, terms, chosen, choice))
                    continue
                own, k = terms[0], len(terms[0].free)
                looked.append(Judged(name, (*held, *terms), gain, full=False, choice=choice,
                                     strength=own.among_all(np.mean(fitted, axis=0)[:k]),
                                     variance=own.among_all(_of_mean(variances)[:k], np.inf)))
            elif any(t.kind == SPECTRUM for t in terms):
                shaken.append((name, terms, choice))
            else:
                sure.append(_crossed(data, parts, base, name, held, terms, chosen, choice))
    looked = _best_variants(looked)
    tried = _shaken(data, parts, base, screen, left, added, held, chosen, shaken, looked, thorough)
    sure += [j for j in tried if j.full]
    looked += [j for j in tried if not j.full]
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
    return _with_evidence(data, best, before)


def _shaken(data: Data, parts: Sequence[Part], base: Sequence[Sequence[float]], screen: Screen,
            left: Sequence[np.ndarray], added: Sequence[np.ndarray], held: Hypothesis, chosen: Judged | None,
            hypotheses: Sequence[tuple[str, Hypothesis, float]], means: Sequence[Judged], thorough: bool,
            ) -> list[Judged]:
    """Hypotheses with a random effect: the variant of each that a first look finds best is judged in full.

    hypotheses: name, terms, and what the choice of the variant costs. means: looks at mean effects, best first; the
    random part of one of these goes with its best variant.
    """
    before = chosen.gain if chosen else 0.0
    mean = {j.name: j for j in reversed(means) if len(j.terms) == len(held) + 1}
    looks: dict[str, list[tuple[float, np.ndarray, Hypothesis, float]]] = {}
    for name, terms, choice in hypotheses:
        if name in mean and not _same(terms[0], mean[name].terms[-1]):
            continue
        if len(terms) == 1 or terms[0].kind == MEAN:
            random = next(t for t in terms if t.kind == SPECTRUM)
            gain, strength = random_look(screen, parts, left, added, random)
            looks.setdefault(name, []).append((gain - choice, strength, terms, choice))
    out = []
    for name, tried in looks.items():
        gain, strength, terms, choice = max(tried, key=lambda t: t[0])
        promising = gain > HOPELESS or name in mean and mean[name].gain - before > HOPELESS
        if not (promising or thorough):
            if name not in mean:  # else the look at its mean part says what there is
                out.append(Judged(name, (*held, *terms), before + min(gain, 0.0), full=False, choice=choice,
                                  strength=telling(terms).among_all(strength)))
            continue
        longer = [(t, c) for n, t, c in hypotheses if n == name and len(t) > len(terms) and _same(t[0], terms[0])]
        out += [_crossed(data, parts, base, name, held, t, chosen, c) for t, c in ((terms, choice), *longer)]
    return out


def _only_in_commands(data: Data, screen: Screen, terms: Hypothesis) -> bool:
    """Whether effects change what the loop commands, and nothing of what the logged commands lead to expect."""
    law = data.study.controller
    moved = [t.active(np.ones(len(t.free))) for t in terms]
    return law is not None and not any(screen.shows(t) for t in terms) and not np.allclose(law.ratio(moved), 1.0)


def _same(one: Term, other: Term) -> bool:
    """Whether two terms are the same variant of an effect."""
    fixed = [{k: v for k, v in t.values.items() if k not in t.free} for t in (one, other)]
    return one.name == other.name and one.free == other.free and fixed[0] == fixed[1]


def _with_evidence(data: Data, best: Mapping[str, Judged], before: float) -> dict[str, Judged]:
    """Every candidate with its evidence: what it gains, and no more than its strength alone says.

    None where the strength is the largest that can be: there the effect stands in for another.
    """
    scatter = data.study.scatter
    out = {}
    for n, j in best.items():
        own = next(t for t in reversed(j.terms) if t.name == n)
        stretched = own.kind == MEAN and _at_bound(own, j.strength).any()
        most = 0.0 if stretched else scatter.evidence(n, j.strength) if scatter else np.inf
        out[n] = replace(j, evidence=min(j.gain - before, most))
    return out


def _price(terms: Sequence[Term]) -> float:
    """Held-out log likelihood that parameters beyond an effect's first must earn."""
    return PRICE * sum(len(t.free) - 1 for t in terms if t.kind != CLOCK)


def _best_variants(looked: Sequence[Judged]) -> list[Judged]:
    """The best of each candidate's variants of one length, best first."""
    kept: dict[tuple[str, int], Judged] = {}
    for j in sorted(looked, key=lambda j: -j.gain):
        kept.setdefault((j.name, len(j.terms)), j)
    return list(kept.values())


def _crossed(data: Data, parts: Sequence[Part], base: Sequence[Sequence[float]], name: str, held: Hypothesis,
             terms: Hypothesis, chosen: Judged | None, choice: float) -> Judged:
    """Fit on each half, judge on the other; choice: what the choice of this variant costs."""
    joint = (*held, *terms)
    timed = [t for t in terms if t.kind == CLOCK]
    paid = choice + (chosen.choice if chosen else 0.0)
    gain, fits = 0.0, []
    if chosen and not [t for t in terms if t.kind != CLOCK]:
        gain, fits = chosen.gain, list(chosen.fits)
    else:
        others = [t for t in joint if t.kind != CLOCK]
        gain += sum(clock_gain(data, t)[1] for t in held if t.kind == CLOCK)
        against = base[any(t.kind == SPECTRUM for t in others)]
        for train, test in ((0, 1), (1, 0)):
            found = _refined(data, parts[train], fit(data, parts[train], others, _start(chosen, others, train)))
            gain += judge(data, parts[test], found.terms) - against[test] if others else 0.0
            fits.append(found)
        gain -= _price(found.terms if others else ()) + paid
    fitted = list(fits[0].terms) if fits else []
    for t in (t for t in joint if t.kind == CLOCK):
        made, more = clock_gain(data, t)
        fitted.append(made)
        gain += more if t in timed else 0.0
    strength, variance = _strength(telling(terms), fitted, fits)
    return Judged(name, tuple(fitted), gain, tuple(fits), choice=paid, strength=strength, variance=variance)


def _strength(term: Term, fitted: Sequence[Term], fits: Sequence[Fit]) -> tuple[np.ndarray, np.ndarray]:
    """Scaled parameters (k,) of a term as fitted, the mean of both halves, and variances (k,), 0 but for mean effects.

    k: of all parameters that the effect may have free; those that this variant leaves alone are 0, and nobody knows
    how far they lie from it.
    """
    every = [fitted] if term.kind == CLOCK or not fits else [f.terms for f in fits]
    def own(t):
        return (t.name, t.kind, t.values.get("rotor"))
    same = [next(t for t in terms if own(t) == own(term)) for terms in every]
    k = len(term.free)
    strength = term.among_all(np.mean([t.scaled(t.values)[:k] for t in same], axis=0))
    if term.kind != MEAN:
        return strength, np.zeros(len(strength))
    variances = []
    for f, t in zip(fits, same, strict=True):
        place = sum(len(x.free) for x in f.terms[:f.terms.index(t)] if x.kind == MEAN)
        variances.append(np.diag(f.covariance)[place:place + k])
    return strength, term.among_all(_of_mean(variances), np.inf)


def _of_mean(variances: Sequence[np.ndarray]) -> np.ndarray:
    """Variance of the mean of independent values."""
    return np.sum(variances, axis=0) / len(variances) ** 2


def _refined(data: Data, part: Part, found: Fit) -> Fit:
    """A fit with the parameters free too that only a fit close to the truth can find."""
    terms = [t.refined() for t in found.terms]
    if all(a.free == b.free for a, b in zip(terms, found.terms, strict=True)):
        return found
    return fit(data, part, terms, np.concatenate([t.scaled(t.values) for t in terms if t.kind == MEAN]))


def _start(chosen: Judged | None, terms: Sequence[Term], train: int) -> np.ndarray | None:
    """The parameters found before, with nothing of the new effects; None where nothing was found."""
    if chosen is None or not chosen.fits:
        return None
    known = chosen.fits[train].scaled
    size = sum(len(t.free) for t in terms if t.kind == MEAN)
    return np.concatenate([known, np.zeros(size - len(known))])


def _against_none(gain: float, least: float, many: int = 1) -> float:
    """Score of one of many candidates beside 0 for `none`: what is missing counts in full, what is over little.

    gain: the evidence, over `none` and over what nominal flights show.
    """
    if gain < least:
        return TEMPERATURE * (gain - least - np.log(many))
    return gain - least


def _scores(selection: Selection, names: Sequence[str]) -> list[float]:
    """Score of every single candidate beside 0 for `none`; those that could be named keep the order of their gains."""
    singles, least = selection.singles, selection.least
    out = {n: _against_none(singles[n].evidence, least[n], len(names)) for n in names}
    if selection.named and selection.named[0].name in names:
        first = selection.named[0]
        for n in names:
            if out[n] >= 0.0:
                behind = max(singles[first.name].gain - singles[n].gain, BEHIND) if n != first.name else 0.0
                out[n] = max(out[first.name] - behind, -TEMPERATURE)
    return [out[n] for n in names]


def probabilities(selection: Selection, at_floor: bool = False) -> dict[str, float]:
    """Of every single candidate, `none` and `unknown`; they sum to 1.

    at_floor: nothing is named and the gap does not stand over its floor, so that `none` is the answer.

    `unknown` has one half where as much is left as is allowed, and odds that grow with its square.
    """
    names = list(selection.singles)
    score = np.array([*_scores(selection, names), 0.0])
    weight = np.exp((score - score.max()) / TEMPERATURE)
    odds = (np.logaddexp(selection.free_after, 0.0) / selection.allowed) ** 2
    unknown = odds / (1.0 + odds)
    if selection.chosen is not None and selection.explained:  # not above the effect that is the answer
        share = weight[names.index(selection.named[0].name)] / weight.sum()
        unknown = min(unknown, BELOW * share / (1.0 + BELOW * share))
    if at_floor:
        share = weight[-1] / weight.sum()
        unknown = min(unknown, BELOW * share / (1.0 + BELOW * share))
    known = (1.0 - unknown) * weight / weight.sum()
    return dict(zip([*names, "none", "unknown"], [*known, unknown], strict=True))
