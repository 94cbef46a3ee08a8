"""Values with intervals as text, and the rules by which a claim counts as reproduced."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from airtouch.detector.evaluation import summary
from airtouch.detector.evaluation.score import FlightScore
from airtouch.paper_figures.claims import NOT_REPRODUCED, REPRODUCED, UNDECIDED
from airtouch.paper_figures.figure import Verdict

Gain: TypeAlias = tuple[float | None, tuple[float, float] | None]  #: a fraction and its 95 % interval; None: unknown

MOST_MISSED = 0.10  #: fraction of missed edges above which the mean error of the others is not compared
#: Margins within which the 95 % interval of a difference must lie for "the same" or "reached". No source: chosen.
ERROR_MARGIN = 0.25  #: of a mean error or a power, as a fraction of it
COUNT_MARGIN = 0.10  #: of a count without an interval (bytes, operations), as a fraction of the paper's
SHARE_MARGIN = 0.10  #: of a share: of edges missed, of edges within a distance


def metres(row: Mapping[str, Any]) -> str:
    """`0.018 m [0.013, 0.024]`, the mean error of a summary with its 95 % interval."""
    value, interval = row["mean_abs_error_m"], row["intervals"]["mean_abs_error_m"]
    if value is None:
        return "no edge found"
    return f"{value:.3f} m" + (f" [{interval[0]:.3f}, {interval[1]:.3f}]" if interval else "")


def percent(value: float | None, interval: tuple[float, float] | list[float] | None = None) -> str:
    """A fraction with its interval as `2.9 % [0, 6.9]`."""
    if value is None:
        return "-"
    text = f"{100 * value:.1f} %"
    return text if interval is None else f"{text} [{100 * interval[0]:.1f}, {100 * interval[1]:.1f}]"


def misses(row: Mapping[str, Any]) -> str:
    """`2.9 % of 174 missed [0, 6.9]`."""
    interval = row["intervals"]["missed"]
    text = f"{percent(row['missed'])} of {row['edges']} missed"
    return text if interval is None else f"{text} [{100 * interval[0]:.1f}, {100 * interval[1]:.1f}]"


def score(row: Mapping[str, Any]) -> str:
    """Error, misses and false edges side by side; "-" where the number of false edges is unknown."""
    false = row["false_per_minute"]
    return f"{metres(row)}, {misses(row)}, {'-' if false is None else f'{false:.1f}'} false a minute"


def reaches(row: Mapping[str, Any], error_m: float) -> bool | None:
    """Whether the mean error is as small as the paper's, with MOST_MISSED missed at most; None for undecided.

    Yes: the 95 % interval ends within ERROR_MARGIN above the paper's error. No: it begins above the paper's error, or
    every edge is missed. Flights without an edge say neither.
    """
    if not row["edges"]:
        return None
    interval, value = row["intervals"]["mean_abs_error_m"], row["mean_abs_error_m"]
    if value is None or row["missed"] > MOST_MISSED or (interval or (value,))[0] > error_m:
        return False
    return True if interval and interval[1] <= (1.0 + ERROR_MARGIN) * error_m else None


def worse(first: Mapping[str, Any], second: Mapping[str, Any]) -> bool | None:
    """Whether the second has a larger error or more misses than the first; None for undecided.

    Yes: the 95 % intervals of either are disjoint. No: the second's ends within the margin (ERROR_MARGIN of the first's
    error, SHARE_MARGIN) above the beginning of the first's, in both.
    """
    answers = []
    for key, margin in (("mean_abs_error_m", ERROR_MARGIN * (first["mean_abs_error_m"] or 0.0)),
                        ("missed", SHARE_MARGIN)):
        a, b = first["intervals"][key], second["intervals"][key]
        answers.append(None if a is None or b is None else decided(b[0] > a[1], b[1] - a[0] <= margin))
    return any_of(answers)


def gain(rows: Mapping[str, Any], scores: Mapping[str, Sequence[FlightScore]], name: str, other: str) -> Gain:
    """How much less the error of `name` is than that of `other`, as a fraction, with its 95 % interval by flight.

    rows, scores: summary and scores of the same flights, by name. (None, None) where either detects no edge.
    """
    ours, theirs = (rows[n]["mean_abs_error_m"] for n in (name, other))
    if ours is None or not theirs:
        return None, None
    interval = summary.paired(scores[name], scores[other], lambda first, second: {
        "gain": 1.0 - first["mean_abs_error_m"] / second["mean_abs_error_m"]})
    return 1.0 - ours / theirs, interval["gain"]


def gained(reduction: Gain, least: float, below: float) -> bool | None:
    """Whether a `gain` is enough: yes if its interval begins at `least` or above, no if it ends under `below`."""
    low, high = reduction[1] or (np.nan, np.nan)
    return decided(low >= least, high < below)


def near(value: float, published: float) -> bool:
    """Whether a count lies within COUNT_MARGIN of the paper's."""
    return abs(value - published) <= COUNT_MARGIN * published


def decided(yes: bool, no: bool) -> bool | None:
    """True for yes, False for no and not yes, None for neither."""
    return True if yes else False if no else None


def any_of(answers: Iterable[bool | None]) -> bool | None:
    """True if any answer is True, False if all are False, else None: undecided."""
    answers = list(answers)
    return decided(any(a is True for a in answers), all(a is False for a in answers))


def all_of(answers: Iterable[bool | None]) -> bool | None:
    """False if any answer is False, True if all are True, else None: undecided."""
    return inverse(any_of(inverse(a) for a in answers))


def inverse(answer: bool | None) -> bool | None:
    """The opposite answer; undecided stays undecided."""
    return None if answer is None else not answer


def verdict(answer: bool | None, evidence: str, judged: str = Verdict.judged) -> Verdict:
    """The verdict "reproduced", "not reproduced", or for None "undecided", with the figures behind it."""
    return Verdict(UNDECIDED if answer is None else REPRODUCED if answer else NOT_REPRODUCED, evidence, judged)


def table_row(name: str, row: Mapping[str, Any], **more: Any) -> dict[str, Any]:
    """A row of a table of scores: the common columns, and `more`."""
    def pair(key: str) -> tuple[float | None, float | None]:
        return tuple(row["intervals"][key] or (None, None))

    low, high = pair("mean_abs_error_m")
    missed_low, missed_high = pair("missed")
    hit = row["hit"]["0.05"]
    hit_low, hit_high = row["intervals"]["hit"]["0.05"] or (None, None)
    return {"what": name, **more, "flights": row["flights"], "edges": row["edges"],
            "mean_abs_error_m": row["mean_abs_error_m"], "error_low_m": low, "error_high_m": high,
            "missed": row["missed"], "missed_low": missed_low, "missed_high": missed_high,
            "within_0.05_m": hit, "within_low": hit_low, "within_high": hit_high,
            "false_per_minute": row["false_per_minute"], "balanced_accuracy": row["balanced_accuracy"]}
