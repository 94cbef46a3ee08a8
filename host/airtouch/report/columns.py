"""The columns of score tables, on the terminal and in reports."""

from typing import Any, NamedTuple

#: column -> (path in the summary, format); misses and false edges always stand beside the error
COLUMNS = {
    "missed": ("missed", "{:.0%}"),
    "false/min": ("false_per_minute", "{:.1f}"),
    "mean |error|, m": ("mean_abs_error_m", "{:.3f}"),
    "s": ("mean_abs_error_s", "{:.2f}"),
    "in 0.05 m": ("hit/0.05", "{:.0%}"),
    "in 0.10 m": ("hit/0.10", "{:.0%}"),
    "in 0.25 m": ("hit/0.25", "{:.0%}"),
    "balanced": ("balanced_accuracy", "{:.0%}"),
    "ECE": ("ece", "{:.2f}"),
}


class WithInterval(NamedTuple):
    """A number as text, and its interval as text, "" where there is none."""

    value: str
    interval: str = ""


def cell(table: dict[str, Any], key: str, form: str) -> WithInterval:
    """A figure of a summary with its interval; "-" for None.

    table: the summary, with `intervals`; key: path in it, with "/" between keys; form: format of the number.
    """
    value, interval = _value_at(table, key), _value_at(table["intervals"], key)
    if value is None:
        return WithInterval("-")
    bounds = [] if interval is None else [form.format(bound) for bound in interval]
    return WithInterval(form.format(value), " - ".join(bounds))


def _value_at(source: Any, path: str) -> Any:
    """The value of nested tables at a path of keys with "/" between them."""
    for key in path.split("/"):
        source = source[key]
    return source
