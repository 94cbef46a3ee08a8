"""Plots of the gap without and with the named effects in the model, each as a matplotlib figure."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, Locator, MaxNLocator, NullFormatter, StrMethodFormatter

from airtouch.gap.answer.curves import MeanSpectra, Signal, Spectrum
from airtouch.gap.signals.channels import CHANNEL_WORDS
from airtouch.logs.segments import KINDS
from airtouch.report.style import BLUE, GREEN, GREY, RED, TITLE_AT, Room, limit, panes, style

BEFORE, AFTER, FLOOR = RED, GREEN, GREY  #: colours of the gap without and with the named effects, and of its floor
#: changes of `style.STYLE` for plots that are read on a phone; the dots per inch are chosen, sharp there
PHONE = {"font.size": 10, "axes.titlesize": 10, "legend.frameon": False, "legend.fontsize": 9, "figure.dpi": 170}
#: look of the gap without the named effects: broad and pale, so that it shows behind the gap with them
BEHIND: dict[str, Any] = {"color": BEFORE, "lw": 2.6, "alpha": 0.5}
FLOOR_LINE = "#3f444d"  #: a darker grey, of the floor's outline in front of dense curves
ABOVE = 2.5  #: zorder of the measured curve and of the floor, above that of lines, 2: a dense curve would hide them
#: look of the seconds in which an effect acts: a bar along the upper end of a pane
ACTS: dict[str, Any] = {"facecolor": AFTER, "ymin": 0.96, "lw": 0.0, "zorder": ABOVE}
#: look of the seconds in the phase of the answer's cell: a bar along the lower end of a pane
ANSWER: dict[str, Any] = {"facecolor": BLUE, "ymax": 0.04, "lw": 0.0, "zorder": ABOVE}
SIGNAL_LIMITS = {"margin": 0.2, "least": 1e-6}  #: arguments of `style.limit` for the axis of a signal; chosen
LEAST_POWER = 1e-12  #: least power that is drawn, in a channel's unit squared/Hz, as 0 has no place on a log axis
MOST_LABELS = 4  #: labels of an axis of power; chosen, as many as fit a pane
WIDTH_IN = 4.4  #: inch, width of a plot; chosen, readable on a phone
POWERS = 10.0 ** np.arange(-40, 41)  #: that have a label on an axis of power
ROUNDING = 1e-9  #: relative, of a limit that a tick is at
#: of a plot with a legend above each pane, and of one with titles and one legend above all
LEGENDS, TITLES = Room(left_in=1.0, below_in=0.5, above_in=0.35), Room(0.75, 0.5, 0.3, top_in=0.25)
SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
#: colour behind the curves of each phase that is shaded
PHASE_COLOURS = {"take-off": "#dbeafe", "over platform": "#fef3c7", "landing": "#dbeafe"}


def signals(signal: Signal) -> Figure:
    """One channel of one flight in a band: measured, modelled, their difference, the height."""
    gaps = [gap for gap in (signal.before, signal.after) if gap is not None]
    rows = 1 + (signal.measured is not None) + (signal.height_m is not None)
    with style(PHONE):
        figure, axes = _column(rows, 1.6, LEGENDS)
        if signal.measured is not None:
            axes[0].plot(signal.time_s, signal.measured, color="black", lw=0.8, zorder=ABOVE, label="measured")
            axes[0].plot(signal.time_s, signal.measured - signal.before, label="model", **BEHIND)
            if signal.after is not None:
                axes[0].plot(signal.time_s, signal.measured - signal.after, color=AFTER, lw=1.0,
                             label="model with effect")
            axes[0].set_ylabel(f"{CHANNEL_WORDS[signal.channel]}\n{_unit(signal.unit)}")
            limit(axes[0], signal.measured, *(signal.measured - gap for gap in gaps), **SIGNAL_LIMITS)
        gap = axes[0 if signal.measured is None else 1]
        if np.isfinite(signal.floor).any():
            gap.fill_between(signal.time_s, -signal.floor, signal.floor, step="post", facecolor="none",
                             edgecolor=FLOOR_LINE, lw=0.9, zorder=ABOVE, label="floor")
        gap.plot(signal.time_s, signal.before, label="gap" if signal.after is None else "gap before", **BEHIND)
        if signal.after is not None:
            gap.plot(signal.time_s, signal.after, color=AFTER, lw=1.0, label="gap after")
        gap.set_ylabel(f"measured - model\n{_unit(signal.unit)}")
        if signal.height_m is not None:
            axes[-1].plot(signal.time_s, signal.height_m, color=BLUE, lw=1.0, label="height over the ground below")
            axes[-1].set_ylabel("height\nm")
        axes[-1].set_xlabel("time, s")
        limit(gap, *gaps, -signal.floor, signal.floor, **SIGNAL_LIMITS)
        for ax in axes:
            _phases(ax, signal)
            for begin, end in signal.acts_s:
                ax.axvspan(begin, end, **ACTS)
            ax.margins(x=0)
            ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, columnspacing=1.0, handlelength=1.5)
    return figure


def spectra(frequency_hz: np.ndarray, shown: Sequence[Spectrum]) -> Figure:
    """The gap's spectra, one pane a channel: before, floor, and after if there is an effect."""
    rows = len(shown)
    with style(PHONE):
        figure, axes = _column(rows, 1.35, TITLES)
        for ax, spectrum in zip(axes, shown, strict=True):
            before = "gap" if spectrum.after is None else "before"
            looks = {"floor": (spectrum.floor, {"color": FLOOR, "lw": 1.6}), before: (spectrum.before, BEHIND),
                     "after": (spectrum.after, {"color": AFTER, "lw": 1.0})}
            for label, (power, look) in looks.items():
                if power is not None:
                    ax.loglog(frequency_hz[1:], np.maximum(power[1:], LEAST_POWER), label=label, **look)
            ax.set_title(CHANNEL_WORDS[spectrum.channel], loc="left", y=TITLE_AT)
            unit = _unit(spectrum.unit)
            ax.set_ylabel(f"({unit})²/Hz" if "/" in unit else f"{unit}²/Hz")
            ax.grid(alpha=0.2)
        _legend(figure, axes)
        _frequency_axis(axes, (0.5, 1, 2, 5, 10, 20, 50))
    return figure


def commands(curves: MeanSpectra) -> Figure:
    """The motor commands' spectra beside those of nominal flights, one pane an axis."""
    f = curves.frequency_hz
    with style(PHONE):
        figure, axes = _column(len(curves.flown), 1.2, TITLES)
        for ax, (name, flown) in zip(axes, curves.flown.items(), strict=True):
            if name in curves.nominal:
                ax.loglog(f, curves.nominal[name], color=FLOOR, lw=1.6, label="baseline flights")
            ax.loglog(f, flown, color=BLUE, lw=1.2, label="these flights")
            ax.set_title(f"{name} command", loc="left", y=TITLE_AT)
            ax.set_ylabel("N²/Hz")
            ax.grid(alpha=0.2)
        _legend(figure, axes)
        _frequency_axis(axes, (2, 5, 10, 20, 40))
    return figure


def _column(rows: int, pane_in: float, room: Room) -> tuple[Figure, np.ndarray]:
    """A figure, and its panes (rows,) one below another, each pane_in inch high."""
    height_in = room.below_in + rows * (pane_in + room.above_in) + room.top_in
    figure, axes = panes((WIDTH_IN, height_in), rows, room=room)
    return figure, axes[:, 0]


def _legend(figure: Figure, axes: np.ndarray) -> None:
    """One legend above all panes, of that with most curves."""
    handles, labels = max((ax.get_legend_handles_labels() for ax in axes), key=lambda pair: len(pair[1]))
    figure.legend(handles, labels, loc="upper center", ncols=len(labels))


class LogTicks(Locator):
    """Ticks of a log axis: of some values those in view, at most some number of them, and others where there are not
    two: 1, 2 and 5 times powers of ten, or, without two of these, evenly spaced ones.
    """

    def __init__(self, values: Sequence[float] | np.ndarray, most: int) -> None:
        self.values, self.most = np.asarray(values, float), most

    def __call__(self) -> Sequence[float]:
        """The ticks of the axis as it is."""
        return [] if self.axis is None else self.tick_values(*self.axis.get_view_interval())

    def tick_values(self, vmin: float, vmax: float) -> Sequence[float]:
        """The ticks between two limits."""
        low, high = sorted((vmin, vmax))
        for values in (self.values, np.outer(POWERS, (1.0, 2.0, 5.0)).ravel()):
            inside = values[(values >= low * (1.0 - ROUNDING)) & (values <= high * (1.0 + ROUNDING))]
            if len(inside) > 1:
                return list(inside[::-(-len(inside) // self.most)])
        return MaxNLocator(self.most, steps=[1, 2, 5, 10]).tick_values(low, high)


def _frequency_axis(axes: np.ndarray, ticks: Sequence[float]) -> None:
    """Set plain ticks, Hz, on the frequency axis that the panes share."""
    for ax in axes:
        ax.set_xticks(ticks)  # widens the axis to hold them
        ax.xaxis.set_major_locator(LogTicks(ticks, len(ticks)))
        ax.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        ax.xaxis.set_minor_formatter(NullFormatter())
        _power_axis(ax)
    axes[-1].set_xlabel("frequency, Hz")


def _power_axis(ax: Axes) -> None:
    """Label powers of ten on a log axis of power, from two to MOST_LABELS; its limits are widened where none are."""
    low, high = np.log10(ax.get_ylim())
    first, last = int(np.ceil(low)), int(np.floor(high))
    while last <= first:  # to the nearer power outside
        if first - 1 - low > high - last - 1:
            first, low = first - 1, first - 1.0
        else:
            last, high = last + 1, last + 1.0
    ax.set_ylim(10.0 ** low, 10.0 ** high)
    ax.yaxis.set_major_locator(LogTicks(POWERS, MOST_LABELS))
    ax.yaxis.set_major_formatter(FuncFormatter(power_of_ten))
    ax.yaxis.set_minor_formatter(NullFormatter())


def power_of_ten(x: float, _place: int | None = None) -> str:
    """The label of a tick of a log axis: 10⁻³, 2·10⁻³. Matplotlib's needs its parser of formulas, a second to begin."""
    factor, exponent = f"{x:.2e}".split("e")
    power = "10" + f"{int(exponent)}".translate(SUPERSCRIPT)
    return power if float(factor) == 1.0 else f"{float(factor):g}·{power}"


def _unit(unit: str) -> str:
    """A unit as an axis shows it: rad/s²."""
    return unit.replace("^2", "²")


def _phases(ax: Axes, signal: Signal) -> None:
    """Shade take-off, landing and platforms behind the curves, and mark the phase of the answer's cell."""
    time_s, phase = signal.time_s, signal.phase
    bounds = np.r_[0, np.flatnonzero(np.diff(phase)) + 1, len(phase)]
    for a, b in zip(bounds[:-1], bounds[1:] - 1, strict=True):
        kind = KINDS[phase[a]]
        if kind in PHASE_COLOURS:
            ax.axvspan(time_s[a], time_s[b], color=PHASE_COLOURS[kind], lw=0, zorder=0)
            if b - a > 0.15 * len(phase):
                ax.annotate(kind, ((time_s[a] + time_s[b]) / 2, 0.98), xycoords=ax.get_xaxis_transform(), ha="center",
                            va="top", fontsize=8, color=GREY, annotation_clip=True)  # clip: with its place in view
        if signal.cell is not None and kind == signal.cell.phase:
            ax.axvspan(time_s[a], time_s[b], **ANSWER)
