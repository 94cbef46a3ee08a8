"""Plots of a twin beside the recorded flights, each as a matplotlib figure."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from airtouch.parameters import SAMPLE_RATE_HZ
from airtouch.report.style import BLUE, GREEN, GREY, TITLE_AT, Room, panes, style
from airtouch.twin.comparison.curves import AFTER, BEFORE, AroundEdges, Signals
from airtouch.twin.recorded import channels as ch
from airtouch.twin.recorded.channels import NAMES, UNITS
from airtouch.twin.recorded.features import BANDS_HZ, CLASSES

WIDTH_IN = 7.2  #: inch, width of a plot
ROOM = Room(left_in=0.6, below_in=0.5, above_in=0.3)
#: (label, colour) of each of a pair
SOURCES = (("recorded", GREEN), ("simulated", BLUE))


def overlaid(pair: tuple[Signals, Signals]) -> Figure:
    """All twelve channels of a recorded flight and its twin, from 2 s before the entry to 2 s after the exit."""
    with style():
        figure, axes = panes((WIDTH_IN, 10.5), 6, 2, ROOM)
        for k, axis in enumerate(axes.T.ravel()):
            for flight, (label, colour) in zip(pair, SOURCES, strict=True):
                axis.plot(flight.time_s, flight.channels[:, k], color=colour, lw=0.7, label=label)
            axis.set_title(f"{NAMES[k]}, {UNITS[k]}", loc="left", y=TITLE_AT)
            axis.axvline(0.0, color=GREY, lw=0.6)
        axes[0, 0].legend(frameon=False)
        for axis in axes[-1]:
            axis.set_xlabel("s after the entry")
    return figure


def edges(kinds: dict[str, tuple[AroundEdges, AroundEdges]]) -> Figure:
    """The twelve channels around the edges of one height class, entry beside exit, as quartiles over flights.

    kinds: by kind of edge the recorded and the simulated flights.
    """
    time = (np.arange(BEFORE + AFTER) - BEFORE) / SAMPLE_RATE_HZ
    with style():
        figure, axes = panes((WIDTH_IN, 15.0), len(NAMES), 2, ROOM, sharey="row")
        for column, (kind, pair) in enumerate(kinds.items()):
            for around, (label, colour) in zip(pair, SOURCES, strict=True):
                for k, axis in enumerate(axes[:, column]):
                    _quartiles(axis, time, around.quartiles[:, :, k], colour, f"{label}, {around.flights} flights")
                    axis.axvline(0.0, color=GREY, lw=0.6)
                    axis.set_title(f"{kind}: {NAMES[k]}, {UNITS[k]}", loc="left", y=TITLE_AT)
        axes[0, 0].legend(frameon=False)
        for axis in axes[-1]:
            axis.set_xlabel("s after the edge")
    return figure


def spectra(pair: tuple[np.ndarray, np.ndarray]) -> Figure:
    """Band powers in free air of eleven channels, as quartiles over flights.

    pair: quartiles of the recorded and of the simulated flights, (3, 11, bands) each, dB.
    """
    place = np.arange(len(BANDS_HZ))
    with style():
        figure, grid = panes((WIDTH_IN, 9.0), 4, 3, ROOM._replace(below_in=0.8))
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
    return figure


def _quartiles(axis: Axes, x: np.ndarray, quartiles: np.ndarray, colour: str, label: str) -> None:
    """Draw the median as a line in a band from the first to the third quartile. quartiles (3, n): at places x (n,)."""
    low, median, high = quartiles
    axis.plot(x, median, color=colour, lw=1.0, label=label)
    axis.fill_between(x, low, high, color=colour, alpha=0.15, lw=0)


def class_in_words(name: str) -> str:
    """A height class and its bounds, as text."""
    low, high = CLASSES[name]
    return f"{name}: {100 * low:g} to {100 * high:g} cm of down range over the platform"
