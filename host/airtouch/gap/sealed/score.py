"""Scores of diagnoses against the opened key: every figure with its n and a 95 % interval."""

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.gap.naming.policy import FIRST_GAIN
from airtouch.gap.sealed.answers import Answer, check_answers, flight_of, flights_in, read_answers
from airtouch.gap.sealed.intervals import Figure, auroc, median, pooled, share, share_in_groups
from airtouch.gap.sealed.key import DrawnEffect, Key, answers_sha256, open_key
from airtouch.gap.sealed.severity import FACTORS, SEEN
from airtouch.gap.sealed.variant import has_variants, same_variant
from airtouch.gap.signatures.alike import interchangeable, same_things
from airtouch.gap.signatures.term import neutral_of, unit
from airtouch.simulation.effects import get

SEVERITIES = ("weakest", "2x", "4x")  #: names of the three, in rising order: an effect's `level` in the key
#: goals of the figures, by their place in `figures` with "/" between keys; host/docs/gap-blind.md has them too
GOALS = {
    "top_1": "at least 95 %",
    "by_severity/weakest/top_1": "at least 80 %",
    "false_alarms": "at most 2 %",
    "pairs_exact": "at least 85 %",
    **{f"unknown/{level}/auroc_told_apart": "at least 0.97" for level in SEVERITIES[1:]},
    **{f"unknown/{level}/wrong_name_told_apart": "at most 5 %" for level in SEVERITIES[1:]},
    "shrink/right": "at least 90 %",
    "shrink/wrong": "at most 20 %",
    "parameters/error": "at most 10 %",
    "parameters/coverage": "87 to 93 %",
}
ROUNDED = 1e-9  #: relative difference of two strengths that are the same
WRONG_VARIANT = 1.0  #: relative error of parameters of a wrong rotor or loop, as that of an answer of no effect; chosen
LEAST_GAP = 1.05  #: gap, in units of the floor, above which the share of it that goes is scored; chosen


@dataclass(frozen=True)
class Sheet:
    """The answer sheet: what each flight's key says, beside its diagnosis.

    cases: all diagnoses; full_registry: by flight, those with no effect left out; single_effect: the one effect of
    flights that have one; without_effect: flights free of effects; pairs: names of the two effects of the others.
    is_first, in_first_three: whether a single effect is first, or among the first three, of the ranking.
    """

    key: Key
    cases: Sequence[Answer]
    full_registry: Mapping[str, Answer]
    single_effect: Mapping[str, DrawnEffect]
    without_effect: Sequence[str]
    pairs: Mapping[str, Sequence[str]]
    is_first: Mapping[str, bool]
    in_first_three: Mapping[str, bool]


def score(folder: Path, answers: Path, key: Path | None = None) -> dict[str, Any]:
    """Open the key of a set and score the diagnoses in `answers`: `figures`.

    The key stays shut where `check_answers` refuses them.
    """
    cases = read_answers(answers)
    check_answers(cases, flights_in(folder))
    return figures(open_key(folder, answers_sha256([c for c in cases if not c.get("without")]), key), cases)


def figures(key: Key, cases: Sequence[Answer]) -> dict[str, Any]:
    """All figures of a set, JSON-ready. A flight without a diagnosis counts as wrong.

    Right means the effect by name (or another name of it); right_variant says how often its rotor or loop is right too.

    flights, diagnosed, effects: numbers of flights, of diagnoses, of effects drawn alone. Of single effects: top_1,
    top_3, exact (named, and nothing else), by_severity, by_effect, misses. Of flights free of effects: false_alarms
    (anything but `none`), false_unknown. Of pairs: pairs_exact, pairs_one_right. The others as the functions of these
    names say: right_variant, unknown, shrink, parameters, confusion, reliability. Raises AirTouchError for a diagnosis
    of a flight that is not in the key.
    """
    sheet = sheet_of(key, cases)
    answers, single = sheet.full_registry, sheet.single_effect
    return {
        "flights": len(key.flights), "diagnosed": len(answers), "effects": len({e.name for e in single.values()}),
        "top_1": share(sheet.is_first.values()), "top_3": share(sheet.in_first_three.values()),
        "right_variant": right_variant(sheet),
        "exact": share(same_things(_named(answers.get(n)), [e.name]) for n, e in single.items()),
        "by_severity": by_severity(sheet), "by_effect": by_effect(sheet),
        **of_flights_without_effect(sheet), **of_pairs(sheet),
        "unknown": unknown(sheet), "shrink": shrink(sheet), "parameters": parameters(sheet),
        "confusion": confusion(sheet), "reliability": reliability(sheet), "misses": misses(sheet),
    }


def sheet_of(key: Key, cases: Sequence[Answer]) -> Sheet:
    """The diagnoses beside the key; raises AirTouchError for one of a flight that is not in it."""
    full_registry = {flight_of(c): c for c in cases if not c.get("without")}
    extra = sorted(set(full_registry) - set(key.flights))
    if extra:
        raise AirTouchError(f"{extra[0]}: diagnosed, but not a flight of this set")
    single = {n: f.effects[0] for n, f in key.flights.items() if len(f.effects) == 1}
    first, three = ({n: top(full_registry.get(n), e.name, rank) for n, e in single.items()} for rank in (1, 3))
    return Sheet(
        key=key, cases=cases, full_registry=full_registry, single_effect=single,
        without_effect=[n for n, f in key.flights.items() if not f.effects],
        pairs={n: [e.name for e in f.effects] for n, f in key.flights.items() if len(f.effects) == 2},
        is_first=first, in_first_three=three)


def by_severity(sheet: Sheet) -> dict[str, Any]:
    """For each severity of single effects: top_1, top_3, how often `none` is said, `ideal`, and `capped`."""
    groups = {name: [n for n, e in sheet.single_effect.items() if e.level == i] for i, name in enumerate(SEVERITIES)}
    return {name: {"top_1": share(sheet.is_first[n] for n in group),
                   "top_3": share(sheet.in_first_three[n] for n in group),
                   "none": share(_verdict(sheet.full_registry.get(n)) == "none" for n in group),
                   "ideal": ideal(sheet.key, group), "capped": capped(sheet, group)}
            for name, group in groups.items() if group}


def by_effect(sheet: Sheet) -> dict[str, Any]:
    """For each kind of single effect: top_1, top_3, and the three strengths that were drawn."""
    groups = defaultdict(list)
    for n, e in sheet.single_effect.items():
        groups[e.kind].append(n)
    return {kind: {"top_1": share(sheet.is_first[n] for n in group),
                   "top_3": share(sheet.in_first_three[n] for n in group),
                   "strengths": sheet.key.severities.get(kind)}
            for kind, group in sorted(groups.items())}


def of_flights_without_effect(sheet: Sheet) -> dict[str, Any]:
    """false_alarms: flights free of effects that are not called `none`; false_unknown: those called `unknown`."""
    verdicts = [_verdict(sheet.full_registry.get(n)) for n in sheet.without_effect]
    return {"false_alarms": share(verdict != "none" for verdict in verdicts),
            "false_unknown": share(verdict == "unknown" for verdict in verdicts)}


def of_pairs(sheet: Sheet) -> dict[str, Any]:
    """pairs_exact: flights with two effects of which both are named and nothing else; pairs_one_right: one or both."""
    named = {n: _named(sheet.full_registry.get(n)) for n in sheet.pairs}
    return {"pairs_exact": share(same_things(named[n], e) for n, e in sheet.pairs.items()),
            "pairs_one_right": share(any(interchangeable(a, b) for a in named[n] for b in e)
                                     for n, e in sheet.pairs.items())}


def misses(sheet: Sheet) -> list[dict[str, Any]]:
    """Flights whose single effect is not first: flight, true kind, its level and the first three answers."""
    return [{"flight": n, "true": e.kind, "level": e.level,
             "answer": [r["name"] for r in sheet.full_registry[n]["ranking"][:3]] if n in sheet.full_registry else []}
            for n, e in sheet.single_effect.items() if not sheet.is_first[n]]


def ideal(key: Key, flights: Sequence[str]) -> Figure:
    """How many flights a test for the true effect at its true strength sees; n: of those whose nats the key has."""
    return share(nats > SEEN for n in flights if (nats := key.flights[n].nats) is not None)


def capped(sheet: Sheet, flights: Sequence[str]) -> Figure:
    """How many flights have a kind whose strongest severity is less than four times the weakest: no more is plausible.

    n: of those whose strengths the key has.
    """
    strengths = [s for n in flights if (s := sheet.key.severities.get(sheet.single_effect[n].kind))]
    return share(s[2] < (1.0 - ROUNDED) * FACTORS[2] * s[0] for s in strengths)


def top(case: Answer | None, name: str, first: int) -> bool:
    """Whether an effect, or another name of it, is among the first of a ranking."""
    return case is not None and any(interchangeable(name, r["name"]) for r in case["ranking"][:first])


def right_variant(sheet: Sheet) -> Figure:
    """How often the variant is right too: the rotor of an effect of one rotor, the parameter that a kind scales alone.

    n: flights whose single effect has variants, is first and is named.
    """
    named = {n: [f for f in sheet.full_registry[n]["effects"] if f["name"] == e.name]
             for n, e in sheet.single_effect.items() if sheet.is_first[n] and has_variants(e)}
    return share(any(same_variant(sheet.single_effect[n], f["parameters"]) for f in found)
                 for n, found in named.items() if found)


def unknown(sheet: Sheet) -> dict[str, Any]:
    """How often flights whose effect was taken out of the registry are called `unknown`, and how likely that is.

    Diagnoses without other effects, in which the true one could be named, do not count.
    said_unknown, wrong_name: share of them with that answer; auroc: of the probability of `unknown`, against the same
    flights with the effect in the registry. wrong_name_told_apart, auroc_told_apart: among those flights whose data
    tell the effect from the names that it was given. A flight answered `unknown` or `none` got no name and counts as
    told apart, so wrong_name_told_apart is a little too good.
    """
    single, full_registry = sheet.single_effect, sheet.full_registry
    out = {n: c for c in sheet.cases if (n := flight_of(c)) in single
           and any(interchangeable(single[n].name, name) for name in c.get("without") or ())}
    groups = {"all": list(out)}
    groups |= {name: [n for n in out if single[n].level == i] for i, name in enumerate(SEVERITIES)}
    score = {n: _chance(c, "unknown") for n, c in out.items()}
    apart = {n for n, c in out.items() if separable(full_registry.get(n), single[n].name, _named(c))}
    known = {n: _chance(c, "unknown") for n, c in full_registry.items()}
    return {g: {"said_unknown": share(out[n]["verdict"] == "unknown" for n in names),
                "wrong_name": share(out[n]["verdict"] == "effect" for n in names),
                "wrong_name_told_apart": share(out[n]["verdict"] == "effect" for n in names if n in apart),
                "auroc": auroc([score[n] for n in names], [known[n] for n in names if n in known]),
                "auroc_told_apart": auroc([score[n] for n in names if n in apart],
                                          [known[n] for n in names if n in apart and n in known])}
            for g, names in groups.items() if names}


def separable(case: Answer | None, true: str, named: Iterable[str]) -> bool:
    """Whether held-out data gain more by an effect than by others together: as much as a first effect must gain.

    case: the diagnosis with all effects. True where no others are named, and where the gains are not known.
    """
    gained = {r["name"]: r["nats"] for r in case["ranking"] if "nats" in r} if case else {}
    others = [gained.get(n, 0.0) for n in named]
    return not others or true not in gained or gained[true] - sum(others) >= FIRST_GAIN


def shrink(sheet: Sheet) -> dict[str, Any]:
    """Share of the gap over the floor that goes, over all flights rightly named: with the effect, with a wrong one."""
    answers = [sheet.full_registry[n] for n in sheet.single_effect if sheet.is_first[n]]
    named = [c for c in answers if c["verdict"] == "effect"]
    right = [(c["gap"]["before"], c["gap"]["after"]) for c in named if c["gap"]["before"] > LEAST_GAP]
    wrong = [(c["control"]["before"], c["control"]["after"]) for c in named
             if c.get("control") and c["control"]["before"] > LEAST_GAP]
    return {"right": pooled(right), "wrong": pooled(wrong)}


def parameters(sheet: Sheet) -> dict[str, Any]:
    """Parameters of single effects that are first and named: relative error of each vector, coverage.

    error, in natural steps: of parameters that have a neutral value. coverage: of all that are free, a battery's charge
    and capacity too. Both whatever the rotor, without answers that free no parameter that was drawn off neutral.
    error_with_variant, coverage_with_variant: of all, where a wrong rotor or loop counts as an error of WRONG_VARIANT
    and as a miss. The n of a coverage counts parameters, by_effect's that of errors.
    """
    errors, held = defaultdict(list), defaultdict(list)
    errors_all, held_all = [], []
    for n, e in sheet.single_effect.items():
        effects = sheet.full_registry[n]["effects"] if sheet.is_first[n] else []
        named = next((f for f in effects if f["name"] == e.name), None)
        if named is None:
            continue
        known = {k: q for k, q in named["parameters"].items() if "low" in q and k in e.values}
        within = [q["low"] <= e.values[k] <= q["high"] for k, q in known.items()]
        error = relative_error(e.name, e.values, known)
        if error is not None:
            errors[e.kind].append(error)
            held[e.kind].append(within)
        if not same_variant(e, named["parameters"]):
            errors_all.append(WRONG_VARIANT)
            held_all.append([False] * max(len(known), 1))
        elif error is not None:
            errors_all.append(error)
            held_all.append(within)
    return {"error": median(np.array([x for v in errors.values() for x in v])),
            "coverage": share_in_groups([x for v in held.values() for x in v]),
            "error_with_variant": median(np.array(errors_all)), "coverage_with_variant": share_in_groups(held_all),
            "by_effect": {k: {"error": float(np.median(v)), "n": len(v), "coverage": share_in_groups(held[k])}
                          for k, v in sorted(errors.items())}}


def relative_error(effect: str, values: Mapping[str, float], known: Mapping[str, Mapping[str, float]],
                   ) -> float | None:
    """Distance of answered parameters of an effect from the drawn ones over theirs from neutral, in natural steps.

    values: the drawn ones; known: the answered ones, as JSON. Those without a neutral value, such as the charge of a
    battery or the length of a rope, do not count: a wrong strength would vanish beside them. None where none that
    counts was drawn off neutral.
    """
    counted = [p for p in get(effect).parameters if p.name in known and p.neutral is not None]
    size = np.sqrt(sum(((values[p.name] - neutral_of(p)) / unit(p)) ** 2 for p in counted))
    if size == 0.0:
        return None
    off = np.sqrt(sum(((known[p.name]["value"] - values[p.name]) / unit(p)) ** 2 for p in counted))
    return float(off / size)


def confusion(sheet: Sheet) -> dict[str, dict[str, int]]:
    """How often a flight of each effect (or `none`) got each answer first; pairs are not in it."""
    out: dict[str, Counter] = defaultdict(Counter)
    for n, name in _true_names(sheet).items():
        out[name][sheet.full_registry[n]["ranking"][0]["name"]] += 1
    return {k: dict(v) for k, v in sorted(out.items())}


def reliability(sheet: Sheet, bins: int = 8) -> list[Figure]:
    """For bins of the first answer's probability: its mean, how often the answer was right, and n."""
    rows = []
    for n, name in _true_names(sheet).items():
        best = sheet.full_registry[n]["ranking"][0]
        rows.append((best["probability"], interchangeable(name, best["name"])))
    place = [min(int(p * bins), bins - 1) for p, _ in rows]
    return [{"probability": float(np.mean([r[0] for r in group])), **share(r[1] for r in group)}
            for b in range(bins) if (group := [r for r, k in zip(rows, place, strict=True) if k == b])]


def _true_names(sheet: Sheet) -> dict[str, str]:
    """The right first answer to each flight that was diagnosed, but for pairs: its effect, or "none"."""
    return {n: f.effects[0].name if f.effects else "none" for n, f in sheet.key.flights.items()
            if n in sheet.full_registry and len(f.effects) < 2}


def _verdict(case: Answer | None) -> str:
    """The verdict; empty without a diagnosis."""
    return case["verdict"] if case else ""


def _named(case: Answer | None) -> list[str]:
    """Names of the effects that a diagnosis names; empty without one."""
    return [f["name"] for f in case["effects"]] if case else []


def _chance(case: Answer, name: str) -> float:
    """Probability that a diagnosis gives a name; 0 where its ranking has none of that name."""
    return next((r["probability"] for r in case["ranking"] if r["name"] == name), 0.0)
