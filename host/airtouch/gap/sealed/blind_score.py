"""Scores of diagnoses against the opened key: every figure with its n and a 95 % interval."""

import json
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.gap.naming.judging import FIRST_GAIN
from airtouch.gap.sealed.blind_severity import SEEN
from airtouch.gap.signatures.alike import interchangeable
from airtouch.gap.signatures.candidates import terms

Case = Mapping[str, Any]
LEVELS = ("weakest", "2x", "4x")
DRAWS = 1000


def read_answers(path: Path) -> list[Case]:
    """Diagnoses from a folder of JSON files, one each, or a file of many (`diagnose --each --json`).

    Raises AirTouchError for what is none.
    """
    path = Path(path)
    files = sorted(path.glob("*.json")) if path.is_dir() else [path]
    out: list[Case] = []
    for file in files:
        try:
            table = json.loads(file.read_text(encoding="utf-8"))
            out += table["cases"] if "cases" in table else [table]
        except (OSError, ValueError, TypeError):
            raise AirTouchError(f"{file}: not the JSON of a diagnosis; write it with `diagnose --json`") from None
    if not out:
        raise AirTouchError(f"{path}: no diagnosis in it (*.json)")
    for case in out:
        if not isinstance(case, dict) or not case.get("flights") or not case.get("ranking"):
            raise AirTouchError(f"{path}: a diagnosis without `flights` or `ranking`")
    return out


def figures(key: Mapping[str, Any], cases: Sequence[Case]) -> dict[str, Any]:
    """All figures: see the keys. A flight without a diagnosis counts as wrong."""
    plain = {_name(c): c for c in cases if not c.get("without")}
    truth = {n: a["effects"] for n, a in key["answers"].items()}
    extra = sorted(set(plain) - set(truth))
    if extra:
        raise AirTouchError(f"{extra[0]}: diagnosed, but not a flight of this set")
    single = {n: e[0] for n, e in truth.items() if len(e) == 1}
    none = [n for n, e in truth.items() if not e]
    pairs = {n: [x["name"] for x in e] for n, e in truth.items() if len(e) == 2}
    first = {n: top(plain.get(n), e["name"], 1) for n, e in single.items()}
    three = {n: top(plain.get(n), e["name"], 3) for n, e in single.items()}
    alarms = [plain[n]["verdict"] != "none" if n in plain else True for n in none]
    sets = {n: _named(plain.get(n)) for n in pairs}
    return {
        "flights": len(truth), "diagnosed": len(plain), "effects": len({e["name"] for e in single.values()}),
        "top_1": share(first.values()), "top_3": share(three.values()),
        "exact": share(_same(_named(plain.get(n)), [e["name"]]) for n, e in single.items()),
        "by_severity": {LEVELS[i]: {"top_1": share(first[n] for n in group), "top_3": share(three[n] for n in group),
                                    "none": share(_verdict(plain.get(n)) == "none" for n in group),
                                    "ideal": ideal(key, group)}
                        for i in range(3) if (group := [n for n, e in single.items() if e["level"] == i])},
        "by_effect": {k: {"top_1": share(first[n] for n in group), "top_3": share(three[n] for n in group),
                          "strengths": key.get("severities", {}).get(k)}
                      for k in sorted({e["kind"] for e in single.values()})
                      if (group := [n for n, e in single.items() if e["kind"] == k])},
        "false_alarms": share(alarms), "false_unknown": share(_verdict(plain.get(n)) == "unknown" for n in none),
        "pairs_exact": share(_same(sets[n], e) for n, e in pairs.items()),
        "pairs_one_right": share(any(interchangeable(a, b) for a in sets[n] for b in e) for n, e in pairs.items()),
        "unknown": unknown(single, plain, cases),
        "shrink": shrink(single, plain, first), "parameters": parameters(single, plain, first),
        "confusion": confusion(truth, plain), "reliability": reliability(truth, plain),
        "misses": [{"flight": n, "true": e["kind"], "level": e["level"],
                    "answer": [r["name"] for r in plain[n]["ranking"][:3]] if n in plain else []}
                   for n, e in single.items() if not first[n]],
    }


def ideal(key: Mapping[str, Any], flights: Sequence[str]) -> dict[str, float | None]:
    """How many flights a test could tell from nominal ones that is told effect and strength; n: of those known."""
    return share(nats > SEEN for n in flights if (nats := key["answers"][n].get("nats")) is not None)


def share(values: Any) -> dict[str, float | None]:
    """Share of true values with n and Wilson's 95 % interval."""
    found = [bool(v) for v in values]
    return wilson(sum(found), len(found))


def wilson(hits: int, n: int, z: float = 1.959964) -> dict[str, float | None]:
    """Share hits / n with Wilson's score interval; without trials anything is possible."""
    if not n:
        return {"value": None, "low": 0.0, "high": 1.0, "hits": 0, "n": 0}
    p, middle = hits / n, (hits + 0.5 * z * z) / (n + z * z)
    half = z * np.sqrt(p * (1.0 - p) / n + z * z / (4.0 * n * n)) / (1.0 + z * z / n)
    return {"value": p, "low": float(max(middle - half, 0.0)), "high": float(min(middle + half, 1.0)),
            "hits": int(hits), "n": int(n)}


def top(case: Case | None, name: str, first: int) -> bool:
    """Whether an effect, or another name of it, is among the first of a ranking."""
    return case is not None and any(interchangeable(name, r["name"]) for r in case["ranking"][:first])


def unknown(single: Mapping[str, Any], plain: Mapping[str, Case], cases: Sequence[Case]) -> dict[str, Any]:
    """Effects taken out of the registry: is `unknown` said, is it likelier than where they are in.

    wrong_name_told_apart, auroc_told_apart: among those flights whose data tell the effect from the names that it was
    given.
    """
    out = {_name(c): c for c in cases if c.get("without") and _name(c) in single}
    groups = {"all": list(out), **{LEVELS[i]: [n for n in out if single[n]["level"] == i] for i in range(3)}}
    score = {n: _chance(c, "unknown") for n, c in out.items()}
    apart = {n for n, c in out.items() if told_apart(plain.get(n), single[n]["name"], _named(c))}
    known = {n: _chance(c, "unknown") for n, c in plain.items()}
    return {g: {"said_unknown": share(out[n]["verdict"] == "unknown" for n in names),
                "wrong_name": share(out[n]["verdict"] == "effect" for n in names),
                "wrong_name_told_apart": share(out[n]["verdict"] == "effect" for n in names if n in apart),
                "auroc": auroc([score[n] for n in names], [known[n] for n in names if n in known]),
                "auroc_told_apart": auroc([score[n] for n in names if n in apart],
                                          [known[n] for n in names if n in apart and n in known])}
            for g, names in groups.items() if names}


def told_apart(case: Case | None, true: str, named: Iterable[str]) -> bool:
    """Whether held-out data gain more by an effect than by others together: as much as a first effect must gain.

    case: the diagnosis with all effects. True where no others are named, and where the gains are not known.
    """
    gained = {r["name"]: r["nats"] for r in case["ranking"] if "nats" in r} if case else {}
    others = [gained.get(n, 0.0) for n in named]
    return not others or true not in gained or gained[true] - sum(others) >= FIRST_GAIN


def auroc(positive: Sequence[float], negative: Sequence[float]) -> float | None:
    """Chance that a positive scores higher than a negative, ties counted half."""
    if not len(positive) or not len(negative):
        return None
    a, b = np.asarray(positive)[:, None], np.asarray(negative)[None, :]
    return float((a > b).mean() + 0.5 * (a == b).mean())


def shrink(single: Mapping[str, Any], plain: Mapping[str, Case], first: Mapping[str, bool]) -> dict[str, Any]:
    """Share of the gap over the floor that goes, over all flights rightly named: with the effect, with a wrong one."""
    named = [plain[n] for n in single if first[n] and plain[n]["verdict"] == "effect"]
    right = [(c["gap"]["before"], c["gap"]["after"]) for c in named if c["gap"]["before"] > 1.05]
    wrong = [(c["control"]["before"], c["control"]["after"]) for c in named
             if c.get("control") and c["control"]["before"] > 1.05]
    return {"right": pooled(right), "wrong": pooled(wrong)}


def pooled(pairs: Sequence[tuple[float, float]]) -> dict[str, float | None]:
    """(before - after) / (before - 1) of sums and its median over flights, 95 % intervals by bootstrap."""
    if not pairs:
        return {"value": None, "low": None, "high": None, "median": None, "n": 0}
    x = np.array(pairs)
    gone, there = x[:, 0] - x[:, 1], x[:, 0] - 1.0
    pick = np.random.default_rng(0).integers(0, len(x), (DRAWS, len(x)))
    low, high = np.percentile(gone[pick].sum(axis=1) / there[pick].sum(axis=1), [2.5, 97.5])
    return {"value": float(gone.sum() / there.sum()), "low": float(low), "high": float(high),
            "median": float(np.median(gone / there)), "n": len(x)}


def parameters(single: Mapping[str, Any], plain: Mapping[str, Case], first: Mapping[str, bool]) -> dict[str, Any]:
    """Parameters of flights rightly named: relative error of each effect's vector, and whether 90 % intervals hold."""
    errors, held = defaultdict(list), defaultdict(list)
    for n, e in single.items():
        found = next((f for f in plain[n]["effects"] if f["name"] == e["name"]), None) if first[n] else None
        if found is None:
            continue
        neutral = terms(e["name"])[0].values
        known = {k: q for k, q in found["parameters"].items() if "low" in q and k in e["values"]}
        size = np.sqrt(sum((e["values"][k] - neutral[k]) ** 2 for k in known))
        if not known or size == 0.0:
            continue
        errors[e["kind"]].append(float(np.sqrt(sum((q["value"] - e["values"][k]) ** 2 for k, q in known.items()))
                                       / size))
        held[e["kind"]] += [q["low"] <= e["values"][k] <= q["high"] for k, q in known.items()]
    every = np.array([x for v in errors.values() for x in v])
    return {"error": _median(every), "coverage": share(x for v in held.values() for x in v),
            "by_effect": {k: {"error": float(np.median(v)), "n": len(v), "coverage": share(held[k])}
                          for k, v in sorted(errors.items())}}


def _median(values: np.ndarray) -> dict[str, float | None]:
    if not len(values):
        return {"value": None, "low": None, "high": None, "n": 0}
    pick = np.random.default_rng(0).integers(0, len(values), (DRAWS, len(values)))
    low, high = np.percentile(np.median(values[pick], axis=1), [2.5, 97.5])
    return {"value": float(np.median(values)), "low": float(low), "high": float(high), "n": len(values)}


def confusion(truth: Mapping[str, Sequence[Any]], plain: Mapping[str, Case]) -> dict[str, dict[str, int]]:
    """How often a flight of each effect (or `none`) got each answer first; pairs are not in it."""
    out: dict[str, Counter] = defaultdict(Counter)
    for n, e in truth.items():
        if len(e) < 2 and n in plain:
            out[e[0]["name"] if e else "none"][plain[n]["ranking"][0]["name"]] += 1
    return {k: dict(v) for k, v in sorted(out.items())}


def reliability(truth: Mapping[str, Sequence[Any]], plain: Mapping[str, Case], bins: int = 8,
                ) -> list[dict[str, float | None]]:
    """For bins of the first answer's probability: its mean, how often the answer was right, and n."""
    rows = []
    for n, e in truth.items():
        if n in plain and len(e) < 2:
            best = plain[n]["ranking"][0]
            rows.append((best["probability"], interchangeable(e[0]["name"] if e else "none", best["name"])))
    place = [min(int(p * bins), bins - 1) for p, _ in rows]
    return [{"probability": float(np.mean([r[0] for r in group])), **share(r[1] for r in group)}
            for b in range(bins) if (group := [r for r, k in zip(rows, place, strict=True) if k == b])]


def _name(case: Case) -> str:
    name = Path(case["flights"][0]).name
    return name.split(".")[0]


def _verdict(case: Case | None) -> str:
    return case["verdict"] if case else ""


def _named(case: Case | None) -> list[str]:
    return [f["name"] for f in case["effects"]] if case else []


def _same(named: Sequence[str], true: Sequence[str]) -> bool:
    """Whether two lists of effects hold the same, names of one thing counted as one."""
    left = list(true)
    for n in named:
        match = next((t for t in left if interchangeable(n, t)), None)
        if match is None:
            return False
        left.remove(match)
    return not left


def _chance(case: Case, name: str) -> float:
    return next((r["probability"] for r in case["ranking"] if r["name"] == name), 0.0)
