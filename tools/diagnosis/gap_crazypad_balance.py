"""Prints how well the balance of the motors in hover can name the damaged rotor and the family on CrazyPAD at most.

    python tools/diagnosis/gap_crazypad_balance.py [FOLDER] [--part build|all]    # 20 s

One change for a millimetre cut off a rotor is fitted to all conditions with cut blades, by their labels. The residual
is how a vehicle differs after maintenance: another set of propellers, for the most part. `Priors.maintenance` is this
scatter in the building conditions. Then
- a test of the rotor that knows how many rotors were cut, how much of each, and change and scatter of the other
  conditions; it only chooses which rotors. Severity is then measured along the right rotors' change.
- the diagnosis itself on drawn flights whose changes and scatter are those of its priors: no test on the same six
  numbers is right more often in the mean of the families. Cut rotors are drawn from the conditions of at least 1.5 mm.
The figures are in host/docs/gap-crazypad.md.
"""

import os
from collections.abc import Callable, Sequence

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
import numpy as np
from scipy.stats import spearmanr

from airtouch import vehicle as vehicles
from airtouch.detector.evaluation.bootstrap import resampled
from airtouch.errors import in_one_line
from airtouch.gap.balance.priors import PRIORS
from recordings.crazypad import figures, labels
from recordings.crazypad.balance import FLIGHTS, Balances, RotorTest, family_shares, fit, maintenance, rotor_tests
from recordings.crazypad.patterns import hover_patterns

AXES = "lift, roll, pitch, yaw"  #: the balance's four numbers, as they are printed


def show_scatter(b: Balances) -> None:
    """Print the fit, the rms of its residuals, and the `maintenance` scatter that follows."""
    (slope, yaw), residuals = fit(b.means, b.cuts)
    print(f"{len(b.pairs)} conditions with cut blades: {100 * slope:.1f} % more command to a rotor for each mm, "
          f"yaw {yaw:.2f} of what follows from it")
    for text, values in (("between flights of a condition", b.within()),
                         ("left of the conditions, rms", np.sqrt((residuals ** 2).mean(axis=0))),
                         ("scatter by maintenance that makes these likeliest",
                          maintenance(residuals, b.nominal(), PRIORS.freedom))):
        print(f"{text}, {AXES}: " + ", ".join(f"{100 * v:.1f} %" for v in values))


def show_conditions(b: Balances) -> None:
    """Print the mean change of the balance in each condition with cut blades."""
    print(f"\nchange from the drone's normal flights, {AXES}")
    for pair, mean in zip(b.pairs, b.means, strict=True):
        print(f"  {' '.join(pair):55s} " + ", ".join(f"{100 * v:.1f} %" for v in mean))


def show_rotor(tests: list[RotorTest]) -> None:
    """Print what the balance says of which rotor was cut, to a test that knows the rest."""
    print("\n| cut | flights | the cut changes less than two sets of propellers differ | changed to the predicted "
          "side | exact rotors, labels of their number and the mm | expected of these | severity, labels of the "
          "rotors |\n|---|---|---|---|---|---|---|")
    for text, large in (("all", False), ("at least 1.5 mm off a rotor", True)):
        group = [t for t in tests if not large or labels.large(t.pair[1])]
        flights = sum(len(t.hits) for t in group)
        small, sides = sum(len(t.hits) for t in group if t.small), sum(int(t.sides.sum()) for t in group)
        expected = sum(t.expected * len(t.hits) for t in group) / flights
        print(f"| {text} | {flights} | {small} | {sides} | {_with_interval(group, _share_right)} | {expected:.2f} | "
              f"{_with_interval(group, _severity)} |")
    for t in tests:
        print(f"  {' '.join(t.pair):55s} {t.hits.sum()} of {len(t.hits)}, expected {t.expected:.2f}"
              f"{', small' if t.small else ''}")


def _share_right(tests: Sequence[RotorTest]) -> float:
    """Share of flights whose rotors are named right."""
    return float(np.concatenate([t.hits for t in tests]).mean())


def _severity(tests: Sequence[RotorTest]) -> float:
    """Spearman's rank correlation of measured and true millimetres; NaN where all cuts are the same."""
    true = np.concatenate([np.full(len(t.mm), labels.cut_mm(t.pair[1])) for t in tests])
    if len(set(true)) == 1:
        return float("nan")
    return float(spearmanr(np.concatenate([t.mm for t in tests]), true).statistic)


def _with_interval(tests: Sequence[RotorTest], figure: Callable[[Sequence[RotorTest]], float]) -> str:
    """A figure with its 90 % interval, conditions resampled; a dash and why where it is NaN."""
    value = figure(tests)
    if np.isnan(value):
        return "- (all cuts are the same)"
    low, high = resampled(lambda pick: figure([tests[i] for i in pick]), len(tests), replicates=figures.RESAMPLES,
                          level=0.9)
    return f"{value:.2f} ({low:.2f} to {high:.2f})"


def show_family(b: Balances, vehicle: vehicles.Vehicle) -> None:
    """Print how often the diagnosis is right on flights of each family that are drawn from its priors."""
    print(f"\nthe diagnosis on {FLIGHTS} flights of each family, drawn from its priors")
    for drone, right in family_shares(b, vehicle):
        print(f"{drone}: family, balanced {np.mean(list(right.values())):.2f}; "
              + ", ".join(f"{k} {v:.2f}" for k, v in right.items()))


def main() -> None:
    """Print scatter, conditions, rotors and families."""
    options = labels.folder_and_part(__doc__)
    rows, vehicle = labels.manifest(options.folder, options.part), vehicles.load(labels.VEHICLE)
    balances = Balances(rows, hover_patterns(options.folder, rows, vehicle))
    show_scatter(balances)
    show_conditions(balances)
    show_rotor(rotor_tests(balances))
    show_family(balances, vehicle)


if __name__ == "__main__":
    with in_one_line("gap_crazypad_balance"):
        main()
