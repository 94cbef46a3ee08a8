"""Sentences and rows on the comparison of a twin with the recorded flights, for terminal and report."""

from collections.abc import Sequence

from airtouch.twin.comparison.compare import Gap
from airtouch.twin.comparison.two_sample import Auroc

#: AUROC of the worst phase below which twin and flights count as hard to tell apart; random halves of the authors'
#: flights have up to 0.65 (host/docs/twin-findings.md, can a classifier tell). No other source: round number
HARD_TO_TELL = 0.6


def answer(auroc: Sequence[Auroc]) -> str:
    """The AUROC of all phases in a sentence."""
    if not auroc:
        return "Too few flights of any phase for a classifier to be scored."
    worst = max(auroc, key=lambda a: a.value)
    best = min(auroc, key=lambda a: a.value)
    if worst.value < HARD_TO_TELL:
        return f"A classifier hardly tells the twin from the drone: AUROC {worst.value:.2f} at most ({worst.phase})."
    return (f"A classifier tells the twin from the drone with AUROC {best.value:.3f} ({best.phase}) to "
            f"{worst.value:.3f} ({worst.phase}); 0.5 is closed.")


def gap_row(gap: Gap) -> tuple[str, str, str, str, int]:
    """The row (where, what, difference with unit, difference in scatters, flights) of a feature."""
    digits = ".0f" if gap.feature.unit in ("PWM", "PWM/s") else ".2f"
    unit = "" if gap.feature.unit == "1" else f" {gap.feature.unit}"
    return (gap.feature.group, gap.feature.name, f"{gap.difference:+{digits}}{unit}", f"{gap.scatters:+.1f}",
            gap.flights)
