"""Sentences and rows on the comparison of a twin with the recorded flights, for terminal and report."""

import math
from collections.abc import Sequence

from airtouch.twin.comparison.compare import Gap
from airtouch.twin.comparison.two_sample import Auroc

#: AUROC of the worst phase, or 1 less it, below which twin and flights count as hard to tell apart; random halves of
#: the authors' flights have up to 0.65 (host/docs/twin-findings.md, can a classifier tell). No other source: round
#: number
HARD_TO_TELL = 0.6


def answer(auroc: Sequence[Auroc]) -> str:
    """The AUROC of all phases that have one in a sentence. As far below 0.5 as above it counts as told as well."""
    scored = [a for a in auroc if math.isfinite(a.value)]
    if not scored:
        return "Too few flights of any phase for a classifier to be scored."
    worst = max(scored, key=lambda a: abs(a.value - 0.5))
    best = min(scored, key=lambda a: abs(a.value - 0.5))
    if abs(worst.value - 0.5) < HARD_TO_TELL - 0.5:
        bound = "at most" if worst.value >= 0.5 else "at least"
        return f"A classifier hardly tells the twin from the drone: AUROC {worst.value:.2f} {bound} ({worst.phase})."
    return (f"A classifier tells the twin from the drone with AUROC {best.value:.3f} ({best.phase}) to "
            f"{worst.value:.3f} ({worst.phase}); 0.5 is closed.")


def gap_row(gap: Gap) -> tuple[str, str, str, str, int]:
    """The row (where, what, difference with unit, difference in scatters, flights) of a feature."""
    digits = ".0f" if gap.feature.unit in ("PWM", "PWM/s") else ".2f"
    unit = "" if gap.feature.unit == "1" else f" {gap.feature.unit}"
    return (gap.feature.group, gap.feature.name, f"{gap.difference:+{digits}}{unit}", f"{gap.scatters:+.1f}",
            gap.flights)
