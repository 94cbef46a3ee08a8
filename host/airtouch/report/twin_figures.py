"""Plots of a twin beside the recorded flights, each as the bytes of a PNG."""

from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from airtouch.parameters import SAMPLE_RATE_HZ
from airtouch.report.style import BLUE, GREEN, GREY, png, style
from airtouch.twin.comparison.curves import AFTER, BEFORE, AroundEdges, Signals
from airtouch.twin.recorded import channels as ch
from airtouch.twin.recorded.channels import NAMES, UNITS
from airtouch.twin.recorded.features import BANDS_HZ, CLASSES

WIDTH_IN = 7.2  #: inch, width of a plot
#: inch, room left of, below and above a pane, for tick labels, the axis' label and the title; and right of all
LEFT_IN, BELOW_IN, ABOVE_IN, RIGHT_IN = 0.6, 0.5, 0.3, 0.15
TITLE_AT = 1.0  #: height of a title over the pane's: where it is not given, matplotlib lays the axes out twice
#: (label, colour) of each of a pair
SOURCES = (("recorded", GREEN), ("simulated", BLUE))


def overlaid(pair: tuple[Signals, Signals]) -> bytes:
    """PNG of all twelve channels of a recorded flight and its twin, from 2 s before the entry to 2 s after the exit."""
    with style():
        figure, axes = _panes(6, 2, 10.5)
        for k, axis in enumerate(axes.T.ravel()):
            for flight, (label, colour) in zip(pair, SOURCES, strict=True):
                axis.plot(flight.time_s, flight.channels[:, k], color=colour, lw=0.7, label=label)
            axis.set_title(f"{NAMES[k]}, {UNITS[k]}", loc="left", y=TITLE_AT)
            axis.axvline(0.0, color=GREY, lw=0.6)
        axes[0, 0].legend(frameon=False)
        for axis in axes[-1]:
            axis.set_xlabel("s after the entry")
        return png(figure)


def edges(kinds: dict[str, tuple[AroundEdges, AroundEdges]]) -> bytes:
    """PNG of the twelve channels around the edges of one height class, entry beside exit, as quartiles over flights.

    kinds: by kind of edge the recorded and the simulated flights.
    """
    time = (np.arange(BEFORE + AFTER) - BEFORE) / SAMPLE_RATE_HZ
    with style():
        figure, axes = _panes(len(NAMES), 2, 15.0, sharey="row")
        for column, (kind, pair) in enumerate(kinds.items()):
            for around, (label, colour) in zip(pair, SOURCES, strict=True):
                for k, axis in enumerate(axes[:, column]):
                    _quartiles(axis, time, around.quartiles[:, :, k], colour, f"{label}, {around.flights} flights")
                    axis.axvline(0.0, color=GREY, lw=0.6)
                    axis.set_title(f"{kind}: {NAMES[k]}, {UNITS[k]}", loc="left", y=TITLE_AT)
        axes[0, 0].legend(frameon=False)
        for axis in axes[-1]:
            axis.set_xlabel("s after the edge")
        return png(figure)


def spectra(pair: tuple[np.ndarray, np.ndarray]) -> bytes:
    """PNG of band powers in free air of eleven channels, as quartiles over flights.

    pair: quartiles of the recorded and of the simulated flights, (3, 11, bands) each, dB.
    """
    place = np.arange(len(BANDS_HZ))
    with style():
        figure, grid = _panes(4, 3, 9.0, below_in=0.8)
        axes = grid.ravel()
        for k in range(ch.DOWN):
            for quartiles, (label, colour) in zip(pair, SOURCES, strict=True):
                _quartiles(axes[k], place, quartiles[:, k], colour, label)
            axes[k].set_title(f"{NAMES[k]}, dB", loc="left", y=TITLE_AT)
        axes[0].legend(frameon=False)
        axes[-1].set_axis_off()
        for axis in axes[8:11]:
            axis.set_xticks(place, [f"{a:g}-{b:g}" for a, b in BANDS_HZ], rotation=90)
            axis.tick_params(labelbottom=True)  # also of the pane above the empty one
            axis.set_xlabel("Hz")
        return png(figure)


def _panes(rows: int, columns: int, height_in: float, below_in: float = BELOW_IN,
           sharey: Literal["none", "row"] = "none") -> tuple[Figure, np.ndarray]:
    """A figure of a fixed layout, and its panes (rows, columns): to find a layout takes matplotlib seconds.

    below_in: room below the lowest panes, inch; sharey: whether the panes of a row have one y axis.
    """
    figure = Figure(figsize=(WIDTH_IN, height_in))
    pane_width_in = (WIDTH_IN - RIGHT_IN) / columns - LEFT_IN
    pane_height_in = (height_in - below_in) / rows - ABOVE_IN
    grid = {"left": LEFT_IN / WIDTH_IN, "right": 1.0 - RIGHT_IN / WIDTH_IN, "bottom": below_in / height_in,
            "top": 1.0 - ABOVE_IN / height_in, "wspace": LEFT_IN / pane_width_in, "hspace": ABOVE_IN / pane_height_in}
    return figure, figure.subplots(rows, columns, sharex=True, sharey=sharey, squeeze=False, gridspec_kw=grid)


def _quartiles(axis: Axes, x: np.ndarray, quartiles: np.ndarray, colour: str, label: str) -> None:
    """Draw the median as a line in a band from the first to the third quartile. quartiles (3, n): at places x (n,)."""
    low, median, high = quartiles
    axis.plot(x, median, color=colour, lw=1.0, label=label)
    axis.fill_between(x, low, high, color=colour, alpha=0.15, lw=0)


def class_in_words(name: str) -> str:
    """A height class and its bounds, as text."""
    low, high = CLASSES[name]
    return f"{name}: {100 * low:g} to {100 * high:g} cm of down range over the platform"
