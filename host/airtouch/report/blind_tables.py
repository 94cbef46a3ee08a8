"""The tables of a blind check: its figures beside the goals, for the terminal and the docs."""

from collections.abc import Iterable, Mapping
from typing import Any

from airtouch.gap.sealed.score import GOALS, SEVERITIES

Rows = list[tuple[str, str, str, str]]  #: of a table of four columns, as text
APART = "where the data tell the effects apart"


def score_rows(score: Mapping[str, Any]) -> Rows:
    """Rows (figure, value with 95 % interval, n, goal) of a blind check's score, for the terminal and the docs.

    A figure without a value has no row; an AUROC without one has, so that the row after it is not read as its own.
    """
    out: Rows = []
    for name, place in figures_shown(score["unknown"]):
        figure = _figure_at(score, place)
        if figure.get("value") is not None or "auroc" in place:
            out.append((name, _in_words(figure), str(figure.get("n", "")), GOALS.get(place, "")))
    return out


def figures_shown(left_out: Iterable[str]) -> list[tuple[str, str]]:
    """(name, place in the score with "/" between keys) of the figures of the table, in its order.

    left_out: groups of flights whose effect was left out, keys of the score's `unknown`.
    """
    shown = [("top-1, single effects", "top_1"), ("top-3, single effects", "top_3"),
             ("right rotor or loop, where the first answer is right", "right_variant")]
    for level in SEVERITIES:
        shown += [(f"top-1, {level} severity", f"by_severity/{level}/top_1"),
                  (f"test for the true effect at its true strength, {level} severity", f"by_severity/{level}/ideal")]
    shown += [(f"{level} severity: less than that, as no more is plausible", f"by_severity/{level}/capped")
              for level in SEVERITIES[1:]]
    shown += [("exact set, single effects", "exact"), ("false alarms, no effect", "false_alarms"),
              ("pairs: exact set", "pairs_exact"), ("pairs: one right", "pairs_one_right")]
    for group in left_out:
        name, place = f"effect left out, {group}", f"unknown/{group}"
        shown += [(f"{name}: AUROC of unknown", f"{place}/auroc"),
                  (f"{name}: AUROC of unknown, {APART}", f"{place}/auroc_told_apart"),
                  (f"{name}: given a wrong name", f"{place}/wrong_name"),
                  (f"{name}: the same where the data tell the two apart", f"{place}/wrong_name_told_apart")]
    return [*shown, ("shrink with the right effect", "shrink/right"), ("shrink with a wrong effect", "shrink/wrong"),
            ("parameters: median relative error", "parameters/error"),
            ("the same, a wrong rotor or loop as 100 %", "parameters/error_with_variant"),
            ("parameters: in the 90 % interval", "parameters/coverage"),
            ("the same, a wrong rotor or loop as outside", "parameters/coverage_with_variant")]


def _figure_at(score: Mapping[str, Any], place: str) -> Mapping[str, Any]:
    """The figure at a place of the score; empty where there is none.

    An AUROC has the n of the same flights' wrong names.
    """
    *keys, last = place.split("/")
    group: Mapping[str, Any] = score
    for key in keys:
        group = group.get(key, {})
    if last.startswith("auroc"):
        return {"value": group.get(last), "n": group[last.replace("auroc", "wrong_name")]["n"]}
    return group.get(last) or {}


def _in_words(figure: Mapping[str, Any]) -> str:
    """The value of a figure, as a percentage with its interval where it has one; empty without a value."""
    if figure["value"] is None:
        return ""
    if "low" in figure:
        return f"{figure['value']:.1%} ({figure['low']:.1%} to {figure['high']:.1%})"
    return f"{figure['value']:.3f}"


def effect_rows(score: Mapping[str, Any]) -> Rows:
    """Rows (effect, top-1, top-3, median parameter error), one for each kind of effect, right by the effect's name."""
    out: Rows = []
    for kind, part in score["by_effect"].items():
        error = score["parameters"]["by_effect"].get(kind)
        out.append((kind, *(f"{part[k]['hits']} of {part[k]['n']}" for k in ("top_1", "top_3")),
                    f"{error['error']:.0%} ({error['n']})" if error else ""))
    return out
