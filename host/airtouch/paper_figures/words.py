"""Values with intervals as text, and the rules by which a claim counts as reproduced."""

from collections.abc import Mapping
from typing import Any

from airtouch.paper_figures.claims import NOT_REPRODUCED, REPRODUCED
from airtouch.paper_figures.figure import Verdict

MOST_MISSED = 0.10  #: fraction of missed edges above which the mean error of the others is not compared


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


def reaches(row: Mapping[str, Any], error_m: float) -> bool:
    """True if the 95 % interval of the mean error reaches the paper's error, with MOST_MISSED missed at most."""
    interval = row["intervals"]["mean_abs_error_m"]
    value = row["mean_abs_error_m"]
    if value is None or row["missed"] > MOST_MISSED:
        return False
    return (interval[0] if interval else value) <= error_m


def worse(first: dict, second: dict) -> bool:
    """True if the second has a larger error or more misses than the first, with disjoint 95 % intervals."""
    return any(a is not None and b is not None and b[0] > a[1]
               for a, b in ((first["intervals"][k], second["intervals"][k]) for k in ("mean_abs_error_m", "missed")))


def verdict(yes: bool, evidence: str) -> Verdict:
    """The verdict "reproduced" or "not reproduced", with the figures behind it."""
    return Verdict(REPRODUCED if yes else NOT_REPRODUCED, evidence)


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
