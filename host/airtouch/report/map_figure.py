"""The plot of an edge map."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon as PolygonPatch
from shapely.geometry import LineString, Point
from shapely.plotting import patch_from_polygon

from airtouch.detector.evaluation.edge_map import EdgeMap, Platform
from airtouch.report.style import BLUE, GREEN, GREY, RED, panes, style

STRIP_M = 0.3  #: m, drawn width of a platform that was crossed once; its true width is unknown
COLOURS = {"entry": BLUE, "exit": RED, "edge": GREEN}


def edge_map(edges: EdgeMap, title: str) -> Figure:
    """The track, the edges with 2-sigma bars along the track, platforms and a scale bar, as a matplotlib figure."""
    xy = edges.xy
    with style():
        figure, ((ax,),) = panes((7.2, 5.0))
        ax.grid(color="#e5e7eb", lw=0.6, zorder=0)
        ax.plot(*xy.T, color=GREY, lw=0.9, label="track")
        _ends(ax, xy)
        for platform in edges.platforms:
            _draw_platform(ax, platform)
        _draw_points(ax, edges)
        _room_below(ax, xy)
        ax.set(xlabel="x, m", ylabel="y, m", title=title, aspect="equal", adjustable="datalim")
        handles, labels = ax.get_legend_handles_labels()
        unique = dict(zip(labels, handles, strict=True))
        figure.legend(unique.values(), unique.keys(), loc="outside lower center", ncols=5, frameon=False)
        _scale_bar(ax)
        figure.draw_without_rendering()  # the limits grow to fill the pane
        ax.set_adjustable("box")  # those that are set later hold
    return figure


def _draw_platform(ax: Axes, platform: Platform) -> None:
    """Draw the outline with its 2-sigma band, or a strip where a single pass crossed the platform, and both sides."""
    sides = (platform.near_side, platform.far_side)
    if platform.outline is not None:
        ax.add_patch(patch_from_polygon(platform.outline, facecolor=GREEN, alpha=0.12, lw=0, label="platform"))
        band = platform.outline.boundary.buffer(2 * platform.sigma_m)
        ax.add_patch(patch_from_polygon(band, facecolor=GREEN, alpha=0.15, lw=0, label="outline, ±2 sigma"))
        ax.plot(*np.array(platform.outline.exterior.coords).T, color=GREEN, lw=1.6, label="outline")
    elif all(isinstance(side, Point) for side in sides):
        strip = _strip(*(np.array(side.coords[0]) for side in sides))
        ax.add_patch(PolygonPatch(strip, facecolor=GREEN, alpha=0.12, lw=0, label="platform (its width is not known)"))
    for side in sides:
        if isinstance(side, LineString):
            ax.plot(*np.array(side.coords).T, color=GREEN, lw=0.8, ls=":")


def _draw_points(ax: Axes, edges: EdgeMap) -> None:
    """Draw each edge, with a bar of 2 sigma along the track."""
    for point in edges.points:
        along = _direction(edges.xy, point.sample) * 2 * point.sigma_m
        ends = np.array([[point.x_m, point.y_m]]) + np.outer([-1, 1], along)
        ax.plot(*ends.T, color=COLOURS[point.kind], lw=2.5, alpha=0.4, solid_capstyle="round")
    for kind, colour in COLOURS.items():
        at = [p for p in edges.points if p.kind == kind]
        if at:
            ax.scatter([p.x_m for p in at], [p.y_m for p in at], s=14, color=colour, zorder=3,
                       label=f"{kind} ({len(at)})")


def _strip(near: np.ndarray, far: np.ndarray) -> np.ndarray:
    """Corners (4, 2), m, of the area between two edges of one pass, STRIP_M wide."""
    along = far - near
    length = float(np.hypot(*along))
    side = 0.5 * STRIP_M * (np.array([-along[1], along[0]]) / length if length > 0.0 else np.array([0.0, 1.0]))
    return np.array([near + side, far + side, far - side, near - side])


def _ends(ax: Axes, xy: np.ndarray) -> None:
    """Mark start, end and direction of the flight."""
    known = xy[np.isfinite(xy).all(axis=1)]
    if len(known) < 2:
        return
    first, last = known[:1], known[-1:]
    for place, marker, label in ((first, "o", "start"), (last, "s", "end")):
        ax.scatter(place[:, 0], place[:, 1], s=46, marker=marker, facecolor="white", edgecolor="black", zorder=4,
                   label=label)
    passed = np.r_[0.0, np.cumsum(np.hypot(*np.diff(known, axis=0).T))]
    for part in (0.25, 0.75):
        i = int(np.clip(np.searchsorted(passed, part * passed[-1]), 1, len(known) - 1))
        step = _direction(known, i)
        if step.any():
            ax.annotate("", known[i] + 0.02 * step, known[i] - 0.02 * step, zorder=4,
                        arrowprops={"arrowstyle": "-|>", "color": "#4b5563", "lw": 1.2})


def _room_below(ax: Axes, xy: np.ndarray) -> None:
    """Extend the axes below the track (n, 2), so that the scale bar covers none of it."""
    known = xy[np.isfinite(xy).all(axis=1)]
    if len(known):
        corner = known.min(axis=0)
        ax.update_datalim([(corner[0], corner[1] - 0.1 * max(np.ptp(known, axis=0)))])
        ax.autoscale_view()


def _scale_bar(ax: Axes) -> None:
    """Draw a scale bar of a round length at the lower left, and keep it there when the limits change."""
    (bar,) = ax.plot([], [], color="black", lw=3, solid_capstyle="butt", scalex=False, scaley=False)
    text = ax.annotate("", (0.0, 0.0), (0.0, 3.0), textcoords="offset points", ha="center", va="bottom", fontsize=8)

    def place(ax: Axes) -> None:
        (x0, x1), (y0, y1) = ax.get_xlim(), ax.get_ylim()
        length = next((s for s in (5.0, 2.0, 1.0, 0.5, 0.2, 0.1) if s < 0.3 * abs(x1 - x0)), 0.05)
        x, y = x0 + 0.04 * (x1 - x0), y0 + 0.05 * (y1 - y0)
        end = x + np.copysign(length, x1 - x0)
        bar.set_data(np.array([x, end]), np.array([y, y]))
        text.xy = ((x + end) / 2, y)
        text.set_text(f"{length:g} m")

    place(ax)
    for change in ("xlim_changed", "ylim_changed"):
        ax.callbacks.connect(change, place)


def _direction(xy: np.ndarray, sample: int) -> np.ndarray:
    """Unit vector (2,) along the track at a sample; zero where the drone stands still."""
    low, high = max(0, sample - 10), min(len(xy) - 1, sample + 10)
    step = xy[high] - xy[low]
    length = float(np.hypot(*step))
    return step / length if np.isfinite(length) and length > 0 else np.zeros(2)
