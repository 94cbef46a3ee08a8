"""Plots of flights and scores, each as a matplotlib figure."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from airtouch.detector.evaluation.score_report import HitCurve, Reliability
from airtouch.detector.shared.channels import PAPER_CHANNELS
from airtouch.detector.shared.sensors import GRAVITY_MPS2
from airtouch.detector.trace import Trace
from airtouch.logs import Edge, airborne
from airtouch.logs.flight_log import FlightLog
from airtouch.parameters import SAMPLE_PERIOD_S
from airtouch.report.style import BLUE, GREEN, GREY, RED, limit, panes, style

#: detector -> its colour in every plot
COLOURS = {"best": BLUE, "paper": RED, "baseline": "#b26a00", "paper-stream": "#7a3e9d"}
MARKERS = {"entry": "v", "exit": "^", "edge": "o"}  #: of each kind of edge
LEAST_BAND_POWER = 1e-30  #: least band power that is drawn, in a channel's unit squared; far below any measured
LEAST_FORCE_POWER = 1e-12  #: N^2, least power of the disturbance force that is drawn
LOWEST_FORCE_LIMIT = 1e-10  #: N^2, lowest end of that axis; chosen


class PlottedFlight(NamedTuple):
    """One flight as all panes of a plot show it.

    time_s (n,): of its samples; trace: of the detector whose signals are shown; rows: traces by detector, that one
    first, whose edges are shown.
    """

    time_s: np.ndarray
    log: FlightLog
    trace: Trace
    rows: Mapping[str, Trace]


def colour_of(name: str) -> str:
    """The colour of a detector; that of `best` for one that is not in COLOURS."""
    return COLOURS.get(name, BLUE)


def flight(
    log: FlightLog, trace: Trace, edges: Sequence[Edge] | None = None, others: Mapping[str, Trace] | None = None,
    name: str = "detected",
) -> Figure:
    """One flight, from signals to edges, in panes over the same time axis.

    The panes: signals, band power, probability, detected edges, disturbance force with its FR-CFAR threshold, down
    range. Panes without a signal in the trace are left out. A detected edge stands where it was reported, later by the
    detector's lag. edges: true ones, marked in every pane. others: traces of other detectors, whose edges are shown
    below those of `trace`. name: label of `trace`.
    """
    drawn: list[Callable[[Axes, PlottedFlight], None]] = []
    drawn += [_accelerations, _rates, _motors] if "channels" in trace.signals else []
    drawn += [_band_power] if "band_power" in trace.signals else []
    drawn += [_probability, _edges]
    drawn += [_force, _cfar] if "force" in trace.signals else []
    drawn += [_range] if log.has("zrange_m") else []
    with style():
        figure, grid = panes((7.2, 1.15 * len(drawn) + 0.9), len(drawn), sharex=True)
        axes = grid[:, 0]
        plotted = PlottedFlight(np.arange(len(log)) * SAMPLE_PERIOD_S, log, trace, {name: trace, **(others or {})})
        for ax, draw in zip(axes, drawn, strict=True):
            draw(ax, plotted)
            for edge in edges or ():
                ax.axvline(edge.sample * SAMPLE_PERIOD_S, color=GREEN, lw=1.2, ls="--", alpha=0.8)
            ax.margins(x=0)
        axes[-1].set_xlabel("time, s" + (" (dashed green: true edges, from the down range)" if edges else ""))
    return figure


def reliability(curves: Mapping[str, Reliability]) -> Figure:
    """Reliability diagrams: fraction of samples truly over a platform against the stated probability."""
    with style():
        figure, ((ax,),) = panes((4.6, 4.2))
        ax.plot([0, 1], [0, 1], color=GREY, lw=1, ls="--", label="perfect")
        for name, curve in curves.items():
            if len(curve.stated):
                ax.plot(curve.stated, curve.truly, color=colour_of(name), lw=1, alpha=0.6)
                ax.scatter(curve.stated, curve.truly, s=8 + 250 * curve.samples, color=colour_of(name), clip_on=False,
                           label=f"{name}, ECE {curve.ece:.3f}")
        ax.set(xlim=(0, 1), ylim=(0, 1), xlabel="P(over a platform) as stated", ylabel="fraction truly over",
               title="Reliability; the larger a dot, the more samples")
        ax.legend(loc="upper left", frameon=False)
    return figure


def error_distribution(curves: Mapping[str, HitCurve]) -> Figure:
    """Hit curves, one a detector: fraction of all true edges detected within a distance."""
    with style():
        figure, ((ax,),) = panes((4.6, 4.2))
        for name, curve in curves.items():
            if curve.edges:
                ax.step(curve.distance_m, curve.share, where="post", color=colour_of(name),
                        label=f"{name}, {curve.edges} edges")
        ax.set(xlim=(0, 0.5), ylim=(0, 1), xlabel="distance error, m", ylabel="fraction of true edges",
               title="Edges detected within a distance")
        ax.grid(alpha=0.25)
        ax.legend(loc="lower right", frameon=False)
    return figure


def _accelerations(ax: Axes, plotted: PlottedFlight) -> None:
    """Draw the accelerations, without gravity."""
    channels = plotted.trace.signals["channels"][:, :3] - [0, 0, GRAVITY_MPS2]
    ax.plot(plotted.time_s, channels, lw=0.6, label=["x", "y", "z - g"])
    _finish(ax, "acceleration\nm/s²", channels)


def _rates(ax: Axes, plotted: PlottedFlight) -> None:
    """Draw the rates of the gyro."""
    rates = np.rad2deg(plotted.trace.signals["channels"][:, 3:6])
    ax.plot(plotted.time_s, rates, lw=0.6, label=["x", "y", "z"])
    _finish(ax, "rates\ndeg/s", rates)


def _motors(ax: Axes, plotted: PlottedFlight) -> None:
    """Draw the differences of the motors' commands to that of motor 1."""
    motors = plotted.trace.signals["channels"][:, 6:] / 1000
    ax.plot(plotted.time_s, motors, lw=0.6, label=["m2-m1", "m3-m1", "m4-m1"])
    _finish(ax, "motors\n10³ PWM", motors)


def _band_power(ax: Axes, plotted: PlottedFlight) -> None:
    """Draw the band power of every channel, in dB over its median."""
    level = 10 * np.log10(np.maximum(plotted.trace.signals["band_power"].astype(float), LEAST_BAND_POWER))
    level -= np.nanmedian(level, axis=0)
    image = ax.imshow(level.T, aspect="auto", cmap="magma", vmin=-5, vmax=20, interpolation="nearest",
                      extent=(plotted.time_s[0], plotted.time_s[-1], len(PAPER_CHANNELS) - 0.5, -0.5))
    ax.set_yticks(range(len(PAPER_CHANNELS)), PAPER_CHANNELS, fontsize=6)
    ax.set_ylabel("band power", fontsize=8)
    bar = ax.figure.colorbar(image, ax=ax, pad=0.01, aspect=8, extend="both", ticks=(-5, 0, 10, 20))
    bar.ax.tick_params(labelsize=6)
    bar.set_label("dB on median", fontsize=7)


def _probability(ax: Axes, plotted: PlottedFlight) -> None:
    """Draw the probability of being over a platform."""
    ax.plot(plotted.time_s, plotted.trace.probability, color=colour_of(next(iter(plotted.rows))), lw=0.9)
    ax.set_ylim(-0.05, 1.05)
    ax.set_ylabel("P(over)", fontsize=8)


def _edges(ax: Axes, plotted: PlottedFlight) -> None:
    """Draw the edges that each detector has detected, a row for each."""
    for row, (name, trace) in enumerate(plotted.rows.items()):
        for kind, marker in MARKERS.items():
            samples = [e.sample for e in trace.edges if e.kind == kind]
            ax.plot(np.array(samples) * SAMPLE_PERIOD_S, np.full(len(samples), row), marker, ms=6,
                    color=colour_of(name), ls="none")
    ax.set_yticks(range(len(plotted.rows)), plotted.rows, fontsize=7)
    ax.set_ylim(len(plotted.rows) - 0.5, -0.5)
    ax.set_ylabel("edges\n▼ in, ▲ out", fontsize=8)


def _force(ax: Axes, plotted: PlottedFlight) -> None:
    """Draw the vertical disturbance force; its limits are those in the air, as on the ground it is the weight."""
    force = plotted.trace.signals["force"][:, 2] * 1000
    ax.plot(plotted.time_s, force, lw=0.6)
    flying = airborne(plotted.log)
    _finish(ax, "force f_w,z\nmN", force[flying] if flying.any() else force, legend=False)


def _cfar(ax: Axes, plotted: PlottedFlight) -> None:
    """Draw FR-CFAR's cells under test, its threshold and its alerts."""
    power = np.maximum(plotted.trace.signals["cfar_power"].astype(float), LEAST_FORCE_POWER)
    ax.semilogy(plotted.time_s, power, lw=0.6, label="tested")
    threshold = np.maximum(plotted.trace.signals["threshold"].astype(float), LEAST_FORCE_POWER)
    ax.semilogy(plotted.time_s, threshold, lw=0.9, color=RED, label="threshold T")
    alert = plotted.trace.signals["alert"].astype(bool)
    ax.plot(plotted.time_s[alert], power[alert], ".", ms=5, color="black", label="alert")
    ax.set_ylim(max(float(np.nanpercentile(power, 5)), LOWEST_FORCE_LIMIT), None)
    ax.legend(loc="upper right", ncols=3, fontsize=6, frameon=False)
    ax.set_ylabel("FR-CFAR\nN²", fontsize=8)


def _range(ax: Axes, plotted: PlottedFlight) -> None:
    """Draw the measured range to the ground."""
    ax.plot(plotted.time_s, plotted.log["zrange_m"], color=GREEN, lw=0.9)
    ax.set_ylabel("down range\nm (truth)", fontsize=8)


def _finish(ax: Axes, label: str, values: np.ndarray, legend: bool = True) -> None:
    """Set the label, and the limits by the values, (n,) or (n, curves); with a legend unless it says not."""
    limit(ax, *np.atleast_2d(values.T))
    ax.set_ylabel(label, fontsize=8)
    if legend:
        ax.legend(loc="lower right", bbox_to_anchor=(1.0, 0.95), ncols=3, fontsize=7, frameon=False, borderpad=0.1)
