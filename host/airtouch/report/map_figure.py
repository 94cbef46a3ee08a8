"""The edge map as a picture."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from shapely.geometry import LineString
from shapely.plotting import patch_from_polygon

from airtouch.detector.edge_map import EdgePoint, Platform
from airtouch.report.figures import FOUND, MUTED, OTHER, TRUE, png, style

COLOURS = {"entry": FOUND, "exit": OTHER, "edge": TRUE}


def edge_map(xy: np.ndarray, points: Sequence[EdgePoint], platforms: Sequence[Platform], title: str) -> bytes:
    """PNG of the track (n, 2), the edges felt with 2-sigma bars along the track, and fitted outlines."""
    with style():
        figure = Figure(figsize=(7.2, 5.0), layout="constrained")
        ax = figure.subplots()
        ax.plot(*xy.T, color=MUTED, lw=0.7, label="track")
        for platform in platforms:
            if platform.outline is not None:
                ring = np.array(platform.outline.exterior.coords)
                band = platform.outline.boundary.buffer(2 * platform.sigma_m)
                ax.add_patch(patch_from_polygon(band, facecolor=TRUE, alpha=0.15, lw=0))
                ax.plot(*ring.T, color=TRUE, lw=1.6, label="outline")
            for line in (platform.near, platform.far):
                if isinstance(line, LineString):
                    ax.plot(*np.array(line.coords).T, color=TRUE, lw=0.8, ls=":")
        for point in points:
            along = _direction(xy, point.sample) * 2 * point.sigma_m
            ends = np.array([[point.x_m, point.y_m]]) + np.outer([-1, 1], along)
            ax.plot(*ends.T, color=COLOURS[point.kind], lw=2.5, alpha=0.4, solid_capstyle="round")
        for kind, colour in COLOURS.items():
            at = [(p.x_m, p.y_m) for p in points if p.kind == kind]
            if at:
                ax.scatter(*np.array(at).T, s=14, color=colour, zorder=3, label=f"{kind} ({len(at)})")
        ax.set(xlabel="x, m", ylabel="y, m", title=title, aspect="equal", adjustable="datalim")
        handles, labels = ax.get_legend_handles_labels()
        unique = dict(zip(labels, handles))
        figure.legend(unique.values(), unique.keys(), loc="outside lower center", ncols=5, frameon=False)
        return png(figure)


def _direction(xy: np.ndarray, sample: int) -> np.ndarray:
    """Unit vector along the track there; zero where it stands still."""
    low, high = max(0, sample - 10), min(len(xy) - 1, sample + 10)
    step = xy[high] - xy[low]
    length = float(np.hypot(*step))
    return step / length if np.isfinite(length) and length > 0 else np.zeros(2)
