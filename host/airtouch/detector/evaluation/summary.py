"""Scores of many flights as one table, each figure with its interval."""

import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import numpy as np

from airtouch.detector.evaluation.bootstrap import Sums, bootstrap
from airtouch.detector.evaluation.calibration import expected_calibration_error
from airtouch.detector.evaluation.data.dataset import Condition
from airtouch.detector.evaluation.score import HIT_RADII_M, FlightScore, WindowCounts

#: Height classes also reported together: 75 to 85 mm, where the lift is too weak to carry the edge.
HIGH = ("h82", "h85")


def summarise(scores: Sequence[FlightScore], *, replicates: int = 2000, seed: int = 0) -> dict:
    """Figures over all flights, NaN-free (None where there is nothing to count).

    Keys: flights, edges, matched, mean_abs_error_m and _s (matched edges; also
    entry_ and exit_), mean_error_s (signed, positive early), missed (share of the
    true edges) and missed_count, false_count, false_per_minute (of airborne time,
    flights with known truth), hit (share of all true edges within 0.05/0.10/0.25 m),
    kind_mistakes, balanced_accuracy, ece, airborne_minutes, detections, intervals
    (95 %, by flight, same names).
    """
    table = {key: np.array([_totals(s)[key] for s in scores], float) for key in _totals_keys()}
    whole = _statistics({key: values.sum(keepdims=True) for key, values in table.items()})
    intervals = bootstrap(table, _statistics, replicates=replicates, seed=seed)
    number = {name: _plain(values[0]) for name, values in whole.items()}
    radii = [f"{radius:.2f}" for radius in HIT_RADII_M]
    hit = {r: number.pop(f"hit_{r}") for r in radii}
    hit_intervals = {r: _pair(intervals.pop(f"hit_{r}")) for r in radii}
    counts = {name: int(table[key].sum()) for name, key in (
        ("flights", "flights"), ("edges", "true"), ("matched", "matched"), ("missed_count", "missed"),
        ("false_count", "false"), ("kind_mistakes", "kind"), ("detections", "detections"))}
    return {
        **counts,
        **number,
        "hit": hit,
        "airborne_minutes": float(sum(s.airborne_s for s in scores)) / 60.0,
        "intervals": {**{name: _pair(value) for name, value in intervals.items()}, "hit": hit_intervals},
    }


def paired(first: Sequence[FlightScore], second: Sequence[FlightScore], compare: Callable[[Sums, Sums], Sums], *,
           replicates: int = 2000, seed: int = 0) -> dict[str, tuple[float, float] | None]:
    """95 % intervals of what `compare` makes of two sets of scores of the same flights, each drawn for both at once.

    compare: the figures of `summarise` by name, shapes (...,), of the first and of the second -> name -> (...,).
    Flights that one of them lacks are left out, with a warning; None as in `bootstrap`.
    """
    others = {s.flight: s for s in second}
    pairs = [(s, others[s.flight]) for s in first if s.flight in others]
    if alone := len(first) + len(second) - 2 * len(pairs):
        warnings.warn(f"{alone} of {len(first) + len(second)} scores have no score of the same flight beside them: the "
                      "intervals leave them out", stacklevel=2)
    table = {f"{side} {key}": np.array([_totals(pair[side])[key] for pair in pairs], float)
             for side in (0, 1) for key in _totals_keys()}

    def statistics(sums: Sums) -> Sums:
        return compare(*(_statistics({key: sums[f"{side} {key}"] for key in _totals_keys()}) for side in (0, 1)))

    return bootstrap(table, statistics, replicates=replicates, seed=seed)


def one_a_flight(scores: Iterable[FlightScore]) -> list[FlightScore]:
    """One score a flight, the sum of its scores by several models, so that intervals draw a flight whole."""
    of_flight: dict[str, list[FlightScore]] = {}
    for score in scores:
        of_flight.setdefault(score.flight, []).append(score)
    return [replace(same[0], edges=tuple(e for s in same for e in s.edges),
                    false=None if all(s.false is None for s in same)
                    else tuple(sample for s in same for sample in s.false or ()),
                    detections=sum(s.detections for s in same), airborne_s=sum(s.airborne_s for s in same),
                    windows=WindowCounts(*(sum(counts) for counts in zip(*(s.windows for s in same), strict=True))),
                    bins=np.sum([s.bins for s in same], axis=0)) for same in of_flight.values()]


def breakdown(scores: Sequence[FlightScore], key: Callable[[FlightScore], str | None]) -> dict[str, dict]:
    """`summarise` for each value of key, sorted; flights whose key is None are left out."""
    groups: dict[str, list[FlightScore]] = {}
    for score in scores:
        value = key(score)
        if value is not None:
            groups.setdefault(value, []).append(score)
    return {value: summarise(groups[value]) for value in sorted(groups, key=_order)}


def _order(value: str) -> tuple[bool, float, str]:
    """Numbers by value, also those of centimetres, before names."""
    try:
        return False, float(value.removesuffix(" cm")), value
    except ValueError:
        return True, 0.0, value


def by_height(scores: Sequence[FlightScore]) -> dict[str, dict]:
    """By the manifest's height class; "h82+h85" is 75 to 85 mm together."""
    groups = breakdown(scores, lambda s: s.condition.height)
    high = [s for s in scores if s.condition.height in HIGH]
    return {**groups, "+".join(HIGH): summarise(high)} if high else groups


def by_centimetre(scores: Sequence[FlightScore]) -> dict[str, dict]:
    """As `by_height`; heights such as "24mm" in whole centimetres, for simulated ones are drawn and all differ."""
    def rounded(score: FlightScore) -> FlightScore:
        height = score.condition.height or ""
        digits = height.removesuffix("mm")
        if digits == height or not digits.isdigit():
            return score
        return replace(score, condition=replace(score.condition, height=f"{(int(digits) + 5) // 10} cm"))

    return by_height([rounded(score) for score in scores])


def by_angle(scores: Sequence[FlightScore]) -> dict[str, dict]:
    """By the approach angle in degrees."""
    def angle(score: FlightScore) -> str | None:
        return None if score.condition.angle_deg is None else f"{score.condition.angle_deg:+g}"

    return breakdown(scores, angle)


def by_wind(scores: Sequence[FlightScore]) -> dict[str, dict]:
    """By where a fan blew."""
    return breakdown(scores, lambda s: s.condition.wind)


def _totals(score: FlightScore) -> dict[str, float]:
    """The numbers of a flight from whose sums over flights `_statistics` makes every figure.

    m, s (and with "entry" or "exit" appended): summed absolute errors in metres and seconds, of n matched edges. m and
    hits are NaN where the distance of one is unknown, for want of a speed.
    over_hits of over, beside_hits of beside: airborne samples that are classified correctly, of those over a platform
    and of the others.
    """
    matched = [(e, e.error_s) for e in score.edges if e.error_s is not None]
    judged = score.false is not None
    totals: dict[str, float] = {
        "flights": 1,
        "detections": score.detections,
        "true": len(score.edges),
        "matched": len(matched),
        "missed": len(score.edges) - len(matched),
        "false": len(score.false or ()),
        "minutes": score.airborne_s / 60.0 if judged else 0.0,
        "kind": sum(e.detected_kind not in (e.kind, "edge") for e, _ in matched),
        "signed_s": sum(seconds for _, seconds in matched),
    }
    for name in ("", "entry", "exit"):
        some = [(e, seconds) for e, seconds in matched if name in ("", e.kind)]
        totals[f"n{name}"] = len(some)
        totals[f"s{name}"] = sum(abs(seconds) for _, seconds in some)
        totals[f"m{name}"] = sum(abs(e.error_m) if e.error_m is not None else np.nan for e, _ in some)
    for radius in HIT_RADII_M:
        totals[f"hit_{radius:.2f}"] = sum(abs(e.error_m) <= radius if e.error_m is not None else np.nan
                                          for e, _ in matched)
    for name, value in zip(("over_hits", "over", "beside_hits", "beside"), score.windows, strict=True):
        totals[name] = value
    for index, value in enumerate(score.bins.ravel()):
        totals[f"bin_{index}"] = value
    return totals


def _totals_keys() -> list[str]:
    """The names of the numbers of `_totals`."""
    return list(_totals(FlightScore("", Condition(), (), (), 0, 0.0)))


def _statistics(sums: Sums) -> dict[str, np.ndarray]:
    """Every figure as a function of the sums, shapes (...,) in and out."""
    figures = {
        "mean_abs_error_m": _ratio(sums["m"], sums["n"]),
        "mean_abs_error_s": _ratio(sums["s"], sums["n"]),
        "mean_error_s": _ratio(sums["signed_s"], sums["n"]),
        "missed": _ratio(sums["missed"], sums["true"]),
        "false_per_minute": _ratio(sums["false"], sums["minutes"]),
        "balanced_accuracy": 0.5 * (
            _ratio(sums["over_hits"], sums["over"]) + _ratio(sums["beside_hits"], sums["beside"])),
    }
    for kind in ("entry", "exit"):
        for unit in ("m", "s"):
            figures[f"{kind}_mean_abs_error_{unit}"] = _ratio(sums[f"{unit}{kind}"], sums[f"n{kind}"])
    for radius in HIT_RADII_M:
        figures[f"hit_{radius:.2f}"] = _ratio(sums[f"hit_{radius:.2f}"], sums["true"])
    bins = np.stack([sums[f"bin_{i}"] for i in range(sum(k.startswith("bin_") for k in sums))], axis=-1)
    figures["ece"] = expected_calibration_error(bins.reshape(*bins.shape[:-1], -1, 3))
    return figures


def _ratio(numerator: np.ndarray, denominator: np.ndarray) -> np.ndarray:
    """Element by element, NaN where the denominator is 0."""
    numerator, denominator = np.asarray(numerator, float), np.asarray(denominator, float)
    return np.divide(numerator, denominator, out=np.full_like(numerator, np.nan), where=denominator > 0)


def _plain(value: float) -> float | None:
    """The value, None for NaN: JSON has no NaN."""
    return float(value) if np.isfinite(value) else None


def _pair(interval: tuple[float, float] | None) -> list[float] | None:
    """An interval as JSON holds it."""
    return None if interval is None else list(interval)
