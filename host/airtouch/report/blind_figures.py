"""The result of a blind check: its figures beside the goals, and a picture."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from airtouch.report.style import BLUE, GREY, png, style

Rows = list[tuple[str, str, str, str]]  #: of a table of four columns, as text


def rows(score: Mapping[str, Any]) -> Rows:
    """Rows (figure, value with 95 % interval, n, goal) of a blind check's score, for the terminal and the docs."""
    out: Rows = []

    def add(name: str, figure: Mapping[str, Any] | None, goal: str = "") -> None:
        """Add the row of a figure that the score has: its value, with `low` and `high` where it has an interval."""
        if figure is None or figure.get("value") is None:
            return
        text = f"{figure['value']:.3f}"
        if "low" in figure:
            text = f"{figure['value']:.1%} ({figure['low']:.1%} to {figure['high']:.1%})"
        out.append((name, text, str(figure.get("n", "")), goal))

    add("top-1, single effects", score["top_1"], "at least 95 %")
    add("top-3, single effects", score["top_3"])
    for level, goal in (("weakest", "at least 80 %"), ("2x", ""), ("4x", "")):
        of_level = score["by_severity"].get(level, {})
        add(f"top-1, {level} severity", of_level.get("top_1"), goal)
        add(f"test for the true effect at its true strength, {level} severity", of_level.get("ideal"))
    add("exact set, single effects", score["exact"])
    add("false alarms, no effect", score["false_alarms"], "at most 2 %")
    add("pairs: exact set", score["pairs_exact"], "at least 80 %")
    add("pairs: one right", score["pairs_one_right"], "at least 97 %")
    for group, of_group in score["unknown"].items():
        goal_of_auroc, goal_of_names = ("at least 0.95", "at most 5 %") if group == "all" else ("", "")
        for key, condition in (("auroc", ""), ("auroc_told_apart", ", where the data tell the effects apart")):
            auroc = of_group.get(key)
            out.append((f"effect left out, {group}: AUROC of unknown{condition}",
                        "" if auroc is None else f"{auroc:.3f}", str(of_group["wrong_name"]["n"]), goal_of_auroc))
        add(f"effect left out, {group}: given a wrong name", of_group["wrong_name"])
        add(f"effect left out, {group}: the same where the data tell the two apart",
            of_group.get("wrong_name_told_apart"), goal_of_names)
    add("shrink with the right effect", score["shrink"]["right"], "at least 90 %")
    add("shrink with a wrong effect", score["shrink"]["wrong"], "at most 20 %")
    add("parameters: median relative error", score["parameters"]["error"], "at most 10 %")
    add("parameters: in the 90 % interval", score["parameters"]["coverage"], "85 to 95 %")
    return out


def effect_rows(score: Mapping[str, Any]) -> Rows:
    """Rows (effect, top-1, top-3, median parameter error), one for each kind of effect."""
    out: Rows = []
    for kind, part in score["by_effect"].items():
        error = score["parameters"]["by_effect"].get(kind)
        out.append((kind, *(f"{part[k]['hits']} of {part[k]['n']}" for k in ("top_1", "top_3")),
                    f"{error['error']:.0%} ({error['n']})" if error else ""))
    return out


def picture(score: Mapping[str, Any]) -> bytes:
    """PNG of the confusion matrix beside the reliability diagram."""
    with style():
        figure = Figure(figsize=(12.0, 7.6), layout="constrained")
        left, right = figure.subplots(1, 2, width_ratios=[1.7, 1.0])
        _draw_confusion(left, score["confusion"])
        _draw_reliability(right, score["reliability"])
        return png(figure)


def _draw_confusion(axes: Axes, table: Mapping[str, Mapping[str, int]]) -> None:
    """Flights by true effect, a row each, and first answer; shaded by their share of the row."""
    true = list(table)
    answers = sorted({a for v in table.values() for a in v} | set(true))
    counts = np.array([[table[t].get(a, 0) for a in answers] for t in true], float).reshape(len(true), len(answers))
    shown = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1.0)
    axes.imshow(shown, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
    for i, j in zip(*np.nonzero(counts), strict=True):
        axes.text(j, i, f"{counts[i, j]:.0f}", ha="center", va="center", fontsize=7,
                  color="white" if shown[i, j] > 0.6 else "black")
    axes.set_xticks(range(len(answers)), answers, rotation=90)
    axes.set_yticks(range(len(true)), true)
    axes.set_xlabel("answered first")
    axes.set_title("flights by true effect (rows) and first answer", loc="left")


def _draw_reliability(axes: Axes, points: Sequence[Mapping[str, float]]) -> None:
    """How often answers of a probability were right, beside the diagonal of a calibrated answer."""
    p, share = (np.array([b[k] for b in points], float) for k in ("probability", "value"))
    bars = np.maximum([share - [b["low"] for b in points], [b["high"] for b in points] - share], 0.0)
    axes.plot([0, 1], [0, 1], color=GREY, lw=0.8)
    axes.errorbar(p, share, bars, fmt="o", color=BLUE, ms=4, lw=1)
    for b in points:
        axes.annotate(f"{b['n']}", (b["probability"], b["value"]), xytext=(5, -9), textcoords="offset points",
                      fontsize=7, color=GREY)
    axes.set(xlim=(0, 1), ylim=(0, 1.02), xlabel="probability of the first answer",
             ylabel="share that was right, 95 % interval")
    axes.set_title("reliability (numbers: flights)", loc="left")
