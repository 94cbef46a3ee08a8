"""The look of every plot: colours, fonts, limits of an axis, and the PNG."""

import io
from collections.abc import Mapping
from contextlib import AbstractContextManager
from typing import Any, Literal, NamedTuple

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

GREEN, BLUE, RED, GREY = "#1a7f37", "#0b57d0", "#b3261e", "#8a8f98"
STYLE: dict[str, Any] = {"font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "axes.titlesize": 9}

TITLE_AT = 1.0  #: height of a title over the pane's: where it is not given, matplotlib lays the axes out twice


class Room(NamedTuple):
    """Room for labels and titles, inch: left of, below and above a pane, right of all, and at the top of all."""

    left_in: float
    below_in: float
    above_in: float
    right_in: float = 0.15
    top_in: float = 0.0


def panes(size_in: tuple[float, float], rows: int, columns: int, room: Room,
          sharey: Literal["none", "row"] = "none") -> tuple[Figure, np.ndarray]:
    """A figure of a fixed layout, and its panes (rows, columns): to find a layout, matplotlib draws twice.

    size_in: width and height, inch; room: below the lowest panes alone, as all share the x axis; sharey: whether the
    panes of a row have one y axis.
    """
    width_in, height_in = size_in
    pane_width_in = (width_in - room.right_in) / columns - room.left_in
    pane_height_in = (height_in - room.below_in - room.top_in) / rows - room.above_in
    grid = {"left": room.left_in / width_in, "right": 1.0 - room.right_in / width_in,
            "bottom": room.below_in / height_in, "top": 1.0 - (room.above_in + room.top_in) / height_in,
            "wspace": room.left_in / pane_width_in, "hspace": room.above_in / pane_height_in}
    figure = Figure(figsize=size_in)
    return figure, figure.subplots(rows, columns, sharex=True, sharey=sharey, squeeze=False, gridspec_kw=grid)


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
    """Set the y limits to hold the middle 99 % of each of the values, so that a hard landing does not set the scale.

    margin: above and below, as a fraction of that range. least: range of values that hardly differ. Values that are not
    finite do not count.
    """
    finite = [v[np.isfinite(v)] for v in values]
    ends = [np.percentile(v, [0.5, 99.5]) for v in finite if len(v)]
    if ends:
        low, high = np.min(ends), np.max(ends)
        pad = margin * max(high - low, least)
        ax.set_ylim(low - pad, high + pad)
