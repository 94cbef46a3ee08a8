"""The look of every plot: colours, fonts, limits of an axis, and the PNG."""

import io
from collections.abc import Mapping
from contextlib import AbstractContextManager
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

GREEN, BLUE, RED, GREY = "#1a7f37", "#0b57d0", "#b3261e", "#8a8f98"
STYLE: dict[str, Any] = {"font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "axes.titlesize": 9}


def style(changes: Mapping[str, Any] | None = None) -> AbstractContextManager[None]:
    """A context in which matplotlib draws with STYLE, and with these changes of it."""
    look: Any = {**STYLE, **(changes or {})}
    return matplotlib.rc_context(look)


def png(figure: Figure, dots_per_inch: float = 120) -> bytes:
    """The figure as a PNG."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=dots_per_inch)
    return buffer.getvalue()


def limit(ax: Axes, *values: np.ndarray, margin: float = 0.15, least: float = 1e-9) -> None:
    """Set the y limits from the middle 99 % of the values, so that a hard landing does not set the scale.

    margin: above and below, as a fraction of that range. least: range of values that hardly differ. Values that are not
    finite do not count.
    """
    joined = np.concatenate([np.ravel(v) for v in values])
    joined = joined[np.isfinite(joined)]
    if len(joined):
        low, high = np.percentile(joined, [0.5, 99.5])
        pad = margin * max(high - low, least)
        ax.set_ylim(low - pad, high + pad)
