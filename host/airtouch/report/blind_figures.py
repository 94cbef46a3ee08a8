"""The plot of a blind check, as a matplotlib figure."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from airtouch.report.style import BLUE, GREY, panes, style


def confusion_and_reliability(score: Mapping[str, Any]) -> Figure:
    """The confusion matrix beside the reliability diagram."""
    with style():
        figure, ((confusion, reliability),) = panes((12.0, 7.6), columns=2, width_ratios=[1.7, 1.0])
        _draw_confusion(confusion, score["confusion"])
        _draw_reliability(reliability, score["reliability"])
    return figure


def _draw_confusion(axes: Axes, table: Mapping[str, Mapping[str, int]]) -> None:
    """Flights by true effect, a row each, and first answer; shaded by their fraction of the row."""
    true = list(table)
    answers = sorted({a for v in table.values() for a in v} | set(true))
    counts = np.array([[table[t].get(a, 0) for a in answers] for t in true], float).reshape(len(true), len(answers))
    shown = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1.0)
    axes.imshow(shown, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
    for i, j in zip(*np.nonzero(counts), strict=True):
        axes.text(j, i, f"{counts[i, j]:.0f}", ha="center", va="center", fontsize=7, clip_on=True,
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
    axes.errorbar(p, share, bars, fmt="o", color=BLUE, ms=4, lw=1, clip_on=False)
    for b in points:
        axes.annotate(f"{b['n']}", (b["probability"], b["value"]), xytext=(5, -9), textcoords="offset points",
                      fontsize=7, color=GREY)
    axes.set(xlim=(0, 1), ylim=(0, 1.02), xlabel="probability of the first answer",
             ylabel="fraction that was right, 95 % interval")
    axes.set_title("reliability (numbers: flights)", loc="left")
