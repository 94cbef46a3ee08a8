"""The look of every plot: colours, fonts, panes, limits of an axis; and the image file that a figure becomes.

A plot is a function that returns a matplotlib `Figure`, drawn without pyplot: it needs no display, and none stays open.
"""

import io
import os
from collections.abc import Mapping
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backend_bases import RendererBase
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from airtouch.errors import AirTouchError
from airtouch.logs.files import write_bytes

GREEN, BLUE, RED, GREY = "#1a7f37", "#0b57d0", "#b3261e", "#8a8f98"
STYLE: dict[str, Any] = {"font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "axes.titlesize": 9,
                         "figure.dpi": 120}
#: image formats, with the metadata of each: no date, so that equal figures are equal files
FORMATS: dict[str, dict[str, None]] = {"png": {}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}
#: of a file: names in an SVG that do not change, and fonts in a PDF that journals take (TrueType)
FILE_STYLE: Any = {"svg.hashsalt": "airtouch", "pdf.fonttype": 42}

OUTSIDE = 3  #: zorder of the marks of what is outside a pane, above that of lines, 2
MARK = "outside"  #: gid of these marks
LEAST_OUTSIDE = 1e-9  #: of a pane's size: what lies less far outside is on its edge, but for rounding
TITLE_AT = 1.0  #: height of a title over the pane's: where it is not given, matplotlib lays the axes out twice


class Room(NamedTuple):
    """Room for labels and titles, inch: left of, below and above a pane, right of all, and at the top of all."""

    left_in: float
    below_in: float
    above_in: float
    right_in: float = 0.15
    top_in: float = 0.0


class PlotFigure(Figure):
    """A figure whose files have FILE_STYLE, whoever saves them, and whose panes leave their room at any size."""

    room: Room | None = None  #: of its panes, where their layout is fixed
    grid = (1, 1)  #: rows and columns of these panes

    def savefig(self, fname: Any, **settings: Any) -> None:
        """Save it as `Figure.savefig` does.

        A page of matplotlib's `PdfPages` has the fonts that are set where these are closed: there FILE_STYLE would mix
        two kinds, and is left out.
        """
        a_file = isinstance(fname, (str, os.PathLike, io.IOBase))
        with matplotlib.rc_context(FILE_STYLE if a_file else {}):
            super().savefig(fname, **settings)

    def set_size_inches(self, *args: Any, **settings: Any) -> None:
        """Set the size as `Figure.set_size_inches` does; panes with fixed room are laid out anew."""
        super().set_size_inches(*args, **settings)
        self.leave_room()

    def leave_room(self) -> None:
        """Lay the panes out in the room that is left, if their layout is fixed and there is any."""
        if self.room is None:
            return
        width_in, height_in = self.get_size_inches()
        rows, columns = self.grid
        pane_width_in = (width_in - self.room.right_in) / columns - self.room.left_in
        pane_height_in = (height_in - self.room.below_in - self.room.top_in) / rows - self.room.above_in
        if pane_width_in > 0.0 and pane_height_in > 0.0:
            self.subplots_adjust(
                left=self.room.left_in / width_in, right=1.0 - self.room.right_in / width_in,
                bottom=self.room.below_in / height_in,
                top=1.0 - (self.room.above_in + self.room.top_in) / height_in,
                wspace=self.room.left_in / pane_width_in, hspace=self.room.above_in / pane_height_in)


def panes(size_in: tuple[float, float], rows: int = 1, columns: int = 1, room: Room | None = None,
          **subplots: Any) -> tuple[Figure, np.ndarray]:
    """A figure, and its panes (rows, columns).

    size_in: width and height, inch. room: fixes the layout, and all panes share the x axis, so that there is room below
    the lowest alone; without, matplotlib finds the layout, for which it draws twice. subplots: as in `Figure.subplots`.
    """
    figure = PlotFigure(figsize=size_in, layout=None if room else "constrained")
    figure.room, figure.grid = room, (rows, columns)
    figure.leave_room()
    if room:
        subplots = {"sharex": True, **subplots}
    axes = figure.subplots(rows, columns, squeeze=False, **subplots)
    for ax in axes.flat:  # as many ticks as fit are made when the figure is saved, by then without the style
        ax.tick_params(which="both", labelsize=matplotlib.rcParams["font.size"])
    return figure, axes


def style(changes: Mapping[str, Any] | None = None) -> AbstractContextManager[None]:
    """A context in which matplotlib draws with STYLE, and with these changes of it."""
    look: Any = {**STYLE, **(changes or {})}
    return matplotlib.rc_context(look)


def image(figure: Figure, form: str = "png") -> bytes:
    """The figure as the bytes of an image file, in one of FORMATS."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format=form, metadata=FORMATS[form])
    return buffer.getvalue()


def write_image(figure: Figure, path: Path, force: bool = False) -> None:
    """Write the figure as PNG, SVG or PDF, by the ending of the name.

    Raises AirTouchError as `format_of`, and as `logs.files.write_bytes`.
    """
    write_bytes(image(figure, format_of(path)), path, force)


def format_of(path: Path) -> str:
    """The one of FORMATS that the ending of a file's name says; raises AirTouchError for another ending."""
    ending = path.suffix.lower().removeprefix(".")
    if ending not in FORMATS:
        raise AirTouchError(f"{path}: a plot is written as .png, .svg or .pdf; give a name with one of these endings")
    return ending


def limit(ax: Axes, *values: np.ndarray, margin: float = 0.15, least: float = 1e-9) -> None:
    """Set the y limits to hold the middle 99 % of each of the values, so that a hard landing does not set the scale.

    Where a line of the pane leaves these limits, or others that are set later, a triangle at the pane's edge marks it.
    margin: above and below, as a fraction of that range. least: range of values that hardly differ. Values that are not
    finite do not count.
    """
    finite = [v[np.isfinite(v)] for v in values]
    ends = [np.percentile(v, [0.5, 99.5]) for v in finite if len(v)]
    if ends:
        low, high = np.min(ends), np.max(ends)
        pad = margin * max(high - low, least)
        ax.set_ylim(low - pad, high + pad)
        ax.add_artist(OutsideMarks())


class OutsideMarks(Artist):
    """The marks of where the lines of a pane leave it, found anew whenever the pane is drawn.

    So they fit whatever lines and limits the pane has by then. They take no room in a layout.
    """

    def __init__(self) -> None:
        super().__init__()
        self.set(zorder=OUTSIDE, in_layout=False, clip_on=False)

    def draw(self, renderer: RendererBase) -> None:
        """Draw them."""
        if self.get_visible() and isinstance(self.axes, Axes):
            for mark in marks_outside(self.axes):
                mark.set_figure(self.axes.figure)
                mark.draw(renderer)


def marks_outside(ax: Axes) -> list[Line2D]:
    """Triangles at a pane's edges, for each stretch of a line above or below the pane one where it is farthest out.

    Of a line, only what lies between the limits in x counts.
    """
    marks = []
    for line in ax.get_lines():
        if not line.get_visible() or line.get_transform() != ax.transData:
            continue
        x, height = (ax.transScale + ax.transLimits).transform(line.get_xydata()).T  # 0 to 1 within the pane
        within = (x > -LEAST_OUTSIDE) & (x < 1.0 + LEAST_OUTSIDE)
        for edge, marker, beyond in ((1.0, "^", height - 1.0), (0.0, "v", -height)):
            bounds = np.flatnonzero(np.diff(within & (beyond > LEAST_OUTSIDE), prepend=False, append=False))
            farthest = [a + int(np.argmax(beyond[a:b])) for a, b in bounds.reshape(-1, 2)]
            if farthest:
                marks.append(Line2D(x[farthest], np.full(len(farthest), edge), linestyle="", marker=marker, gid=MARK,
                                    transform=ax.transAxes, color=line.get_color(), ms=4, mew=0))
    return marks
