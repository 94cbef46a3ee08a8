"""Table 1: power of each stage, measured if there is an INA219 log, otherwise estimated."""

import math
from pathlib import Path
from typing import Any

from airtouch.errors import AirTouchError
from airtouch.paper_figures import pictures, words
from airtouch.paper_figures.claims import CLAIMS, UNTESTABLE
from airtouch.paper_figures.figure import Figure, Job, Missing, Verdict
from airtouch.power import ina219, stages

NEGLIGIBLE = 0.05  #: fraction of the propellers' power; no source: round number, the paper finds 0.014 negligible


def power(job: Job) -> Figure:
    """The paper's Table 1 beside a measurement or an estimate."""
    return measured_power(job.power_log) if job.power_log else estimated_power()


def measured_power(log: Path) -> Figure:
    """Table 1 from a power log with a column of stages. Raises AirTouchError if it cannot be read."""
    try:
        trace = ina219.parse(log.read_text(encoding="utf-8", errors="replace"), str(log))
    except OSError as error:
        raise AirTouchError(f"{log}: cannot be read: {error.strerror}") from None
    measured = ina219.by_stage(trace, tuple(stages.PAPER_MW))
    if lacking := [name for name in stages.PAPER_MW if name not in measured]:
        raise AirTouchError(f"{log}: no stage {', '.join(lacking)}; Table 1 needs {', '.join(stages.PAPER_MW)}; "
                            "the sketch in tools/power writes a column of stages")
    powers = {name: measured[name] for name in stages.PAPER_MW}
    others = [name for name in measured if name not in powers]
    rows = [{"what": stages.NAMES.get(name, name), "mw": mw, "low_mw": mw - half, "high_mw": mw + half,
             "paper_mw": stages.PAPER_MW.get(name), "seconds": powers[name].seconds, "lines": powers[name].lines}
            for name, (mw, half) in ina219.added_power(powers).items()]
    total, idle = powers["network"], powers["baseline"]  # a stage runs on top of those before it
    added = total.mw - idle.mw, math.hypot(total.half_mw, idle.half_mw)
    of_paper = sum(stages.PAPER_MW.values()) - stages.PAPER_MW["baseline"]
    same = words.all_of([_same(total.mw, total.half_mw, CLAIMS["power"].values[0]), _same(*added, of_paper)])
    verdicts = {"power": words.verdict(same, f"total {_interval(total.mw, total.half_mw)}, of which "
                                             f"{_interval(*added)} for AirTouch, over {total.seconds:.0f} s",
                                      "the paper's stages"),
                "negligible": _negligible(*added, "measured")}
    caption = (f"Measured with an INA219: {log.name}; 95 % intervals from blocks of 1 s."
               + (f" Left out, stages that the paper does not have: {', '.join(others)}." if others else ""))
    return Figure("Power", rows, caption, verdicts, lambda canvas: _draw(canvas, rows))


def _same(mw: float, half_mw: float, paper_mw: float) -> bool | None:
    """Whether a measured power is the paper's; None for undecided, as with an interval that is unknown (NaN).

    Yes: the 95 % interval lies within ERROR_MARGIN of the paper's, whether it holds that or not. No: it reaches beyond
    the margin and leaves the paper's out.
    """
    off = abs(mw - paper_mw)
    return words.decided(off + half_mw <= words.ERROR_MARGIN * paper_mw, off > half_mw)


def _interval(mw: float, half_mw: float) -> str:
    if math.isnan(half_mw):
        return f"{mw:.1f} mW [interval unknown: log each stage for some seconds]"
    return f"{mw:.1f} mW [{mw - half_mw:.1f}, {mw + half_mw:.1f}]"


def estimated_power() -> Figure:
    """Table 1 estimated from instruction counts. Raises Missing without the counts."""
    if not stages.BUDGETS.is_dir():
        raise Missing("the counted instructions are in a checkout alone (tools/instruction_counts); clone the "
                      "repository, or measure and give --power-log")
    estimates = stages.estimate(*(stages.counts(stages.BUDGETS / f"{n}.toml") for n in ("budget", "gap8_budget")))
    rows = [{"what": stages.NAMES.get(name, name), "mw": (e.low_mw + e.high_mw) / 2, "low_mw": e.low_mw,
             "high_mw": e.high_mw, "instructions_a_step": e.instructions,
             "paper_mw": stages.PAPER_MW.get(name.split(",")[0])} for name, e in estimates.items()]
    stages_of_paper = [estimates[n] for n in ("FC-FE", "CCS-FF", "filter", "network, paper on the GAP8")]
    low, high = sum(p.low_mw for p in stages_of_paper), sum(p.high_mw for p in stages_of_paper)
    verdicts = {"power": Verdict(UNTESTABLE, f"no meter here; the work itself is estimated at {low:.1f} to {high:.1f} "
                                             "mW for the paper's stages (43 mW there), from counted instructions, "
                                             "without idle power, clocks and regulators"),
                "negligible": _negligible(high, 0.0, "estimated, at most")}
    return Figure("Power", rows, "An estimate, nothing was measured: instructions counted in the emulator times "
                                 "energy an instruction, 100 steps a second (power.md). A log of an INA219 is read "
                                 "with --power-log.", verdicts,
                  lambda canvas: _draw(canvas, rows))


def _negligible(mw: float, half_mw: float, source: str) -> Verdict:
    """Whether a power is small beside the propellers'; undecided too where the log says that it is less than 0."""
    propellers = CLAIMS["negligible"].values[0]
    low, high = mw - half_mw, mw + half_mw
    answer = words.decided(0.0 <= high < NEGLIGIBLE * propellers, low >= NEGLIGIBLE * propellers)
    return words.verdict(answer,
                         f"{source} {mw:.1f} mW are {100 * mw / propellers:.1f} % of the paper's 3000 mW; the paper's "
                         "own 43 mW are 1.4 %. The propellers' power was not measured here", "the paper's stages")


def _draw(canvas: Any, rows: list[dict[str, Any]]) -> None:
    """Draw the power of each stage beside the paper's."""
    axes = canvas.subplots()
    places = range(len(rows))
    axes.barh([p - 0.2 for p in places], [r["mw"] for r in rows], height=0.38, color=pictures.COLOURS["best"],
              label="here",
              xerr=[[r["mw"] - r["low_mw"] for r in rows], [r["high_mw"] - r["mw"] for r in rows]])
    axes.barh([p + 0.2 for p in places], [r["paper_mw"] or 0.0 for r in rows], height=0.38, color=pictures.PAPER,
              label="paper, measured")
    axes.set_yticks(places, [r["what"] for r in rows], fontsize=7)
    axes.invert_yaxis()
    axes.set(xlabel="power, mW (logarithmic)", xscale="log", xlim=(0.01, 200))
    axes.legend(fontsize=7, frameon=False)
