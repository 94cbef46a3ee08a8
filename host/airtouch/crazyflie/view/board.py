"""The live view of a flight, its data and its layout: the same for a drone and for a recorded flight."""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from airtouch.crazyflie.view.sparkline import sparkline, text_map

SECONDS = 10.0  #: s of signals shown
WIDTH = 50
#: positions of the track at most, the newest of them, 20 s of a drone, that are not thinned, and those that stay of the
#: older ones; round numbers
MOST_TRACK, DENSE_TRACK, THIN_TRACK = 2000, 400, 800
#: label -> (function of the columns, lower and upper end of the scale, unit)
SIGNALS = {
    "P(over)": (None, 0.0, 1.0, ""),
    "acc z": (lambda c: c.get("acc_z_mps2", c.get("acc_world_z_mps2")), 8.8, 10.8, "m/s²"),
    "rates": (lambda c: np.sqrt(sum(c[f"gyro_{a}_radps"] ** 2 for a in "xyz")), 0.0, 1.0, "rad/s"),
    "m4 - m1": (lambda c: c["m4_pwm"] - c["m1_pwm"], -8000.0, 8000.0, "PWM"),
    "down": (lambda c: c.get("zrange_m"), 0.0, 1.2, "m"),
}


@dataclass(frozen=True)
class ReportedEdge:
    """A detected edge: kind, time of its report (s from the start), position (m), and probability."""

    kind: str
    at_s: float
    x_m: float
    y_m: float
    probability: float


@dataclass
class Link:
    """State of the link: rate (Hz), fraction of lost samples, lateness, round trip and silence (s)."""

    rate_hz: float = float("nan")
    lost: float = 0.0
    late_s: float = float("nan")
    round_trip_s: float = float("nan")
    silent_s: float = 0.0

    def __str__(self) -> str:
        if self.silent_s > 1.0:
            return f"SILENT for {self.silent_s:.1f} s"
        if not np.isfinite(self.rate_hz):
            return "waiting for data"
        ways = [f"{self.rate_hz:.0f} Hz", f"{100 * self.lost:.1f} % lost"]
        if np.isfinite(self.late_s):
            ways.append(f"late {1000 * self.late_s:.0f} ms")
        if np.isfinite(self.round_trip_s):
            ways.append(f"round trip {1000 * self.round_trip_s:.0f} ms")
        return ", ".join(ways)


@dataclass
class Board:
    """Data of the live view: signals of the last SECONDS, track, edges, link.

    lag_s: delay from a crossing to its report; an edge is placed on the track that much earlier.
    restarts: how often the drone's clock began again; now_s and edges are since the last time.
    """

    title: str
    detector: str
    lag_s: float = 0.0
    link: Link | None = None
    status: str = ""
    now_s: float = 0.0
    restarts: int = 0
    edges: list[ReportedEdge] = field(default_factory=list)
    latest: dict[str, float] = field(default_factory=dict)
    _signals: dict[str, deque] = field(
        default_factory=lambda: {name: deque(maxlen=int(100 * SECONDS)) for name in SIGNALS})
    _track: list[tuple[float, float, float]] = field(default_factory=list)

    def add(self, times_s: np.ndarray, columns: Mapping[str, np.ndarray], probability: np.ndarray) -> None:
        """Append rows: seconds from the start, SI columns, and P(over a platform) or NaN; each (n,)."""
        if not len(times_s):
            return
        self.now_s = float(times_s[-1])
        self.latest = {name: float(values[-1]) for name, values in columns.items()}
        for name, (make, *_) in SIGNALS.items():
            try:
                values = probability if make is None else make(columns)
            except KeyError:  # a sensor that the log lacks
                values = None
            self._signals[name].extend(np.full(len(times_s), np.nan) if values is None else values)
        if "x_m" in columns and "y_m" in columns:
            self._track += zip(times_s[::5], columns["x_m"][::5], columns["y_m"][::5], strict=True)
            if len(self._track) > MOST_TRACK:
                self._track = thinned(self._track[:-DENSE_TRACK]) + self._track[-DENSE_TRACK:]

    def clear(self) -> None:
        """Forget signals, track and edges: their times are of a clock that begins again."""
        for values in (*self._signals.values(), self._track, self.edges):
            values.clear()
        self.now_s, self.restarts = 0.0, self.restarts + 1

    def closing_line(self) -> str:
        """What was watched, as one line: seconds, link and edges, all since the last restart of the drone."""
        since = " since the drone's last restart" if self.restarts else ""
        return (f"{self.now_s:.1f} s watched{since}: {self.link or 'no data'}; {len(self.edges)} edges "
                f"({self.detector})")

    def add_edge(self, kind: str, at_s: float, probability: float) -> ReportedEdge:
        """Add an edge reported at `at_s`. Its position is that of the drone one lag earlier."""
        known = [p for p in self._track if np.isfinite(p[1])]
        times = np.array([p[0] for p in known])
        i = int(np.searchsorted(times, at_s - self.lag_s)) if known else 0
        x, y = known[min(i, len(known) - 1)][1:] if known else (float("nan"), float("nan"))
        edge = ReportedEdge(kind, at_s, float(x), float(y), probability)
        self.edges.append(edge)
        return edge

    def line(self) -> str:
        """The view as one line, for output that is no terminal."""
        value = self.latest.get
        parts = [f"{self.now_s:7.1f} s", f"P {self._last('P(over)'):.2f}",
                 f"down {value('zrange_m', np.nan):.2f} m", f"{len(self.edges)} edges"]
        parts += [f"{value('vbat_V'):.2f} V"] if np.isfinite(value("vbat_V", np.nan)) else []
        parts += [str(self.link)] if self.link else []
        return "  ".join(parts + ([self.status] if self.status else []))

    def render(self):
        """The whole view as a renderable of rich."""
        from rich.columns import Columns
        from rich.panel import Panel
        from rich.table import Table
        from rich.text import Text

        signals = Table.grid(padding=(0, 1))
        for name, (_, low, high, unit) in SIGNALS.items():
            signals.add_row(name, Text(sparkline(self._signals[name], WIDTH, low, high), style="cyan"),
                            f"{self._last(name):8.2f} {unit}")
        if np.isfinite(self.latest.get("vbat_V", np.nan)):
            signals.add_row("battery", "", f"{self.latest['vbat_V']:8.2f} V")
        latest = [f"{f.kind:5} {f.at_s:6.2f} s  x {f.x_m:+.2f} y {f.y_m:+.2f} m  P {f.probability:.2f}"
                 for f in self.edges[-6:]]
        below = "\n".join([f"edges ({len(self.edges)}, {self.detector})", *latest])
        track = np.array([(x, y) for _, x, y in self._track]).reshape(-1, 2)
        plan = Text("\n".join(text_map(track, [(f.x_m, f.y_m, f.kind) for f in self.edges])))
        foot = "   ".join(part for part in (str(self.link) if self.link else "", self.status) if part)
        panels = [Panel(signals, title=f"last {SECONDS:g} s"),
                  Panel(plan, title="from above: [ entry  ] exit  o drone"), Panel(below)]
        return Panel(Columns(panels), title=f"{self.title}   {self.now_s:.1f} s", subtitle=foot)

    def _last(self, name: str) -> float:
        return float(self._signals[name][-1]) if self._signals[name] else float("nan")


def thinned(track: list[tuple[float, float, float]]) -> list[tuple[float, float, float]]:
    """Some THIN_TRACK positions of a track, (time, x, y) each, evenly in time."""
    times = np.array([at for at, *_ in track])
    slot = np.floor(THIN_TRACK * (times - times[0]) / max(times[-1] - times[0], 1e-9))
    return [track[i] for i in np.unique(slot, return_index=True)[1]]


def edge_line(edge: ReportedEdge) -> str:
    """A detected edge as one line of text."""
    place = f", x {edge.x_m:+.2f} m, y {edge.y_m:+.2f} m" if np.isfinite(edge.x_m) else ""
    return f"{edge.kind} detected at {edge.at_s:.2f} s{place} (P {edge.probability:.2f})"
