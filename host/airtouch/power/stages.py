"""The paper's Table 1: what each stage needs, measured by an INA219 or estimated from counted instructions.

Sources and limits of the estimate: host/docs/power.md.
"""

import math
import tomllib
from dataclasses import dataclass
from pathlib import Path

from airtouch.detector.best.recipe import STRIDE
from airtouch.errors import AirTouchError
from airtouch.power.ina219 import Power, added

#: stage -> the paper's figure, mW (Table 1), in the order in which stages are switched on
PAPER_MW = {"baseline": 78.0, "FC-FE": 6.0, "CCS-FF": 2.0, "filter": 2.0, "network": 33.0}
PAPER_TOTAL_MW = 121.0
NAMES = {"baseline": "Basic drone module power", "FC-FE": "Fluctuation Components Feature Extraction",
         "CCS-FF": "Cascaded Cross-Spectrum Feature Fusion", "filter": "Double Phase Physical Filter",
         "network": "Physical Knowledge-aided Network"}
STEP_HZ = 100.0
#: folder of the counted instructions, in a checkout alone
BUDGETS = Path(__file__).resolve().parents[3] / "tests" / "emulation"


def table(stages: dict[str, Power]) -> str:
    """Table 1: what each stage adds, its energy a step, and the paper's figure."""
    lines = [f"{'':44} {'measured, mW':>22} {'a step, uJ':>11} {'paper, mW':>10} {'n, s':>14}"]
    for name, (mw, half) in added(stages).items():
        interval = f"{mw:8.1f} [{mw - half:.1f}, {mw + half:.1f}]" if math.isfinite(half) else f"{mw:8.1f}"
        a_step = "" if name == "baseline" else f"{1e3 * mw / STEP_HZ:.0f}"
        paper = f"{PAPER_MW[name]:.0f}" if name in PAPER_MW else ""
        s = stages[name]
        lines.append(f"{NAMES.get(name, name):44} {interval:>22} {a_step:>11} {paper:>10} "
                     f"{s.lines:>7}, {s.seconds:5.1f}")
    total = list(stages.values())[-1]
    interval = f"[{total.mw - total.half_mw:.1f}, {total.mw + total.half_mw:.1f}]"
    lines.append(f"{'Total':44} {total.mw:8.1f} {interval}{'':>14} {PAPER_TOTAL_MW:>7.0f}")
    return "\n".join(lines)


# Without a meter.

#: mA that a busy STM32F405 at 168 MHz draws over a sleeping one. crazyflie-firmware,
#: src/modules/src/system.c,
#: vApplicationIdleHook: sleeping "currently saves about 20mA"; that is an average over a processor that also
#: works, so the full difference is larger: twice that where it works half of the time.
STM32_MA = (20.0, 40.0)
STM32_HZ = 168e6
STM32_CPI = (1.0, 2.0)  #: cycles an instruction; assumed: flash waits, loads and divisions make more than one
BATTERY_V = 3.7  #: behind a linear regulator the battery gives the same current
#: joules an instruction of one of the GAP8's eight cores, its whole board included: PULP-DroNet needs 64 mW
#: with
#: the cluster at 100 MHz, 1.0 V (Palossi et al., IEEE IoT Journal 2019); as if all cores were
#: always busy, so at least that
GAP8_J = 64e-3 / (8 * 100e6)
GAP8_CORES = 8
#: stage -> kernels of the budget that run in every step
KERNELS = {"FC-FE": ("band_power",), "CCS-FF": ("cross_spectrum",),
           "filter": ("disturbance_force", "fr_cfar")}


@dataclass(frozen=True)
class Estimate:
    """What a stage needs at 100 steps a second: low and high mW, and of how many instructions a step."""

    low_mw: float
    high_mw: float
    instructions: float


def stm32_mw(instructions: float) -> tuple[float, float]:
    """Low and high mW at the battery of so many instructions a step, 100 steps a second."""
    low, high = (1e3 * instructions * STEP_HZ * cpi / STM32_HZ * 1e-3 * ma * BATTERY_V
                 for cpi, ma in zip(STM32_CPI, STM32_MA, strict=True))
    return low, high


def instructions(budget: dict, kernel: str) -> float:
    """Mean instructions a step of a kernel on the Cortex-M4.

    Raises AirTouchError where the budget lacks it.
    """
    try:
        return float(budget["cortex-m4"][kernel]["instructions_mean"])
    except (KeyError, TypeError, ValueError):
        raise AirTouchError(f"the budget has no instructions_mean for cortex-m4.{kernel}; count again with "
                            "python -m tools.emulator.count") from None


def gap8_mw(network: dict) -> Estimate:
    """A network on the GAP8: high is plain C, low the eight cores with their own instructions where they were
    counted."""
    try:
        count = float(network["step_instructions"] if "step_instructions" in network
                      else network["window_instructions"])
        cycles = GAP8_CORES * float(network["cycles_8"]) if "window_instructions" in network else count
    except (KeyError, TypeError, ValueError):
        raise AirTouchError("the GAP8's budget has no instructions and cycles of a network; count again with "
                            "python tools/gap8_figures.py --counts") from None
    low, high = sorted(1e3 * n * STEP_HZ * GAP8_J for n in (min(cycles, count), count))
    return Estimate(low, high, count)


def estimate(budget: dict, gap8: dict) -> dict[str, Estimate]:
    """Stages of the table from counts: kernels on the STM32, networks on the GAP8."""
    found = {stage: sum(instructions(budget, k) for k in kernels) for stage, kernels in KERNELS.items()}
    result = {stage: Estimate(*stm32_mw(count), count) for stage, count in found.items()}
    result |= {f"network, {name} on the GAP8": gap8_mw(network) for name, network in gap8.items()}
    # the network and its decoder run on every STRIDE-th sample, and the budget counts those
    count = sum(instructions(budget, k) for k in ("stream_int8", "edge_decoder")) / STRIDE
    count += instructions(budget, "motion_channels")
    result["network, best on the STM32 instead"] = Estimate(*stm32_mw(count), count)
    return result


def estimate_table(found: dict[str, Estimate]) -> str:
    """The estimate as text that says what it is."""
    lines = [f"{'ESTIMATE, nothing was measured':44} {'mW':>14} {'instructions a step':>20} "
             f"{'paper, measured, mW':>20}"]
    for name, e in found.items():
        shown = f"{e.low_mw:.2f} to {e.high_mw:.2f}" if e.high_mw > e.low_mw else f"{e.low_mw:.2f}"
        paper = PAPER_MW.get(name.split(",")[0])
        lines.append(f"{NAMES.get(name, name):44} {shown:>14} {e.instructions:>20.0f} "
                     f"{'' if paper is None else f'{paper:.0f}':>20}")
    return "\n".join([
        *lines, "ESTIMATE: instructions counted in the emulator (tests/emulation/*budget.toml, 3 % above the counts)",
        f"times 1 to 2 cycles x 20 to 40 mA at 168 MHz x {BATTERY_V:g} V (STM32), {1e12 * GAP8_J:.0f} pJ (GAP8). "
        "Sources and limits: host/docs/power.md"])


def counts(path: Path) -> dict:
    """A budget file. Raises AirTouchError for one that cannot be read."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise AirTouchError(f"{path}: cannot be read as a budget: {error}") from None
