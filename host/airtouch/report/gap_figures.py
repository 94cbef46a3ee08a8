"""Plots of the gap before and after an effect is in the model, each as the bytes of a PNG."""

import io
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from airtouch.gap.band_sums import BANDS_HZ, filtered, stretches
from airtouch.gap.channels import CHANNELS, TORQUE
from airtouch.gap.flight import PERIOD_S, Flight
from airtouch.gap.gap_map import CHANNEL_WORDS
from airtouch.logs.segments import KINDS
from airtouch.report.figures import FOUND, MUTED, OTHER, TRUE

BEFORE, AFTER, FLOOR = OTHER, TRUE, MUTED
STYLE = {"font.size": 10, "axes.spines.top": False, "axes.spines.right": False, "axes.titlesize": 10,
         "legend.frameon": False, "legend.fontsize": 9}
WIDTH_IN = 4.4  #: a phone's width at a readable size
PHASE_COLOURS = {"take-off": "#dbeafe", "over platform": "#fef3c7", "landing": "#dbeafe"}


def signals(flight: Flight, channel: str, band: int, before: np.ndarray, after: np.ndarray | None,
            floor: float) -> bytes:
    """One channel of one flight: measured and modelled above, what is left below, up to the band's end.

    before, after (n, COUNT): the gap without and with the effects in the model.
    """
    c = next(i for i, ch in enumerate(CHANNELS) if ch.name == channel)
    t = np.arange(len(flight)) * PERIOD_S
    measured = _measured(flight, c)
    rows = 1 if measured is None else 2
    with style():
        figure = Figure(figsize=(WIDTH_IN, 2.0 * rows + 0.8), layout="constrained")
        axes = figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0]
        left = _below(flight, before[:, c], band)
        then = None if after is None else _below(flight, after[:, c], band)
        if measured is not None:
            said = _below(flight, measured, band)
            axes[0].plot(t, said, color="black", lw=1.0, label="measured")
            axes[0].plot(t, said - left, color=BEFORE, lw=1.0, label="model")
            if then is not None:
                axes[0].plot(t, said - then, color=AFTER, lw=1.0, label="model with effect")
            axes[0].set_ylabel(f"{CHANNEL_WORDS[channel]}\n{CHANNELS[c].unit}")
            _robust(axes[0], said, said - left)
        axes[-1].axhspan(-floor, floor, color=FLOOR, alpha=0.25, lw=0, label="floor")
        axes[-1].plot(t, left, color=BEFORE, lw=1.0, label="gap before")
        if then is not None:
            axes[-1].plot(t, then, color=AFTER, lw=1.0, label="gap after")
        axes[-1].set(ylabel=f"measured - model\n{CHANNELS[c].unit}", xlabel="time, s")
        _robust(axes[-1], left, np.array([-floor, floor]))
        for ax in axes:
            _phases(ax, flight.phase)
            ax.margins(x=0)
            ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)
        return _png(figure)


def spectra(frequency_hz: np.ndarray, shown: Sequence[Mapping[str, Any]]) -> bytes:
    """Spectra of the gap: for each shown channel `before`, `floor` and, where there is one, `after`, PSD."""
    rows = len(shown)
    with style():
        figure = Figure(figsize=(WIDTH_IN, 1.75 * rows + 0.6), layout="constrained")
        axes = figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0]
        for ax, some in zip(axes, shown, strict=True):
            for key, colour, width in (("floor", FLOOR, 1.6), ("before", BEFORE, 1.3), ("after", AFTER, 1.3)):
                if some.get(key) is not None:
                    ax.loglog(frequency_hz[1:], np.maximum(some[key][1:], 1e-12), color=colour, lw=width,
                              label=key)
            ax.set_title(CHANNEL_WORDS[some["channel"]], loc="left")
            ax.set_ylabel(f"({some['unit']})²/Hz")
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


def _frequency_axis(axes: Sequence[Axes], ticks: Sequence[float]) -> None:
    for ax in axes:
        ax.set_xticks(ticks, [f"{t:g}" for t in ticks])
        ax.xaxis.set_minor_formatter(NullFormatter())
        ax.yaxis.set_minor_formatter(NullFormatter())
    axes[-1].set_xlabel("frequency, Hz")


def _below(flight: Flight, values: np.ndarray, band: int) -> np.ndarray:
    """Values up to the end of a band, NaN where nothing is judged."""
    out = np.full(len(values), np.nan)
    for start, stop in stretches(flight):
        here = values[start:stop]
        if band < len(BANDS_HZ) - 1:
            here = filtered(np.nan_to_num(here[:, None]))[:max(band, 1) + 1].sum(axis=0)[:, 0]
        out[start:stop] = here
    return out


def _measured(flight: Flight, channel: int) -> np.ndarray | None:
    if channel < 3:
        return flight.acceleration[:, channel]
    if TORQUE.start <= channel < TORQUE.stop and flight.rates is not None:
        return np.diff(flight.rates[:, channel - 3], append=flight.rates[-1:, channel - 3]) / PERIOD_S
    return None


def _phases(ax: Axes, phase: np.ndarray) -> None:
    """Take-off, landing and platforms shaded behind the curves."""
    bounds = np.r_[0, np.flatnonzero(np.diff(phase)) + 1, len(phase)]
    for a, b in zip(bounds[:-1], bounds[1:], strict=True):
        kind = KINDS[phase[a]]
        if kind in PHASE_COLOURS:
            ax.axvspan(a * PERIOD_S, b * PERIOD_S, color=PHASE_COLOURS[kind], lw=0, zorder=0)
            if b - a > 0.15 * len(phase):
                ax.text((a + b) / 2 * PERIOD_S, 0.98, kind, transform=ax.get_xaxis_transform(), ha="center",
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
