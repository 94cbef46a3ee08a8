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
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import permutations

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
import numpy as np
from scipy.optimize import least_squares, minimize_scalar
from scipy.stats import spearmanr
from scipy.stats import t as student

from airtouch import vehicle as vehicles
from airtouch.detector.evaluation.bootstrap import resampled
from airtouch.errors import in_one_line
from airtouch.gap.balance import hover_balance
from airtouch.gap.balance.hover_hypotheses import commanded_change, hypotheses
from airtouch.gap.balance.hover_pattern import LEAST_POWER, HoverPattern
from airtouch.gap.balance.priors import PRIORS, STEADY
from recordings.crazypad import figures, labels
from recordings.crazypad.patterns import hover_patterns, likeliest

DRAWS = 4000  #: of the scatter, for the expected fraction of right rotors; no source: round number, good to 0.01
FLIGHTS = 400  #: drawn of each family; no source: round number, good to 0.03
SMALL = 2.0  #: times the variance of one set of propellers in each axis: what two sets differ by
MOST_MAINTENANCE = 0.1  #: upper bound of the scatter of vehicles after maintenance; no source: far above what was found
#: the balance's four numbers, as they are printed
AXES = "lift, roll, pitch, yaw"
Condition = tuple[str, str]  #: drone and what was done to it


def change(cut: dict[int, float], slope: float, yaw: float) -> np.ndarray:
    """Change (4,) of the balance where so many millimetres are cut off these rotors.

    slope: growth of a rotor's commanded thrust, 1/mm. yaw: ratio of the change of
    yaw to that of a rotor whose torque follows its thrust.
    """
    command = np.ones(4)
    for rotor, mm in cut.items():
        command[rotor - 1] += slope * mm
    return commanded_change(command[None])[0] * (1.0, 1.0, 1.0, yaw)


def fit(means: np.ndarray, cuts: list[dict[int, float]]) -> tuple[np.ndarray, np.ndarray]:
    """Slope and yaw ratio (2,) that fit the balances (conditions, 4) best, and their residuals (conditions, 4)."""
    def residuals(x: np.ndarray) -> np.ndarray:
        """Residuals (conditions, 4) with slope and yaw ratio x."""
        return np.array([m - change(c, *x) for m, c in zip(means, cuts, strict=True)])

    solution = least_squares(lambda x: residuals(x).ravel(), (0.03, 1.0)).x
    return solution, residuals(solution)


def maintenance(residuals: np.ndarray, nominal: np.ndarray, freedom: float) -> np.ndarray:
    """Scatter (4,) beside the nominal variances (conditions, 4) that makes the residuals (conditions, 4) likeliest.

    Roll and pitch have one, as the vehicle is symmetric; the tail is Student's, as the diagnosis takes it.
    """
    def scatter(columns: list[int]) -> float:
        """The likeliest scatter of these columns together."""
        def minus_log(extra: float) -> float:
            """Minus the log likelihood of a scatter."""
            width = np.sqrt(nominal[:, columns] + extra ** 2)
            return -float((student.logpdf(residuals[:, columns] / width, freedom) - np.log(width)).sum())
        return float(minimize_scalar(minus_log, bounds=(0.0, MOST_MAINTENANCE), method="bounded").x)

    sides = scatter([1, 2])
    return np.array([scatter([0]), sides, sides, scatter([3])])


class Balances:
    """Balances of the flights over the drone's normal ones.

    bases: by drone; difference (flights, 6): over all normal flights of the drone; pairs: conditions with cut blades.
    """

    def __init__(self, rows: Sequence[dict[str, str]], patterns: list[HoverPattern]) -> None:
        drone, normal = [r["drone"] for r in rows], np.array([labels.family(r["condition"]) == "normal" for r in rows])
        self.bases = {d: hover_balance.reference([patterns[i] for i in np.flatnonzero(normal & (np.array(drone) == d))])
                      for d in sorted(set(drone))}
        self.difference = np.array([self.bases[d].difference(p) for d, p in zip(drone, patterns, strict=True)])
        self.of = [(r["drone"], r["condition"]) for r in rows]
        self.pairs = sorted({p for p in self.of if np.isfinite(labels.cut_mm(p[1]))})
        self.cuts = [labels.millimetres(condition) for _, condition in self.pairs]
        self.means = np.array([self.own(p).mean(axis=0) for p in self.pairs])

    def own(self, pair: Condition) -> np.ndarray:
        """Differences (flights, 4) of one condition."""
        return self.difference[[p == pair for p in self.of], hover_balance.BALANCE]


def show_scatter(b: Balances) -> None:
    """Print the fit, the rms of its residuals, and the `maintenance` scatter that follows."""
    (slope, yaw), residuals = fit(b.means, b.cuts)
    each = [b.own(p) - b.own(p).mean(axis=0) for p in sorted(set(b.of))]
    within = np.sqrt((np.concatenate(each) ** 2).sum(axis=0) / sum(len(e) - 1 for e in each))
    print(f"{len(b.pairs)} conditions with cut blades: {100 * slope:.1f} % more command to a rotor for each mm, "
          f"yaw {yaw:.2f} of what follows from it")
    nominal = np.array([b.bases[drone].variance[hover_balance.BALANCE] for drone, _ in b.pairs])
    for text, values in (("between flights of a condition", within),
                         ("left of the conditions, rms", np.sqrt((residuals ** 2).mean(axis=0))),
                         ("scatter by maintenance that makes these likeliest",
                          maintenance(residuals, nominal, PRIORS.freedom))):
        print(f"{text}, {AXES}: " + ", ".join(f"{100 * v:.1f} %" for v in values))


def _rivals(cut: dict[int, float]) -> Iterator[dict[int, float]]:
    """The same millimetres on as many rotors, in every way."""
    for rotors in permutations((1, 2, 3, 4), len(cut)):
        yield dict(zip(rotors, cut.values(), strict=True))


@dataclass(frozen=True)
class RotorTest:
    """A condition as a test of the rotor sees it.

    small: whether the cut changes less than two sets of propellers differ; expected: fraction right, if residuals are
    normal; sides, hits (flights,): whether the change is to the predicted side, the rotors right; mm (flights,): of
    the cut, as measured.
    """

    pair: Condition
    small: bool
    expected: float
    sides: np.ndarray
    hits: np.ndarray
    mm: np.ndarray


def rotor_tests(b: Balances) -> list[RotorTest]:
    """Each condition with cut blades, change and scatter fitted to the others."""
    out, generator = [], np.random.default_rng(0)
    for k, pair in enumerate(b.pairs):
        rest = np.arange(len(b.pairs)) != k
        solution, residuals = fit(b.means[rest], [c for c, r in zip(b.cuts, rest, strict=True) if r])
        whiten = np.linalg.inv(np.linalg.cholesky(residuals.T @ residuals / (rest.sum() - 2))).T
        out.append(rotor_test(pair, b.own(pair), solution, whiten, generator))
    return out


def rotor_test(pair: Condition, balances: np.ndarray, solution: np.ndarray, whiten: np.ndarray,
               generator: np.random.Generator) -> RotorTest:
    """The test of one condition's balances (flights, 4).

    solution: slope and yaw ratio (2,) of `fit`; whiten (4, 4): makes the scatter of balances that of unit noise.
    """
    cut = labels.millimetres(pair[1])
    rivals = np.array([change(c, *solution) for c in _rivals(cut)]) @ whiten
    right = np.array([set(c) == set(cut) for c in _rivals(cut)])
    true = change(cut, *solution) @ whiten
    samples, own = true + generator.standard_normal((DRAWS, 4)), balances @ whiten
    return RotorTest(pair, bool(true @ true < SMALL * len(true)), float(right[_nearest(samples, rivals)].mean()),
                     own @ true > 0.0, right[_nearest(own, rivals)], own @ true / (true @ true) * sum(cut.values()))


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
    """Spearman's rank correlation of measured and true millimetres."""
    true = np.concatenate([np.full(len(t.mm), labels.cut_mm(t.pair[1])) for t in tests])
    return float(spearmanr(np.concatenate([t.mm for t in tests]), true).statistic)


def _with_interval(tests: Sequence[RotorTest], figure: Callable[[Sequence[RotorTest]], float]) -> str:
    """A figure with its 90 % interval, conditions resampled."""
    low, high = resampled(lambda pick: figure([tests[i] for i in pick]), len(tests), replicates=figures.RESAMPLES,
                          level=0.9)
    return f"{figure(tests):.2f} ({low:.2f} to {high:.2f})"


def _nearest(balances: np.ndarray, rivals: np.ndarray) -> np.ndarray:
    """Index (n,) of the rival (rivals, 4) nearest to each balance (n, 4)."""
    return ((balances[:, None] - rivals) ** 2).sum(axis=2).argmin(axis=1)


def drawn_pattern(kind: str, changes: np.ndarray, variance: np.ndarray,
                  generator: np.random.Generator) -> HoverPattern:
    """A flight of a family, drawn from the priors of the diagnosis.

    changes (n, 4): of the balance, one of which the flight has; variance (6,): of the drone's normal flights.
    """
    balance = changes[generator.integers(len(changes))]
    scatter = PRIORS.maintenance if kind != "normal" or generator.random() < 0.5 else np.zeros(4)
    width = np.sqrt(variance[hover_balance.BALANCE] + np.array(scatter) ** 2)
    balance = balance + width * generator.standard_t(PRIORS.freedom, 4)
    power_change = PRIORS.damaged if kind == "rotor damage" else STEADY
    power = [generator.normal(m, np.hypot(s, np.sqrt(v)))
             for (m, s), v in zip(power_change, variance[hover_balance.POWER], strict=True)]
    return HoverPattern(balance, np.array(power), np.full(2, LEAST_POWER))


def show_family(b: Balances, vehicle: vehicles.Vehicle) -> None:
    """Print how often the diagnosis is right on drawn flights of each family that are drawn from its priors."""
    generator, candidates = np.random.default_rng(0), hypotheses(vehicle)
    families = [{"none": "normal", **figures.FAMILY_OF}.get(h.name, h.name) for h in candidates]
    solution, _ = fit(b.means, b.cuts)
    cuts = [change(c, *solution) for c, (_, text) in zip(b.cuts, b.pairs, strict=True) if labels.large(text)]
    changes_of = {"normal": np.zeros((1, 4)), "rotor damage": np.array(cuts),
                  "added weight": next(h.change for h in candidates if h.name == "mass"),
                  "slung load": next(h.change for h in candidates if h.name == "slung_load")}
    print(f"\nthe diagnosis on {FLIGHTS} flights of each family, drawn from its priors")
    for drone, base in b.bases.items():
        reference = hover_balance.Reference(np.zeros(6), base.variance, np.zeros(2))
        right = {}
        for kind, changes in changes_of.items():
            patterns = (drawn_pattern(kind, changes, base.variance, generator) for _ in range(FLIGHTS))
            right[kind] = np.mean([likeliest(hover_balance.evidence(p, reference, candidates)[0], families) == kind
                                   for p in patterns])
        print(f"{drone}: family, balanced {np.mean(list(right.values())):.2f}; "
              + ", ".join(f"{k} {v:.2f}" for k, v in right.items()))


def main() -> None:
    """Print scatter, rotors and families."""
    options = labels.folder_and_part(__doc__)
    rows, vehicle = labels.manifest(options.folder, options.part), vehicles.load(labels.VEHICLE)
    balances = Balances(rows, hover_patterns(options.folder, rows, vehicle))
    show_scatter(balances)
    show_rotor(rotor_tests(balances))
    show_family(balances, vehicle)


if __name__ == "__main__":
    with in_one_line("gap_crazypad_balance"):
        main()
