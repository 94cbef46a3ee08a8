"""The paper's Table 1: power of each stage, measured by an INA219 or estimated from counted instructions.

Sources and limits of the estimate: host/docs/power.md.
"""

import math
import tomllib
from dataclasses import dataclass
from pathlib import Path

from airtouch.detector.best.recipe import ROW_STRIDE
from airtouch.errors import AirTouchError
from airtouch.parameters import SAMPLE_RATE_HZ
from airtouch.power.ina219 import Power, added_power

#: stage -> the paper's figure, mW (Table 1), in the order in which stages are switched on
PAPER_MW = {"baseline": 78.0, "FC-FE": 6.0, "CCS-FF": 2.0, "filter": 2.0, "network": 33.0}
PAPER_TOTAL_MW = 121.0  #: mW, the total of Table 1
NAMES = {"baseline": "Basic drone module power", "FC-FE": "Fluctuation Components Feature Extraction",
         "CCS-FF": "Cascaded Cross-Spectrum Feature Fusion", "filter": "Double Phase Physical Filter",
         "network": "Physical Knowledge-aided Network"}
#: folder of the instruction counts; only in a checkout
BUDGETS = Path(__file__).resolve().parents[3] / "tools" / "instruction_counts"


def table(stages: dict[str, Power]) -> str:
    """Table 1 as text: power added by each stage with its interval, energy per step, and the paper's figure."""
    lines = [f"{'':44} {'measured, mW':>22} {'a step, uJ':>11} {'paper, mW':>10} {'n, s':>14}"]
    for name, (mw, half) in added_power(stages).items():
        a_step = "" if name == "baseline" else f"{1e3 * mw / SAMPLE_RATE_HZ:.0f}"
        paper = f"{PAPER_MW[name]:.0f}" if name in PAPER_MW else ""
        s = stages[name]
        lines.append(f"{NAMES.get(name, name):44} {_interval(mw, half):>22} {a_step:>11} {paper:>10} "
                     f"{s.lines:>7}, {s.seconds:5.1f}")
    total = list(stages.values())[-1]
    lines.append(f"{'Total':44} {_interval(total.mw, total.half_mw):>22} {'':>11} {PAPER_TOTAL_MW:>10.0f}")
    return "\n".join(lines)


def _interval(mw: float, half_mw: float) -> str:
    """A power with its interval, or alone where the interval is not known."""
    return f"{mw:8.1f}" + (f" [{mw - half_mw:.1f}, {mw + half_mw:.1f}]" if math.isfinite(half_mw) else "")


# The estimate, without a power meter.

#: mA, extra current of a busy STM32F405 at 168 MHz over a sleeping one: low and high. Source of the low value:
#: crazyflie-firmware, src/modules/src/system.c, vApplicationIdleHook: sleeping "currently saves about 20mA". That is
#: an average over a processor that also works; the high value assumes that it works half of the time.
STM32_MA = (20.0, 40.0)
STM32_HZ = 168e6  #: the STM32F405 of the Crazyflie 2.1 at full speed
STM32_CPI = (1.0, 2.0)  #: cycles per instruction, low and high; assumed: flash waits, loads and divisions take several
BATTERY_V = 3.7  #: V; the regulator is linear, so the battery's current equals the processor's
#: J per instruction of one of the GAP8's eight cores, including its board: PULP-DroNet needs 64 mW with the cluster
#: at 100 MHz and 1.0 V (Palossi et al., IEEE IoT Journal 2019). A lower bound: it assumes that all cores are busy.
GAP8_J = 64e-3 / (8 * 100e6)
GAP8_CORES = 8
#: stage -> kernels in the budget file that run in every step
KERNELS = {"FC-FE": ("band_power",), "CCS-FF": ("cross_spectrum",),
           "filter": ("disturbance_force", "fr_cfar")}


@dataclass(frozen=True)
class Estimate:
    """Estimated power of a stage at 100 steps a second, low and high in mW, and its instructions per step."""

    low_mw: float
    high_mw: float
    instructions: float


def stm32_mw(instructions: float) -> tuple[float, float]:
    """Power at the battery, low and high in mW, of this many instructions per step at 100 steps a second."""
    low, high = (1e3 * instructions * SAMPLE_RATE_HZ * cpi / STM32_HZ * 1e-3 * ma * BATTERY_V
                 for cpi, ma in zip(STM32_CPI, STM32_MA, strict=True))
    return low, high


def instructions(budget: dict, kernel: str) -> float:
    """Mean instructions per step of a kernel on the Cortex-M4. Raises AirTouchError if the budget lacks it."""
    try:
        return float(budget["cortex-m4"][kernel]["instructions_mean"])
    except (KeyError, TypeError, ValueError):
        raise AirTouchError(f"the budget has no instructions_mean for cortex-m4.{kernel}; count again with "
                            "python -m tools.instruction_counts.count") from None


def gap8_mw(network: dict) -> Estimate:
    """Estimate of a network on the GAP8: high is plain C on one core.

    Low is eight cores with the GAP8's own instructions, if those were counted; otherwise it equals high.
    Raises AirTouchError if the budget lacks the counts.
    """
    try:
        count = float(network["step_instructions"] if "step_instructions" in network
                      else network["window_instructions"])
        cycles = GAP8_CORES * float(network["cycles_8"]) if "window_instructions" in network else count
    except (KeyError, TypeError, ValueError):
        raise AirTouchError("the GAP8's budget has no instructions and cycles of a network; count again with "
                            "python -m tools.instruction_counts.gap8_figures --counts") from None
    low, high = sorted(1e3 * n * SAMPLE_RATE_HZ * GAP8_J for n in (min(cycles, count), count))
    return Estimate(low, high, count)


def estimate(budget: dict, gap8: dict) -> dict[str, Estimate]:
    """Stage -> estimate from instruction counts: kernels on the STM32, networks on the GAP8.

    budget, gap8: budget files as `counts` reads them.
    """
    sums = {stage: sum(instructions(budget, k) for k in kernels) for stage, kernels in KERNELS.items()}
    result = {stage: Estimate(*stm32_mw(count), count) for stage, count in sums.items()}
    result |= {f"network, {name} on the GAP8": gap8_mw(network) for name, network in gap8.items()}
    # the network and its decoder run on every ROW_STRIDE-th sample, and the budget counts those
    count = sum(instructions(budget, k) for k in ("stream_int8", "edge_decoder")) / ROW_STRIDE
    count += instructions(budget, "motion_channels")
    result["network, best on the STM32 instead"] = Estimate(*stm32_mw(count), count)
    return result


def estimate_table(estimates: dict[str, Estimate]) -> str:
    """The estimate as text, with its assumptions and marked as an estimate."""
    lines = [f"{'ESTIMATE, nothing was measured':44} {'mW':>14} {'instructions a step':>20} "
             f"{'paper, measured, mW':>20}"]
    for name, e in estimates.items():
        shown = f"{e.low_mw:.2f} to {e.high_mw:.2f}" if e.high_mw > e.low_mw else f"{e.low_mw:.2f}"
        paper = PAPER_MW.get(name.split(",")[0])
        lines.append(f"{NAMES.get(name, name):44} {shown:>14} {e.instructions:>20.0f} "
                     f"{'' if paper is None else f'{paper:.0f}':>20}")
    return "\n".join([
        *lines,
        "ESTIMATE: instructions counted in the emulator (tools/instruction_counts/*budget.toml, 3 % above the counts)",
        f"times 1 to 2 cycles x 20 to 40 mA at 168 MHz x {BATTERY_V:g} V (STM32), {1e12 * GAP8_J:.0f} pJ (GAP8). "
        "Sources and limits: host/docs/power.md"])


def counts(path: Path) -> dict:
    """The content of a budget file (TOML). Raises AirTouchError if it cannot be read."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise AirTouchError(f"{path}: cannot be read as a budget: {error}") from None
