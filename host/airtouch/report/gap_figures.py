"""Plots of the gap before and after an effect is in the model, each as the bytes of a PNG."""

import io
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from airtouch.gap.gap_map import CHANNEL_WORDS
from airtouch.gap.pictures import Signal, Spectrum
from airtouch.logs.segments import KINDS
from airtouch.report.figures import FOUND, MUTED, OTHER, TRUE

BEFORE, AFTER, FLOOR = OTHER, TRUE, MUTED
STYLE = {"font.size": 10, "axes.spines.top": False, "axes.spines.right": False, "axes.titlesize": 10,
         "legend.frameon": False, "legend.fontsize": 9}
WIDTH_IN = 4.4  #: a phone's width at a readable size
PHASE_COLOURS = {"take-off": "#dbeafe", "over platform": "#fef3c7", "landing": "#dbeafe"}


def signals(made: Signal) -> bytes:
    """One channel of one flight: measured and modelled above, what is left below, up to the band's end."""
    rows = 1 if made.measured is None else 2
    with style():
        figure = Figure(figsize=(WIDTH_IN, 2.0 * rows + 0.8), layout="constrained")
        axes = figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0]
        if made.measured is not None:
            axes[0].plot(made.time_s, made.measured, color="black", lw=1.0, label="measured")
            axes[0].plot(made.time_s, made.measured - made.before, color=BEFORE, lw=1.0, label="model")
            if made.after is not None:
                axes[0].plot(made.time_s, made.measured - made.after, color=AFTER, lw=1.0, label="model with effect")
            axes[0].set_ylabel(f"{CHANNEL_WORDS[made.channel]}\n{made.unit}")
            _robust(axes[0], made.measured, made.measured - made.before)
        axes[-1].axhspan(-made.floor, made.floor, color=FLOOR, alpha=0.25, lw=0, label="floor")
        axes[-1].plot(made.time_s, made.before, color=BEFORE, lw=1.0, label="gap before")
        if made.after is not None:
            axes[-1].plot(made.time_s, made.after, color=AFTER, lw=1.0, label="gap after")
        axes[-1].set(ylabel=f"measured - model\n{made.unit}", xlabel="time, s")
        _robust(axes[-1], made.before, np.array([-made.floor, made.floor]))
        for ax in axes:
            _phases(ax, made.time_s, made.phase)
            ax.margins(x=0)
            ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)
        return _png(figure)


def spectra(frequency_hz: np.ndarray, shown: Sequence[Spectrum]) -> bytes:
    """Spectra of the gap: for each shown channel before, floor and, where there is one, after."""
    rows = len(shown)
    with style():
        figure = Figure(figsize=(WIDTH_IN, 1.75 * rows + 0.6), layout="constrained")
        axes = figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0]
        for ax, some in zip(axes, shown, strict=True):
            for key, colour, width in (("floor", FLOOR, 1.6), ("before", BEFORE, 1.3), ("after", AFTER, 1.3)):
                if getattr(some, key) is not None:
                    ax.loglog(frequency_hz[1:], np.maximum(getattr(some, key)[1:], 1e-12), color=colour, lw=width,
                              label=key)
            ax.set_title(CHANNEL_WORDS[some.channel], loc="left")
            ax.set_ylabel(f"({some.unit})²/Hz")
            ax.grid(alpha=0.2)
        _legend(figure, axes[0])
        _frequency_axis(axes, (0.5, 1, 2, 5, 10, 20, 50))
        return _png(figure)


def commands(made: Mapping[str, Any]) -> bytes:
    """The twin view: spectra of the commands as flown, beside those of nominal flights."""
    f = np.array(made["frequency_hz"])
    axes_named = [k for k in made if isinstance(made[k], Mapping)]
    with style():
        figure = Figure(figsize=(WIDTH_IN, 1.6 * len(axes_named) + 0.6), layout="constrained")
        axes = figure.subplots(len(axes_named), 1, sharex=True, squeeze=False)[:, 0]
        for ax, name in zip(axes, axes_named, strict=True):
            if "nominal" in made[name]:
                ax.loglog(f, made[name]["nominal"], color=FLOOR, lw=1.6, label="baseline flights")
            ax.loglog(f, made[name]["flown"], color=FOUND, lw=1.2, label="these flights")
            ax.set_title(f"{name} command", loc="left")
            ax.set_ylabel("N²/Hz")
            ax.grid(alpha=0.2)
        _legend(figure, axes[0])
        _frequency_axis(axes, (2, 5, 10, 20, 40))
        return _png(figure)


def _png(figure: Figure) -> bytes:
    """Fine enough for a phone's screen."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=170)
    return buffer.getvalue()


def _legend(figure: Figure, ax: Axes) -> None:
    """One legend above all panes."""
    handles, labels = ax.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))


def _frequency_axis(axes: np.ndarray, ticks: Sequence[float]) -> None:
    for ax in axes:
        ax.set_xticks(ticks, [f"{t:g}" for t in ticks])
        ax.xaxis.set_minor_formatter(NullFormatter())
        ax.yaxis.set_minor_formatter(NullFormatter())
    axes[-1].set_xlabel("frequency, Hz")


def _phases(ax: Axes, time_s: np.ndarray, phase: np.ndarray) -> None:
    """Take-off, landing and platforms shaded behind the curves."""
    bounds = np.r_[0, np.flatnonzero(np.diff(phase)) + 1, len(phase)]
    for a, b in zip(bounds[:-1], bounds[1:] - 1, strict=True):
        kind = KINDS[phase[a]]
        if kind in PHASE_COLOURS:
            ax.axvspan(time_s[a], time_s[b], color=PHASE_COLOURS[kind], lw=0, zorder=0)
            if b - a > 0.15 * len(phase):
                ax.text((time_s[a] + time_s[b]) / 2, 0.98, kind, transform=ax.get_xaxis_transform(), ha="center",
                        va="top", fontsize=8, color=MUTED)


def _robust(ax: Axes, *values: np.ndarray) -> None:
    """Limits that take-off and landing do not spoil."""
    every = np.concatenate([np.ravel(v) for v in values])
    every = every[np.isfinite(every)]
    if len(every):
        low, high = np.percentile(every, [0.5, 99.5])
        pad = 0.2 * max(high - low, 1e-6)
        ax.set_ylim(low - pad, high + pad)


def style():
    import matplotlib

    return matplotlib.rc_context(STYLE)
