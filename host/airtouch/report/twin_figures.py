"""Plots of a twin beside the recorded flights, each as the bytes of a PNG."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from airtouch.report.figures import FOUND, MUTED, TRUE, png, style
from airtouch.twin import channels as ch
from airtouch.twin.channels import NAMES, RATE_HZ, UNITS
from airtouch.twin.compare import Flown
from airtouch.twin.course import Course
from airtouch.twin.features import BANDS_HZ, CLASSES, edge_locked, height_class, names
from airtouch.twin.flights import Recorded

BEFORE, BEHIND = 50, 100  #: samples shown around an edge
REAL, TWIN = TRUE, FOUND


def overlaid(recorded: Recorded, simulated: Sequence[Flown]) -> bytes:
    """One recorded flight and its twin, 2 s before the entry to 2 s after the exit, all twelve channels."""
    length = [f.course.exit - f.course.entry for f in simulated]
    one = simulated[int(np.argsort(length)[len(length) // 2])]
    course, x = recorded.courses[one.number], recorded.channels[one.number]
    with style():
        figure = Figure(figsize=(7.2, 10.5), layout="constrained")
        axes = figure.subplots(6, 2, sharex=True)
        for k, axis in enumerate(axes.T.ravel()):
            for data, of, colour, label in ((x, course, REAL, "recorded"),
                                            (one.channels, one.course, TWIN, "simulated")):
                span = slice(max(of.entry - 200, 0), min(of.exit + 200, len(data)))
                level = 0.0 if k == ch.DOWN else np.median(data[of.free, k])
                axis.plot((np.arange(span.start, span.stop) - of.entry) / RATE_HZ, data[span, k] - level,
                          color=colour, lw=0.7, label=label)
            axis.set_title(f"{NAMES[k]}, {UNITS[k]}", loc="left")
            axis.axvline(0.0, color=MUTED, lw=0.6)
        axes[0, 0].legend(frameon=False)
        for axis in axes[-1]:
            axis.set_xlabel("s after the entry")
        return png(figure)


def edges(recorded: Recorded, simulated: Sequence[Flown], name: str) -> bytes | None:
    """Edge-locked medians of the twelve channels of one height class, entry and exit side by side.

    Bands: quarter to three quarters of the flights. None where either set has no such flight.
    """
    real = [(x, c) for x, c in zip(recorded.channels, recorded.courses, strict=True)
            if height_class(c.clearance_m) == name]
    fake = [(f.channels, f.course) for f in simulated if height_class(f.course.clearance_m) == name]
    if not real or not fake:
        return None
    time = (np.arange(BEFORE + BEHIND) - BEFORE) / RATE_HZ
    with style():
        figure = Figure(figsize=(7.2, 15.0), layout="constrained")
        axes = figure.subplots(12, 2, sharex=True, sharey="row")
        for column, kind in enumerate(("entry", "exit")):
            for flights, colour, label in ((real, REAL, f"recorded, {len(real)} flights"),
                                           (fake, TWIN, f"simulated, {len(fake)} flights")):
                low, middle, high = _quartiles(flights, kind)
                for k in range(12):
                    axis = axes[k, column]
                    axis.plot(time, middle[:, k], color=colour, lw=1.0, label=label)
                    axis.fill_between(time, low[:, k], high[:, k], color=colour, alpha=0.15, lw=0)
                    axis.axvline(0.0, color=MUTED, lw=0.6)
                    axis.set_title(f"{kind}: {NAMES[k]}, {UNITS[k]}", loc="left")
        axes[0, 0].legend(frameon=False)
        for axis in axes[-1]:
            axis.set_xlabel("s after the edge")
        return png(figure)


def _quartiles(flights: Sequence[tuple[np.ndarray, Course]], kind: str) -> np.ndarray:
    locked = np.array([edge_locked(x, c, getattr(c, kind), BEFORE, BEHIND) for x, c in flights])
    rows = np.isfinite(locked[:, :, 0]).any(axis=0)
    out = np.full((3, *locked.shape[1:]), np.nan)
    out[:, rows] = np.nanpercentile(locked[:, rows], [25, 50, 75], axis=0)
    return out


def spectra(recorded: Recorded, simulated: Sequence[Flown]) -> bytes:
    """Band powers in free air, median and quartiles over flights, of eleven channels."""
    at = [k for k, f in enumerate(names()) if f.group == "spectrum"]
    real = recorded.features[:, at].reshape(-1, ch.DOWN, len(BANDS_HZ))
    fake = np.array([f.features[at] for f in simulated]).reshape(-1, ch.DOWN, len(BANDS_HZ))
    place = np.arange(len(BANDS_HZ))
    with style():
        figure = Figure(figsize=(7.2, 9.0), layout="constrained")
        axes = figure.subplots(4, 3, sharex=True).ravel()
        for k in range(ch.DOWN):
            for data, colour, label in ((real, REAL, "recorded"), (fake, TWIN, "simulated")):
                low, middle, high = np.nanpercentile(data[:, k], [25, 50, 75], axis=0)
                axes[k].plot(place, middle, color=colour, lw=1.0, label=label)
                axes[k].fill_between(place, low, high, color=colour, alpha=0.15, lw=0)
            axes[k].set_title(f"{NAMES[k]}, dB", loc="left")
        axes[0].legend(frameon=False)
        axes[-1].set_axis_off()
        for axis in axes[8:11]:
            axis.set_xticks(place, [f"{a:g}-{b:g}" for a, b in BANDS_HZ], rotation=90)
            axis.set_xlabel("Hz")
        return png(figure)


def class_in_words(name: str) -> str:
    """A height class with its bounds."""
    low, high = CLASSES[name]
    return f"{name}: {100 * low:g} to {100 * high:g} cm of down range over the platform"
